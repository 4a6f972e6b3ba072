//! Integer hashes. CPU version of `kernels/sampling/hash.wesl`.

use super::Coordinate;

/// PCG output permutation over an LCG step.
///
/// Source: M. Jarzynski, M. Olano, "Hash functions for GPU rendering", JCGT 9(3), 2020.
pub fn pcg_hash(x: u32) -> u32 {
    let state = x.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

/// Wang's 32-bit hash.
///
/// Source: T. Wang 1997, as in N. Reed, "Quick and easy GPU random numbers", 2013; Dufay 2017 Alg. 5.2.
pub(crate) fn wang_hash(x: u32) -> u32 {
    let mut s = (x ^ 61) ^ (x >> 16);
    s = s.wrapping_mul(9);
    s ^= s >> 4;
    s = s.wrapping_mul(0x27d4_eb2d);
    s ^ (s >> 15)
}

/// Weyl's factor: the golden ratio's fraction, odd.
const STRIDE_FACTOR: u32 = 0x9e37_79b1;

/// Element x of the progression that starts at `key`, with an odd stride derived from the key.
///
/// With the same stride for all keys (`key + x`), the numbers of one seed would be those of
/// another, shifted by the difference of the keys: of 30 seeds over 1920 × 1080 pixels two would
/// share a run in 35 % of all cases. Two progressions with different strides share isolated
/// elements only. Equal strides belong to keys k, k′ whose `k · STRIDE_FACTOR` differ in the last
/// bit only: one partner per key, whose run has a random offset within 2³² elements.
pub(super) fn strided(key: u32, x: u32) -> u32 {
    let stride = key.wrapping_mul(STRIDE_FACTOR) | 1;
    key.wrapping_add(x.wrapping_mul(stride))
}

/// A random number of key and x, for each key a permutation of all x; `key` must be well mixed.
pub(crate) fn keyed_hash(key: u32, x: u32) -> u32 {
    pcg_hash(strided(key, x))
}

/// A random number of the pixel, the same for all its samples.
pub fn pixel_number(at: Coordinate) -> u32 {
    keyed_hash(pcg_hash(at.seed), at.pixel)
}

/// A random number of the pixel and dimension, the same for all samples.
pub fn dimension_number(at: Coordinate) -> u32 {
    keyed_hash(pixel_number(at), at.dimension)
}

pub(crate) fn sample_number(at: Coordinate) -> u32 {
    keyed_hash(dimension_number(at), at.sample)
}
