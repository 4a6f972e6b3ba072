//! Perfect mirrors.

use super::{Description, Format, Lobes, Look, Material, MaterialKind};
use glam::Vec3;

/// Perfect mirrors.
pub static MIRROR: MaterialKind = MaterialKind {
    name: "mirror",
    feature: "mirror",
    description: "perfect mirror tinted by the base colour (MTL illum 3, 5, 8; glTF smooth metal)",
    parameters: &[],
    lobes: Lobes::Delta,
    sources: &[],
    recognise,
};

/// MTL illumination models that mirror (3 … 9 all ray trace; 5 is a mirror with Fresnel).
const ILLUM: [u8; 3] = [3, 5, 8];
/// Least metalness and largest roughness of a perfect mirror.
const METALLIC: f32 = 0.99;
const ROUGHNESS: f32 = 0.02;

fn recognise(description: &Description<'_>) -> Option<Look> {
    let source = description.source;
    let (is_mirror, base_color) = match description.format {
        Format::Mtl => {
            let specular = Vec3::from(source.specular.unwrap_or_default());
            // Those with a metalness are of the metallic-roughness model.
            let is_plain = source.metallic.is_none();
            (
                is_plain && outshines(source.illum, description.base_color, specular),
                specular,
            )
        }
        Format::Gltf => {
            let is_metal = source.metallic.is_some_and(|m| m >= METALLIC);
            let is_smooth = source.roughness.is_some_and(|r| r <= ROUGHNESS);
            (
                is_metal && is_smooth && !description.is_varied,
                description.base_color,
            )
        }
    };
    is_mirror.then(|| Look::plain(base_color))
}

/// True for a mirroring illumination model with a specular part over a nearly black diffuse one.
fn outshines(illum: Option<u8>, diffuse: Vec3, specular: Vec3) -> bool {
    illum.is_some_and(|illum| ILLUM.contains(&illum))
        && specular.max_element() > 0.0
        && diffuse.max_element() <= 0.1 * specular.max_element()
}

impl Material {
    /// A perfect mirror with this linear RGB reflectance.
    pub fn mirror(name: impl Into<String>, color: Vec3) -> Self {
        Self::looking(name, &MIRROR, Look::plain(color))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_bright_specular_part_over_black_makes_a_mirror() {
        let (black, grey) = (Vec3::ZERO, Vec3::splat(0.5));
        assert!(outshines(Some(5), black, grey));
        assert!(!outshines(Some(2), black, grey));
        assert!(!outshines(Some(5), grey, grey));
        assert!(!outshines(Some(5), black, black));
    }
}
