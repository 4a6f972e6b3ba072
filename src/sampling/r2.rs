//! `r2`: multiples of powers of a generalised golden ratio. CPU version of
//! `kernels/sampling/r2.wesl`.
//!
//! Source: M. Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018:
//! x_j(i) = ½ + (i + 1) φ_d^(−j−1) modulo 1, where φ_d is the positive root of x^(d+1) = x + 1. The
//! powers are fractions of 2³², so the error of point i is below (i + 1) / 2³³.
//!
//! With more dimensions, φ_d is closer to 1 and its powers are more similar: with d = 20 a pair of
//! dimensions has D* = 0.124 after 1024 points. Beyond [`GOLDEN`] dimensions the steps are
//! therefore the square roots of primes (R. Richtmyer, "The evaluation of definite integrals, and a
//! quasi-Monte-Carlo method based on the properties of algebraic numbers", 1951), whose worst pair
//! of 20 has 0.032.

use super::primes::primes;
use super::{Coordinate, Demand, Facts, SamplerTable, Sequence};
use raystone_core::parameters;

parameters! {
    /// additive recurrence: powers of a generalised golden ratio (Roberts 2018), beyond 8 dimensions
    /// square roots of primes (Richtmyer 1951)
    pub(crate) struct R2 {
        /// all dimensions that are drawn; up to 8 it is the d of the ratio's equation x^(d+1) = x + 1
        dimensions: u32 = 2, in 1..=256;
    }
}

/// Maximum dimensions that use powers of the ratio.
const GOLDEN: u32 = 8;

/// φ_d by Newton's method from above, with products only: the same on every machine.
fn generalised_golden_ratio(dimensions: u32) -> f64 {
    let mut x = 2.0_f64;
    for _ in 0..64 {
        let power = (0..dimensions).fold(1.0, |power, _| power * x);
        let slope = f64::from(dimensions + 1) * power - 1.0;
        x -= (power * x - x - 1.0) / slope;
    }
    x
}

impl Sequence for R2 {
    fn facts(&self) -> Facts {
        Facts {
            extensible: true,
            dimensions: Some(self.dimensions),
            ..Facts::default()
        }
    }

    fn table(&self, demand: &Demand) -> Vec<u32> {
        let word = |step: f64| (step.fract() * 2.0_f64.powi(32)).round() as u32;
        if self.dimensions > GOLDEN {
            let roots = primes(demand.dimensions as usize).into_iter();
            return roots.map(|p| word(f64::from(p).sqrt())).collect();
        }
        let step = 1.0 / generalised_golden_ratio(self.dimensions);
        let powers = std::iter::successors(Some(step), |power| Some(power * step));
        powers.take(demand.dimensions as usize).map(word).collect()
    }

    fn sequence(&self, table: &SamplerTable, at: Coordinate) -> u32 {
        let multiple = at
            .sample
            .wrapping_add(1)
            .wrapping_mul(table.sequence_word(at.dimension));
        multiple.wrapping_add(0x8000_0000)
    }
}
