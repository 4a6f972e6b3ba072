//! Normalised Phong: a diffuse lobe and a power of the cosine about the mirror direction.
//!
//! MTL: illumination model 2 with `Kd`, `Ks` and `Ns`; `Kd` and `Ks` sum to at most 1.

use super::{Description, Format, Lobes, Look, Material, MaterialKind, within};
use glam::Vec3;

/// Normalised Phong.
pub static PHONG: MaterialKind = MaterialKind {
    name: "phong",
    feature: "phong",
    description: "diffuse and a normalised power of the cosine to the mirror direction (MTL illum 2 with Ks and Ns)",
    parameters: &[
        "specular red",
        "specular green",
        "specular blue",
        "exponent",
    ],
    lobes: Lobes::Glossy,
    sources: &[],
    recognise,
};

/// MTL illumination model with highlights and no reflected rays.
const ILLUM: u8 = 2;
/// Exponent above which the lobe is too narrow for f32 directions.
const GREATEST_EXPONENT: f32 = 1e5;

fn recognise(description: &Description<'_>) -> Option<Look> {
    let source = description.source;
    let exponent = source.shininess?;
    let specular = Vec3::from(source.specular?);
    let is_phong = description.format == Format::Mtl
        && source.illum == Some(ILLUM)
        && specular.max_element() > 0.0;
    is_phong.then(|| look(description.base_color, specular, exponent))
}

fn look(diffuse: Vec3, specular: Vec3, exponent: f32) -> Look {
    let exponent = within(exponent, 0.0, GREATEST_EXPONENT);
    Look::balanced(diffuse, specular, &[exponent])
}

impl Material {
    /// A normalised Phong material: linear RGB reflectance of both lobes, scaled down if the sum
    /// exceeds 1, and the exponent (0 to 10⁵).
    pub fn phong(name: impl Into<String>, diffuse: Vec3, specular: Vec3, exponent: f32) -> Self {
        Self::looking(name, &PHONG, look(diffuse, specular, exponent))
    }
}

#[cfg(test)]
mod tests {
    use super::super::MaterialSource;
    use super::*;

    #[test]
    fn only_the_second_model_with_a_specular_colour_and_an_exponent_is_phong() {
        let recognised = |illum, specular, shininess| {
            let source = MaterialSource {
                illum,
                specular,
                shininess,
                ..MaterialSource::default()
            };
            let description = Description {
                format: Format::Mtl,
                base_color: Vec3::splat(0.5),
                is_varied: false,
                is_followed: false,
                source: &source,
            };
            recognise(&description).map(|look| (look.base_color, look.parameters, look.reflected))
        };
        let grey = Some([0.25; 3]);
        let expected = (Vec3::splat(0.5), vec![0.25, 0.25, 0.25, 10.0], 0.75);
        assert_eq!(recognised(Some(2), grey, Some(10.0)), Some(expected));
        assert_eq!(recognised(Some(1), grey, Some(10.0)), None);
        assert_eq!(recognised(None, grey, Some(10.0)), None);
        assert_eq!(recognised(Some(2), Some([0.0; 3]), Some(10.0)), None);
        assert_eq!(recognised(Some(2), None, Some(10.0)), None);
        assert_eq!(recognised(Some(2), grey, None), None);
        // Reflects more than arrives: both lobes are halved.
        let (base, parameters, reflected) =
            recognised(Some(2), Some([1.5; 3]), Some(-1.0)).unwrap();
        assert_eq!((base, reflected), (Vec3::splat(0.25), 2.0));
        assert_eq!(parameters, [0.75, 0.75, 0.75, 0.0]);
    }
}
