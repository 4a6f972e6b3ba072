//! Radical inverses. CPU version of `kernels/sampling/radical_inverse.wesl`.

/// The weight of an index's first digit: the largest power of `base` that is at most `n`, 1 for 0.
pub(super) fn first_weight(n: u32, base: u32) -> u32 {
    let mut weight = 1;
    while n / weight >= base {
        weight *= base;
    }
    weight
}

/// (`digit` + x) / `base` for a fraction x of 2³², truncated to such a fraction: long division by
/// halves of 16 bits, for `digit < base ≤ 2¹⁶`.
pub(super) fn prepend_digit(digit: u32, x: u32, base: u32) -> u32 {
    let upper = (digit << 16) | (x >> 16);
    let lower = ((upper % base) << 16) | (x & 0xffff);
    ((upper / base) << 16) | (lower / base)
}

/// The radical inverse of `n` in `base` (2 to 2¹⁶) as a fraction of 2³², exact up to truncation
/// after its last bit.
///
/// The index's most significant digit comes first: x ← ⌊(2³² d + x) / b⌋. Truncating in each step
/// equals truncating once at the end, since ⌊(m + ⌊y⌋) / b⌋ = ⌊(m + y) / b⌋ for integer m.
pub(crate) fn radical_inverse(n: u32, base: u32) -> u32 {
    if base == 2 {
        return n.reverse_bits();
    }
    let mut rest = n;
    let mut weight = first_weight(n, base);
    let mut x = 0;
    while weight > 0 {
        x = prepend_digit(rest / weight, x, base);
        rest %= weight;
        weight /= base;
    }
    x
}
