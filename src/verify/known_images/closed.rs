//! Closed forms and quadrature for the light that surfaces receive.

use glam::DVec3;
use raystone_scene::EnvironmentMap;
use std::f64::consts::{PI, TAU};

/// Irradiance over radiance at `point` with this normal from a polygon wholly above its horizon and
/// seen from its front (J. H. Lambert, Photometria, 1760): half the sum over edges of the angle
/// subtended by the edge times the cosine between the normal and the plane through it.
pub fn polygon(point: DVec3, normal: DVec3, corners: &[DVec3]) -> f64 {
    let towards: Vec<DVec3> = corners.iter().map(|c| *c - point).collect();
    let edges = towards.iter().zip(towards.iter().cycle().skip(1));
    let sum: f64 = edges
        .map(|(a, b)| {
            let across = a.cross(*b);
            across.length().atan2(a.dot(*b)) * normal.dot(across.normalize_or_zero())
        })
        .sum();
    0.5 * sum.abs()
}

/// Irradiance over radiance from a parallel disk whose axis passes the point at `offset` (J. R.
/// Howell, A Catalog of Radiation Heat Transfer Configuration Factors, B-13, times π).
pub fn disk(height: f64, radius: f64, offset: f64) -> f64 {
    let (h, r) = (height / offset, radius / offset);
    let z = 1.0 + h * h + r * r;
    0.5 * PI * (1.0 - (z - 2.0 * r * r) / (z * z - 4.0 * r * r).sqrt())
}

/// Irradiance over radiance of a sphere wholly above the horizon, with this offset from its centre:
/// π sin²α cos θ (Howell, B-43, times π).
pub fn sphere(offset: DVec3, normal: DVec3, radius: f64) -> f64 {
    PI * radius * radius / offset.length_squared() * offset.normalize().dot(normal)
}

/// Fraction of the cosine-weighted hemisphere whose directions have a component of at least `c`
/// along an axis in the plane: the segment of the unit disk cut off at distance `c` from its centre
/// (W. Nusselt, 1928).
pub(crate) fn segment(c: f64) -> f64 {
    let c = c.clamp(-1.0, 1.0);
    (c.acos() - c * (1.0 - c * c).sqrt()) / PI
}

/// The same with at least `a` along one axis and at least `b` along the other, by quadrature.
pub(crate) fn corner(a: f64, b: f64) -> f64 {
    let end = (1.0 - b * b).max(0.0).sqrt();
    if a >= end {
        return 0.0;
    }
    integral([a, end], |x| (1.0 - x * x).max(0.0).sqrt() - b) / PI
}

/// ∫ f over an interval: five-point Gauss–Legendre quadrature in 200 parts.
pub fn integral([start, end]: [f64; 2], f: impl Fn(f64) -> f64) -> f64 {
    const PARTS: u32 = 200;
    const RULE: [[f64; 2]; 5] = [
        [0.0, 0.568_888_888_888_888_9],
        [0.538_469_310_105_683, 0.478_628_670_499_366_5],
        [-0.538_469_310_105_683, 0.478_628_670_499_366_5],
        [0.906_179_845_938_664, 0.236_926_885_056_189_1],
        [-0.906_179_845_938_664, 0.236_926_885_056_189_1],
    ];
    let half = 0.5 * (end - start) / f64::from(PARTS);
    let part = |k: u32| {
        let middle = start + half * f64::from(2 * k + 1);
        let sum = RULE
            .iter()
            .map(|[at, weight]| weight * f(middle + half * at));
        half * sum.sum::<f64>()
    };
    (0..PARTS).map(part).sum()
}

