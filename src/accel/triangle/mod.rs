//! Ray–triangle tests and what all of them share. Twin of `kernels/accel/triangle.wesl`.
//!
//! A test decides whether the ray's line meets the triangle, and computes distance and barycentrics
//! ([`Meeting`]). The step that follows is the same for all, and makes "equal to brute force" a theorem
//! instead of a hope: the distance is clamped into the ray's padded slab interval of the triangle's own
//! bounds, and a hit whose interval is empty is no hit. `(bound - origin) * inverse` is monotone in
//! `bound` even after rounding, so every box that contains the triangle's bounds yields an interval that
//! contains the clamped distance, whatever the rounding errors of the triangle test were. A hierarchy of
//! such boxes therefore returns to the bit what brute force returns.
//!
//! The clamp may repair rounding, but not invent a distance: a ray that slides along a face of the
//! bounds is inside them for a stretch that need not hold the point where it meets the plane (from
//! an origin in the face it begins or ends at distance 0). Each test therefore says how far rounding may
//! have carried its distance out of the slab of each axis (`allowance`). If it lies farther outside, the
//! ray only grazed an edge of the triangle: no hit.

mod baldwin_weber;
mod compensated;
mod moeller_trumbore;
mod plane;
mod pluecker;
pub(super) mod watertight;

pub use compensated::product_error;
pub use plane::DISTANCE_PAD;

use super::bounds::{Bounds, slabs};
use super::intersection::Reciprocal;
use super::ray::{Hit, Ray, SMALLEST_COMPONENT, SMALLEST_SLOPE};
use super::watch::{self, Event};
use crate::geometry::Triangle;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use serde::{Deserialize, Serialize};

/// Relative widening of a triangle's own slab interval, 2⁻²¹: four ulp or more, which covers the
/// subtraction, the reciprocal at WGSL's 2.5 ulp, and the product.
pub const TRIANGLE_PAD: f32 = 4.768_371_6e-7;

/// A triangle as kernels read it: three `vec4<u32>`, 48 bytes, the vertices as they are in the scene.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct TriangleRecord {
    /// First vertex.
    pub v0: [f32; 3],
    /// Index in the scene.
    pub id: u32,
    /// Second vertex.
    pub v1: [f32; 3],
    /// Material index.
    pub material: u32,
    /// Third vertex.
    pub v2: [f32; 3],
    /// Where the words that [`TriangleTest::transformed`] makes of this triangle begin in the buffer
    /// `triangles`, in `vec4`; 0 if the test needs none.
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

/// A ray–triangle test.
#[derive(
    Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[serde(rename_all = "kebab-case")]
pub enum TriangleTest {
    /// T. Möller, B. Trumbore, "Fast, minimum storage ray/triangle intersection", 1997.
    MoellerTrumbore,
    /// D. Baldwin, M. Weber, "Fast ray–triangle intersections by coordinate transformation", 2016.
    BaldwinWeber,
    /// Plücker coordinates with Embree's tolerance.
    Pluecker,
    /// S. Woop, C. Benthin, I. Wald, "Watertight ray/triangle intersection", 2013.
    #[default]
    Watertight,
    /// The same with exact edge signs.
    Compensated,
}

impl TriangleTest {
    /// Every test.
    pub const ALL: [TriangleTest; 5] = [
        Self::MoellerTrumbore,
        Self::BaldwinWeber,
        Self::Pluecker,
        Self::Watertight,
        Self::Compensated,
    ];

