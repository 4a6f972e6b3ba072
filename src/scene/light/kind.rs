//! The table of kinds of lights.

use raystone_core::params::Sources;
use std::fmt;

/// A kind of light.
#[derive(Clone)]
pub struct LightKind {
    /// Name.
    pub name: &'static str,
    /// One line: what it is, and its unit.
    pub description: &'static str,
    /// Name of its colour.
    pub color: &'static str,
    /// The feature that adds its kernel to a scene's kernels.
    pub feature: &'static str,
    /// Its group of features: `lights`, or `background` if rays that leave the scene find it.
    pub group: &'static str,
    /// Kernel modules of a kind from outside the program. From `shading/light/<feature>`, kernels
    /// import `<feature>_sample(light, surface, point)`.
    pub sources: Sources,
}

macro_rules! kind {
    ($id:ident, $name:literal, $feature:literal, $group:literal, $color:literal, $description:literal) => {
        pub(super) static $id: LightKind = LightKind {
            name: $name,
            description: $description,
            color: $color,
            feature: $feature,
            group: $group,
            sources: &[],
        };
    };
}

kind!(
    TRIANGLE,
    "triangle",
    "triangle_lights",
    "lights",
    "radiance",
    "a triangle of an emissive material (MTL Ke, glTF emissive)"
);
kind!(
    RECTANGLE,
    "rectangle",
    "rectangle_lights",
    "lights",
    "radiance",
    "two triangles of an emissive material that form a parallelogram, as one light"
);
kind!(
    SPHERE,
    "sphere",
    "sphere_lights",
    "lights",
    "radiance",
    "an analytic sphere: visible, casts shadows, reflects nothing"
);
kind!(
    POINT,
    "point",
    "point_lights",
    "lights",
    "intensity",
    "a point of even intensity (glTF KHR_lights_punctual, candela)"
);
kind!(
    SPOT,
    "spot",
    "spot_lights",
    "lights",
    "intensity",
    "a point that shines into a cone, with or without decay (glTF KHR_lights_punctual, candela)"
);
kind!(
    IES,
    "ies",
    "ies_lights",
    "lights",
    "colour",
    "a point with the measured intensities of a luminaire (IES LM-63, candela)"
);
kind!(
    DIRECTIONAL,
    "directional",
    "directional_lights",
    "lights",
    "irradiance",
    "light from infinitely far away (glTF KHR_lights_punctual, lux)"
);

kind!(
    ENVIRONMENT,
    "environment",
    "environment_map",
    "background",
    "radiance",
    "radiance from all around by an equirectangular map (HDR, EXR, PFM, NPY)"
);

/// All kinds, in the order of the light list; a kind's index is its number in
/// `kernels/shading/light/table.wesl`.
pub static LIGHT_KINDS: [&LightKind; 8] = [
    &TRIANGLE,
    &RECTANGLE,
    &SPHERE,
    &POINT,
    &SPOT,
    &IES,
    &DIRECTIONAL,
    &ENVIRONMENT,
];

impl LightKind {
    /// Index in [`LIGHT_KINDS`]; one past the end for kinds from outside the program.
    pub fn number(&self) -> u32 {
        let place = LIGHT_KINDS.iter().position(|known| *known == self);
        place.unwrap_or(LIGHT_KINDS.len()) as u32
    }
}

impl PartialEq for LightKind {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Eq for LightKind {}

impl fmt::Debug for LightKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}
