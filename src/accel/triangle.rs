//! The one ray–triangle test of all structures. Twin of `kernels/accel/triangle.wesl`.
//!
//! Möller–Trumbore with the unnormalised normal and without a division before the accept (the form
//! used by Embree), followed by one step that makes "equal to brute force" a theorem instead of a
//! hope: the distance is clamped into the ray's padded slab interval of the triangle's own bounds,
//! and a hit whose interval is empty is no hit. `(bound - origin) * inverse` is monotone in `bound`
//! even after rounding, so every box that contains the triangle's bounds yields an interval that
//! contains the clamped distance, whatever the rounding errors of the triangle test were. A
//! hierarchy of such boxes therefore returns to the bit what brute force returns.
//!
//! The clamp may repair rounding, but not invent a distance: a ray that slides along a face of the
//! bounds is inside them for a stretch that need not hold the point where it meets the plane (from
//! an origin in the face it begins or ends at distance 0). If the clamp moves the distance by more
//! than rounding can ([`DISTANCE_PAD`]), the ray only grazed an edge of the triangle: no hit.

use super::bounds::{Bounds, slab};
use super::ray::{Hit, Ray};
use crate::scene::Triangle;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Relative widening of a triangle's own slab interval, 2⁻²¹: four ulp or more, which covers the
/// subtraction, the reciprocal at WGSL's 2.5 ulp, and the product.
pub const TRIANGLE_PAD: f32 = 4.768_371_6e-7;

/// Bound on the relative rounding error of the distance to the plane, 2⁻²⁰, in units of the sum of
/// the magnitudes of all terms that it is made of: twice the seven roundings of 2⁻²⁴ on the longest
/// way from an edge to numerator or denominator, and the division.
pub const DISTANCE_PAD: f32 = 9.536_743e-7;

/// A triangle as kernels read it: three `vec4<u32>`, 48 bytes.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct TriangleRecord {
    /// First vertex.
    pub v0: [f32; 3],
    /// Index in the scene.
    pub id: u32,
    /// `v0 - v1`, rounded.
    pub e1: [f32; 3],
    /// Material index.
    pub material: u32,
    /// `v2 - v0`, rounded.
    pub e2: [f32; 3],
    /// Reserved, zero.
    pub reserved: u32,
}

impl TriangleRecord {
    /// The record of triangle `id`.
    pub fn new(triangle: &Triangle, id: u32, material: u32) -> Self {
        let [v0, v1, v2] = triangle.vertices;
        Self {
            v0: v0.to_array(),
            id,
            e1: (v0 - v1).to_array(),
            material,
            e2: (v2 - v0).to_array(),
            reserved: 0,
        }
    }

    /// The triangle as the kernels know it: vertices rebuilt from the rounded edges.
    pub fn triangle(&self) -> Triangle {
        let v0 = Vec3::from(self.v0);
        Triangle {
            vertices: [v0, v0 - Vec3::from(self.e1), v0 + Vec3::from(self.e2)],
        }
    }

    /// Bounds of the triangle as the kernels know it (vertices rebuilt from the rounded edges).
    /// Structures must build on these: see the module's theorem.
    pub fn bounds(&self) -> Bounds {
        let mut bounds = Bounds::EMPTY;
        for axis in 0..3 {
            let a = self.v0[axis];
            let b = a - self.e1[axis];
            let c = a + self.e2[axis];
            bounds.min[axis] = a.min(b).min(c);
            bounds.max[axis] = a.max(b).max(c);
        }
        bounds
    }
}

/// Tests `ray` against `triangle`; a nearer hit, or an equally near one of a lower index, replaces
/// `hit`.
pub fn intersect_triangle(triangle: &TriangleRecord, ray: &Ray, inverse: [f32; 3], hit: &mut Hit) {
    let [dx, dy, dz] = ray.direction;
    let [e1x, e1y, e1z] = triangle.e1;
    let [e2x, e2y, e2z] = triangle.e2;
    let cx = triangle.v0[0] - ray.origin[0];
    let cy = triangle.v0[1] - ray.origin[1];
    let cz = triangle.v0[2] - ray.origin[2];
    let nx = e1y * e2z - e1z * e2y;
    let ny = e1z * e2x - e1x * e2z;
    let nz = e1x * e2y - e1y * e2x;
    let rx = dy * cz - dz * cy;
    let ry = dz * cx - dx * cz;
    let rz = dx * cy - dy * cx;
    let det = nx * dx + ny * dy + nz * dz;
    let sign = det.to_bits() & 0x8000_0000;
    let flip = |x: f32| f32::from_bits(x.to_bits() ^ sign);
    let area = det.abs();
    let u = flip(rx * e2x + ry * e2y + rz * e2z);
    let v = flip(rx * e1x + ry * e1y + rz * e1z);
    if !(area > 0.0 && u >= 0.0 && v >= 0.0 && u + v <= area) {
        return;
    }
    let plane = flip(nx * cx + ny * cy + nz * cz) / area;
    let (enter, exit) = slab(&triangle.bounds(), ray, inverse);
    let enter = enter - enter.abs() * TRIANGLE_PAD;
    let exit = exit + exit.abs() * TRIANGLE_PAD;
    let t = plane.max(enter).min(exit);
    let mut repaired = enter <= exit;
    if t != plane {
        let reach = |c: f32, d: f32| c.abs() + plane.abs() * d.abs();
        let terms = ((e1y * e2z).abs() + (e1z * e2y).abs()) * reach(cx, dx)
            + ((e1z * e2x).abs() + (e1x * e2z).abs()) * reach(cy, dy)
            + ((e1x * e2y).abs() + (e1y * e2x).abs()) * reach(cz, dz);
        repaired = repaired && (t - plane).abs() * area <= terms * DISTANCE_PAD;
    }
    let nearer = t < hit.t || (t == hit.t && triangle.id < hit.triangle);
    if repaired && t >= ray.t_min && t <= ray.t_max && nearer {
        // None of the three is negative, but any may be −0, whose sign compilers do not keep.
        *hit = Hit {
            t: t.abs(),
            triangle: triangle.id,
            u: u.abs() / area,
            v: v.abs() / area,
        };
    }
}
