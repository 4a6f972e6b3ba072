//! `sobol`: the digital (t, s)-sequence in base 2 with Joe and Kuo's direction numbers, in natural
//! order from index 0. Twin of `kernels/sampling/sobol.wesl`.
//!
//! Source: S. Joe, F. Kuo, "Constructing Sobol sequences with better two-dimensional projections",
//! SIAM J. Sci. Comput. 30, 2008 (set D6, from the crate `sobol`).

use super::{Coordinate, Sequence, TABLE_DIMENSIONS};
use crate::config::Params;
use ::sobol::params::JoeKuoD6;

const BITS: usize = 32;

/// The registry entry.
pub struct Sobol;

impl Sequence for Sobol {
    fn name(&self) -> &'static str {
        "sobol"
    }

    fn description(&self) -> &'static str {
        "(t, s)-sequence in base 2, 128 dimensions of Joe & Kuo's D6 direction numbers (2008), from index 0"
    }

    fn kernel(&self) -> &'static str {
        "sampling/sobol"
    }

    /// 32 direction numbers a dimension, most significant digit of the sample's bit 0 first.
    fn table(&self, _: &Params) -> Vec<u32> {
        let parameters = JoeKuoD6::standard();
        let directions = ::sobol::Sobol::<u32>::init_direction_vals::<u32>(
            TABLE_DIMENSIONS as usize,
            BITS,
            &parameters,
        );
        directions.into_iter().flatten().collect()
    }

    fn sequence(&self, _: &Params, table: &[u32], at: Coordinate) -> u32 {
        let mut rest = at.sample;
        let mut column = at.dimension as usize * BITS;
        let mut x = 0;
        while rest > 0 {
            if rest & 1 == 1 {
                x ^= table[column];
            }
            rest >>= 1;
            column += 1;
        }
        x
    }
}
