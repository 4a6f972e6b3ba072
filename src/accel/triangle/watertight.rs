//! The watertight test. Twin of `kernels/accel/triangle/watertight.wesl`.
//! Source: S. Woop, C. Benthin, I. Wald, "Watertight ray/triangle intersection", JCGT 2(1), 2013.
//!
//! Vertices are sheared so that the ray is the z axis. What a vertex becomes depends on vertex and ray
//! alone, so that the triangles of a closed mesh still fit together. The sign of an edge function
//! `p − q` is that of comparing the rounded products: rounding is monotone, so it is the true sign or
//! 0, never the opposite. Zero counts as inside, on both sides of the edge. So wherever the sheared mesh
//! holds the ray, some triangle accepts it, and the paper's second test in double precision, which WGSL
//! has not got, is not needed: without it a ray on an edge may meet both triangles.
//!
//! The distance is not the paper's average of those of the vertices, which errs by the length over the height
//! of a thin triangle, but that of the point of the plane that is abreast of the ray ([`slid`]). Of a triangle
//! that is edge-on the weights are nothing but rounding, and would place the hit anywhere in its box: it is
//! no hit. A closed mesh has others there.

use super::{APART, Meeting, TRIANGLE_PAD, TriangleRecord, TriangleTest};
use crate::accel::ray::Ray;

/// The axis along which the direction is longest.
pub fn longest(d: [f32; 3]) -> usize {
    let [x, y, z] = d.map(f32::abs);
    if z >= x.max(y) { 2 } else { usize::from(y > x) }
}

/// Axes turned so that `axis` comes last.
pub fn turned([x, y, z]: [f32; 3], axis: usize) -> [f32; 3] {
    match axis {
        0 => [y, z, x],
        1 => [z, x, y],
        _ => [x, y, z],
    }
}

/// The inverse of [`turned`].
fn turned_back([x, y, z]: [f32; 3], axis: usize) -> [f32; 3] {
    match axis {
        0 => [z, x, y],
        1 => [y, z, x],
        _ => [x, y, z],
    }
}

/// A ray as vertices are sheared by it: x and y for each unit of z, and 1 / direction along z.
#[derive(Debug, Clone, Copy)]
pub struct Shear {
    axis: usize,
    origin: [f32; 3],
    x: f32,
    y: f32,
    /// 1 / direction along z.
    pub scale: f32,
}

