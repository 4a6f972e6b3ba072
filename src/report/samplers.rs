//! What the replicates of a sampler say together.

use super::data::View;
use crate::measure::record::{BiasRecord, ErrorRecord, Interval, SpectrumRecord};
use crate::measure::statistics::{bootstrap_mean, log_log_slope};

/// A sampler under one scene and integrator.
#[derive(Debug)]
pub struct Sampler<'a> {
    /// `sequence × decorrelation`.
    pub name: String,
    /// Its replicates.
    pub replicates: Vec<&'a ErrorRecord>,
    /// Verdict on its bias.
    pub bias: Option<&'a BiasRecord>,
    /// What its error looks like.
    pub spectrum: Option<&'a SpectrumRecord>,
}

/// An error metric that the report shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Metric {
    /// Relative mean squared error: what samplers are ranked by.
    RelMse,
    /// Root of the mean squared error.
    Rmse,
}

impl Metric {
    /// How tables and axes name it.
    pub fn name(self) -> &'static str {
        match self {
            Self::RelMse => "relMSE",
            Self::Rmse => "RMSE",
        }
    }

    /// What the metric's versioned id starts with.
    fn prefix(self) -> &'static str {
        match self {
            Self::RelMse => "relmse/",
            Self::Rmse => "rmse/",
        }
    }
}

/// Mean error at one number of samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeanError {
    /// Samples per pixel.
    pub spp: u32,
    /// Mean over replicates; the interval has no width for a single replicate.
    pub error: Interval,
}

impl<'a> Sampler<'a> {
    /// Whether no seed changes it, so that its one replicate is exact.
    pub fn is_deterministic(&self) -> bool {
        self.replicates
            .first()
            .is_some_and(|replicate| !replicate.randomised)
    }

    /// Whether the spread over replicates is unknown: randomised, but measured once.
    pub fn lacks_spread(&self) -> bool {
        !self.is_deterministic() && self.replicates.len() < 2
    }

    /// Why it may not win, however small its error.
    pub fn fault(&self) -> Option<String> {
        let bad: usize = self
            .replicates
            .iter()
            .map(|replicate| replicate.non_finite_pixels)
            .sum();
        if bad > 0 {
            return Some(format!("{bad} NaN or infinite pixels"));
        }
        self.bias
            .filter(|bias| bias.verdict == "biased")
            .map(|bias| format!("biased: {} of {} tiles rejected", bias.rejected, bias.tiles))
    }

    /// The full id of a metric as recorded.
    pub fn metric_id(&self, metric: Metric) -> Option<&'a str> {
        let errors = self
            .replicates
            .iter()
            .flat_map(|replicate| &replicate.errors);
        let mut ids = errors.flat_map(|error| error.metrics.keys());
        ids.find(|id| id.starts_with(metric.prefix()))
            .map(String::as_str)
    }

    /// Mean error by growing spp, over the replicates that have it.
    pub fn mean_errors(&self, metric: Metric) -> Vec<MeanError> {
        let Some(id) = self.metric_id(metric) else {
            return Vec::new();
        };
        let mut spps: Vec<u32> = self
            .replicates
            .iter()
            .flat_map(|r| &r.errors)
            .map(|e| e.spp)
            .collect();
        spps.sort_unstable();
        spps.dedup();
        let mean_at = |spp| {
            let values: Vec<f64> = self
                .replicates
                .iter()
                .filter_map(|r| value(r, spp, id))
                .collect();
            bootstrap_mean(&values).map(|error| MeanError { spp, error })
        };
        spps.into_iter().filter_map(mean_at).collect()
    }

    /// Mean error at this spp.
    pub fn mean_error_at(&self, metric: Metric, spp: u32) -> Option<Interval> {
        self.mean_errors(metric)
            .into_iter()
            .find(|mean| mean.spp == spp)
            .map(|mean| mean.error)
    }

    /// Slope of log error against log spp, over the spp that every replicate has.
    pub fn slope(&self, metric: Metric) -> Option<Interval> {
        let id = self.metric_id(metric)?;
        let first = self.replicates.first()?;
        let common: Vec<u32> = first
            .errors
            .iter()
            .map(|error| error.spp)
            .filter(|&spp| self.replicates.iter().all(|r| value(r, spp, id).is_some()))
            .collect();
        let curve = |r: &&ErrorRecord| -> Vec<(f64, f64)> {
            common
                .iter()
                .filter_map(|&spp| Some((f64::from(spp), value(r, spp, id)?)))
                .collect()
        };
        let curves: Vec<_> = self.replicates.iter().map(curve).collect();
        log_log_slope(&curves)
    }
}

fn value(replicate: &ErrorRecord, spp: u32, id: &str) -> Option<f64> {
    let at = replicate.errors.iter().find(|error| error.spp == spp)?;
    at.metrics
        .get(id)
        .copied()
        .filter(|value| value.is_finite())
}

impl View<'_> {
    /// The highest spp at which every measured sampler has an error.
    pub fn common_spp(&self) -> Option<u32> {
        let measured = self
            .samplers
            .iter()
            .map(|s| s.mean_errors(Metric::RelMse))
            .filter(|m| !m.is_empty());
        let sets: Vec<Vec<u32>> = measured
            .map(|m| m.iter().map(|mean| mean.spp).collect())
            .collect();
        let first = sets.first()?;
        first
            .iter()
            .rev()
            .find(|spp| sets.iter().all(|set| set.contains(spp)))
            .copied()
    }
}

/// Error after `seconds`, from a curve of `(seconds, error)`: log–log interpolation between the
/// neighbours, `None` outside the curve.
pub fn error_after(curve: &[(f64, Interval)], seconds: f64) -> Option<Interval> {
    let exact = |&&(x, _): &&(f64, Interval)| (x / seconds - 1.0).abs() < 1e-9;
    if let Some(&(_, error)) = curve.iter().find(exact) {
        return Some(error);
    }
    let pair = curve
        .windows(2)
        .find(|pair| pair[0].0 < seconds && seconds < pair[1].0)?;
    let share = (seconds / pair[0].0).ln() / (pair[1].0 / pair[0].0).ln();
    let between = |a: f64, b: f64| a.powf(1.0 - share) * b.powf(share);
    let (a, b) = (pair[0].1, pair[1].1);
    Some(Interval {
        value: between(a.value, b.value),
        low: between(a.low, b.low),
        high: between(a.high, b.high),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interpolation_follows_a_power_law_and_ends_with_the_curve() {
        let exact = |value| Interval {
            value,
            low: value,
            high: value,
        };
        let curve = [(1.0, exact(8.0)), (4.0, exact(2.0))];
        assert!((error_after(&curve, 2.0).unwrap().value - 4.0).abs() < 1e-12);
        assert_eq!(error_after(&curve, 4.0).unwrap().value, 2.0);
        assert!(error_after(&curve, 5.0).is_none());
    }
}
