//! Smooth glass: Fresnel's equations choose between reflection and refraction.

use super::*;

pub(super) struct Dielectric<'a>(pub &'a Surface<'a>);

/// Schlick's polynomial of a cosine on the optically thinner side.
pub(super) fn schlick(f0: f64, cos: f64) -> f64 {
    f0 + (1.0 - f0) * (1.0 - cos).max(0.0).powi(5)
}

/// Reflectance at normal incidence.
pub(super) fn normal_reflectance(index: f64) -> f64 {
    ((index - 1.0) / (index + 1.0)).powi(2)
}

/// Reflectance for unpolarised light between media of these indices, and the cosine of the refracted direction;
/// `None` at total reflection.
pub(super) fn fresnel(cos: f64, from: f64, to: f64) -> Option<(f64, f64)> {
    let sin_2 = (1.0 - cos * cos) * (from / to).powi(2);
    if sin_2 >= 1.0 {
        return None;
    }
    let beyond = (1.0 - sin_2).sqrt();
    let across = (from * cos - to * beyond) / (from * cos + to * beyond);
    let along = (to * cos - from * beyond) / (to * cos + from * beyond);
    Some(((across * across + along * along) / 2.0, beyond))
}

impl Bsdf for Dielectric<'_> {
    fn sample(&self, [u, _]: [f64; 2], rounding: &mut Rounding) -> Option<Bounce> {
        let surface = self.0;
        let (index, is_thin) = (parameter(surface, 0), parameter(surface, 1) > 0.5);
        let (from, to) = match is_thin || surface.side > 0.0 {
            true => (1.0, index),
            false => (index, 1.0),
        };
        let cos = surface.normal.dot(surface.out).min(1.0);
        let delta = |direction, weight, medium| Bounce {
            direction,
            weight,
            density: None,
            medium,
        };
        let passed = fresnel(cos, from, to);
        let reflectance = passed.map_or(1.0, |(exact, beyond)| {
            let r = match parameter(surface, 2) > 0.5 {
                false => exact,
                true => schlick(
                    normal_reflectance(index),
                    if from > to { beyond } else { cos },
                ),
            };
            if is_thin { 2.0 * r / (1.0 + r) } else { r }
        });
        let Some((_, beyond)) = passed.filter(|_| u >= rounding.share(reflectance)) else {
            let direction =
                rounding.direction(kept(surface, mirrored(surface.out, surface.normal)));
            return Some(delta(direction, DVec3::ONE, 1.0));
        };
        if is_thin {
            return Some(delta(-surface.out, surface.base, 1.0));
        }
        let ratio = from / to;
        let refracted = -ratio * surface.out + (ratio * cos - beyond) * surface.normal;
        let direction = rounding.direction(kept(surface, refracted.normalize()));
        let scale = ratio * ratio;
        Some(delta(direction, surface.base * scale, 1.0 / scale))
    }

    fn evaluate(&self, _: DVec3, _: &mut Rounding) -> Option<Reflected> {
        None
    }

    fn is_delta(&self) -> bool {
        true
    }
}
