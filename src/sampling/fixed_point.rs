//! Arithmetic on fractions of 2³². Twin of `kernels/sampling/fixed_point.wesl`, where 64 bits are not
//! to be had.

/// The upper word of a product.
pub(crate) fn mul_high(a: u32, b: u32) -> u32 {
    ((u64::from(a) * u64::from(b)) >> 32) as u32
}
