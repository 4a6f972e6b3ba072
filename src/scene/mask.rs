//! Alpha masks: rays pass where the alpha is below a threshold, or by chance.

use super::{Material, Texture, TextureUse};

/// The image channel that gives the alpha.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum AlphaChannel {
    /// Alpha.
    #[default]
    Alpha,
    /// Red.
    Red,
    /// Green.
    Green,
    /// Blue.
    Blue,
    /// Luminance of the encoded red, green and blue (Rec. 709).
    Luminance,
    /// Alpha if some texel is not opaque, otherwise luminance (MTL `map_d` without `-imfchan`: both
    /// kinds of images are in use).
    AlphaOrLuminance,
}

impl AlphaChannel {
    /// The channel to read from this image.
    fn of(self, texture: &Texture) -> Self {
        match self {
            Self::AlphaOrLuminance if texture.texels.iter().any(|t| t[3] < 255) => Self::Alpha,
            Self::AlphaOrLuminance => Self::Luminance,
            channel => channel,
        }
    }

    /// Alpha of a texel, in units of 1/255.
    pub fn value(self, [r, g, b, a]: [u8; 4]) -> u8 {
        match self {
            Self::Alpha => a,
            Self::Red => r,
            Self::Green => g,
            Self::Blue => b,
            Self::Luminance | Self::AlphaOrLuminance => {
                let [r, g, b] = [r, g, b].map(u32::from);
                ((2126 * r + 7152 * g + 722 * b + 5000) / 10_000) as u8
            }
        }
    }
}

/// Alpha and cutoff: the surface exists where alpha is not below the cutoff, or with the probability
/// alpha (glTF 2.0, 3.9.4: `MASK` and `BLEND`; Enderton et al., "Stochastic transparency", I3D 2010).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AlphaMask {
    /// The image; without one, the factor is the alpha.
    pub texture: Option<TextureUse>,
    /// The image's channel.
    pub channel: AlphaChannel,
    /// Multiplier of the image.
    pub factor: f32,
    /// The lowest alpha at which the surface exists; `None` if it exists with the probability alpha.
    pub cutoff: Option<f32>,
}

impl AlphaMask {
    /// Cutoff if the file gives none.
    pub(crate) const CUTOFF: f32 = 0.5;

    /// The mask of an image, with this cutoff.
    pub fn of(texture: TextureUse, channel: AlphaChannel, cutoff: Option<f32>) -> Self {
        Self {
            texture: Some(texture),
            channel,
            factor: 1.0,
            cutoff,
        }
    }

    /// A surface that exists everywhere with this probability.
    pub(crate) fn even(factor: f32) -> Self {
        Self {
            texture: None,
            channel: AlphaChannel::Alpha,
            factor,
            cutoff: None,
        }
    }

    /// The lowest image value of the surface, in units of 1/(255 · 65536); `u32::MAX` for none.
    /// `None` if chance decides.
    pub fn threshold(&self) -> Option<u32> {
        Some(self.least(self.cutoff?))
    }

    fn least(&self, cutoff: f32) -> u32 {
        let (factor, cutoff) = (f64::from(self.factor), f64::from(cutoff));
        if cutoff <= 0.0 {
            return 0;
        }
        let least = (cutoff / factor * 255.0 * 65536.0).ceil();
        // False if the factor is 0, negative or NaN.
        if factor > 0.0 && least <= 255.0 * 65536.0 {
            least as u32
        } else {
            u32::MAX
        }
    }

    /// True if some point of the surface may be missing, given the images.
    fn cuts(&self, textures: &[Texture]) -> bool {
        let threshold = self.least(self.cutoff.unwrap_or(1.0));
        let Some(used) = self.texture else {
            return threshold > 255 << 16;
        };
        let mut texels = textures[used.texture as usize].texels.iter();
        texels.any(|texel| u32::from(self.channel.value(*texel)) << 16 < threshold)
    }
}

/// Removes masks that cut nothing, so kernels have none, and resolves the channel of the others.
pub(super) fn settle(materials: &mut [Material], textures: &[Texture]) {
    for material in materials {
        if let Some(mask) = &mut material.mask
            && let Some(used) = mask.texture
        {
            mask.channel = mask.channel.of(&textures[used.texture as usize]);
        }
        material.mask = material.mask.filter(|mask| mask.cuts(textures));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mask(factor: f32, cutoff: f32) -> AlphaMask {
        AlphaMask {
            cutoff: Some(cutoff),
            ..AlphaMask::even(factor)
        }
    }

    #[test]
    fn the_threshold_is_the_least_alpha_that_is_not_below_the_cutoff() {
        for (factor, cutoff, least) in [(1.0, 0.5, 128), (1.0, 1.0, 255), (0.5, 0.25, 128)] {
            let threshold = mask(factor, cutoff).threshold().unwrap();
            assert!(threshold <= least << 16, "{factor} {cutoff}");
            assert!(threshold > (least - 1) << 16, "{factor} {cutoff}");
        }
        assert_eq!(mask(1.0, 0.0).threshold(), Some(0));
        assert_eq!(mask(0.0, 0.0).threshold(), Some(0));
        for (factor, cutoff) in [(1.0, 1.01), (0.0, 0.5), (0.4, 0.5), (f32::NAN, 0.5)] {
            assert_eq!(mask(factor, cutoff).threshold(), Some(u32::MAX));
        }
        assert_eq!(AlphaMask::even(0.5).threshold(), None);
    }

    #[test]
    fn masks_that_cut_nothing_are_taken_away() {
        let texture = |alpha| Texture {
            name: String::new(),
            width: 2,
            height: 1,
            texels: vec![[255; 4], [255, 255, 255, alpha]],
        };
        let textures = [texture(127), texture(128), texture(255)];
        let of = |id| AlphaMask::of(TextureUse::plain(id), AlphaChannel::Alpha, Some(0.5));
        let blended = |id| AlphaMask {
            cutoff: None,
            ..of(id)
        };
        let even = AlphaMask::even;
        let masks = [
            of(0),
            of(1),
            mask(0.4, 0.5),
            mask(0.5, 0.5),
            blended(1),
            blended(2),
            even(0.99),
            even(1.0),
        ];
        let mut materials = masks.map(|mask| {
            let mut material = Material::diffuse("", glam::Vec3::ONE);
            material.mask = Some(mask);
            material
        });
        settle(&mut materials, &textures);
        let kept = materials.map(|material| material.mask.is_some());
        let expected = [true, false, true, false, true, false, true, false];
        assert_eq!(kept, expected);
    }

    #[test]
    fn an_image_without_alpha_is_a_mask_by_its_luminance() {
        let mut texture = Texture {
            name: String::new(),
            width: 1,
            height: 2,
            texels: vec![[200, 200, 200, 255]; 2],
        };
        let channel = AlphaChannel::AlphaOrLuminance;
        assert_eq!(channel.of(&texture), AlphaChannel::Luminance);
        assert_eq!(channel.of(&texture).value(texture.texels[0]), 200);
        texture.texels[1][3] = 0;
        assert_eq!(channel.of(&texture), AlphaChannel::Alpha);
        assert_eq!(AlphaChannel::Luminance.value([255, 255, 255, 0]), 255);
        assert_eq!(AlphaChannel::Green.value([1, 2, 3, 4]), 2);
    }
}
