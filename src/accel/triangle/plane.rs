//! Shared part of the tests that compute a distance to the triangle's plane. CPU version of
//! `kernels/accel/triangle/plane.wesl`.

use super::{Meeting, TriangleRecord};
use crate::ray::Ray;

/// Relative rounding error bound of the distance to the plane, 2⁻²⁰, in units of the sum of the
/// magnitudes of all its terms: twice the seven roundings of 2⁻²⁴ on the longest path from an edge
/// to numerator or denominator, and the division.
pub(crate) const DISTANCE_PAD: f32 = 9.536_743e-7;

/// Rounding error bound of a plane distance from vertex differences, by `DISTANCE_PAD`.
pub fn plane_error(triangle: &TriangleRecord, ray: &Ray, found: &Meeting) -> f32 {
    let TriangleRecord { v0, v1, v2, .. } = triangle;
    let [e1x, e1y, e1z] = [0, 1, 2].map(|a| v0[a] - v1[a]);
    let [e2x, e2y, e2z] = [0, 1, 2].map(|a| v2[a] - v0[a]);
    let [dx, dy, dz] = ray.direction;
    let nx = e1y * e2z - e1z * e2y;
    let ny = e1z * e2x - e1x * e2z;
    let nz = e1x * e2y - e1y * e2x;
    let det = nx * dx + ny * dy + nz * dz;
    let reach = |a: usize| (v0[a] - ray.origin[a]).abs() + found.t.abs() * ray.direction[a].abs();
    let terms = ((e1y * e2z).abs() + (e1z * e2y).abs()) * reach(0)
        + ((e1z * e2x).abs() + (e1x * e2z).abs()) * reach(1)
        + ((e1x * e2y).abs() + (e1y * e2x).abs()) * reach(2);
    terms * DISTANCE_PAD / det.abs()
}
