//! `owen-hash`: nested uniform scrambling of index and digits by hashes. CPU version of
//! `kernels/sampling/owen_hash.wesl`.
//!
//! Source: A. Owen, "Randomly permuted (t, m, s)-nets and (t, s)-sequences", 1995, by the hash of
//! [`super::owen`]. The index is scrambled as well (B. Burley 2020), so that pixels differ in order
//! as well as in position; blocks of 2^m samples stay blocks.

use super::hash::{dimension_number, pixel_number};
use super::owen::owen_scramble;
use super::{Coordinate, Decorrelation, Partner, SamplerTable, Seeded, Seeding};
use raystone_core::parameters;

parameters! {
    /// Owen scrambling and a nested shuffle of the index, by hashing, for each pixel (Burley 2020;
    /// Vegdahl 2021)
    pub(crate) struct OwenHash {
        /// Whether pixels differ.
        seeded: Seeded;
    }
}

impl Decorrelation for OwenHash {
    fn seeding(&self) -> Seeding {
        self.seeded.seeding
    }

    fn refusal(&self, partner: &Partner) -> Option<String> {
        let refused = partner.without_structure();
        refused
            .or_else(|| partner.not_base_2())
            .or_else(|| partner.not_extensible())
    }

    fn index(&self, _: &SamplerTable, at: Coordinate) -> u32 {
        owen_scramble(at.sample, pixel_number(at))
    }

    fn decorrelate(&self, x: u32, _: &SamplerTable, at: Coordinate) -> u32 {
        owen_scramble(x, dimension_number(at))
    }
}
