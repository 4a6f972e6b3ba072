//! The watertight test with exact signs. CPU version of `kernels/accel/triangle/compensated.wesl`.
//!
//! Edge functions are differences of two-products (T. Dekker, "A floating-point technique for
//! extending the available precision", 1971), with significands cut by a mask, which no compiler
//! simplifies. On adapters with other arithmetic, signs are only as good as the watertight test's:
//! [`raystone_gpu::ArithmeticProbe::exact_products`] detects them.

use super::watertight::{area_of, products, residual, shear, sheared};
use super::{APART, Meeting, TriangleRecord, TriangleTest};
use crate::ray::Ray;

/// The upper half of a significand.
const UPPER: u32 = 0xffff_f000;

pub(crate) fn product_error(a: f32, b: f32, p: f32) -> f32 {
    let a1 = f32::from_bits(a.to_bits() & UPPER);
    let b1 = f32::from_bits(b.to_bits() & UPPER);
    let (a2, b2) = (a - a1, b - b1);
    a2 * b2 - (((p - a1 * b1) - a2 * b1) - a1 * b2)
}

/// [`super::Watertight`] with exact edge signs.
pub struct Compensated;

impl TriangleTest for Compensated {
    fn name(&self) -> &'static str {
        "compensated"
    }

    fn description(&self) -> &'static str {
        "watertight with edge functions from two-products: signs exact, if the adapter keeps them"
    }

    fn kernel(&self) -> &'static str {
        "accel/triangle/compensated"
    }

    fn is_watertight(&self) -> bool {
        true
    }

    fn needs_exact_products(&self) -> bool {
        true
    }

    fn follows_watertight_signs(&self) -> bool {
        true
    }

    fn meet(&self, triangle: &TriangleRecord, ray: &Ray, inverse: &[f32; 3]) -> Meeting {
        let s = shear(ray, inverse);
        let [a, b, c] = triangle.vertices().map(|v| sheared(&s, v));
        let (p, q) = products([a, b, c]);
        // If both products round apart, their order already is the sign.
        if !((0..3).all(|i| p[i] >= q[i]) || (0..3).all(|i| p[i] <= q[i])) {
            return APART;
        }
        let first = [c, a, b];
        let second = [b, c, a];
        let e = [0, 1, 2].map(|i| {
            let (first, second) = (first[i], second[i]);
            (p[i] - q[i])
                + (product_error(first[0], second[1], p[i])
                    - product_error(first[1], second[0], q[i]))
        });
        if !(e.iter().all(|e| *e >= 0.0) || e.iter().all(|e| *e <= 0.0)) {
            return APART;
        }
        let w = e.map(f32::abs);
        let area = area_of(w, p, q);
        Meeting {
            area,
            t: (w[0] * a[2] + w[1] * b[2] + w[2] * c[2]) * s.scale / area,
            u: w[1],
            v: w[2],
        }
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

#[cfg(test)]
mod tests {
    use super::product_error;

    #[test]
    fn a_product_and_its_error_are_the_exact_product() {
        let mut state = 1_u32;
        let mut next = || {
            state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            let word = (state >> (state >> 28 & 7)) ^ state.rotate_left(13);
            f32::from_bits((word & 0x807f_ffff) | ((word >> 24 & 31) + 112) << 23)
        };
        let mut inexact = 0;
        for _ in 0..1_000_000 {
            let (a, b) = (next(), next());
            let p = a * b;
            let error = product_error(a, b, p);
            let exact = f64::from(a) * f64::from(b);
            assert_eq!(f64::from(p) + f64::from(error), exact, "{a:e} {b:e}");
            inexact += usize::from(error != 0.0);
        }
        assert!(inexact > 900_000, "only {inexact} were rounded");
    }
}
