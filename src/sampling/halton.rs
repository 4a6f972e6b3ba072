//! `halton`: radical inverses in prime bases, with plain or permuted digits. CPU version of
//! `kernels/sampling/halton.wesl`.
//!
//! Source: J. Halton, "On the efficiency of certain quasi-random sequences of points in evaluating
//! multi-dimensional integrals", Numer. Math. 2, 1960. Words: for each dimension its base and the
//! start of its permutation, then the permutations. All of them map 0 to 0, so that an expansion
//! ends.

use super::primes::{faure_permutation, primes, random_permutation};
use super::radical_inverse::{first_weight, prepend_digit, radical_inverse};
use super::{Coordinate, Demand, Facts, SamplerTable, Sequence};
use raystone_core::parameters;

parameters! {
    /// radical inverses in the first 256 primes, from index 0 (Halton 1960)
    pub(crate) struct Halton {
        /// What becomes of digits.
        rule: DigitRule;
    }

    /// The parameter of sequences in prime bases. Plain digits of large bases run along diagonals: with a
    /// shift D* of the bases 59 and 61 is 0.121 after 1024 points, and 0.029 is the worst of the first 20
    /// dimensions with Faure's.
    pub(crate) struct DigitRule {
        /// digits as they are, permuted by Faure's rule (1992), or at random once and for all
        digits: Digits = Digits::Faure;
    }

    /// How digits are permuted.
    pub enum Digits {
        /// Unpermuted.
        Plain = "plain",
        /// Faure's permutations (1992).
        Faure = "faure",
        /// Fixed random permutations.
        Random = "random",
    }
}

/// The radical inverse whose digits d are replaced by the words `first + d`.
fn permuted_inverse(table: &SamplerTable, n: u32, base: u32, first: u32) -> u32 {
    let mut rest = n;
    let mut weight = first_weight(n, base);
    let mut x = 0;
    while weight > 0 {
        x = prepend_digit(table.sequence_word(first + rest / weight), x, base);
        rest %= weight;
        weight /= base;
    }
    x
}

impl DigitRule {
    /// The constant of the kernel that selects permuted digits.
    pub(super) fn constants(&self) -> Vec<(&'static str, u32)> {
        vec![("PERMUTED", u32::from(self.digits != Digits::Plain))]
    }

    /// For each of the first primes the base and the start of its permutation, then the
    /// permutations; preceded by `before` words.
    pub(super) fn digit_table(&self, count: u32, before: u32) -> Vec<u32> {
        let bases = primes(count as usize);
        let permutation = match self.digits {
            Digits::Faure => faure_permutation,
            Digits::Random => random_permutation,
            Digits::Plain => |_| Vec::new(),
        };
        let mut words = Vec::new();
        let mut permutations = Vec::new();
        for base in &bases {
            let place = before as usize + 2 * bases.len() + permutations.len();
            words.extend([*base, place as u32]);
            permutations.extend(permutation(*base));
        }
        words.extend(permutations);
        words
    }

    /// The radical inverse in the base in word `place`, with the permutation in the next word.
    pub(super) fn inverse_at(&self, table: &SamplerTable, n: u32, place: u32) -> u32 {
        let base = table.sequence_word(place);
        if base > 2 && self.digits != Digits::Plain {
            return permuted_inverse(table, n, base, table.sequence_word(place + 1));
        }
        radical_inverse(n, base)
    }
}

impl Sequence for Halton {
    fn facts(&self) -> Facts {
        Facts {
            extensible: true,
            dimensions: Some(256),
            ..Facts::default()
        }
    }

    fn table(&self, demand: &Demand) -> Vec<u32> {
        self.rule.digit_table(demand.dimensions, 0)
    }

    fn constants(&self) -> Vec<(&'static str, u32)> {
        self.rule.constants()
    }

    fn sequence(&self, table: &SamplerTable, at: Coordinate) -> u32 {
        self.rule.inverse_at(table, at.sample, 2 * at.dimension)
    }
}
