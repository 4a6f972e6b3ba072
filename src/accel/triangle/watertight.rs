//! The watertight test. CPU version of `kernels/accel/triangle/watertight.wesl`.
//! Source: S. Woop, C. Benthin, I. Wald, "Watertight ray/triangle intersection", JCGT 2(1), 2013.
//!
//! Vertices are sheared so that the ray is the z axis. A sheared vertex depends on vertex and ray
//! alone, so the triangles of a closed mesh still fit together. The sign of an edge function `p −
//! q` is that of comparing the rounded products: rounding is monotone, so it is the true sign or 0,
//! never the opposite. Zero counts as inside, on both sides of the edge. So wherever the sheared
//! mesh contains the ray, some triangle accepts it, and the paper's second test in double
//! precision, which WGSL lacks, is not needed: without it a ray on an edge may hit both triangles.
//!
//! The distance is not the paper's average over the vertices, whose error for a thin triangle
//! scales with length over height, but that of the point of the plane closest to the ray
//! ([`step_along`]). For an edge-on triangle the weights are pure rounding, and would place the hit
//! anywhere in its box: it counts as a miss. A closed mesh has other triangles there.

use super::{APART, Meeting, TRIANGLE_PAD, TriangleRecord, TriangleTest};
use crate::ray::Ray;

/// The axis of the direction's longest component.
pub(crate) fn longest(d: [f32; 3]) -> usize {
    let [x, y, z] = d.map(f32::abs);
    if z >= x.max(y) { 2 } else { usize::from(y > x) }
}

/// Axes rotated so that `axis` comes last.
pub(crate) fn turned([x, y, z]: [f32; 3], axis: usize) -> [f32; 3] {
    match axis {
        0 => [y, z, x],
        1 => [z, x, y],
        _ => [x, y, z],
    }
}

fn turned_back([x, y, z]: [f32; 3], axis: usize) -> [f32; 3] {
    match axis {
        0 => [z, x, y],
        1 => [y, z, x],
        _ => [x, y, z],
    }
}

/// The shear for a ray: x and y per unit of z, and 1 / direction along z.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shear {
    axis: usize,
    origin: [f32; 3],
    x: f32,
    y: f32,
    /// 1 / direction along z.
    pub scale: f32,
}

pub(crate) fn shear(ray: &Ray, inverse: &[f32; 3]) -> Shear {
    let axis = longest(ray.direction);
    let [dx, dy, _] = turned(ray.direction, axis);
    let [_, _, scale] = turned(*inverse, axis);
    Shear {
        axis,
        origin: ray.origin,
        x: dx * scale,
        y: dy * scale,
        scale,
    }
}

/// A vertex relative to the ray: across it in x and y, along it in z.
pub(crate) fn sheared(s: &Shear, vertex: [f32; 3]) -> [f32; 3] {
    let relative = [0, 1, 2].map(|a| vertex[a] - s.origin[a]);
    let [x, y, z] = turned(relative, s.axis);
    [x - s.x * z, y - s.y * z, z]
}

/// Relative rounding error of an area's terms: a smaller area is edge-on.
const EDGE_ON: f32 = 5.960_464_5e-8;

/// Twice the area from the weights; 0 if it is edge-on.
pub(super) fn area_of(w: [f32; 3], p: [f32; 3], q: [f32; 3]) -> f32 {
    let area = w[0] + w[1] + w[2];
    let terms = [0, 1, 2].map(|i| p[i].abs() + q[i].abs());
    if area > (terms[0] + terms[1] + terms[2]) * EDGE_ON {
        area
    } else {
        0.0
    }
}

/// Area of a triangle as a ray sees it over the limit at which it counts as edge-on: no hit up to 1. `None` where the
/// ray's line passes it.
pub fn edge_on_share(triangle: &TriangleRecord, ray: &Ray, inverse: &[f32; 3]) -> Option<f32> {
    let s = shear(ray, inverse);
    let (p, q) = products(triangle.vertices().map(|v| sheared(&s, v)));
    let passes = !((0..3).all(|i| p[i] >= q[i]) || (0..3).all(|i| p[i] <= q[i]));
    let sum = |term: fn(f32, f32) -> f32| (0..3).map(|i| term(p[i], q[i])).sum::<f32>();
    let (area, terms) = (sum(|p, q| (p - q).abs()), sum(|p, q| p.abs() + q.abs()));
    (!passes && terms > 0.0).then(|| area / (terms * EDGE_ON))
}

/// Both products of the edge functions opposite to the three vertices.
pub(crate) fn products([a, b, c]: [[f32; 3]; 3]) -> ([f32; 3], [f32; 3]) {
    (
        [c[0] * b[1], a[0] * c[1], b[0] * a[1]],
        [c[1] * b[0], a[1] * c[0], b[1] * a[0]],
    )
}

/// The smallest denominator: squares of shorter edges underflow.
const SMALLEST_SQUARE: f32 = 1.175_494_4e-38;
/// Smaller steps, as fractions of an edge, are rounding: a quarter of the offset's margin.
const NEGLIGIBLE: f32 = 2.384_185_8e-7;

