//! `hammersley`: i / N, then radical inverses in prime bases. CPU version of
//! `kernels/sampling/hammersley.wesl`.
//!
//! Source: J. Hammersley, "Monte Carlo methods for solving multivariable problems", Ann. New York
//! Acad. Sci. 86, 1960. The set is made for N points: a part of it is biased, so a run draws a
//! separate set for every number of samples. Words: N, the quotient and the remainder of 2³² / N,
//! then those of Halton's sequence for the dimensions after the first.

use super::halton::DigitRule;
use super::{Coordinate, Demand, Facts, SamplerTable, Sequence};
use raystone_core::parameters;

parameters! {
    /// i/N and radical inverses in prime bases, for N known beforehand (Hammersley 1960)
    pub(crate) struct Hammersley {
        /// What becomes of digits.
        rule: DigitRule;
    }
}

const BASES: u32 = 3;

impl Sequence for Hammersley {
    fn constants(&self) -> Vec<(&'static str, u32)> {
        self.rule.constants()
    }

    fn facts(&self) -> Facts {
        Facts {
            by_count: true,
            dimensions: Some(256),
            // Up to here i · (2³² mod N) fits a word.
            samples: Some(1 << 16),
            ..Facts::default()
        }
    }

    fn table(&self, demand: &Demand) -> Vec<u32> {
        let count = u64::from(demand.samples.unwrap_or(1).max(1));
        let whole = 1_u64 << 32;
        let mut words = vec![count as u32, (whole / count) as u32, (whole % count) as u32];
        words.extend(
            self.rule
                .digit_table(demand.dimensions.saturating_sub(1), BASES),
        );
        words
    }

    /// i / N rounded down: i · 2³² / N in two parts.
    fn sequence(&self, table: &SamplerTable, at: Coordinate) -> u32 {
        if at.dimension == 0 {
            let count = table.sequence_word(0);
            let part = at.sample.wrapping_mul(table.sequence_word(2)) / count;
            return at
                .sample
                .wrapping_mul(table.sequence_word(1))
                .wrapping_add(part);
        }
        self.rule
            .inverse_at(table, at.sample, BASES + 2 * (at.dimension - 1))
    }
}
