//! Integer hashes. Twin of `kernels/sampling/hash.wesl`.

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
pub fn wang_hash(x: u32) -> u32 {
    let mut s = (x ^ 61) ^ (x >> 16);
    s = s.wrapping_mul(9);
    s ^= s >> 4;
    s = s.wrapping_mul(0x27d4_eb2d);
    s ^ (s >> 15)
}

/// A random number of the pixel, the same for all its samples.
pub fn pixel_number(at: Coordinate) -> u32 {
    pcg_hash(at.pixel.wrapping_add(pcg_hash(at.seed)))
}

/// A random number of the pixel and dimension, the same for all samples.
pub fn dimension_number(at: Coordinate) -> u32 {
    pcg_hash(at.dimension.wrapping_add(pixel_number(at)))
}

/// A random number of the pixel, dimension and sample.
pub fn sample_number(at: Coordinate) -> u32 {
    pcg_hash(at.sample.wrapping_add(dimension_number(at)))
}
