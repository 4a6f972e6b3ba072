//! Owen scrambling by hashing. CPU version of `kernels/sampling/owen.wesl`.
//!
//! Source: S. Laine, T. Karras, "Stratified sampling for stochastic transparency", EGSR 2011; B.
//! Burley, "Practical hash-based Owen scrambling", JCGT 9(4), 2020; with the better constants of N.
//! Vegdahl ("Building a better LK hash", 2021), as in the crate `sobol_burley`.

/// Scrambles a bit-reversed number with a well-mixed `key`: a bit changes only those above it.
pub(crate) fn scramble_reversed(n: u32, key: u32) -> u32 {
    let mut x = n;
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(key);
    x = x.wrapping_mul((key >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x
}

/// Scrambles a fraction: each digit is flipped depending on the digits before it and `key`.
pub(crate) fn owen_scramble(x: u32, key: u32) -> u32 {
    scramble_reversed(x.reverse_bits(), key).reverse_bits()
}

/// Mixes a number into a key.
///
/// Source: C. Wellons, "Prospecting for hash functions", 2018 (lowbias32); 0 must not map to 0.
pub(crate) fn owen_key(x: u32) -> u32 {
    let mut n = x ^ 0xe6fe_3beb;
    n ^= n >> 16;
    n = n.wrapping_mul(0x7feb_352d);
    n ^= n >> 15;
    n = n.wrapping_mul(0x846c_a68b);
    n ^ (n >> 16)
}