/// A step along an edge, times the area.
struct Step {
    /// True for the edge to the second vertex, false for the third.
    is_first: bool,
    /// Fraction of the edge.
    size: f32,
    /// Length along the ray.
    z: f32,
}

/// The step along the longer of two edges of a sheared triangle that brings the weighted point
/// closest to the ray.
///
/// Weights err by the rounding of products of edges over the area: for a thin triangle by its
/// length over its height. In any case the point lies in the plane, and misses the ray almost only
/// along the triangle's length, since the height leaves little room. So a step along a long edge
/// brings the point to the ray, except for rounding of the vertices, and stays in the plane. The
/// longer of two edges has at least half of the maximum length. No normal is computed: that of a
/// thin triangle with three long edges is a difference of large products.
fn step_along([a, b, c]: [[f32; 3]; 3], w: [f32; 3], area: f32) -> Step {
    let x = w[0] * a[0] + w[1] * b[0] + w[2] * c[0];
    let y = w[0] * a[1] + w[1] * b[1] + w[2] * c[1];
    let ab = [0, 1, 2].map(|i| b[i] - a[i]);
    let ac = [0, 1, 2].map(|i| c[i] - a[i]);
    let first = ab[0] * ab[0] + ab[1] * ab[1];
    let second = ac[0] * ac[0] + ac[1] * ac[1];
    let is_first = first >= second;
    let along = if is_first { ab } else { ac };
    let part = (x * along[0] + y * along[1]) / first.max(second).max(SMALLEST_SQUARE);
    let size = if part.abs() > area * NEGLIGIBLE {
        part
    } else {
        0.0
    };
    Step {
        is_first,
        size,
        z: size * along[2],
    }
}

/// S. Woop, C. Benthin, I. Wald, "Watertight ray/triangle intersection", 2013.
pub struct Watertight;

impl TriangleTest for Watertight {
    fn name(&self) -> &'static str {
        "watertight"
    }

    fn description(&self) -> &'static str {
        "sheared to the ray, edges by compared products, zero is inside (Woop, Benthin, Wald 2013)"
    }

    fn kernel(&self) -> &'static str {
        "accel/triangle/watertight"
    }

    fn is_watertight(&self) -> bool {
        true
    }

    fn follows_watertight_signs(&self) -> bool {
        true
    }

    fn meet(&self, triangle: &TriangleRecord, ray: &Ray, inverse: &[f32; 3]) -> Meeting {
        let s = shear(ray, inverse);
        let [a, b, c] = triangle.vertices().map(|v| sheared(&s, v));
        let (p, q) = products([a, b, c]);
        if !((0..3).all(|i| p[i] >= q[i]) || (0..3).all(|i| p[i] <= q[i])) {
            return APART;
        }
        let w = [0, 1, 2].map(|i| (p[i] - q[i]).abs());
        let area = area_of(w, p, q);
        let step = step_along([a, b, c], w, area);
        let t = (w[0] * a[2] + w[1] * b[2] + w[2] * c[2] - step.z) * s.scale / area;
        // Not past an end, for interpolation.
        let from = if step.is_first { w[1] } else { w[2] };
        let back = step.size.min(from).max(-w[0]);
        let [u, v] = if step.is_first {
            [w[1] - back, w[2]]
        } else {
            [w[1], w[2] - back]
        };
        Meeting { area, t, u, v }
    }

    fn allowance(
        &self,
        triangle: &TriangleRecord,
        ray: &Ray,
        inverse: &[f32; 3],
        found: &Meeting,
    ) -> [f32; 3] {
        residual(triangle, ray, inverse, found.area)
    }
}

/// Bound on how far the distance may lie outside the slab of each axis.
///
/// The point Σ wᵢ·vᵢ lies in the bounds. The ray passes it by the residual Σ wᵢ·v′ᵢ of the sheared
/// vertices, which is 0 except for rounding: of the weights (three units of the products, times x
/// or y of the vertex) and of the vertices (a unit of the difference, up to seven of the shear's
/// offset where division errs by 2.5 ulp). Divided by the direction, that is how far the distance
/// may lie outside the slab. Where the point was moved along an edge, the distance differs from its
/// average by the weights' errors times z. Weights are no larger than the terms that they are
/// differences of, so twice the moments of the terms bound all of it. [`TRIANGLE_PAD`] is eight
/// units.
pub(super) fn residual(
    triangle: &TriangleRecord,
    ray: &Ray,
    inverse: &[f32; 3],
    area: f32,
) -> [f32; 3] {
    let s = shear(ray, inverse);
    let vertices = triangle.vertices().map(|v| sheared(&s, v));
    let (p, q) = products(vertices);
    let [a, b, c] = vertices.map(|v| v.map(f32::abs));
    let terms = [0, 1, 2].map(|i| p[i].abs() + q[i].abs());
    let moment = |i: usize| terms[0] * a[i] + terms[1] * b[i] + terms[2] * c[i];
    let along = moment(2) * s.scale.abs();
    let [ix, iy, _] = turned(inverse.map(f32::abs), s.axis);
    let errors = [moment(0) * ix + along, moment(1) * iy + along, along];
    turned_back(errors, s.axis).map(|error| error * (2.0 * TRIANGLE_PAD / area))
}
