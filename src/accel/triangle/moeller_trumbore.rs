//! Möller and Trumbore's test. CPU version of `kernels/accel/triangle/moeller_trumbore.wesl`.
//! Source: T. Möller, B. Trumbore, "Fast, minimum storage ray/triangle intersection", Journal of
//! Graphics Tools 2(1), 1997; with the unnormalised normal and without a division before
//! acceptance.

use super::plane::plane_error;
use super::{APART, Meeting, TriangleRecord, TriangleTest};
use crate::ray::Ray;

/// T. Möller, B. Trumbore, "Fast, minimum storage ray/triangle intersection", 1997.
pub struct MoellerTrumbore;

impl TriangleTest for MoellerTrumbore {
    fn name(&self) -> &'static str {
        "moeller-trumbore"
    }

    fn description(&self) -> &'static str {
        "scalar triple products of edges and direction, division last (Möller, Trumbore 1997)"
    }

    fn kernel(&self) -> &'static str {
        "accel/triangle/moeller_trumbore"
    }

    fn meet(&self, triangle: &TriangleRecord, ray: &Ray, _: &[f32; 3]) -> Meeting {
        let TriangleRecord { v0, v1, v2, .. } = triangle;
        let [dx, dy, dz] = ray.direction;
        let [e1x, e1y, e1z] = [0, 1, 2].map(|a| v0[a] - v1[a]);
        let [e2x, e2y, e2z] = [0, 1, 2].map(|a| v2[a] - v0[a]);
        let [cx, cy, cz] = [0, 1, 2].map(|a| v0[a] - ray.origin[a]);
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
            return APART;
        }
        let height = flip(nx * cx + ny * cy + nz * cz);
        Meeting {
            area,
            t: height / area,
            u,
            v,
        }
    }

    fn allowance(
        &self,
        triangle: &TriangleRecord,
        ray: &Ray,
        _: &[f32; 3],
        found: &Meeting,
    ) -> [f32; 3] {
        [plane_error(triangle, ray, found); 3]
    }
}
