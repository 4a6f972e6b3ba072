//! Arithmetic on fractions of 2³². Without 64-bit integers in `kernels/sampling/fixed_point.wesl`.

/// The upper word of a product.
pub(crate) fn mul_high(a: u32, b: u32) -> u32 {
    ((u64::from(a) * u64::from(b)) >> 32) as u32
}
