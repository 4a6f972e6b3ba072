//! Beckmann microfacets over a diffuse lobe. No model file uses them; shading experiments do.

use super::{Lobes, Look, Material, MaterialKind, within};
use glam::Vec3;

/// Beckmann microfacets over a diffuse lobe.
pub static COOK_TORRANCE: MaterialKind = MaterialKind {
    name: "cook-torrance",
    feature: "cook_torrance",
    description: "diffuse and microfacets with Beckmann's distribution",
    parameters: &[
        "specular red",
        "specular green",
        "specular blue",
        "roughness",
        "index of refraction",
        "masking: 0 V-cavities, 1 Smith",
        "Fresnel: 0 Schlick, 1 exact",
    ],
    lobes: Lobes::Glossy,
    sources: &[],
    recognise: |_| None,
};

/// Slope below which the lobe is too narrow for f32 directions.
const LEAST_ROUGHNESS: f32 = 0.01;
const GREATEST_IOR: f32 = 10.0;

/// Masking and shadowing of facets.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Masking {
    /// Long grooves (Cook and Torrance 1982).
    #[default]
    VCavities,
    /// Uncorrelated facets (Smith 1967), as approximated by Walter et al. 2007.
    Smith,
}

/// Fresnel term.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Fresnel {
    /// Schlick's polynomial (1994).
    Schlick,
    /// Fresnel's equations for unpolarised light.
    #[default]
    Exact,
}

/// Parameters of a Cook–Torrance material.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CookTorrance {
    /// Linear RGB reflectance of the diffuse lobe.
    pub diffuse: Vec3,
    /// Linear RGB weight of the specular lobe. If the sum exceeds 1, both are scaled down.
    pub specular: Vec3,
    /// Root mean square facet slope, 0.01 to 1.
    pub roughness: f32,
    /// Index of refraction, 1 to 10.
    pub ior: f32,
    /// Masking and shadowing of facets.
    pub masking: Masking,
    /// Fresnel term.
    pub fresnel: Fresnel,
}

impl Material {
    /// Returns a Cook–Torrance material.
    pub fn cook_torrance(name: impl Into<String>, of: &CookTorrance) -> Self {
        let flag = |is_on| f32::from(u8::from(is_on));
        let numbers = [
            within(of.roughness, LEAST_ROUGHNESS, 1.0),
            within(of.ior, 1.0, GREATEST_IOR),
            flag(of.masking == Masking::Smith),
            flag(of.fresnel == Fresnel::Exact),
        ];
        let look = Look::balanced(of.diffuse, of.specular, &numbers);
        Self::looking(name, &COOK_TORRANCE, look)
    }
}
