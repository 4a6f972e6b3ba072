//! `jittered`: one random point in each of as many strata as samples, for each pair of dimensions.
//! CPU version of `kernels/sampling/jittered.wesl`.
//!
//! Source: R. Cook, "Stochastic sampling in computer graphics", ACM Trans. Graph. 5, 1986. Each
//! pair of dimensions visits its strata in a separate order, by the permutation that A. Kensler
//! computes in "Correlated multi-jittered sampling", Pixar Technical Memo 13-01, 2013, so that
//! pairs are independent.
//!
//! N samples have a · b strata: the factors of N if one is at most twice the other, otherwise ⌈√N⌉
//! columns of as many rows as needed, of which those last in the permutation stay empty; each
//! sample alone is uniform either way. The set is made for N samples: beyond it, sample N + i is in
//! the stratum of sample i again.
//!
//! Words, for a and then for b: the number, the quotient and the remainder of 2³² over it.

use super::fixed_point::mul_high;
use super::hash::{keyed_hash, pixel_number, sample_number};
use super::{Coordinate, Demand, Facts, SamplerTable, Seeded, Seeding, Sequence};
use raystone_core::parameters;

parameters! {
    /// a random point in each of N strata, for each pair of dimensions in an order of its own; for N known
    /// beforehand (Cook 1986, Kensler 2013)
    pub(crate) struct Jittered {
        /// Whether pixels differ.
        seeded: Seeded;
    }
}

const PAIR_KEY: u32 = 0x5bd1_e995;

/// Columns and rows of strata for this many samples.
fn strata(samples: u32) -> [u32; 2] {
    let samples = samples.max(1);
    let rows = (1..=samples.isqrt())
        .rev()
        .find(|b| samples.is_multiple_of(*b));
    let rows = rows.unwrap_or(1);
    let columns = samples / rows;
    if columns <= 2 * rows {
        return [columns, rows];
    }
    let columns = samples.isqrt() + u32::from(samples.isqrt().pow(2) < samples);
    [columns, samples.div_ceil(columns)]
}

/// A permutation of the numbers below `length`; `i` is below it.
fn permuted(i: u32, length: u32, key: u32) -> u32 {
    let mut w = length - 1;
    w |= w >> 1;
    w |= w >> 2;
    w |= w >> 4;
    w |= w >> 8;
    w |= w >> 16;
    let mut x = i;
    loop {
        x ^= key;
        x = x.wrapping_mul(0xe170_893d);
        x ^= key >> 16;
        x ^= (x & w) >> 4;
        x ^= key >> 8;
        x = x.wrapping_mul(0x0929_eb3f);
        x ^= key >> 23;
        x ^= (x & w) >> 1;
        x = x.wrapping_mul(1 | (key >> 27));
        x = x.wrapping_mul(0x6935_fa69);
        x ^= (x & w) >> 11;
        x = x.wrapping_mul(0x74dc_b303);
        x ^= (x & w) >> 2;
        x = x.wrapping_mul(0x9e50_1cc3);
        x ^= (x & w) >> 2;
        x = x.wrapping_mul(0xc860_a3df);
        x &= w;
        x ^= x >> 5;
        if x < length {
            break;
        }
    }
    (x + key % length) % length
}

/// Start of stratum `i`, with the number of strata in the word at `place`.
fn begin(table: &SamplerTable, i: u32, place: u32) -> u32 {
    let [count, quotient, remainder] = [0, 1, 2].map(|k| table.sequence_word(place + k));
    let part = i.wrapping_mul(remainder) / count;
    i.wrapping_mul(quotient).wrapping_add(part)
}

impl Sequence for Jittered {
    fn seeding(&self) -> Seeding {
        self.seeded.seeding
    }

    fn facts(&self) -> Facts {
        Facts {
            random: true,
            independent: self.seeded.seeding == Seeding::PixelSample,
            by_count: true,
            // Up to here i · (2³² mod a) fits a word.
            samples: Some(1 << 24),
            ..Facts::default()
        }
    }

    fn table(&self, demand: &Demand) -> Vec<u32> {
        let whole = 1_u64 << 32;
        let words = |count: u32| {
            let count = u64::from(count);
            [count as u32, (whole / count) as u32, (whole % count) as u32]
        };
        strata(demand.samples.unwrap_or(1)).map(words).concat()
    }

    fn sequence(&self, table: &SamplerTable, at: Coordinate) -> u32 {
        let columns = table.sequence_word(0);
        let strata = columns * table.sequence_word(3);
        let key = keyed_hash(pixel_number(at) ^ PAIR_KEY, at.dimension >> 1);
        let stratum = permuted(at.sample % strata, strata, key);
        let (i, place) = match at.dimension & 1 {
            0 => (stratum % columns, 0),
            _ => (stratum / columns, 3),
        };
        let first = begin(table, i, place);
        let width = begin(table, i + 1, place).wrapping_sub(first);
        let random = sample_number(at);
        // A single stratum is 2³² wide.
        if width == 0 {
            return random;
        }
        first.wrapping_add(mul_high(random, width))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strata_are_as_many_as_samples_or_a_few_more_and_nearly_square() {
        for (samples, expected) in [
            (0, [1, 1]),
            (1, [1, 1]),
            (2, [2, 1]),
            (3, [2, 2]),
            (5, [3, 2]),
            (8, [4, 2]),
            (10, [4, 3]),
            (12, [4, 3]),
            (13, [4, 4]),
            (64, [8, 8]),
            (100, [10, 10]),
            (1000, [40, 25]),
        ] {
            assert_eq!(strata(samples), expected, "{samples}");
        }
        for samples in 1..5000 {
            let [a, b] = strata(samples);
            assert!(
                a * b >= samples && b <= a && a <= 2 * b,
                "{samples}: {a} × {b}"
            );
            assert!(a * b < samples + a, "{samples}: a row is empty");
        }
    }

    #[test]
    fn every_key_permutes_numbers_below_any_length() {
        for length in [1, 2, 3, 7, 12, 64, 1000] {
            for key in [0, 1, 0xdead_beef, u32::MAX].into_iter().chain(100..140) {
                let mut found: Vec<u32> = (0..length).map(|i| permuted(i, length, key)).collect();
                found.sort_unstable();
                assert!(found.iter().copied().eq(0..length), "{length} {key}");
            }
        }
    }
}
