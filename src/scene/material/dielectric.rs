//! Smooth dielectrics: glass, water, and thin panes.
//!
//! * MTL: illumination models 4, 6, 7 and 9 refract, where the reader of the file leaves them to a
//!   material: opaque and partly covering surfaces with 4, 6 or 9 have another. The index is `Ni`
//!   (default 1.5); the body filters light by `Tf`, by its square root at each of two surfaces. A
//!   missing or black `Tf` filters nothing: exporters write 0 for "not stated". An index of 1
//!   without a filter would be nothing to see, and is no glass.
//! * glTF: `KHR_materials_transmission` of at least a half on non-metals, with the base colour as
//!   tint and `KHR_materials_ior` (default 1.5). Walls are thin, as in the standard, unless
//!   `KHR_materials_volume` gives them a thickness.

use super::{Description, Format, Lobes, Look, Material, MaterialKind};
use glam::Vec3;

/// Smooth dielectrics.
pub static DIELECTRIC: MaterialKind = MaterialKind {
    name: "dielectric",
    feature: "dielectric",
    description: "smooth glass: Fresnel reflection, refraction tinted by the base colour (MTL illum 4, 6, 7, 9; \
                  glTF transmission)",
    parameters: &[
        "index of refraction of the inside, relative to the outside",
        "1 if both surfaces of a wall are one triangle, else 0",
        "Fresnel: 0 exact (also where it is missing), 1 Schlick",
    ],
    lobes: Lobes::Delta,
    sources: &[],
    recognise,
};

/// Default index of refraction: window glass.
pub const DEFAULT_IOR: f32 = 1.5;

/// Outside these bounds, no surface transmits a significant amount.
const LEAST_IOR: f32 = 0.1;
const GREATEST_IOR: f32 = 10.0;

/// MTL illumination models that refract.
const ILLUM: [u8; 4] = [4, 6, 7, 9];
/// Transmitted fraction above which a surface counts as glass.
const LEAST_TRANSMISSION: f32 = 0.5;
/// Metalness above which nothing is transmitted.
const METAL: f32 = 0.5;

fn recognise(description: &Description<'_>) -> Option<Look> {
    let source = description.source;
    let (is_glass, tint, is_thin) = match description.format {
        Format::Mtl => {
            let filter = Vec3::from(source.filter.unwrap_or([1.0; 3]));
            let stated = filter.is_finite() && filter.max_element() > 0.0;
            let filter = if stated { filter } else { Vec3::ONE };
            let tint = filter.clamp(Vec3::ZERO, Vec3::ONE).map(f32::sqrt);
            // Maya writes so for surfaces of every kind.
            let is_nothing =
                tint == Vec3::ONE && source.ior.is_some_and(|ior| (ior - 1.0).abs() < 1e-3);
            (refracts(source.illum) && !is_nothing, tint, false)
        }
        Format::Gltf => {
            let transmits = source.transmission.is_some_and(|t| t >= LEAST_TRANSMISSION);
            let is_metal = source.metallic.is_some_and(|m| m >= METAL);
            let is_thin = source.thickness.is_none_or(|t| t <= 0.0);
            let is_glass = transmits && !is_metal && !description.is_varied;
            (is_glass, description.base_color, is_thin)
        }
    };
    is_glass.then(|| look(tint, source.ior, is_thin))
}

/// Whether this MTL illumination model is one of glass.
pub(in super::super) fn refracts(illum: Option<u8>) -> bool {
    illum.is_some_and(|illum| ILLUM.contains(&illum))
}

fn look(tint: Vec3, ior: Option<f32>, is_thin: bool) -> Look {
    Look {
        parameters: parameters(ior, is_thin),
        ..Look::plain(tint)
    }
}

