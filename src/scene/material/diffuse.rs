//! Lambertian surfaces, and whatever no other kind recognises.

use super::{Lobes, Look, Material, MaterialKind};
use glam::Vec3;

/// The kind.
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
    /// A plain Lambertian material, `color` being linear RGB reflectance.
    pub fn diffuse(name: impl Into<String>, color: Vec3) -> Self {
        Self::looking(name, &DIFFUSE, Look::plain(color))
    }
}
