//! How a material uses a texture.

use glam::{Mat2, Vec2};

/// What is beyond a texture's edge.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Wrap {
    /// The texture again.
    #[default]
    Repeat,
    /// The texture again, every other time mirrored.
    Mirrored,
    /// The texels of the edge.
    Clamp,
}

/// A texture with its place on the surface. What it is used for says how it is encoded: colours are sRGB, all else is linear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TextureUse {
    /// Index into [`super::SceneData::textures`].
    pub texture: u32,
    /// In u and v.
    pub wrap: [Wrap; 2],
    /// What the coordinates of the mesh are multiplied by (`KHR_texture_transform`, MTL `-s`), …
    pub linear: Mat2,
    /// … and what is added then (MTL `-o`).
    pub offset: Vec2,
    /// What x and y of a normal map's vectors are multiplied by.
    pub scale: f32,
}

impl TextureUse {
    /// A texture that repeats at the coordinates of the mesh.
    pub fn plain(texture: u32) -> Self {
        Self {
            texture,
            wrap: [Wrap::Repeat; 2],
            linear: Mat2::IDENTITY,
            offset: Vec2::ZERO,
            scale: 1.0,
        }
    }

    /// Whether the texture repeats, and takes the coordinates of the mesh as they are.
    pub fn is_plain(&self) -> bool {
        let plain = Self::plain(self.texture);
        (self.wrap, self.linear, self.offset) == (plain.wrap, plain.linear, plain.offset)
    }
}