/// ∫ f over the directions above z = 0: the midpoints of `2 n · n` cells of equal solid angle.
pub(crate) fn over_hemisphere(n: u32, f: impl Fn(DVec3) -> DVec3) -> DVec3 {
    let mut sum = DVec3::ZERO;
    for row in 0..n {
        // Equal steps in the squared cosine: cosine-weighted integrands are sampled evenly.
        let cos = ((f64::from(row) + 0.5) / f64::from(n)).sqrt();
        let sin = (1.0 - cos * cos).sqrt();
        for column in 0..2 * n {
            let (y, x) = (TAU * (f64::from(column) + 0.5) / f64::from(2 * n)).sin_cos();
            sum += f(DVec3::new(sin * x, sin * y, cos)) / cos;
        }
    }
    sum * PI / f64::from(2 * n * n)
}

/// Radiance of a map for these angles, from its description: bilinear between texel centres.
pub(crate) fn map_radiance(map: &EnvironmentMap, turn: f64, polar: f64, azimuth: f64) -> DVec3 {
    let (width, height) = (map.width as usize, map.height as usize);
    // A turn by +a about y maps the azimuth φ, measured from −z towards +x, to φ − a.
    let around = (azimuth + turn).rem_euclid(TAU) / TAU * width as f64 - 0.5;
    let down = (polar / PI * height as f64 - 0.5).clamp(0.0, height as f64 - 1.0);
    let column = around.floor();
    let left = column.rem_euclid(width as f64) as usize;
    let (row, s, t) = (down.floor() as usize, around - column, down.fract());
    let at = |x: usize, y: usize| map.texels[y.min(height - 1) * width + x % width].as_dvec3();
    let along = |y: usize| (1.0 - s) * at(left, y) + s * at(left + 1, y);
    (1.0 - t) * along(row) + t * along(row + 1)
}

/// Irradiance of a plane with normal +y below a map, by the midpoints of half a million cells.
pub(crate) fn map_irradiance(map: &EnvironmentMap, turn: f64) -> DVec3 {
    let (rows, columns) = (500, 1000);
    let cell = 0.5 * PI / f64::from(rows) * TAU / f64::from(columns);
    let mut sum = DVec3::ZERO;
    for row in 0..rows {
        let polar = 0.5 * PI * (f64::from(row) + 0.5) / f64::from(rows);
        for column in 0..columns {
            let azimuth = TAU * (f64::from(column) + 0.5) / f64::from(columns);
            sum += map_radiance(map, turn, polar, azimuth) * (polar.cos() * polar.sin() * cell);
        }
    }
    sum
}

/// Fresnel reflectance of a smooth surface for unpolarised light; `cos` is on the side of index 1,
/// `index` that of the other medium (A. Fresnel, 1823, by Snell's angles).
pub(crate) fn fresnel(cos: f64, index: f64) -> f64 {
    let (i, t) = (cos.acos(), ((1.0 - cos * cos).sqrt() / index).asin());
    if i == 0.0 {
        return ((index - 1.0) / (index + 1.0)).powi(2);
    }
    let across = (i - t).sin() / (i + t).sin();
    let along = (i - t).tan() / (i + t).tan();
    0.5 * (across * across + along * along)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closed_forms_agree_with_sums_over_directions() {
        let part = |is_in: &dyn Fn(DVec3) -> bool| {
            over_hemisphere(700, |d| DVec3::splat(if is_in(d) { d.z } else { 0.0 })).x / PI
        };
        assert!((part(&|d| d.x > 0.3) - segment(0.3)).abs() < 1e-4);
        assert!((part(&|d| d.x > 0.3 && d.y > 0.4) - corner(0.3, 0.4)).abs() < 1e-4);
        assert_eq!(corner(0.7, 0.8), 0.0);
        let middle = DVec3::new(0.3, 0.2, 0.9);
        let ball = |d: DVec3| (middle - d * d.dot(middle)).length() < 0.4;
        assert!((part(&ball) * PI - sphere(middle, DVec3::Z, 0.4)).abs() < 1e-3);
        assert!(
            (fresnel(1e-9, 1.5) - 1.0).abs() < 1e-6 && (fresnel(1.0, 1.5) - 0.04).abs() < 1e-12
        );
        let whole = over_hemisphere(50, |d| DVec3::splat(d.z));
        assert!((whole.x - PI).abs() < 1e-9);
    }
}
