//! Textures: bilinear between texel centres, decoded before they are interpolated.

use crate::scene::{SceneData, Texture};
use glam::{DVec2, DVec3};

/// The textures of a scene.
pub(super) struct Textures<'a> {
    scene: &'a SceneData,
    /// Whether triangles have texture coordinates.
    mapped: bool,
}

/// The linear value of a component of sRGB (IEC 61966-2-1).
fn linear(byte: u8) -> f64 {
    let c = f64::from(byte) / 255.0;
    match c <= 0.04045 {
        true => c / 12.92,
        false => ((c + 0.055) / 1.055).powf(2.4),
    }
}

impl<'a> Textures<'a> {
    pub fn new(scene: &'a SceneData) -> Self {
        Self {
            scene,
            mapped: scene.uvs.len() == scene.triangles.len(),
        }
    }

    /// Texture coordinates of a point of a triangle.
    pub fn coordinates(&self, triangle: u32, [u, v]: [f64; 2]) -> DVec2 {
        if !self.mapped {
            return DVec2::ZERO;
        }
        let [a, b, c] = self.scene.uvs[triangle as usize].map(|uv| uv.as_dvec2());
        a * (1.0 - u - v) + b * u + c * v
    }

    /// The colour of a texture there, linear.
    pub fn colour(&self, texture: u32, at: DVec2) -> DVec3 {
        self.bilinear(&self.scene.textures[texture as usize], at)
    }

    fn bilinear(&self, texture: &Texture, at: DVec2) -> DVec3 {
        let size = DVec2::new(texture.width.into(), texture.height.into());
        let place = at * size - 0.5;
        let (cell, part) = (place.floor(), place - place.floor());
        let texel = |dx: f64, dy: f64| {
            let column = (cell.x + dx).rem_euclid(size.x) as usize;
            let row = (cell.y + dy).rem_euclid(size.y) as usize;
            let [r, g, b, _] = texture.texels[row * texture.width as usize + column];
            DVec3::new(linear(r), linear(g), linear(b))
        };
        let upper = texel(0.0, 0.0).lerp(texel(1.0, 0.0), part.x);
        let lower = texel(0.0, 1.0).lerp(texel(1.0, 1.0), part.x);
        upper.lerp(lower, part.y)
    }
}
