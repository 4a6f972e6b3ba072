//! How a material uses a texture.

use glam::{Mat2, Vec2};

/// Addressing beyond a texture's edge.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Wrap {
    /// Repeats.
    #[default]
    Repeat,
    /// Repeats, mirrored every other time.
    Mirrored,
    /// Clamps to the edge texels.
    Clamp,
}

/// A texture and its placement. Colours are sRGB, all else is linear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TextureUse {
    /// Index into [`super::SceneData::textures`].
    pub texture: u32,
    /// Addressing in u and v.
    pub wrap: [Wrap; 2],
    /// Multiplies the mesh's coordinates (`KHR_texture_transform`, MTL `-s`).
    pub linear: Mat2,
    /// Added after `linear` (MTL `-o`).
    pub offset: Vec2,
    /// Scale of x and y of a normal map's vectors.
    pub scale: f32,
}

impl TextureUse {
    /// A repeating texture at the mesh's coordinates.
    pub fn plain(texture: u32) -> Self {
        Self {
            texture,
            wrap: [Wrap::Repeat; 2],
            linear: Mat2::IDENTITY,
            offset: Vec2::ZERO,
            scale: 1.0,
        }
    }

    /// True if the texture repeats and uses the mesh's coordinates unchanged.
    pub fn is_plain(&self) -> bool {
        let plain = Self::plain(self.texture);
        (self.wrap, self.linear, self.offset) == (plain.wrap, plain.linear, plain.offset)
    }
}
