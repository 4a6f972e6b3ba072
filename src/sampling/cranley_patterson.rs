//! `cranley-patterson`: a random shift modulo 1 for each pixel and dimension. CPU version of
//! `kernels/sampling/cranley_patterson.wesl`.
//!
//! Source: R. Cranley, T. Patterson, "Randomization of number theoretic methods for multiple
//! integration", SIAM J. Numer. Anal. 13, 1976. On fractions of 2³² the wrap is exact.

use super::hash::dimension_number;
use super::{Coordinate, Decorrelation, Partner, SamplerTable, Seeded, Seeding};
use raystone_core::parameters;

parameters! {
    /// a random shift modulo 1 for each pixel and dimension (Cranley & Patterson 1976)
    pub(crate) struct CranleyPatterson {
        /// Whether pixels differ.
        seeded: Seeded;
    }
}

impl Decorrelation for CranleyPatterson {
    fn seeding(&self) -> Seeding {
        self.seeded.seeding
    }

    fn refusal(&self, partner: &Partner) -> Option<String> {
        partner.without_structure()
    }

    fn index(&self, _: &SamplerTable, at: Coordinate) -> u32 {
        at.sample
    }

    fn decorrelate(&self, x: u32, _: &SamplerTable, at: Coordinate) -> u32 {
        x.wrapping_add(dimension_number(at))
    }
}
