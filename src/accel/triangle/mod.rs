//! Ray–triangle tests and their shared parts. CPU version of `kernels/accel/triangle.wesl`.
//!
//! A test decides whether the ray's line meets the triangle, and computes distance and barycentrics
//! ([`Meeting`]). The next step is the same for all, and makes "equal to brute force" a theorem:
//! the distance is clamped into the ray's padded slab interval of the triangle's own bounds, and an
//! empty interval means no hit. `(bound - origin) * inverse` is monotone in `bound` even after
//! rounding, so every box that contains the triangle's bounds has an interval that contains the
//! clamped distance, whatever the rounding errors of the triangle test. A hierarchy of such boxes
//! therefore returns bit-identical results to brute force.
//!
//! The clamp may repair rounding, but not invent a distance: a ray that slides along a face of the
//! bounds is inside them for a stretch that need not contain its intersection with the plane (from
//! an origin in the face it begins or ends at distance 0). Each test therefore bounds the rounding
//! error of its distance relative to the slab of each axis (`allowance`). If the distance lies
//! farther outside, the ray only grazed an edge of the triangle: no hit.

mod baldwin_weber;
mod bare;
mod compensated;
mod moeller_trumbore;
mod plane;
mod pluecker;
pub(super) mod watertight;

pub use baldwin_weber::BaldwinWeber;
pub(crate) use bare::Bare;
pub use compensated::Compensated;
pub use moeller_trumbore::MoellerTrumbore;
pub(crate) use plane::DISTANCE_PAD;
pub use plane::plane_error;
pub(crate) use pluecker::Pluecker;
pub use watertight::{Watertight, edge_on_share};

use super::bounds::{Bounds, slabs};
use super::intersection::Reciprocal;
use super::mask::{Masks, is_cut_out};
use super::ray::{Hit, Ray, SMALLEST_COMPONENT, SMALLEST_SLOPE};
use super::watch::{self, Event};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use raystone_core::geometry::Triangle;
use raystone_core::params::Sources;
use std::fmt;

/// Relative widening of a triangle's own slab interval, 2⁻²¹: at least four ulp, which covers the
/// subtraction, the reciprocal at WGSL's 2.5 ulp, and the product.
pub(crate) const TRIANGLE_PAD: f32 = 4.768_371_6e-7;

/// A triangle in kernel layout: three `vec4<u32>`, 48 bytes, with the scene's vertices unchanged.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct TriangleRecord {
    /// First vertex.
    pub v0: [f32; 3],
    /// Index in the scene.
    pub id: u32,
    /// Second vertex.
    pub v1: [f32; 3],
    /// Material index; for a triangle with a mask, the index of its mask words: see `MASKED`.
    pub material: u32,
    /// Third vertex.
    pub v2: [f32; 3],
    /// Start of the words from [`TriangleTest::transformed`] in the buffer `triangles`, in `vec4`;
    /// 0 if the test needs none.
    pub transformed: u32,
}

impl TriangleRecord {
    /// The record of triangle `id`.
    pub fn new(triangle: &Triangle, id: u32, material: u32) -> Self {
        let [v0, v1, v2] = triangle.vertices.map(|v| v.to_array());
        Self {
            v0,
            id,
            v1,
            material,
            v2,
            transformed: 0,
        }
    }

    /// The three vertices.
    pub fn vertices(&self) -> [[f32; 3]; 3] {
        [self.v0, self.v1, self.v2]
    }

    /// The triangle.
    pub fn triangle(&self) -> Triangle {
        Triangle {
            vertices: self.vertices().map(Vec3::from),
        }
    }

    /// `v1 - v0` and `v2 - v0`, f64.
    pub fn edges(&self) -> [[f64; 3]; 2] {
        [self.v1, self.v2].map(|v| [0, 1, 2].map(|a| f64::from(v[a]) - f64::from(self.v0[a])))
    }

    /// The box around the vertices.
    pub fn bounds(&self) -> Bounds {
        let mut bounds = Bounds::EMPTY;
        for axis in 0..3 {
            let [a, b, c] = self.vertices().map(|v| v[axis]);
            bounds.min[axis] = a.min(b).min(c);
            bounds.max[axis] = a.max(b).max(c);
        }
        bounds
    }
}

/// A ray–triangle test, with one line in its registry.
pub trait TriangleTest: Send + Sync {
    /// Name used in configurations.
    fn name(&self) -> &'static str;
    /// One-line description with source.
    fn description(&self) -> &'static str;
    /// Kernel module, relative to the kernel folder: it exports `meet` and `allowance`, the kernel
    /// versions of the functions below.
    fn kernel(&self) -> &'static str;
    /// Paths and texts of its own kernel modules, for tests that are not built in.
    fn sources(&self) -> Sources {
        &[]
    }
    /// True if no ray slips through between the triangles of a closed mesh, not even along their
    /// edges; the correctness check then includes such rays.
    fn is_watertight(&self) -> bool {
        false
    }
    /// True if the hits of all structures are equal to the bit. Structures with another one are timed on recorded rays: their
    /// answers are compared up to rounding, and they are neither ranked nor rendered with.
    fn is_exact(&self) -> bool {
        true
    }
    /// True if it becomes a different test on adapters without exact two-products.
    fn needs_exact_products(&self) -> bool {
        false
    }
    /// True if it accepts only hits that the compared products of [`Watertight`] accept, so that
    /// brute force may test these first, for several triangles at once.
    fn follows_watertight_signs(&self) -> bool {
        false
    }
    /// Precomputed kernel data in addition to the record, three `vec4`; `None` if there is none.
    fn transformed(&self, _triangle: &TriangleRecord) -> Option<[[u32; 4]; 3]> {
        None
    }
    /// Bytes read per triangle: its record and precomputed data.
    fn bytes(&self) -> u32 {
        let transformed = self.transformed(&TriangleRecord::zeroed());
        (size_of::<TriangleRecord>() + transformed.map_or(0, |words| size_of_val(&words))) as u32
    }
    /// Intersection of a ray's line with a triangle, given the reciprocal of its direction.
    fn meet(&self, triangle: &TriangleRecord, ray: &Ray, inverse: &[f32; 3]) -> Meeting;
    /// Rounding error bound of the distance of `found` for each axis' slab, scene units.
    fn allowance(
        &self,
        triangle: &TriangleRecord,
        ray: &Ray,
        inverse: &[f32; 3],
        found: &Meeting,
    ) -> [f32; 3];