    /// Name as a user types it.
    pub fn name(self) -> &'static str {
        match self {
            Self::MoellerTrumbore => "moeller-trumbore",
            Self::BaldwinWeber => "baldwin-weber",
            Self::Pluecker => "pluecker",
            Self::Watertight => "watertight",
            Self::Compensated => "compensated",
        }
    }

    /// The test of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|test| test.name() == name)
    }

    /// One line: what it is and where it comes from.
    pub fn description(self) -> &'static str {
        match self {
            Self::MoellerTrumbore => {
                "scalar triple products of edges and direction, division last (Möller, Trumbore 1997)"
            }
            Self::BaldwinWeber => {
                "pre-transformed to the unit triangle, 48 bytes more a triangle (Baldwin, Weber 2016)"
            }
            Self::Pluecker => {
                "Plücker products of edges and ray, accepted within Embree's tolerance of an ulp"
            }
            Self::Watertight => {
                "sheared to the ray, edges by compared products, zero is inside (Woop, Benthin, Wald 2013)"
            }
            Self::Compensated => {
                "watertight with edge functions from two-products: signs exact, if the adapter keeps them"
            }
        }
    }

    /// Module of the kernel, relative to the kernel folder.
    pub fn kernel(self) -> &'static str {
        match self {
            Self::MoellerTrumbore => "accel/triangle/moeller_trumbore",
            Self::BaldwinWeber => "accel/triangle/baldwin_weber",
            Self::Pluecker => "accel/triangle/pluecker",
            Self::Watertight => "accel/triangle/watertight",
            Self::Compensated => "accel/triangle/compensated",
        }
    }

    /// Bytes that a test reads of a triangle: its record, and what was made of it beforehand.
    pub fn bytes(self) -> u32 {
        let transformed = if self == Self::BaldwinWeber { 48 } else { 0 };
        size_of::<TriangleRecord>() as u32 + transformed
    }

    /// What a test reads beside the record, three `vec4` computed beforehand; `None` if nothing.
    pub fn transformed(self, triangle: &TriangleRecord) -> Option<[[u32; 4]; 3]> {
        (self == Self::BaldwinWeber).then(|| baldwin_weber::transform(triangle).words())
    }

    fn meet(self, triangle: &TriangleRecord, ray: &Ray, inverse: &Reciprocal) -> Meeting {
        match self {
            Self::MoellerTrumbore => moeller_trumbore::meet(triangle, ray),
            Self::BaldwinWeber => baldwin_weber::meet(triangle, ray),
            Self::Pluecker => pluecker::meet(triangle, ray),
            Self::Watertight => watertight::meet(triangle, ray, inverse),
            Self::Compensated => compensated::meet(triangle, ray, inverse),
        }
    }

    fn allowance(
        self,
        triangle: &TriangleRecord,
        ray: &Ray,
        inverse: &Reciprocal,
        found: &Meeting,
    ) -> [f32; 3] {
        match self {
            Self::MoellerTrumbore => moeller_trumbore::allowance(triangle, ray, found),
            Self::Pluecker => pluecker::allowance(triangle, ray, found),
            Self::BaldwinWeber => baldwin_weber::allowance(triangle, ray, found),
            Self::Watertight => watertight::allowance(triangle, ray, inverse, found),
            Self::Compensated => compensated::allowance(triangle, ray, inverse, found),
        }
    }
}

/// Where a ray's line meets a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Meeting {
    /// What barycentrics are to be divided by; 0 if they do not meet.
    area: f32,
    /// Distance, as computed.
    t: f32,
    /// Weight of the second vertex times `area`, not negative but for the sign of zero.
    u: f32,
    /// Weight of the third.
    v: f32,
}

/// They do not meet.
const APART: Meeting = Meeting {
    area: 0.0,
    t: 0.0,
    u: 0.0,
    v: 0.0,
};

/// Whether a ray runs in the plane of a triangle, but for what raising its direction
/// ([`super::ray::raised`]) has tilted it: from an origin in the triangle it would meet it at 0.
fn is_along(triangle: &TriangleRecord, direction: [f32; 3], inverse: &Reciprocal) -> bool {
    let TriangleRecord { v0, v1, v2, .. } = triangle;
    let [e1x, e1y, e1z] = [0, 1, 2].map(|a| v0[a] - v1[a]);
    let [e2x, e2y, e2z] = [0, 1, 2].map(|a| v2[a] - v0[a]);
    let nx = e1y * e2z - e1z * e2y;
    let ny = e1z * e2x - e1x * e2z;
    let nz = e1x * e2y - e1y * e2x;
    // The reciprocal of the longest component: no other is less.
    let [x, y, z] = inverse.map(f32::abs);
    let unit = x.min(y).min(z);
    let tilt = 2.0 * SMALLEST_SLOPE.max(SMALLEST_COMPONENT * unit);
    let [dx, dy, dz] = direction.map(|d| d * unit);
    (nx * dx + ny * dy + nz * dz).abs() <= (nx.abs() + ny.abs() + nz.abs()) * tilt
}

/// Tests `ray` against `triangle`; a nearer hit, or an equally near one of a lower index, replaces
/// `hit`.
pub fn intersect_triangle(
    triangle: &TriangleRecord,
    ray: &Ray,
    inverse: Reciprocal,
    hit: &mut Hit,
) {
    watch::note(Event::Triangle(triangle.id));
    let found = inverse.triangle.meet(triangle, ray, &inverse);
    if found.area <= 0.0 || found.area.is_nan() {
        return;
    }
    let (near, far) = slabs(&triangle.bounds(), ray, *inverse);
    let near = near.map(|x| x - x.abs() * TRIANGLE_PAD);
    let far = far.map(|x| x + x.abs() * TRIANGLE_PAD);
    let enter = near[0].max(near[1]).max(near[2]);
    let exit = far[0].min(far[1]).min(far[2]);
    let t = found.t.max(enter).min(exit);
    let mut repaired = enter <= exit;
    if t != found.t {
        let allowed = inverse.triangle.allowance(triangle, ray, &inverse, &found);
        let within = |a: usize| (near[a] - found.t).max(found.t - far[a]) <= allowed[a];
        repaired = repaired && within(0) && within(1) && within(2);
    }
    let nearer = t < hit.t || (t == hit.t && triangle.id < hit.triangle);
    let within = t >= ray.t_min && t <= ray.t_max;
    if repaired && within && nearer && !is_along(triangle, ray.direction, &inverse) {
        // None of the three is negative, but any may be −0, whose sign compilers do not keep.
        *hit = Hit {
            t: t.abs(),
            triangle: triangle.id,
            u: found.u.abs() / found.area,
            v: found.v.abs() / found.area,
        };
        watch::note(Event::Nearest(*hit));
    }
}
