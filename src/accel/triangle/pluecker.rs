//! Plücker products with a tolerance. CPU version of `kernels/accel/triangle/pluecker.wesl`.
//! Source: the robust triangle test of Embree 4 (S. Woop and others, Intel), which follows R.
//! Davidovič and others, "3D rasterization: a bridge between rasterization and ray casting", 2012.

use super::plane::plane_error;
use super::{APART, Meeting, TriangleRecord, TriangleTest};
use crate::ray::Ray;

/// Embree's tolerance, one ulp of 1.
const TOLERANCE: f32 = 1.192_092_9e-7;

fn triple(a: [f32; 3], b: [f32; 3], d: [f32; 3]) -> f32 {
    let x = a[1] * b[2] - a[2] * b[1];
    let y = a[2] * b[0] - a[0] * b[2];
    let z = a[0] * b[1] - a[1] * b[0];
    x * d[0] + y * d[1] + z * d[2]
}

/// A component of the normal from two pairs of edges, the one with the smaller products.
fn normal(a: [f32; 3], b: [f32; 3], c: [f32; 3]) -> [f32; 3] {
    [(1, 2), (2, 0), (0, 1)].map(|(i, j)| {
        let (ab, bc) = (a[j] * b[i], b[j] * c[i]);
        if ab.abs() < bc.abs() {
            a[i] * b[j] - ab
        } else {
            b[i] * c[j] - bc
        }
    })
}

/// Plücker coordinates with Embree's tolerance.
pub(crate) struct Pluecker;

impl TriangleTest for Pluecker {
    fn name(&self) -> &'static str {
        "pluecker"
    }

    fn description(&self) -> &'static str {
        "Plücker products of edges and ray, accepted within Embree's tolerance of an ulp"
    }

    fn kernel(&self) -> &'static str {
        "accel/triangle/pluecker"
    }

    fn meet(&self, triangle: &TriangleRecord, ray: &Ray, _: &[f32; 3]) -> Meeting {
        let add = |a: [f32; 3], b: [f32; 3]| [0, 1, 2].map(|i| a[i] + b[i]);
        let subtract = |a: [f32; 3], b: [f32; 3]| [0, 1, 2].map(|i| a[i] - b[i]);
        let d = ray.direction;
        let [a, b, c] = triangle.vertices().map(|v| subtract(v, ray.origin));
        let (e0, e1, e2) = (subtract(c, a), subtract(a, b), subtract(b, c));
        let u = triple(e0, add(c, a), d);
        let v = triple(e1, add(a, b), d);
        let w = triple(e2, add(b, c), d);
        let sum = u + v + w;
        let area = sum.abs();
        let slack = TOLERANCE * area;
        let n = normal(e0, e1, e2);
        let det = n[0] * d[0] + n[1] * d[1] + n[2] * d[2];
        let inside = u.min(v).min(w) >= -slack || u.max(v).max(w) <= slack;
        if !(inside && area > 0.0 && det.abs() > 0.0) {
            return APART;
        }
        let flip = |x: f32| f32::from_bits(x.to_bits() ^ (sum.to_bits() & 0x8000_0000));
        let clamp = |x: f32, high: f32| x.max(0.0).min(high);
        let u = clamp(flip(u), area);
        let v = clamp(flip(v), area - u);
        let height = n[0] * a[0] + n[1] * a[1] + n[2] * a[2];
        Meeting {
            area,
            t: height / det,
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
