//! Metallic-roughness: Burley's diffuse part, renormalised, under GGX facets.

use super::dielectric::schlick;
use super::*;
use raystone_scene::{PRINCIPLED, reflectance_of_ior};

pub(crate) static CHECKS: MaterialChecks = MaterialChecks {
    python: include_str!("principled.py"),
    balls,
    planes,
    ..MaterialChecks::new(
        &PRINCIPLED,
        |surface| Box::new(Principled::new(surface)),
        by_formula,
    )
};

/// Minimum width of the facet distribution.
const LEAST_ALPHA: f64 = 0.001;

struct Principled<'a> {
    surface: &'a Surface<'a>,
    metallic: f64,
    roughness: f64,
    alpha: f64,
    /// Normal-incidence reflectance of the dielectric part.
    f0: f64,
    n_o: f64,
    /// Probability of the diffuse lobe.
    diffuse: f64,
}

impl<'a> Principled<'a> {
    fn new(surface: &'a Surface<'a>) -> Self {
        let [metallic, roughness, f0] = [0, 1, 2].map(|place| parameter(surface, place));
        let [metallic, roughness] = [metallic * surface.varied[0], roughness * surface.varied[1]];
        let n_o = surface.normal.dot(surface.out).max(LEAST_COSINE);
        let mut made = Self {
            surface,
            metallic,
            roughness,
            alpha: (roughness * roughness).max(LEAST_ALPHA),
            f0,
            n_o,
            diffuse: 0.0,
        };
        if metallic < 1.0 && surface.base.max_element() > 0.0 {
            let specular = luminance(made.reflectance(n_o));
            let base = (1.0 - metallic) * (1.0 - schlick(f0, n_o)) * luminance(surface.base);
            made.diffuse = (base / (specular + base)).clamp(0.1, 0.9);
        }
        made
    }

    /// Reflectance of the facets, dielectric and metallic parts together.
    fn reflectance(&self, cos: f64) -> DVec3 {
        let base = self.surface.base.to_array();
        let metal = DVec3::from_array(base.map(|f0| schlick(f0, cos)));
        (1.0 - self.metallic) * DVec3::splat(schlick(self.f0, cos)) + self.metallic * metal
    }

    fn facets(&self, n_h: f64) -> f64 {
        let alpha_2 = self.alpha * self.alpha;
        alpha_2 / (PI * (n_h * n_h * (alpha_2 - 1.0) + 1.0).powi(2))
    }

    fn lambda(&self, cos: f64) -> f64 {
        let tan_2 = (1.0 - cos * cos).max(0.0) / (cos * cos);
        ((1.0 + self.alpha * self.alpha * tan_2).sqrt() - 1.0) / 2.0
    }

    fn diffuse_part(&self, n_i: f64, i_h: f64) -> DVec3 {
        let r = self.roughness;
        let energy = 1.0 - r * (1.0 - 1.0 / 1.51);
        let grazing = r / 2.0 + 2.0 * r * i_h * i_h;
        let side = |cos: f64| 1.0 + (grazing - 1.0) * (1.0 - cos).max(0.0).powi(5);
        self.surface.base / PI * (energy * side(n_i) * side(self.n_o))
    }

    fn visible_normal(&self, [u, v]: [f64; 2]) -> DVec3 {
        let n = self.surface.normal;
        let [x, y] = basis(n);
        let o = self.surface.out;
        let alpha = self.alpha;
        let seen = DVec3::new(alpha * o.dot(x), alpha * o.dot(y), self.n_o).normalize();
        let z = (1.0 - v) * (1.0 + seen.z) - seen.z;
        let radius = (1.0 - z * z).max(0.0).sqrt();
        let (sin, cos) = (TAU * u).sin_cos();
        let sum = DVec3::new(radius * cos, radius * sin, z) + seen;
        around(
            n,
            DVec3::new(alpha * sum.x, alpha * sum.y, sum.z).normalize(),
        )
    }
}

impl Bsdf for Principled<'_> {
    fn sample(&self, [u, v]: [f64; 2], rounding: &mut Rounding) -> Option<Bounce> {
        let (is_diffuse, u) = choose(u, self.diffuse, rounding);
        let direction = if is_diffuse {
            cosine_direction(self.surface.normal, [u, v])
        } else {
            mirrored(self.surface.out, self.visible_normal([u, v]))
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
        let (n_i, o_h) = (n.dot(direction), o.dot(h).min(1.0));
        let facets = self.facets(rounding.number(n.dot(h)).min(1.0));
        let (seen, lit) = (self.lambda(self.n_o), self.lambda(n_i));
        // The facets alone, over n·i.
        let specular = facets / (1.0 + seen + lit) / (4.0 * self.n_o);
        let passed = (1.0 - schlick(self.f0, self.n_o)) * (1.0 - schlick(self.f0, n_i));
        let diffuse = (1.0 - self.metallic) * passed * self.diffuse_part(n_i, o_h) * n_i;
        let density = facets / (1.0 + seen) / (4.0 * self.n_o);
        Some(Reflected {
            value: diffuse + self.reflectance(o_h) * specular,
            density: self.diffuse * cosine_density(n, direction) + (1.0 - self.diffuse) * density,
        })
    }
}

fn balls() -> Vec<(Option<usize>, Material)> {
    let color = vec3(0.9, 0.6, 0.4);
    [
        (4, 0.0, 0.3, 0.04),
        (5, 1.0, 0.5, 0.04),
        (6, 0.5, 0.9, 0.08),
    ]
    .map(|(place, metallic, roughness, f0)| {
        let ball = Material::principled("principled", color, metallic, roughness, f0);
        (Some(place), ball)
    })
    .into()
}

fn planes() -> Vec<(&'static str, Material)> {
    [
        ("plastic", 0.0, 0.5, reflectance_of_ior(1.5)),
        ("metal", 1.0, 0.6, 0.04),
        ("between", 0.4, 0.7, 0.08),
    ]
    .map(|(name, metallic, roughness, f0)| {
        let base = vec3(0.5, 0.3, 0.2);
        (
            name,
            Material::principled(name, base, metallic, roughness, f0),
        )
    })
    .into()
}
