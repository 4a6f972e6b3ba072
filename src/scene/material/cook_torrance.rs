//! Microfacets with Beckmann's distribution over a diffuse lobe. No model file has them; experiments of
//! shading do.

use super::{Lobes, Look, Material, MaterialKind, within};
use glam::Vec3;

/// The kind.
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

/// Slope of facets below which the lobe is narrower than f32 tells directions apart.
const LEAST_ROUGHNESS: f32 = 0.01;
const GREATEST_IOR: f32 = 10.0;

/// How facets hide each other.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Masking {
    /// Long grooves (Cook and Torrance 1982).
    #[default]
    VCavities,
    /// Facets that know nothing of their neighbours (Smith 1967), as Walter et al. 2007 approximate it.
    Smith,
}

/// How reflection grows towards grazing angles.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Fresnel {
    /// Schlick's polynomial of 1994.
    Schlick,
    /// Fresnel's equations for unpolarised light.
    #[default]
    Exact,
}

/// What a Cook–Torrance material is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CookTorrance {
    /// Linear RGB reflectance of the diffuse lobe.
    pub diffuse: Vec3,
    /// Linear RGB weight of the specular lobe. Where both add up to more than 1 they are scaled together.
    pub specular: Vec3,
    /// Root mean square slope of the facets, 0.01 to 1.
    pub roughness: f32,
    /// Index of refraction, 1 to 10.
    pub ior: f32,
    /// How facets hide each other.
    pub masking: Masking,
    /// How reflection grows towards grazing angles.
    pub fresnel: Fresnel,
}

impl Material {
    /// A Cook–Torrance material.
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
