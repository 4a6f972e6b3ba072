//! Alpha masks: what of a surface is there at all. Where the alpha is below a threshold, rays pass.

use super::{Material, Texture, TextureUse};

/// The number that an image gives for an alpha.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum AlphaChannel {
    /// The alpha of its texels.
    #[default]
    Alpha,
    /// Their red.
    Red,
    /// Their green.
    Green,
    /// Their blue.
    Blue,
    /// The weighted sum of red, green and blue of Rec. 709, as encoded.
    Luminance,
    /// Their alpha if some texel is not opaque, else the luminance (MTL `map_d` without `-imfchan`: images with and without an
    /// alpha are both in use).
    AlphaOrLuminance,
}

impl AlphaChannel {
    /// What is read of this image.
    fn of(self, texture: &Texture) -> Self {
        match self {
            Self::AlphaOrLuminance if texture.texels.iter().any(|t| t[3] < 255) => Self::Alpha,
            Self::AlphaOrLuminance => Self::Luminance,
            channel => channel,
        }
    }

    /// The alpha of a texel, in units of 1/255.
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

/// An alpha and the least one at which the surface is there (glTF 2.0, 3.9.4: a fragment is drawn if its alpha is not below the cutoff).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AlphaMask {
    /// The image; without it the factor is the alpha.
    pub texture: Option<TextureUse>,
    /// What of the image.
    pub channel: AlphaChannel,
    /// What the image is multiplied by.
    pub factor: f32,
    /// The least alpha of the surface.
    pub cutoff: f32,
}

impl AlphaMask {
    /// The cutoff where a file says nothing of it.
    pub(crate) const CUTOFF: f32 = 0.5;

    /// The mask of an image, with this cutoff.
    pub fn of(texture: TextureUse, channel: AlphaChannel, cutoff: f32) -> Self {
        Self {
            texture: Some(texture),
            channel,
            factor: 1.0,
            cutoff,
        }
    }

    /// The least value of an image at which the surface is there, in units of 1/(255 · 65536); `u32::MAX` if none suffices.
    pub fn threshold(&self) -> u32 {
        let (factor, cutoff) = (f64::from(self.factor), f64::from(self.cutoff));
        if cutoff <= 0.0 {
            return 0;
        }
        let least = (cutoff / factor * 255.0 * 65536.0).ceil();
        // Not above it where the factor is 0, negative or NaN.
        match factor > 0.0 && least <= 255.0 * 65536.0 {
            true => least as u32,
            false => u32::MAX,
        }
    }

    /// Whether some point of the surface may be missing, given the images.
    fn cuts(&self, textures: &[Texture]) -> bool {
        let threshold = self.threshold();
        let Some(used) = self.texture else {
            return threshold > 255 << 16;
        };
        let mut texels = textures[used.texture as usize].texels.iter();
        texels.any(|texel| u32::from(self.channel.value(*texel)) << 16 < threshold)
    }
}

/// Takes away the masks that cut nothing: kernels have none then. Says of the others what of the image they read.
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
            texture: None,
            channel: AlphaChannel::Alpha,
            factor,
            cutoff,
        }
    }

    #[test]
    fn the_threshold_is_the_least_alpha_that_is_not_below_the_cutoff() {
        for (factor, cutoff, least) in [(1.0, 0.5, 128), (1.0, 1.0, 255), (0.5, 0.25, 128)] {
            let threshold = mask(factor, cutoff).threshold();
            assert!(threshold <= least << 16, "{factor} {cutoff}");
            assert!(threshold > (least - 1) << 16, "{factor} {cutoff}");
        }
        assert_eq!(mask(1.0, 0.0).threshold(), 0);
        assert_eq!(mask(0.0, 0.0).threshold(), 0);
        for (factor, cutoff) in [(1.0, 1.01), (0.0, 0.5), (0.4, 0.5), (f32::NAN, 0.5)] {
            assert_eq!(mask(factor, cutoff).threshold(), u32::MAX);
        }
    }

    #[test]
    fn masks_that_cut_nothing_are_taken_away() {
        let texture = |alpha| Texture {
            name: String::new(),
            width: 2,
            height: 1,
            texels: vec![[255; 4], [255, 255, 255, alpha]],
        };
        let textures = [texture(127), texture(128)];
        let of = |id| AlphaMask::of(TextureUse::plain(id), AlphaChannel::Alpha, 0.5);
        let masks = [of(0), of(1), mask(0.4, 0.5), mask(0.5, 0.5)];
        let mut materials = masks.map(|mask| {
            let mut material = Material::diffuse("", glam::Vec3::ONE);
            material.mask = Some(mask);
            material
        });
        settle(&mut materials, &textures);
        let kept = materials.map(|material| material.mask.is_some());
        assert_eq!(kept, [true, false, true, false]);
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
