//! `cranley-patterson-micro-jitter`: two combined decorrelations, a random shift modulo 1 for each
//! pixel and dimension, then a small one for each sample. CPU version of
//! `kernels/sampling/cranley_patterson_micro_jitter.wesl`.
//!
//! Sources: those of [`super::CranleyPatterson`] and [`super::MicroJitter`]. The first makes every
//! number uniform, so nothing is biased; the second moves each point by at most μ = K·N^(−1/s),
//! which breaks the regular structure of points shared by all pixels at the scale of their
//! distances. Word: the width 2μ.

use super::fixed_point::mul_high;
use super::hash::{dimension_number, sample_number};
use super::{
    Coordinate, Decorrelation, Demand, MicroJitter, Partner, SamplerTable, Seeded, Seeding,
};
use raystone_core::parameters;

parameters! {
    /// a random shift modulo 1 for each pixel and dimension (Cranley & Patterson 1976), then one of at most
    /// K·N^(-1/s) for each sample
    pub(crate) struct CranleyPattersonMicroJitter {
        /// K of the amplitude; ½ moves a point within the cell that is its share of a square
        k: f64 = 0.5, in 0.0..=64.0;
        /// s of the amplitude
        s: u32 = 2, in 1..=64;
        /// Whether pixels differ.
        seeded: Seeded;
    }
}

impl Decorrelation for CranleyPattersonMicroJitter {
    fn seeding(&self) -> Seeding {
        self.seeded.seeding
    }

    fn by_count(&self) -> bool {
        true
    }

    fn refusal(&self, partner: &Partner) -> Option<String> {
        partner.without_structure()
    }

    fn table(&self, _: &Partner, demand: &Demand) -> Result<Vec<u32>, String> {
        let samples = demand.samples.unwrap_or(1);
        Ok(vec![MicroJitter::width(self.k, self.s, samples)])
    }

    fn index(&self, _: &SamplerTable, at: Coordinate) -> u32 {
        at.sample
    }

    fn decorrelate(&self, x: u32, table: &SamplerTable, at: Coordinate) -> u32 {
        let width = table.decorrelation_word(0);
        x.wrapping_add(dimension_number(at))
            .wrapping_add(mul_high(sample_number(at), width))
            .wrapping_sub(width >> 1)
    }
}
