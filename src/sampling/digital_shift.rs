//! `digital-shift`: flips the same random bits in all points of a pixel and dimension. CPU version
//! of `kernels/sampling/digital_shift.wesl`.
//!
//! Source: P. L'Ecuyer, C. Lemieux, "Recent advances in randomized quasi-Monte Carlo methods",
//! 2002; Kollig and Keller 2002 in rendering. Unlike Cranley and Patterson's shift it preserves
//! nets in base 2, but it destroys other structure.

use super::hash::dimension_number;
use super::{Coordinate, Decorrelation, Partner, SamplerTable, Seeded, Seeding};
use raystone_core::parameters;

parameters! {
    /// random bits flipped for each pixel and dimension, keeps nets in base 2 (L'Ecuyer & Lemieux 2002)
    pub(crate) struct DigitalShift {
        /// Whether pixels differ.
        seeded: Seeded;
    }
}

impl Decorrelation for DigitalShift {
    fn seeding(&self) -> Seeding {
        self.seeded.seeding
    }

    fn refusal(&self, partner: &Partner) -> Option<String> {
        partner.without_structure().or_else(|| partner.not_base_2())
    }

    fn index(&self, _: &SamplerTable, at: Coordinate) -> u32 {
        at.sample
    }

    fn decorrelate(&self, x: u32, _: &SamplerTable, at: Coordinate) -> u32 {
        x ^ dimension_number(at)
    }
}
