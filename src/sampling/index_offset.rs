//! `index-offset`: each pixel starts at another point of the sequence. CPU version of
//! `kernels/sampling/index_offset.wesl`.
//!
//! Source: Dufay 2017, §5.3.2, eq. 5.7. He does not give the range of the offsets; here it is a
//! parameter. Pixels with close offsets share points, and neighbouring rays need far-apart indices.

use super::fixed_point::mul_high;
use super::hash::pixel_number;
use super::{Coordinate, Decorrelation, Partner, SamplerTable, Seeded, Seeding};
use raystone_core::parameters;

parameters! {
    /// each pixel begins at a random index of the sequence (Dufay 2017 §5.3.2)
    pub(crate) struct IndexOffset {
        /// offsets are drawn from 0 to this, excluded
        offsets: u32 = 65_536, in 2..=1 << 24;
        /// Whether pixels differ.
        seeded: Seeded;
    }
}

impl Decorrelation for IndexOffset {
    fn seeding(&self) -> Seeding {
        self.seeded.seeding
    }

    /// The mean is that of as many first points of the sequence as there are offsets.
    fn is_unbiased(&self) -> bool {
        false
    }

    fn refusal(&self, partner: &Partner) -> Option<String> {
        partner
            .without_structure()
            .or_else(|| partner.not_extensible())
    }

    fn constants(&self) -> Vec<(&'static str, u32)> {
        vec![("OFFSETS", self.offsets)]
    }

    fn index(&self, _: &SamplerTable, at: Coordinate) -> u32 {
        at.sample
            .wrapping_add(mul_high(pixel_number(at), self.offsets))
    }

    fn decorrelate(&self, x: u32, _: &SamplerTable, _: Coordinate) -> u32 {
        x
    }
}
