//! Lambert and microfacets with Beckmann's distribution.

use super::dielectric::{fresnel, normal_reflectance, schlick};
use super::*;
use raystone_scene as scene;
use raystone_scene::{COOK_TORRANCE, Fresnel, Masking};

pub(crate) static CHECKS: MaterialChecks = MaterialChecks {
    python: include_str!("cook_torrance.py"),
    balls,
    planes,
    ..MaterialChecks::new(
        &COOK_TORRANCE,
        |surface| Box::new(CookTorrance::new(surface)),
        by_formula,
    )
};

struct CookTorrance<'a> {
    surface: &'a Surface<'a>,
    specular: DVec3,
    roughness: f64,
    index: f64,
    is_smith: bool,
    is_exact: bool,
    /// Probability of the diffuse lobe.
    diffuse: f64,
}

impl<'a> CookTorrance<'a> {
    fn new(surface: &'a Surface<'a>) -> Self {
        let specular = colour(surface);
        Self {
            surface,
            specular,
            roughness: parameter(surface, 3),
            index: parameter(surface, 4),
            is_smith: parameter(surface, 5) > 0.5,
            is_exact: parameter(surface, 6) > 0.5,
            diffuse: diffuse_share(surface.base, specular),
        }
    }

    /// Beckmann's density of facet normals, as a function of their cosine.
    fn facets(&self, cos: f64) -> f64 {
        let (cos_2, m_2) = (cos * cos, self.roughness * self.roughness);
        let tan_2 = (1.0 - cos_2) / cos_2;
        (-tan_2 / m_2).exp() / (PI * m_2 * cos_2 * cos_2)
    }

    /// The unmasked and unshadowed fraction, for n·o, n·i, n·h and o·h.
    fn visible(&self, [n_o, n_i, n_h, o_h]: [f64; 4]) -> f64 {
        if !self.is_smith {
            let cavity = |cos: f64| 2.0 * n_h * cos / o_h;
            return cavity(n_o).min(cavity(n_i)).min(1.0);
        }
        let one = |cos: f64| {
            let a = cos / (self.roughness * (1.0 - cos * cos).max(0.0).sqrt());
            if a < 1.6 {
                (3.535 * a + 2.181 * a * a) / (1.0 + 2.276 * a + 2.577 * a * a)
            } else {
                1.0
            }
        };
        one(n_o) * one(n_i)
    }

    fn reflectance(&self, cos: f64) -> f64 {
        if self.is_exact {
            fresnel(cos, 1.0, self.index).map_or(1.0, |(r, _)| r)
        } else {
            schlick(normal_reflectance(self.index), cos)
        }
    }
}

impl Bsdf for CookTorrance<'_> {
    fn sample(&self, [u, v]: [f64; 2], rounding: &mut Rounding) -> Option<Bounce> {
        let (is_diffuse, u) = choose(u, self.diffuse, rounding);
        let normal = self.surface.normal;
        let direction = if is_diffuse {
            cosine_direction(normal, [u, v])
        } else {
            let tan_2 = -self.roughness * self.roughness * (1.0 - u).ln();
            let cos = 1.0 / (1.0 + tan_2).sqrt();
            let radius = cos * tan_2.sqrt();
            let (sin_phi, cos_phi) = (TAU * v).sin_cos();
            let facet = around(normal, DVec3::new(radius * cos_phi, radius * sin_phi, cos));
            mirrored(self.surface.out, facet)
        };
        bounce(self, direction, rounding)
    }

    fn folded(&self) -> Option<&Surface<'_>> {
        Some(self.surface)
    }

    fn evaluate(&self, direction: DVec3, rounding: &mut Rounding) -> Option<Reflected> {
        let (o, n) = (self.surface.out, self.surface.normal);
        if n.dot(direction) <= 0.0 {
            return None;
        }
        let h = (o + direction).normalize();
        let (n_o, n_i) = (n.dot(o).max(LEAST_COSINE), n.dot(direction));
        let (n_h, o_h) = (rounding.number(n.dot(h)).min(1.0), o.dot(h));
        let facets = self.facets(n_h);
        let visible = self.visible([n_o, n_i, n_h, o_h]);
        // f · cos, with n·i cancelled.
        let lobe = self.reflectance(o_h.min(1.0)) * visible * facets / (4.0 * n_o);
        let cosine = cosine_density(n, direction);
        Some(Reflected {
            value: self.surface.base * cosine + self.specular * lobe,
            density: self.diffuse * cosine + (1.0 - self.diffuse) * facets * n_h / (4.0 * o_h),
        })
    }
}

fn of(
    [diffuse, specular]: [Vec3; 2],
    ior: f32,
    (masking, fresnel, roughness): (Masking, Fresnel, f32),
) -> Material {
    let of = scene::CookTorrance {
        diffuse,
        specular,
        roughness,
        ior,
        masking,
        fresnel,
    };
    Material::cook_torrance("cook-torrance", &of)
}

fn balls() -> Vec<(Option<usize>, Material)> {
    let colours = [vec3(0.3, 0.2, 0.1), vec3(0.5, 0.6, 0.4)];
    [
        (2, (Masking::VCavities, Fresnel::Schlick, 0.4)),
        (3, (Masking::Smith, Fresnel::Exact, 0.15)),
        // Rough enough to mask half of the angles.
        (8, (Masking::Smith, Fresnel::Schlick, 0.6)),
        (9, (Masking::VCavities, Fresnel::Exact, 0.7)),
    ]
    .map(|(place, facets)| (Some(place), of(colours, 1.7, facets)))
    .into()
}

fn planes() -> Vec<(&'static str, Material)> {
    let colours = [vec3(0.5, 0.3, 0.2), vec3(0.3, 0.5, 0.6)];
    [
        ("V-cavities", (Masking::VCavities, Fresnel::Schlick, 0.4)),
        ("Smith", (Masking::Smith, Fresnel::Exact, 0.5)),
    ]
    .map(|(name, facets)| (name, of(colours, 1.6, facets)))
    .into()
}
