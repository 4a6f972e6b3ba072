//! Arithmetic on fractions of 2³². `kernels/sampling/fixed_point.wesl` has no 64-bit integers.

/// The upper word of a product.
pub(crate) fn mul_high(a: u32, b: u32) -> u32 {
    ((u64::from(a) * u64::from(b)) >> 32) as u32
}
