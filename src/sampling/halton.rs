//! `halton`: radical inverses in prime bases. Twin of `kernels/sampling/halton.wesl`.
//!
//! Source: J. Halton, 1960. Fractions of 2³² by truncated integer division: digit k of index n adds
//! `digit · floor(…floor((2³² − 1) / b)… / b)`; what is lost is below 32·b/2³², and the result stays
//! below 1. Base 2 is exact.

use super::{Coordinate, Sequence, TABLE_DIMENSIONS};
use crate::config::Params;

/// The registry entry.
pub struct Halton;

impl Sequence for Halton {
    fn name(&self) -> &'static str {
        "halton"
    }

    fn description(&self) -> &'static str {
        "radical inverses in the first 128 primes, from index 0 (Halton 1960)"
    }

    fn kernel(&self) -> &'static str {
        "sampling/halton"
    }

    /// The base of each dimension.
    fn table(&self, _: &Params) -> Vec<u32> {
        let mut primes: Vec<u32> = Vec::new();
        let mut candidate = 2;
        while primes.len() < TABLE_DIMENSIONS as usize {
            if primes.iter().all(|p| candidate % p != 0) {
                primes.push(candidate);
            }
            candidate += 1;
        }
        primes
    }

    fn sequence(&self, _: &Params, table: &[u32], at: Coordinate) -> u32 {
        let base = table[at.dimension as usize];
        if base == 2 {
            return at.sample.reverse_bits();
        }
        let mut rest = at.sample;
        let mut weight = u32::MAX / base;
        let mut x = 0;
        while rest > 0 {
            x += (rest % base) * weight;
            rest /= base;
            weight /= base;
        }
        x
    }
}
