//! Lambert and a normalised power of the cosine to the mirror direction.

use super::*;
use raystone_scene::PHONG;

pub(crate) static CHECKS: MaterialChecks = MaterialChecks {
    python: include_str!("phong.py"),
    balls,
    planes,
    ..MaterialChecks::new(&PHONG, |surface| Box::new(Phong::new(surface)), by_formula)
};

struct Phong<'a> {
    surface: &'a Surface<'a>,
    specular: DVec3,
    exponent: f64,
    /// Probability of the diffuse lobe.
    diffuse: f64,
}

impl<'a> Phong<'a> {
    fn new(surface: &'a Surface<'a>) -> Self {
        let specular = colour(surface);
        Self {
            surface,
            specular,
            exponent: parameter(surface, 3),
            diffuse: diffuse_share(surface.base, specular),
        }
    }

    fn mirror(&self) -> DVec3 {
        mirrored(self.surface.out, self.surface.normal)
    }
}

impl Bsdf for Phong<'_> {
    fn sample(&self, [u, v]: [f64; 2], rounding: &mut Rounding) -> Option<Bounce> {
        let (is_diffuse, u) = choose(u, self.diffuse, rounding);
        let direction = if is_diffuse {
            cosine_direction(self.surface.normal, [u, v])
        } else {
            let cos = u.powf(1.0 / (self.exponent + 1.0));
            let radius = (1.0 - cos * cos).max(0.0).sqrt();
            let (sin_phi, cos_phi) = (TAU * v).sin_cos();
            let local = DVec3::new(radius * cos_phi, radius * sin_phi, cos);
            around(self.mirror(), local)
        };
        bounce(self, direction, rounding)
    }

    fn folded(&self) -> Option<&Surface<'_>> {
        Some(self.surface)
    }

    fn evaluate(&self, direction: DVec3, rounding: &mut Rounding) -> Option<Reflected> {
        let cosine = cosine_density(self.surface.normal, direction);
        let towards = rounding.number(direction.dot(self.mirror())).min(1.0);
        // Zero behind the plane across the mirror direction: exponent 0 is a hemisphere.
        let lobe = if towards > 0.0 {
            (self.exponent + 1.0) / TAU * towards.powf(self.exponent)
        } else {
            0.0
        };
        (cosine > 0.0).then(|| Reflected {
            value: self.surface.base * cosine + self.specular * lobe,
            density: self.diffuse * cosine + (1.0 - self.diffuse) * lobe,
        })
    }
}

fn balls() -> Vec<(Option<usize>, Material)> {
    let phong =
        |exponent| Material::phong("phong", vec3(0.3, 0.1, 0.5), vec3(0.4, 0.5, 0.3), exponent);
    // The last is a hemisphere about the mirror direction, with a hard edge.
    [(0, 3.0), (1, 150.0), (10, 0.0)]
        .map(|(place, exponent)| (Some(place), phong(exponent)))
        .into()
}

fn planes() -> Vec<(&'static str, Material)> {
    let phong = Material::phong("phong", vec3(0.5, 0.3, 0.2), Vec3::splat(0.4), 12.0);
    vec![("phong", phong)]
}
