//! `rank1-lattice`: multiples of a generating vector in van der Corput order. CPU version of
//! `kernels/sampling/rank1_lattice.wesl`.
//!
//! Source: F. Hickernell, H. Hong, P. L'Ecuyer, C. Lemieux, "Extensible lattice sequences for
//! quasi-Monte Carlo quadrature", SIAM J. Sci. Comput. 22, 2000: x(i) = φ₂(i) · z modulo 1, so the
//! first 2^m points are a lattice for every m. φ₂(i) is the reversed index, and the product of
//! words wraps by itself.

use super::lattice_search::generating_vector;
use super::{Coordinate, Demand, Facts, SamplerTable, Sequence};
use raystone_core::parameters;

parameters! {
    /// extensible rank-1 lattice, generating vector searched component by component (Sloan & Reztsov
    /// 2002)
    pub(crate) struct Rank1Lattice {}
}

impl Sequence for Rank1Lattice {
    fn facts(&self) -> Facts {
        Facts {
            dimensions: Some(super::lattice_search::DIMENSIONS as u32),
            samples: Some(1 << super::lattice_search::LAST_LEVEL),
            ..Facts::default()
        }
    }

    fn table(&self, demand: &Demand) -> Vec<u32> {
        generating_vector()[..demand.dimensions as usize].to_vec()
    }

    fn sequence(&self, table: &SamplerTable, at: Coordinate) -> u32 {
        at.sample
            .reverse_bits()
            .wrapping_mul(table.sequence_word(at.dimension))
    }
}
