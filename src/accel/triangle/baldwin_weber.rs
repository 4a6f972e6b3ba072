//! The pre-transformed test. CPU version of `kernels/accel/triangle/baldwin_weber.wesl`.
//! Source: D. Baldwin, M. Weber, "Fast ray–triangle intersections by coordinate transformation",
//! JCGT 5(3), 2016.
//!
//! The transform is computed on the host, in f64, and follows the records in the buffer
//! `triangles`: nine numbers and an axis. The CPU version recomputes it for every test, with the
//! same bits.

use super::watertight::turned;
use super::{APART, DISTANCE_PAD, Meeting, TriangleRecord, TriangleTest};
use crate::ray::Ray;
use crate::spatial::cross;

/// The map to the unit triangle, with axes rotated so that the normal's longest one comes last; the
/// coefficient of that axis is 1 in `plane` and 0 in `u` and `v`.
#[derive(Debug, Clone, Copy)]
struct Transform {
    /// Coefficients of x and y, and the height.
    plane: [f32; 3],
    axis: usize,
    /// Coefficients of x and y, and the constant.
    u: [f32; 3],
    v: [f32; 3],
}

/// Never hit: u is −1 everywhere.
const NOWHERE: Transform = Transform {
    plane: [0.0; 3],
    axis: 2,
    u: [0.0, 0.0, -1.0],
    v: [0.0; 3],
};

impl Transform {
    fn words(&self) -> [[u32; 4]; 3] {
        let row = |[x, y, z]: [f32; 3], w| [x.to_bits(), y.to_bits(), z.to_bits(), w];
        [
            row(self.plane, self.axis as u32),
            row(self.u, 0),
            row(self.v, 0),
        ]
    }
}

/// The transform of a triangle; one that is never hit if it has no area or is out of range.
fn load_transform(triangle: &TriangleRecord) -> Transform {
    let [e, f] = triangle.edges();
    let normal = cross(e, f);
    let axis = (0..3).fold(0, |best, axis| {
        if normal[axis].abs() > normal[best].abs() {
            axis
        } else {
            best
        }
    });
    let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
    let corner = triangle.v0.map(f64::from);
    let scale = 1.0 / normal[axis];
    let row = |x: f64, y: f64| {
        let constant = -(x * corner[i] + y * corner[j]);
        [x, y, constant].map(|number| number as f32)
    };
    let [x, y, constant] = row(normal[i] * scale, normal[j] * scale);
    let height = corner[axis] + (normal[i] * corner[i] + normal[j] * corner[j]) * scale;
    let out = Transform {
        plane: [x, y, height as f32],
        axis,
        u: row(f[j] * scale, -f[i] * scale),
        v: row(-e[j] * scale, e[i] * scale),
    };
    let numbers = [out.plane, out.u, out.v];
    let finite = constant.is_finite() && numbers.iter().flatten().all(|x| x.is_finite());
    if finite { out } else { NOWHERE }
}

/// D. Baldwin, M. Weber, "Fast ray–triangle intersections by coordinate transformation", 2016.
pub struct BaldwinWeber;

impl TriangleTest for BaldwinWeber {
    fn name(&self) -> &'static str {
        "baldwin-weber"
    }

    fn description(&self) -> &'static str {
        "pre-transformed to the unit triangle, 48 bytes more per triangle (Baldwin, Weber 2016)"
    }

    fn kernel(&self) -> &'static str {
        "accel/triangle/baldwin_weber"
    }

    fn transformed(&self, triangle: &TriangleRecord) -> Option<[[u32; 4]; 3]> {
        Some(load_transform(triangle).words())
    }

    fn meet(&self, triangle: &TriangleRecord, ray: &Ray, _: &[f32; 3]) -> Meeting {
        let m = load_transform(triangle);
        let o = turned(ray.origin, m.axis);
        let d = turned(ray.direction, m.axis);
        let det = d[2] + m.plane[0] * d[0] + m.plane[1] * d[1];
        if det.abs() <= 0.0 || det.is_nan() {
            return APART;
        }
        let t = (m.plane[2] - o[2] - m.plane[0] * o[0] - m.plane[1] * o[1]) / det;
        let x = o[0] + t * d[0];
        let y = o[1] + t * d[1];
        let u = m.u[0] * x + m.u[1] * y + m.u[2];
        let v = m.v[0] * x + m.v[1] * y + m.v[2];
        if !(u >= 0.0 && v >= 0.0 && u + v <= 1.0) {
            return APART;
        }
        Meeting { area: 1.0, t, u, v }
    }

    /// Rounding error bound of the distance, from coordinates rather than their differences.
    fn allowance(
        &self,
        triangle: &TriangleRecord,
        ray: &Ray,
        _: &[f32; 3],
        found: &Meeting,
    ) -> [f32; 3] {
        let m = load_transform(triangle);
        let signed = turned(ray.direction, m.axis);
        let o = turned(ray.origin, m.axis).map(f32::abs);
        let d = signed.map(f32::abs);
        let n = m.plane.map(f32::abs);
        let det = signed[2] + m.plane[0] * signed[0] + m.plane[1] * signed[1];
        let terms = n[2]
            + o[2]
            + n[0] * o[0]
            + n[1] * o[1]
            + found.t.abs() * (d[2] + n[0] * d[0] + n[1] * d[1]);
        [terms * DISTANCE_PAD / det.abs(); 3]
    }
}
