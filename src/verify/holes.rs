//! Holes cut into triangles by masks, in f64 from the images and texture coordinates as loaded;
//! independent of the data that kernels read. Formula: `docs/shading.md`.

use glam::DVec2;
use raystone_accel::oracle::{Cut, Holes, Weight};
use raystone_scene::{AlphaMask, SceneData, Texture, TextureUse, Wrap};

/// Largest error with which kernels place a point in an image, texels: coordinates of corners and
/// points are multiples of 1/256 texel, and are rounded three times.
pub(crate) const PLACED: f64 = 2.0 / 256.0;
/// Weights are multiples of this.
const WEIGHT: f64 = 1.0 / (1_u32 << 24) as f64;
/// Largest error of a point, texels, for which a verdict is still possible.
const MOST_TEXELS: f64 = 16.0;

#[derive(Clone, Copy)]
pub(crate) struct SceneHoles<'a> {
    scene: &'a SceneData,
    /// Offset added to each triangle index.
    first: u32,
}

impl<'a> SceneHoles<'a> {
    /// `None` if nothing is cut out.
    pub(crate) fn of(scene: &'a SceneData) -> Option<Self> {
        let mut materials = scene.materials.iter();
        let first = 0;
        materials
            .any(|material| material.mask.is_some())
            .then_some(Self { scene, first })
    }

    /// The holes of a copy of an object whose first triangle in the scene is `first`.
    pub(crate) fn of_copy(self, first: u32) -> Self {
        Self { first, ..self }
    }

    /// The surface at the point of a triangle with these weights of its second and third corners,
    /// shifted by `shift` texels; open if it is there by chance.
    pub(crate) fn at(&self, triangle: u32, weights: [f64; 2], shift: DVec2) -> Cut {
        let Some(mask) = self.mask(triangle) else {
            return Cut::Surface;
        };
        let alpha = match mask.texture {
            Some(used) => {
                let [place, x, y] = self.placed(triangle, &used);
                let at = place + weights[0] * x + weights[1] * y + shift;
                Image::of(self.scene, &mask, &used).between(at)
            }
            None => 1.0,
        };
        said(&mask, [alpha, alpha])
    }

    fn mask(&self, triangle: u32) -> Option<AlphaMask> {
        let id = self.scene.material_ids[(triangle + self.first) as usize];
        self.scene.materials[id as usize].mask
    }

    /// The first corner in texels from the first texel's centre, and the differences to the others.
    fn placed(&self, triangle: u32, used: &TextureUse) -> [DVec2; 3] {
        let uvs = self.scene.uvs.get((triangle + self.first) as usize);
        let texture = &self.scene.textures[used.texture as usize];
        let size = DVec2::new(texture.width.into(), texture.height.into());
        let [a, b, c] = uvs.copied().unwrap_or_default().map(|uv| {
            (used.linear.as_dmat2() * uv.as_dvec2() + used.offset.as_dvec2()) * size - 0.5
        });
        [a, b - a, c - a]
    }
}

impl Holes for SceneHoles<'_> {
    fn cut(&self, triangle: u32, weights: Option<[Weight; 2]>) -> Cut {
        let Some(mask) = self.mask(triangle) else {
            return Cut::Surface;
        };
        let Some(used) = mask.texture else {
            return said(&mask, [1.0, 1.0]);
        };
        let Some([u, v]) = weights else {
            return Cut::Open;
        };
        let [place, x, y] = self.placed(triangle, &used);
        let at = place + u.value * x + v.value * y;
        let error = (u.error + WEIGHT) * x.abs() + (v.error + WEIGHT) * y.abs() + PLACED;
        if error.max_element() > MOST_TEXELS || !at.is_finite() {
            return Cut::Open;
        }
        let range = Image::of(self.scene, &mask, &used).range(at - error, at + error);
        said(&mask, range)
    }
}

/// The verdict where the image has this value.
fn at_value(mask: &AlphaMask, value: f64) -> Cut {
    let alpha = value * f64::from(mask.factor);
    match mask.cutoff {
        // A NaN factor cuts out everything.
        Some(cutoff) if (alpha < f64::from(cutoff) || alpha.is_nan()) && cutoff > 0.0 => Cut::Hole,
        Some(_) => Cut::Surface,
        None if alpha >= 1.0 => Cut::Surface,
        None if alpha > 0.0 => Cut::Open,
        None => Cut::Hole,
    }
}

/// The verdict for a region whose image values lie in this range.
fn said(mask: &AlphaMask, range: [f64; 2]) -> Cut {
    let [least, most] = range.map(|value| at_value(mask, value));
    if least == most { least } else { Cut::Open }
}

struct Image<'a> {
    texture: &'a Texture,
    mask: &'a AlphaMask,
    wrap: [Wrap; 2],
}

impl<'a> Image<'a> {
    fn of(scene: &'a SceneData, mask: &'a AlphaMask, used: &TextureUse) -> Self {
        Self {
            texture: &scene.textures[used.texture as usize],
            mask,
            wrap: used.wrap,
        }
    }

    fn texel(&self, x: f64, y: f64) -> f64 {
        let [width, height] = [self.texture.width, self.texture.height];
        let column = wrapped(x, width.into(), self.wrap[0]);
        let row = wrapped(y, height.into(), self.wrap[1]);
        let value = self
            .mask
            .channel
            .value(self.texture.texels[row * width as usize + column]);
        f64::from(value) / 255.0
    }

    /// Bilinear interpolation between texel centres.
    fn between(&self, at: DVec2) -> f64 {
        let (cell, part) = (at.floor(), at - at.floor());
        let row = |y: f64| {
            let [left, right] = [0.0, 1.0].map(|x| self.texel(cell.x + x, cell.y + y));
            left * (1.0 - part.x) + right * part.x
        };
        row(0.0) * (1.0 - part.y) + row(1.0) * part.y
    }

    /// Minimum and maximum in a rectangle, from the corners of its intersections with cells.
    fn range(&self, low: DVec2, high: DVec2) -> [f64; 2] {
        let stops = |low: f64, high: f64| {
            let mut stops = vec![low, high];
            let mut at = low.ceil();
            while at < high {
                stops.push(at);
                at += 1.0;
            }
            stops
        };
        let (xs, ys) = (stops(low.x, high.x), stops(low.y, high.y));
        let all = ys
            .iter()
            .flat_map(|y| xs.iter().map(move |x| DVec2::new(*x, *y)));
        all.map(|at| self.between(at))
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], x| {
                [least.min(x), most.max(x)]
            })
    }
}

/// The texel index for a position on an axis of `size` texels.
pub(super) fn wrapped(at: f64, size: f64, wrap: Wrap) -> usize {
    let inside = match wrap {
        Wrap::Repeat => at.rem_euclid(size),
        Wrap::Clamp => at.clamp(0.0, size - 1.0),
        Wrap::Mirrored => {
            let there = at.rem_euclid(2.0 * size);
            there.min(2.0 * size - 1.0 - there)
        }
    };
    inside as usize
}
