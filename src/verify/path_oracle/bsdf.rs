//! Material evaluation as defined in `docs/shading.md`. The kinds are in `src/verify/materials/`.

use super::luminance;
use super::rounding::Rounding;
use super::surface::Surface;
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// A sampled direction in which a path continues.
pub struct Bounce {
    /// Unit direction.
    pub direction: DVec3,
    /// f · cos / density.
    pub weight: DVec3,
    /// Density over solid angle; `None` for a delta lobe.
    pub density: Option<f64>,
    /// The reciprocal of refraction's scale factor on radiance.
    pub medium: f64,
}

/// The response of a material to light from one direction, without delta lobes.
#[derive(Debug, Clone, Copy)]
pub struct Reflected {
    /// f · cos.
    pub value: DVec3,
    /// Density with which the material samples the direction.
    pub density: f64,
}

/// A material at a point.
pub trait Bsdf {
    /// A sampled direction; `None` ends the path.
    fn sample(&self, uv: [f64; 2], rounding: &mut Rounding) -> Option<Bounce>;
    /// Value and density of a direction relative to the shading normal.
    fn evaluate(&self, direction: DVec3, rounding: &mut Rounding) -> Option<Reflected>;
    /// The surface, if reflection to its back side is mirrored at it.
    fn folded(&self) -> Option<&Surface<'_>> {
        None
    }
    /// Value and density of a direction.
    fn reflect(&self, direction: DVec3, rounding: &mut Rounding) -> Option<Reflected> {
        let Some(surface) = self.folded() else {
            return self.evaluate(direction, rounding);
        };
        if direction.dot(surface.geometric) <= 0.0 {
            return None;
        }
        let parts = [direction, across(surface, direction)];
        let parts = parts.map(|part| self.evaluate(part, rounding));
        let sum = |a: Reflected, b: Reflected| Reflected {
            value: a.value + b.value,
            density: a.density + b.density,
        };
        parts.into_iter().flatten().reduce(sum)
    }
    /// True if all lobes are delta: no light samples are taken then.
    fn is_delta(&self) -> bool {
        false
    }
}

/// Orthonormal basis: T. Duff et al., "Building an orthonormal basis, revisited", JCGT 6(1), 2017.
pub(crate) fn basis(n: DVec3) -> [DVec3; 2] {
    let sign = if n.z >= 0.0 { 1.0 } else { -1.0 };
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    [
        DVec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
        DVec3::new(b, sign + n.y * n.y * a, -n.y),
    ]
}

/// Converts local coordinates around a unit vector `n` to a direction.
pub fn around(n: DVec3, local: DVec3) -> DVec3 {
    let [x, y] = basis(n);
    (x * local.x + y * local.y + n * local.z).normalize()
}

/// A direction with density cos / π.
pub fn cosine_direction(n: DVec3, [u, v]: [f64; 2]) -> DVec3 {
    let (sin, cos) = (TAU * v).sin_cos();
    around(
        n,
        DVec3::new(u.sqrt() * cos, u.sqrt() * sin, (1.0 - u).sqrt()),
    )
}

/// Density of [`cosine_direction`].
pub fn cosine_density(n: DVec3, direction: DVec3) -> f64 {
    n.dot(direction).max(0.0) / PI
}

/// The mirror direction of `o` about `n`.
pub fn mirrored(o: DVec3, n: DVec3) -> DVec3 {
    (2.0 * n.dot(o) * n - o).normalize()
}

/// Parameter number `place` of the material.
pub fn parameter(surface: &Surface, place: usize) -> f64 {
    let parameters = &surface.material.parameters;
    parameters.get(place).copied().unwrap_or_default().into()
}

/// The colour in the first three parameters.
pub fn colour(surface: &Surface) -> DVec3 {
    DVec3::from_array([0, 1, 2].map(|place| parameter(surface, place)))
}

/// Chooses the first of two lobes with probability `p`; also returns the rescaled `u`.
pub fn choose(u: f64, p: f64, rounding: &mut Rounding) -> (bool, f64) {
    let u = rounding.share(u).clamp(0.0, 1.0);
    if u < p {
        (true, u / p)
    } else {
        (false, (u - p) / (1.0 - p))
    }
}

/// Probability of the diffuse lobe beside a specular one of this colour.
pub fn diffuse_share(base: DVec3, specular: DVec3) -> f64 {
    let (base, specular) = (luminance(base), luminance(specular));
    if base + specular > 0.0 {
        base / (base + specular)
    } else {
        1.0
    }
}

/// The smallest n·o that is distinguished from 0.
pub(crate) const LEAST_COSINE: f64 = 1e-7;

/// True if a surface that is not [`Bsdf::folded`] reflects light from this direction at all.
pub fn is_above(surface: &Surface, direction: DVec3) -> bool {
    direction.dot(surface.normal) > 0.0 && direction.dot(surface.geometric) > 0.0
}

fn across(surface: &Surface, direction: DVec3) -> DVec3 {
    direction - surface.geometric * (2.0 * direction.dot(surface.geometric))
}

/// A delta direction, mirrored at the surface where shading and geometric normal disagree.
pub fn kept(surface: &Surface, direction: DVec3) -> DVec3 {
    let [meant, found] = [surface.normal, surface.geometric].map(|n| n.dot(direction) > 0.0);
    if meant == found {
        direction
    } else {
        across(surface, direction)
    }
}

/// A sampled direction of one lobe with the weight of the whole material.
pub fn bounce(
    bsdf: &(impl Bsdf + ?Sized),
    direction: DVec3,
    rounding: &mut Rounding,
) -> Option<Bounce> {
    let direction = match bsdf.folded() {
        Some(surface) if surface.normal.dot(direction) <= 0.0 => return None,
        Some(surface) => kept(surface, direction),
        None => direction,
    };
    let direction = rounding.direction(direction);
    let Reflected { value, density } = bsdf.reflect(direction, rounding)?;
    (density > 0.0).then(|| Bounce {
        direction,
        weight: value / density,
        density: Some(density),
        medium: 1.0,
    })
}
