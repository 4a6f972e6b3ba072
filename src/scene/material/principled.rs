//! The metallic-roughness model of glTF 2.0.
//!
//! * glTF: all materials that are neither mirror nor glass. `KHR_materials_pbrSpecularGlossiness`
//!   is converted like Khronos's converter, solving for metalness from both colours' brightness.
//! * MTL: if `Pm`, a later addition to the format, is stated; with `Pr`, `Kd` and `Ni`.

use super::{DEFAULT_IOR, Description, Format, Lobes, Look, Material, MaterialKind, within};
use glam::Vec3;

/// The metallic-roughness model of glTF 2.0.
pub static PRINCIPLED: MaterialKind = MaterialKind {
    name: "principled",
    feature: "principled",
    description: "metallic-roughness: Burley diffuse under GGX facets, or a metal of them (glTF; MTL with Pm)",
    parameters: &[
        "metalness",
        "roughness",
        "reflectance of the dielectric part at normal incidence",
    ],
    lobes: Lobes::Glossy,
    sources: &[],
    recognise,
};

/// Reflectance of a dielectric in the specular-glossiness model.
const DIELECTRIC_F0: f32 = 0.04;

/// Normal-incidence reflectance of a dielectric with this index of refraction; of glass if invalid. An index of 0 reflects
/// everything, as `KHR_materials_ior` has it.
pub fn reflectance_of_ior(ior: f32) -> f32 {
    let ior = if ior.is_finite() && ior >= 0.0 {
        ior
    } else {
        DEFAULT_IOR
    };
    ((ior - 1.0) / (ior + 1.0)).powi(2)
}

fn recognise(description: &Description<'_>) -> Option<Look> {
    let source = description.source;
    let roughness = source.roughness.unwrap_or(1.0);
    // An index of 0 has a meaning in glTF alone.
    let is_known = |ior: &f32| *ior > 0.0 || description.format == Format::Gltf;
    let f0 = reflectance_of_ior(source.ior.filter(is_known).unwrap_or(DEFAULT_IOR));
    match (description.format, source.metallic, source.specular) {
        (_, Some(metallic), _) if !description.is_varied || description.is_followed => {
            Some(look(description.base_color, metallic, roughness, f0))
        }
        (Format::Gltf, None, Some(specular)) => {
            let (base, metallic) = of_glossy(description.base_color, specular.into());
            Some(look(base, metallic, roughness, DIELECTRIC_F0))
        }
        _ => None,
    }
}

fn look(base_color: Vec3, metallic: f32, roughness: f32, f0: f32) -> Look {
    let numbers = [metallic, roughness, f0].map(|part| within(part, 0.0, 1.0));
    Look {
        parameters: numbers.to_vec(),
        ..Look::plain(base_color)
    }
}

/// Base colour and metalness of a diffuse and a specular colour (Khronos, "PBR specular-glossiness
/// to metallic-roughness conversion", in the repository of `KHR_materials_pbrSpecularGlossiness`).
fn of_glossy(diffuse: Vec3, specular: Vec3) -> (Vec3, f32) {
    let brightness = |c: Vec3| (c * c).dot(Vec3::new(0.299, 0.587, 0.114)).sqrt();
    let left = 1.0 - specular.max_element();
    let metallic = solved_metallic(brightness(diffuse), brightness(specular), left);
    let of_diffuse = diffuse * (left / (1.0 - DIELECTRIC_F0) / (1.0 - metallic).max(1e-6));
    let of_specular = (specular - DIELECTRIC_F0 * (1.0 - metallic)) / metallic.max(1e-6);
    let base = of_diffuse.lerp(of_specular, metallic * metallic);
    (base.clamp(Vec3::ZERO, Vec3::ONE), metallic)
}

fn solved_metallic(diffuse: f32, specular: f32, left: f32) -> f32 {
    if specular < DIELECTRIC_F0 {
        return 0.0;
    }
    let b = diffuse * left / (1.0 - DIELECTRIC_F0) + specular - 2.0 * DIELECTRIC_F0;
    let discriminant = b * b - 4.0 * DIELECTRIC_F0 * (DIELECTRIC_F0 - specular);
    let root = discriminant.max(0.0).sqrt();
    ((root - b) / (2.0 * DIELECTRIC_F0)).clamp(0.0, 1.0)
}

impl Material {
    /// Scales the reflectance of the dielectric part at normal incidence. Other kinds are unchanged.
    pub(in super::super) fn with_reflectance_times(mut self, factor: f32) -> Self {
        if self.kind == &PRINCIPLED
            && let [_, _, f0] = &mut self.parameters[..]
        {
            *f0 = within(*f0 * factor, 0.0, 1.0);
        }
        self
    }

    /// A metallic-roughness material: linear RGB base colour (diffuse or metallic), metalness,
    /// roughness and normal-incidence reflectance of the dielectric, each in [0, 1].
    pub fn principled(
        name: impl Into<String>,
        base_color: Vec3,
        metallic: f32,
        roughness: f32,
        f0: f32,
    ) -> Self {
        Self::looking(name, &PRINCIPLED, look(base_color, metallic, roughness, f0))
    }
}

#[cfg(test)]
mod tests {
    use super::super::MaterialSource;
    use super::*;

    fn recognised(format: Format, source: MaterialSource) -> Option<(Vec3, Vec<f32>)> {
        let description = Description {
            format,
            base_color: Vec3::splat(0.5),
            is_varied: false,
            is_followed: false,
            source: &source,
        };
        recognise(&description).map(|look| (look.base_color, look.parameters))
    }

    #[test]
    fn metalness_makes_a_principled_material_of_either_format() {
        let source = |metallic, ior| MaterialSource {
            metallic,
            roughness: Some(0.25),
            ior,
            ..MaterialSource::default()
        };
        for format in [Format::Gltf, Format::Mtl] {
            let found = recognised(format, source(Some(0.75), Some(3.0)));
            assert_eq!(found, Some((Vec3::splat(0.5), vec![0.75, 0.25, 0.25])));
            assert_eq!(recognised(format, source(None, None)), None);
        }
        let (_, parameters) = recognised(Format::Gltf, source(Some(2.0), Some(0.0))).unwrap();
        assert_eq!((parameters[0], parameters[2]), (1.0, 1.0));
        let (_, parameters) = recognised(Format::Mtl, source(Some(2.0), Some(0.0))).unwrap();
        assert!((parameters[2] - 0.04).abs() < 1e-6, "the index of glass");
    }

    #[test]
    fn a_glossy_material_is_metal_where_its_specular_colour_is_bright() {
        let glossy =
            |diffuse: f32, specular: f32| of_glossy(Vec3::splat(diffuse), Vec3::splat(specular));
        assert_eq!(glossy(0.5, 0.0).1, 0.0);
        let (base, metallic) = glossy(0.5, 0.04);
        assert!(
            metallic < 1e-3 && (base.x - 0.5).abs() < 1e-3,
            "{base} {metallic}"
        );
        let (base, metallic) = glossy(0.0, 0.9);
        assert!(
            metallic > 0.999 && (base.x - 0.9).abs() < 1e-3,
            "{base} {metallic}"
        );
    }
}
