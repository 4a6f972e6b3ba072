//! The digits of an index, mirrored at the point. Twin of `kernels/sampling/radical_inverse.wesl`.

/// The radical inverse of `n` in `base` (at least 2) as a fraction of 2³².
///
/// Digit k adds `digit · floor(…floor((2³² − 1) / b)… / b)`; what the truncated divisions lose is below
/// 32·b/2³², and the result stays below 1. Base 2 is exact.
pub fn radical_inverse(n: u32, base: u32) -> u32 {
    if base == 2 {
        return n.reverse_bits();
    }
    let mut rest = n;
    let mut weight = u32::MAX / base;
    let mut x = 0;
    while rest > 0 {
        x += (rest % base) * weight;
        rest /= base;
        weight /= base;
    }
    x
}