/// Index and thin flag. An invalid index (0 in glTF means infinity) becomes that of glass.
fn parameters(ior: Option<f32>, is_thin: bool) -> Vec<f32> {
    let stated = ior.filter(|ior| ior.is_finite() && *ior > 0.0);
    let ior = stated.unwrap_or(DEFAULT_IOR).clamp(LEAST_IOR, GREATEST_IOR);
    vec![ior, if is_thin { 1.0 } else { 0.0 }]
}

impl Material {
    /// The surface of a solid with this index of refraction, with corners counter-clockwise seen
    /// from outside. Light is multiplied by `tint` at every passage.
    pub fn dielectric(name: impl Into<String>, tint: Vec3, ior: f32) -> Self {
        Self::looking(name, &DIELECTRIC, look(tint, Some(ior), false))
    }

    /// A wall without thickness: light passes straight through.
    pub fn thin_dielectric(name: impl Into<String>, tint: Vec3, ior: f32) -> Self {
        Self::looking(name, &DIELECTRIC, look(tint, Some(ior), true))
    }

    /// Uses Schlick's polynomial instead of Fresnel's equations. Other kinds are unchanged.
    pub fn with_schlick(mut self) -> Self {
        if self.kind == &DIELECTRIC {
            self.parameters.truncate(2);
            self.parameters.push(1.0);
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::super::MaterialSource;
    use super::*;

    fn look(format: Format, source: MaterialSource) -> Option<(Vec3, Vec<f32>)> {
        let description = Description {
            format,
            base_color: Vec3::splat(0.25),
            is_varied: false,
            is_followed: false,
            source: &source,
        };
        recognise(&description).map(|look| (look.base_color, look.parameters))
    }

    #[test]
    fn an_mtl_body_is_glass_by_its_model_and_filters_at_both_surfaces() {
        let mtl = |illum, ior, filter| {
            let source = MaterialSource {
                illum: Some(illum),
                ior,
                filter,
                ..MaterialSource::default()
            };
            look(Format::Mtl, source)
        };
        let half = Vec3::splat(0.5);
        let clear = |ior: f32| Some((Vec3::ONE, vec![ior, 0.0]));
        assert_eq!(
            mtl(7, Some(1.33), Some([0.25; 3])),
            Some((half, vec![1.33, 0.0]))
        );
        assert_eq!(mtl(4, None, None), clear(DEFAULT_IOR));
        assert_eq!(mtl(4, Some(1.0), Some([1.0; 3])), None, "Maya's default");
        assert_eq!(mtl(4, Some(1.0), None), None);
        assert_eq!(
            mtl(4, Some(1.0), Some([0.25; 3])),
            Some((half, vec![1.0, 0.0])),
            "a filter"
        );
        assert_eq!(mtl(6, Some(0.0), Some([0.0; 3])), clear(DEFAULT_IOR));
        assert_eq!(
            mtl(9, Some(f32::INFINITY), Some([f32::NAN; 3])),
            clear(DEFAULT_IOR)
        );
        assert_eq!(mtl(2, Some(1.5), Some([1.0; 3])), None);
        assert_eq!(mtl(5, Some(1.5), Some([1.0; 3])), None, "a mirror");
    }

    #[test]
    fn a_gltf_surface_is_glass_by_its_transmission_and_thick_by_its_volume() {
        let gltf = |transmission, metallic, thickness| {
            let source = MaterialSource {
                transmission: Some(transmission),
                metallic: Some(metallic),
                thickness,
                ior: Some(1.4),
                ..MaterialSource::default()
            };
            look(Format::Gltf, source)
        };
        let glass = |thin: f32| Some((Vec3::splat(0.25), vec![1.4, thin]));
        assert_eq!(gltf(1.0, 0.0, None), glass(1.0));
        assert_eq!(gltf(1.0, 0.0, Some(0.0)), glass(1.0));
        assert_eq!(gltf(0.9, 0.0, Some(0.2)), glass(0.0));
        assert_eq!(gltf(0.1, 0.0, Some(0.2)), None);
        assert_eq!(gltf(1.0, 1.0, None), None, "metals transmit nothing");
    }
}
