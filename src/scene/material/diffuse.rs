//! Lambertian surfaces, the fallback for unrecognised materials.

use super::{Lobes, Look, Material, MaterialKind};
use glam::Vec3;

/// Lambertian surfaces.
pub static DIFFUSE: MaterialKind = MaterialKind {
    name: "diffuse",
    feature: "diffuse",
    description: "Lambertian reflection of the (possibly textured) base colour",
    parameters: &[],
    lobes: Lobes::Diffuse,
    sources: &[],
    recognise: |_| None,
};

impl Material {
    /// A Lambertian material; `color` is linear RGB reflectance.
    pub fn diffuse(name: impl Into<String>, color: Vec3) -> Self {
        Self::looking(name, &DIFFUSE, Look::plain(color))
    }
}
