//! `disc-rotation`: rotates the points on the disc by a random angle. CPU version of
//! `kernels/sampling/disc_rotation.wesl`.
//!
//! Source: Dufay 2017, §5.3.2. The hemisphere is sampled through the disc, whose angle is the
//! second number of a pair: the rotation is Cranley and Patterson's shift of odd dimensions only.
//! It leaves rings, since no radius changes.

use super::hash::dimension_number;
use super::{Coordinate, Decorrelation, Partner, SamplerTable, Seeded, Seeding};
use raystone_core::parameters;

parameters! {
    /// a random turn of the disc of each pair of dimensions, leaves rings (Dufay 2017 §5.3.2)
    pub(crate) struct DiscRotation {
        /// Whether pixels differ.
        seeded: Seeded;
    }
}

impl Decorrelation for DiscRotation {
    fn seeding(&self) -> Seeding {
        self.seeded.seeding
    }

    /// No radius changes.
    fn is_unbiased(&self) -> bool {
        false
    }

    fn refusal(&self, partner: &Partner) -> Option<String> {
        let flat = partner.facts.dimensions == Some(1);
        let reason = || format!("{} has one dimension, a disc has two", partner.name);
        partner.without_structure().or_else(|| flat.then(reason))
    }

    fn index(&self, _: &SamplerTable, at: Coordinate) -> u32 {
        at.sample
    }

    fn decorrelate(&self, x: u32, _: &SamplerTable, at: Coordinate) -> u32 {
        if at.dimension & 1 == 0 {
            return x;
        }
        x.wrapping_add(dimension_number(at))
    }
}
