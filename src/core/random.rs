//! Random number generators of the host.

use glam::DVec3;
use rand_pcg::rand_core::Rng;

/// PCG32 (XSH RR 64/32; O'Neill 2014): small, seeded, the same on every machine.
#[derive(Debug, Clone)]
pub struct Pcg32(rand_pcg::Pcg32);

impl Pcg32 {
    /// The stream of the author's default increment, used for scenes.
    pub const DEFAULT_STREAM: u64 = 1_442_695_040_888_963_407 >> 1;

    /// A generator; equal seeds give equal numbers.
    pub fn new(seed: u64) -> Self {
        Self::with_stream(seed, 0)
    }

    /// A generator of one of 2⁶³ independent streams, seeded as in the author's C library.
    pub fn with_stream(seed: u64, stream: u64) -> Self {
        Self(rand_pcg::Pcg32::new(seed, stream))
    }

    /// Next 32 random bits.
    pub fn next_u32(&mut self) -> u32 {
        self.0.next_u32()
    }

    /// An index below `n`, `1 ≤ n ≤ 2³²`, with a negligible bias of at most `n·2⁻³²`.
    pub fn below(&mut self, n: usize) -> usize {
        ((u64::from(self.next_u32()) * n as u64) >> 32) as usize
    }

    /// A number in `[0, 1)` with 32 random bits.
    pub fn uniform(&mut self) -> f64 {
        f64::from(self.next_u32()) / 2f64.powi(32)
    }

    /// A random element of `of`.
    pub fn one_of<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.below(of.len())]
    }

    /// A number in [−1, 1).
    pub fn signed(&mut self) -> f64 {
        2.0 * self.uniform() - 1.0
    }

    /// A point of the cube [−1, 1)³.
    pub fn in_cube(&mut self) -> DVec3 {
        DVec3::new(self.signed(), self.signed(), self.signed())
    }

    /// A unit vector.
    pub fn direction(&mut self) -> DVec3 {
        let z = self.signed();
        let (sin, cos) = (std::f64::consts::TAU * self.uniform()).sin_cos();
        let radius = (1.0 - z * z).max(0.0).sqrt();
        DVec3::new(radius * cos, radius * sin, z)
    }

    /// A number in `[0, 1)` with 24 random bits.
    pub fn uniform_f32(&mut self) -> f32 {
        (self.next_u32() >> 8) as f32 / 2f32.powi(24)
    }
}

/// SplitMix64 (G. Steele, D. Lea, C. Flood, "Fast splittable pseudorandom number generators",
/// 2014): as small, with 64 bits at a time and no weak seeds.
#[derive(Debug, Clone)]
pub struct SplitMix64(pub u64);

impl SplitMix64 {
    /// Next 64 random bits.
    pub fn next_u64(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// The upper half of the next 64 bits.
    pub fn next_u32(&mut self) -> u32 {
        (self.next_u64() >> 32) as u32
    }

    /// A number in `[0, 1)` with 53 random bits.
    pub fn uniform(&mut self) -> f64 {
        (self.next_u64() >> 11) as f64 * 2f64.powi(-53)
    }

    /// An index below `n`; 0 if `n` is 0.
    pub fn below(&mut self, n: usize) -> usize {
        ((u128::from(self.next_u64()) * n as u128) >> 64) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_generator_gives_the_numbers_of_the_reference_implementation() {
        let mut reference = Pcg32::with_stream(42, 54);
        let first: Vec<u32> = (0..6).map(|_| reference.next_u32()).collect();
        let expected = [
            0xa15c02b7, 0x7b47f409, 0xba1d3330, 0x83d2f293, 0xbfa4784b, 0xcbed606e,
        ];
        assert_eq!(first, expected);
    }

    #[test]
    fn the_splittable_generator_gives_the_numbers_of_its_reference_implementation() {
        let mut reference = SplitMix64(1_234_567);
        let first: Vec<u64> = (0..3).map(|_| reference.next_u64()).collect();
        let expected = [
            6_457_827_717_110_365_317,
            3_203_168_211_198_807_973,
            9_817_491_932_198_370_423,
        ];
        assert_eq!(first, expected);
    }
}
