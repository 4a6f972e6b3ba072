//! Textures: bilinear between texel centres, decoded before interpolation.

use crate::holes::wrapped;
use glam::{DMat2, DVec2, DVec3};
use raystone_scene::{SceneData, TextureUse};

pub(crate) struct Textures<'a> {
    scene: &'a SceneData,
    mapped: bool,
}

/// The linear value of an sRGB component (IEC 61966-2-1).
fn linear(byte: u8) -> f64 {
    let c = f64::from(byte) / 255.0;
    if c <= 0.04045 {
        c / 12.92
    } else {
        ((c + 0.055) / 1.055).powf(2.4)
    }
}

impl<'a> Textures<'a> {
    pub(crate) fn new(scene: &'a SceneData) -> Self {
        Self {
            scene,
            mapped: scene.uvs.len() == scene.triangles.len(),
        }
    }

    /// True if triangles have texture coordinates; otherwise materials use their constants.
    pub(crate) fn are_mapped(&self) -> bool {
        self.mapped
    }

    pub(crate) fn coordinates(&self, triangle: u32, [u, v]: [f64; 2]) -> DVec2 {
        if !self.mapped {
            return DVec2::ZERO;
        }
        let [a, b, c] = self.scene.uvs[triangle as usize].map(|uv| uv.as_dvec2());
        a * (1.0 - u - v) + b * u + c * v
    }

    /// A linear colour there; white without a texture.
    pub(crate) fn colour(&self, used: Option<TextureUse>, at: DVec2) -> DVec3 {
        let used = used.filter(|_| self.mapped);
        used.map_or(DVec3::ONE, |used| self.bilinear(&used, at, linear))
    }

    /// Undecoded numbers; 1 without a texture.
    pub(crate) fn numbers(&self, used: Option<TextureUse>, at: DVec2) -> DVec3 {
        let part = |byte| f64::from(byte) / 255.0;
        let used = used.filter(|_| self.mapped);
        used.map_or(DVec3::ONE, |used| self.bilinear(&used, at, part))
    }

    fn bilinear(&self, used: &TextureUse, at: DVec2, decode: fn(u8) -> f64) -> DVec3 {
        let texture = &self.scene.textures[used.texture as usize];
        let size = DVec2::new(texture.width.into(), texture.height.into());
        let place = (used.linear.as_dmat2() * at + used.offset.as_dvec2()) * size - 0.5;
        let (cell, part) = (place.floor(), place - place.floor());
        let texel = |dx: f64, dy: f64| {
            let column = wrapped(cell.x + dx, size.x, used.wrap[0]);
            let row = wrapped(cell.y + dy, size.y, used.wrap[1]);
            let [r, g, b, _] = texture.texels[row * texture.width as usize + column];
            DVec3::new(decode(r), decode(g), decode(b))
        };
        let upper = texel(0.0, 0.0).lerp(texel(1.0, 0.0), part.x);
        let lower = texel(0.0, 1.0).lerp(texel(1.0, 1.0), part.x);
        upper.lerp(lower, part.y)
    }

    /// Perturbs a normal by a normal map, in the frame of ∂p/∂u and ∂p/∂v.
    pub(crate) fn bent(&self, used: TextureUse, triangle: u32, at: DVec2, normal: DVec3) -> DVec3 {
        let [a, b, c] = self.scene.triangles[triangle as usize]
            .vertices
            .map(|v| v.as_dvec3());
        let [ta, tb, tc] = self.scene.uvs[triangle as usize].map(|uv| uv.as_dvec2());
        let of_texture = DMat2::from_cols(tb - ta, tc - ta);
        if of_texture.determinant() == 0.0 {
            return normal;
        }
        let inverse = of_texture.inverse();
        let along = |x: DVec2| (b - a) * x.x + (c - a) * x.y;
        let (du, dv) = (along(inverse.x_axis), along(inverse.y_axis));
        let tangent = (du - normal * du.dot(normal)).normalize();
        let across = normal.cross(tangent);
        let up = across * -across.dot(dv).signum();
        let map = 2.0 * self.numbers(Some(used), at) - 1.0;
        let scale = f64::from(used.scale);
        (scale * map.x * tangent + scale * map.y * up + map.z * normal).normalize()
    }
}
