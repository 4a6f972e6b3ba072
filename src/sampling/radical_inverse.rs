//! The digits of an index, mirrored at the point. Twin of `kernels/sampling/radical_inverse.wesl`.

/// The weight of the first digit of an index: the greatest power of `base` that is not above `n`, 1 for 0.
pub(super) fn first_weight(n: u32, base: u32) -> u32 {
    let mut weight = 1;
    while n / weight >= base {
        weight *= base;
    }
    weight
}

/// (`digit` + x) / `base` of a fraction x of 2³², cut to such a fraction: long division by halves of 16 bits, for
/// `digit < base ≤ 2¹⁶`.
pub(super) fn prepend_digit(digit: u32, x: u32, base: u32) -> u32 {
    let upper = (digit << 16) | (x >> 16);
    let lower = ((upper % base) << 16) | (x & 0xffff);
    ((upper / base) << 16) | (lower / base)
}

/// The radical inverse of `n` in `base` (2 to 2¹⁶) as a fraction of 2³², cut after its last bit and exact so far.
///
/// The digit of the least weight, which is the first one of the index, comes first: x ← ⌊(2³² d + x) / b⌋. Cutting
/// in each step is cutting once at the end, since ⌊(m + ⌊y⌋) / b⌋ = ⌊(m + y) / b⌋ for whole m.
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
