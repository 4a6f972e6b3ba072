//! `sobol`: the digital (t, s)-sequence in base 2 with Joe and Kuo's direction numbers, in natural
//! order from index 0. CPU version of `kernels/sampling/sobol.wesl`.
//!
//! Source: S. Joe, F. Kuo, "Constructing Sobol sequences with better two-dimensional projections",
//! SIAM J. Sci. Comput. 30, 2008 (set D6, from the crate `sobol`).

use super::{Coordinate, Demand, Facts, SamplerTable, Sequence};
use ::sobol::params::JoeKuoD6;
use raystone_core::parameters;

/// Dimensions of Joe and Kuo's file.
const DIMENSIONS: u32 = 21_201;
const BITS: usize = 32;

parameters! {
    /// (t, s)-sequence in base 2, 21201 dimensions of Joe & Kuo's D6 direction numbers (2008), from
    /// index 0
    pub(crate) struct Sobol {}
}

/// Direction numbers of the first `dimensions` dimensions, as fractions of 2³²: `bits` per
/// dimension, from bit 0 of the index on. The crate packs Joe and Kuo's file in three lengths.
pub(super) fn direction_numbers(dimensions: u32, bits: usize) -> Vec<u32> {
    let parameters = match dimensions {
        ..=100 => JoeKuoD6::minimal(),
        101..=1000 => JoeKuoD6::standard(),
        _ => JoeKuoD6::extended(),
    };
    let wanted = dimensions as usize;
    ::sobol::Sobol::<u32>::init_direction_vals::<u32>(wanted, bits, &parameters)
        .into_iter()
        .flatten()
        .collect()
}

impl Sequence for Sobol {
    fn facts(&self) -> Facts {
        Facts {
            base_2: true,
            extensible: true,
            dimensions: Some(DIMENSIONS),
            ..Facts::default()
        }
    }

    fn table(&self, demand: &Demand) -> Vec<u32> {
        direction_numbers(demand.dimensions, BITS)
    }

    fn sequence(&self, table: &SamplerTable, at: Coordinate) -> u32 {
        let mut rest = at.sample;
        let mut column = at.dimension * BITS as u32;
        let mut x = 0;
        while rest > 0 {
            if rest & 1 == 1 {
                x ^= table.sequence_word(column);
            }
            rest >>= 1;
            column += 1;
        }
        x
    }
}