pub fn shear(ray: &Ray, inverse: &[f32; 3]) -> Shear {
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
pub fn sheared(s: &Shear, vertex: [f32; 3]) -> [f32; 3] {
    let relative = [0, 1, 2].map(|a| vertex[a] - s.origin[a]);
    let [x, y, z] = turned(relative, s.axis);
    [x - s.x * z, y - s.y * z, z]
}

/// The share of the terms of an area that their rounding makes: what is no larger is edge-on.
const EDGE_ON: f32 = 5.960_464_5e-8;

/// Twice the area that the weights make; 0 if it is edge-on.
pub(super) fn area_of(w: [f32; 3], p: [f32; 3], q: [f32; 3]) -> f32 {
    let area = w[0] + w[1] + w[2];
    let terms = [0, 1, 2].map(|i| p[i].abs() + q[i].abs());
    match area > (terms[0] + terms[1] + terms[2]) * EDGE_ON {
        true => area,
        false => 0.0,
    }
}

/// Both products of the edge functions opposite to the three vertices.
pub fn products([a, b, c]: [[f32; 3]; 3]) -> ([f32; 3], [f32; 3]) {
    (
        [c[0] * b[1], a[0] * c[1], b[0] * a[1]],
        [c[1] * b[0], a[1] * c[0], b[1] * a[0]],
    )
}

/// The least denominator: of edges that are shorter, squares underflow.
const SMALLEST_SQUARE: f32 = 1.175_494_4e-38;
/// Smaller steps, as parts of an edge, are what rounding makes of any triangle: a quarter of what the offset leaves room for.
const NEGLIGIBLE: f32 = 2.384_185_8e-7;

/// Weights times the area of a point in the plane of a triangle of sheared vertices, moved along the longer of two
/// edges until the point lies abreast of the ray.
///
/// Weights err by the rounding of products of edges over the area: of a thin triangle by its length over
/// its height. Whatever they are, the point lies in the plane, and beside the ray almost along the
/// triangle's length alone, since across it there are only so many heights. So a step along a long edge
/// brings the point to the ray, but for rounding of the vertices, and does not leave the plane. Of two
/// edges the longer one has half of the greatest length at least. No normal is made: that of a thin
/// triangle with three long edges is a difference of large products.
fn slid([a, b, c]: [[f32; 3]; 3], w: [f32; 3], area: f32) -> [f32; 3] {
    let x = w[0] * a[0] + w[1] * b[0] + w[2] * c[0];
    let y = w[0] * a[1] + w[1] * b[1] + w[2] * c[1];
    let ab = [0, 1].map(|i| b[i] - a[i]);
    let ac = [0, 1].map(|i| c[i] - a[i]);
    let first = ab[0] * ab[0] + ab[1] * ab[1];
    let second = ac[0] * ac[0] + ac[1] * ac[1];
    let along = if first >= second { ab } else { ac };
    let part = (x * along[0] + y * along[1]) / first.max(second).max(SMALLEST_SQUARE);
    let step = match part.abs() > area * NEGLIGIBLE {
        true => part,
        false => 0.0,
    };
    match first >= second {
        true => [w[0] + step, w[1] - step, w[2]],
        false => [w[0] + step, w[1], w[2] - step],
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
        let point = slid([a, b, c], w, area);
        let clamp = |x: f32| x.max(0.0).min(area);
        let u = clamp(point[1]);
        Meeting {
            area,
            t: (point[0] * a[2] + point[1] * b[2] + point[2] * c[2]) * s.scale / area,
            u,
            v: match point[0] < 0.0 {
                true => area - u,
                false => clamp(point[2]),
            },
        }
    }

    fn allowance(
        &self,
        triangle: &TriangleRecord,
        ray: &Ray,
        inverse: &[f32; 3],
        found: &Meeting,
    ) -> [f32; 3] {
        let apart = slide(triangle, ray, inverse, found.area);
        let rounding = residual(triangle, ray, inverse, found.area);
        [0, 1, 2].map(|i| rounding[i] + apart[i])
    }
}

/// How far the point that is abreast of the ray lies from the one that the weights stand for, over the
/// direction.
fn slide(triangle: &TriangleRecord, ray: &Ray, inverse: &[f32; 3], area: f32) -> [f32; 3] {
    let s = shear(ray, inverse);
    let vertices = triangle.vertices().map(|v| sheared(&s, v));
    let (p, q) = products(vertices);
    let w = [0, 1, 2].map(|i| (p[i] - q[i]).abs());
    let point = slid(vertices, w, area);
    let moved = [1, 2].map(|i| (point[i] - w[i]) / area);
    let [v0, v1, v2] = triangle.vertices();
    let along = |i: usize| moved[0] * (v1[i] - v0[i]) + moved[1] * (v2[i] - v0[i]);
    [0, 1, 2].map(|i| along(i).abs() * inverse[i].abs())
}

/// Error of x and y of the point that the weights stand for, and what it makes of the distance.
///
/// The point Σ wᵢ·vᵢ lies in the bounds. The ray passes it by the residual Σ wᵢ·v′ᵢ of the sheared
/// vertices, which is 0 but for rounding: of the weights (three units of the products, times x or y of
/// the vertex) and of the vertices (a unit of the difference, up to seven of what is taken off by the
/// shear where division errs by 2.5 ulp). Divided by the direction, that is how far the distance may lie
/// outside the slab. [`TRIANGLE_PAD`] is eight units.
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
    let w = [0, 1, 2].map(|i| (p[i] - q[i]).abs());
    let terms = [0, 1, 2].map(|i| p[i].abs() + q[i].abs());
    let slope = [s.x.abs(), s.y.abs(), 0.0];
    let weights = |i: usize| terms[0] * a[i] + terms[1] * b[i] + terms[2] * c[i];
    let place = |v: [f32; 3], i: usize| v[i] + 2.0 * slope[i] * v[2];
    let places = |i: usize| w[0] * place(a, i) + w[1] * place(b, i) + w[2] * place(c, i);
    let across = |i: usize| (weights(i) + places(i)) / area * TRIANGLE_PAD;
    // Along the ray the distance is an average: its own rounding alone counts.
    let along = places(2) / area * TRIANGLE_PAD;
    let errors = turned_back([across(0), across(1), along], s.axis);
    [0, 1, 2].map(|i| errors[i] * inverse[i].abs())
}
