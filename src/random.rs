//! The generator behind everything that is drawn at random on the host.

use rand_pcg::rand_core::Rng;

/// PCG32 (XSH RR 64/32; O'Neill 2014): small, seeded, the same on every machine.
#[derive(Debug, Clone)]
pub struct Pcg32(rand_pcg::Pcg32);

impl Pcg32 {
    /// The stream of the author's default increment; scenes are drawn from it.
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

    /// An index below `n`, `1 ≤ n ≤ 2³²`; its bias of at most `n·2⁻³²` does not matter here.
    pub fn below(&mut self, n: usize) -> usize {
        ((u64::from(self.next_u32()) * n as u64) >> 32) as usize
    }

    /// A number in `[0, 1)` with 32 random bits.
    pub fn uniform(&mut self) -> f64 {
        f64::from(self.next_u32()) / 2f64.powi(32)
    }

    /// A number in `[0, 1)` with 24 random bits.
    pub fn uniform_f32(&mut self) -> f32 {
        (self.next_u32() >> 8) as f32 / 2f32.powi(24)
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
    fn numbers_are_uniform_and_depend_on_seed_and_stream() {
        let draw = |seed, stream| -> Vec<f64> {
            let mut generator = Pcg32::with_stream(seed, stream);
            (0..10_000).map(|_| generator.uniform()).collect()
        };
        let numbers = draw(42, 0);
        assert!(numbers != draw(43, 0) && numbers != draw(42, 1));
        assert!(numbers.iter().all(|x| (0.0..1.0).contains(x)));
        let mean = numbers.iter().sum::<f64>() / 1e4;
        let variance = numbers.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 1e4;
        assert!((mean - 0.5).abs() < 0.01 && (variance - 1.0 / 12.0).abs() < 0.003);
        assert_eq!(Pcg32::new(1).below(1), 0);
    }
}
