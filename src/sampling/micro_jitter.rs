//! `micro-jitter`: a random shift of at most μ = K·N^(−1/s) for each pixel and dimension, or for
//! each sample. CPU version of `kernels/sampling/micro_jitter.wesl`.
//!
//! Source: Dufay 2017, §5.4: at sample i all pixels use nearly the same point, hence nearly the
//! same ray. K = 2.5 for Halton and 1.5 for Hammersley, s = 2; from μ = ½ on it is Cranley and
//! Patterson's shift. With a separate shift per sample, points are jittered about their positions,
//! and rays stay as coherent. Clamping at the edges instead of wrapping is biased. Word: the width
//! 2μ.

use super::fixed_point::mul_high;
use super::hash::{dimension_number, sample_number};
use super::{Coordinate, Decorrelation, Demand, Partner, SamplerTable, Seeded, Seeding};
use raystone_core::parameters;

parameters! {
    /// a shift of at most K·N^(-1/s) for each pixel and dimension, keeps rays coherent (Dufay 2017
    /// §5.4)
    pub(crate) struct MicroJitter {
        /// K of the amplitude; 0 takes Dufay's: 1.5 for hammersley, 2.5 else
        k: f64 = 0.0, in 0.0..=64.0;
        /// s of the amplitude; Dufay takes 2 whatever the dimensions
        s: u32 = 2, in 1..=64;
        /// what a shift beyond 0 or 1 does; clamp is biased
        edge: Edge = Edge::Wrap;
        /// whether all samples of a pixel are shifted alike, as by Dufay, or each by its own
        per: Per = Per::Pixel;
        /// Whether pixels differ.
        seeded: Seeded;
    }

    /// The scope of a shift.
    pub(crate) enum Per {
        /// All samples of a pixel have the same shift (Dufay 2017).
        Pixel = "pixel",
        Sample = "sample",
    }

    /// Handling of shifts beyond [0, 1).
    pub enum Edge {
        /// Wrap around.
        Wrap = "wrap",
        /// Clamp.
        Clamp = "clamp",
    }
}

/// Dufay's K for Halton points, also used for sequences that he did not fit.
const HALTON_K: f64 = 2.5;
const HAMMERSLEY_K: f64 = 1.5;

impl MicroJitter {
    /// K, by default that for the sequence.
    fn amplitude(&self, sequence: &str) -> f64 {
        match self.k {
            0.0 if sequence == "hammersley" => HAMMERSLEY_K,
            0.0 => HALTON_K,
            k => k,
        }
    }

    /// The width 2μ = 2K·N^(−1/s) of shifts as a fraction of 2³².
    pub(super) fn width(k: f64, s: u32, samples: u32) -> u32 {
        let samples = f64::from(samples.max(1));
        let root = match s {
            1 => samples,
            2 => samples.sqrt(),
            s => samples.powf(1.0 / f64::from(s)),
        };
        // The cast saturates where μ would be ½ or more.
        (2.0 * k / root * 2.0_f64.powi(32)) as u32
    }
}

impl Decorrelation for MicroJitter {
    fn seeding(&self) -> Seeding {
        self.seeded.seeding
    }

    fn by_count(&self) -> bool {
        true
    }

    /// Shifts smaller than the square retain a part of the error of the points.
    fn is_unbiased(&self) -> bool {
        false
    }

    fn refusal(&self, partner: &Partner) -> Option<String> {
        partner.without_structure()
    }

    fn table(&self, partner: &Partner, demand: &Demand) -> Result<Vec<u32>, String> {
        let k = self.amplitude(partner.name);
        Ok(vec![Self::width(k, self.s, demand.samples.unwrap_or(1))])
    }

    fn constants(&self) -> Vec<(&'static str, u32)> {
        vec![
            ("CLAMP", u32::from(self.edge == Edge::Clamp)),
            ("PER_SAMPLE", u32::from(self.per == Per::Sample)),
        ]
    }

    fn index(&self, _: &SamplerTable, at: Coordinate) -> u32 {
        at.sample
    }

    fn decorrelate(&self, x: u32, table: &SamplerTable, at: Coordinate) -> u32 {
        let width = table.decorrelation_word(0);
        let random = match self.per {
            Per::Pixel => dimension_number(at),
            Per::Sample => sample_number(at),
        };
        let up = mul_high(random, width);
        let down = width >> 1;
        let moved = x.wrapping_add(up).wrapping_sub(down);
        let clamp = self.edge == Edge::Clamp;
        if clamp && up < down && moved > x {
            return 0;
        }
        if clamp && up >= down && moved < x {
            return u32::MAX;
        }
        moved
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn widths_are_those_of_the_thesis() {
        for (sequence, samples, mu) in [
            ("halton", 64, 0.3125),
            ("halton", 1024, 0.078_125),
            ("hammersley", 64, 0.1875),
            ("hammersley", 8, 0.5),
            ("halton", 1, 0.5),
        ] {
            let k = MicroJitter::default().amplitude(sequence);
            let found = f64::from(MicroJitter::width(k, 2, samples)) * 2.0_f64.powi(-33);
            assert!(
                (found - f64::min(mu, 0.5)).abs() < 0.031 * f64::from(samples == 8) + 1e-9,
                "{sequence} {samples}: {found}"
            );
        }
    }
}
