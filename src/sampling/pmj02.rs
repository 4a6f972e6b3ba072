//! `pmj02`: progressive multi-jittered (0, 2) points from a table. CPU version of
//! `kernels/sampling/pmj02.wesl`.
//!
//! Every prefix of 2^m points has one point in each elementary interval of area 2^-m. Words: the
//! number of points minus one, then for each pair of dimensions a separate set in a separate order,
//! alternating x and y.

use super::pmj02_points::shuffled_points;
use super::{Coordinate, Demand, Facts, SamplerTable, Sequence};
use raystone_core::parameters;

parameters! {
    /// progressive multi-jittered (0,2) points, a random set in a random order for each pair of
    /// dimensions (Christensen et al. 2018)
    pub(crate) struct Pmj02 {
        /// seed of the generator: which of the random sets
        set: u32 = 1, in 0..=65_535;
    }
}

impl Sequence for Pmj02 {
    fn facts(&self) -> Facts {
        Facts {
            base_2: true,
            dimensions: Some(128),
            samples: Some(1 << 16),
            ..Facts::default()
        }
    }

    fn table(&self, demand: &Demand) -> Vec<u32> {
        let count = demand.samples.unwrap_or(4096).max(1).next_power_of_two();
        let mut words = vec![count - 1];
        for pair in 0..demand.dimensions.div_ceil(2) {
            let points = shuffled_points(count, self.set << 8 | pair);
            words.extend(points.into_iter().flatten());
        }
        words
    }

    fn sequence(&self, table: &SamplerTable, at: Coordinate) -> u32 {
        let last = table.sequence_word(0);
        let point = (at.dimension >> 1) * (last + 1) + (at.sample & last);
        table.sequence_word(1 + 2 * point + (at.dimension & 1))
    }
}