    /// Tests `ray` against `triangle`, with holes from its mask; a nearer hit, or one at the same
    /// distance with a lower index, replaces `hit`. The part common to all tests; a provided method
    /// so that each test has a copy with its own `meet` inlined.
    fn intersect(
        &self,
        (triangle, masks): (&TriangleRecord, Option<&Masks>),
        ray: &Ray,
        inverse: &[f32; 3],
        hit: &mut Hit,
    ) {
        watch::note(Event::Triangle(triangle.id));
        let found = self.meet(triangle, ray, inverse);
        if found.area <= 0.0 || found.area.is_nan() {
            return;
        }
        let (near, far) = slabs(&triangle.bounds(), ray, *inverse);
        let enter = padded(near[0].max(near[1]).max(near[2]), -TRIANGLE_PAD);
        let exit = padded(far[0].min(far[1]).min(far[2]), TRIANGLE_PAD);
        let t = found.t.max(enter).min(exit);
        let mut repaired = enter <= exit;
        if t != found.t {
            let allowed = self.allowance(triangle, ray, inverse, &found);
            let pad = found.t.abs() * TRIANGLE_PAD;
            let within = |a: usize| (near[a] - found.t).max(found.t - far[a]) <= allowed[a] + pad;
            repaired = repaired && within(0) && within(1) && within(2);
        }
        let nearer = t < hit.t || (t == hit.t && triangle.id < hit.triangle);
        let within = t >= ray.t_min && t <= ray.t_max;
        if repaired && within && nearer && !is_along(triangle, ray.direction) {
            let weights = [found.u, found.v].map(|weight| weight.abs() / found.area);
            if is_cut_out(masks, triangle, ray, weights) {
                return;
            }
            let [u, v] = weights;
            // None is negative, but any may be −0, whose sign compilers do not preserve.
            *hit = Hit {
                t: t.abs(),
                triangle: triangle.id,
                u,
                v,
            };
            watch::note(Event::Nearest(*hit));
        }
    }
}

/// A chosen test.
pub type AnyTriangleTest = &'static dyn TriangleTest;

/// Tests are compared by name.
impl PartialEq for dyn TriangleTest {
    fn eq(&self, other: &Self) -> bool {
        self.name() == other.name()
    }
}

impl fmt::Debug for dyn TriangleTest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Intersection of a ray's line with a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Meeting {
    /// Divisor of the barycentrics; 0 if they do not meet.
    pub area: f32,
    /// Distance, as computed.
    pub t: f32,
    /// Weight of the second vertex times `area`, not negative but for the sign of zero.
    pub u: f32,
    /// Weight of the third.
    pub v: f32,
}

/// No intersection.
pub const APART: Meeting = Meeting {
    area: 0.0,
    t: 0.0,
    u: 0.0,
    v: 0.0,
};

/// A bound moved by a relative pad. Rounding preserves order, so the minimum may be padded last.
fn padded(t: f32, share: f32) -> f32 {
    t + t.abs() * share
}

/// True if a ray lies in the plane of a triangle, except for the tilt from raising its direction
/// ([`super::ray::raised`]): from an origin in the triangle it would meet it at 0.
fn is_along(triangle: &TriangleRecord, direction: [f32; 3]) -> bool {
    let TriangleRecord { v0, v1, v2, .. } = triangle;
    let [e1x, e1y, e1z] = [0, 1, 2].map(|a| v0[a] - v1[a]);
    let [e2x, e2y, e2z] = [0, 1, 2].map(|a| v2[a] - v0[a]);
    let nx = e1y * e2z - e1z * e2y;
    let ny = e1z * e2x - e1x * e2z;
    let nz = e1x * e2y - e1y * e2x;
    let [x, y, z] = direction.map(f32::abs);
    let unit = 1.0 / x.max(y).max(z);
    let tilt = 2.0 * SMALLEST_SLOPE.max(SMALLEST_COMPONENT * unit);
    let [dx, dy, dz] = direction.map(|d| d * unit);
    (nx * dx + ny * dy + nz * dz).abs() <= (nx.abs() + ny.abs() + nz.abs()) * tilt
}

/// Tests `ray` against a triangle with its scene's masks, using the test of the reciprocal: see
/// [`TriangleTest::intersect`].
pub fn intersect_triangle(
    triangle: (&TriangleRecord, Option<&Masks>),
    ray: &Ray,
    inverse: Reciprocal,
    hit: &mut Hit,
) {
    inverse.triangle.intersect(triangle, ray, &inverse, hit);
}
