//! Statistics of the error records of a sampler's replicates, and their dependence on each replicate and on each part
//! of the reference.

use crate::{ErrorRecord, Tail};
use raystone_stats::comparison::LogFigure;
use raystone_stats::statistics::mean;

/// Error records of one sampler, one for each replicate.
#[derive(Debug, Clone, Copy)]
pub struct Replicates<'a>(pub &'a [&'a ErrorRecord]);

/// The sample that an estimate leaves out, to see its influence.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Without {
    /// The estimate itself.
    Nothing,
    /// One of the replicates.
    Replicate(usize),
    /// One of the reference's parts.
    Part(usize),
}

impl Replicates<'_> {
    /// Returns `true` if their spread can be estimated.
    pub fn have_spread(self) -> bool {
        self.0.len() > 1
    }

    /// Returns the influence of single pixels on their mean relMSE.
    pub fn tail(self, spp: u32) -> Option<Tail> {
        let last = self.0.iter().max_by_key(|r| r.replicate)?;
        last.errors.iter().find(|error| error.spp == spp)?.tail
    }

    /// Returns `true` if each has the metric of this id at this number of samples.
    pub fn all_have(self, id: &str, spp: u32) -> bool {
        self.0.iter().all(|r| value(r, spp, id).is_some())
    }

    /// Returns the mean of a recorded metric over those that have it.
    pub fn mean(self, id: &str, spp: u32, without: Without) -> Option<f64> {
        let kept = self.0.iter().enumerate();
        let kept = kept.filter(|(i, _)| without != Without::Replicate(*i));
        let values = kept.filter_map(|(_, r)| match without {
            Without::Part(part) => {
                let at = r.errors.iter().find(|error| error.spp == spp)?;
                at.without_part.get(id)?.get(part).copied()
            }
            _ => value(r, spp, id),
        });
        mean(&values.collect::<Vec<f64>>())
    }

    /// Returns `estimate` without each part of each source of noise: those of [`Replicates::of_reference`], and the
    /// replicates as the last one. No source for a single replicate, whose own noise is unknown.
    pub fn sources(
        self,
        id: &str,
        estimate: impl Fn(Without) -> Option<f64>,
    ) -> Option<Vec<Vec<f64>>> {
        if !self.have_spread() {
            return Some(Vec::new());
        }
        let mut sources = self.of_reference(id, &estimate)?;
        let replicates = 0..self.0.len();
        let by_replicate: Option<_> = replicates
            .map(|i| estimate(Without::Replicate(i)))
            .collect();
        sources.push(by_replicate?);
        Some(sources)
    }

    /// Returns `estimate` without each part of the reference, its halves apart; empty where parts are unknown.
    pub fn of_reference(
        self,
        id: &str,
        estimate: impl Fn(Without) -> Option<f64>,
    ) -> Option<Vec<Vec<f64>>> {
        let errors = self.0.iter().flat_map(|r| &r.errors);
        let known = errors.map(|e| e.without_part.get(id).map_or(0, Vec::len));
        let half = known.min().unwrap_or(0) / 2;
        let of = |parts: std::ops::Range<usize>| -> Option<Vec<f64>> {
            parts.map(|part| estimate(Without::Part(part))).collect()
        };
        Some(vec![of(0..half)?, of(half..2 * half)?])
    }

    /// Returns an estimated logarithm with its noise: that of the replicates is its own, that of the reference it
    /// shares with all that are measured against it. Of a single replicate there is none.
    pub fn log_figure(
        self,
        id: &str,
        estimate: impl Fn(Without) -> Option<f64>,
    ) -> Option<LogFigure> {
        let log = estimate(Without::Nothing)?;
        let mut sources = self.sources(id, estimate)?;
        let own: Vec<Vec<f64>> = sources.pop().into_iter().collect();
        LogFigure::new(log, &own, sources)
    }
}

fn value(replicate: &ErrorRecord, spp: u32, id: &str) -> Option<f64> {
    let at = replicate.errors.iter().find(|error| error.spp == spp)?;
    at.metrics
        .get(id)
        .copied()
        .filter(|value| value.is_finite())
}
