//! Samplers at equal time.

use super::kernels::is_repeat;
use super::verdict::rank;
use crate::data::View;
use crate::format;
use crate::ruling::{Contender, Ruling};
use crate::samplers::{MeanError, MeasuredSampler, Metric, log_time, place_on};
use crate::values::{Estimate, Value};
use raystone_record::axis;
use raystone_record::figure::{self, Figure};
use raystone_stats::comparison::LogFigure;

/// Samplers at equal time, under the fastest structure.
pub(crate) struct Race<'a> {
    /// The end of the first of them: the time at which errors are compared.
    pub seconds: f64,
    /// The structure under which all were timed.
    pub structure: String,
    view: &'a View<'a>,
    runners: Vec<Runner<'a>>,
}

struct Runner<'a> {
    sampler: &'a MeasuredSampler<'a>,
    /// Milliseconds per sample per pixel.
    time: LogFigure,
    /// Samples per pixel and seconds, growing; those whose errors are resolved.
    curve: Vec<(u32, f64)>,
}

impl<'a> Runner<'a> {
    fn new(view: &View, structure: &str, sampler: &'a MeasuredSampler<'a>) -> Option<Self> {
        let time = log_time(view.time(structure, &sampler.name)?)?;
        let means = sampler.mean_errors(Metric::RelMse);
        let resolved = means.iter().filter(|mean| mean.resolved);
        let at = |m: &MeanError| (m.spp, f64::from(m.spp) * time.log.exp() / 1000.0);
        Some(Self {
            sampler,
            curve: resolved.map(at).collect(),
            time,
        })
    }

    /// Returns `true` if all its noise is known.
    fn is_ranked(&self) -> bool {
        self.sampler.is_ranked() && self.time.has_noise()
    }

    /// Returns a figure with the noise of the time, which enters as this power of it; without it beside an image whose own
    /// noise is not known.
    fn with_time(&self, figure: LogFigure, power: f64) -> LogFigure {
        // An exact 0 stays one.
        if self.sampler.is_ranked() && figure.log.is_finite() {
            figure.with_noise_of(&self.time, power)
        } else {
            figure
        }
    }

    /// Returns the error after so many seconds. An error of the time per sample moves it along the curve.
    fn error_after(&self, seconds: f64) -> Option<LogFigure> {
        let times: Vec<f64> = self.curve.iter().map(|at| at.1).collect();
        let (neighbours, share) = place_on(&times, seconds)?;
        let [a, b] = neighbours.map(|i| self.curve[i].0);
        let error = |spps, share| self.sampler.log_error(Metric::RelMse, spps, share);
        // At a point of the curve, errors are assumed to fall as one over the samples.
        let slope = if a < b {
            let fall = error([b; 2], 0.0)?.log - error([a; 2], 0.0)?.log;
            fall / (f64::from(b) / f64::from(a)).ln()
        } else {
            -1.0
        };
        Some(self.with_time(error([a, b], share)?, -slope))
    }

    /// Returns error × seconds, one over the efficiency.
    fn error_seconds(&self, spp: u32) -> Option<LogFigure> {
        let error = self.sampler.log_error(Metric::RelMse, [spp; 2], 0.0)?;
        let seconds = f64::from(spp) * self.time.log.exp() / 1000.0;
        Some(self.with_time(error.scaled(seconds), 1.0))
    }

    /// Returns the seconds until the error falls to `target`.
    fn seconds_to(&self, target: f64) -> Option<LogFigure> {
        let spp = self.sampler.spp_to(Metric::RelMse, target)?;
        Some(self.with_time(spp.scaled(self.time.log.exp() / 1000.0), 1.0))
    }
}

impl<'a> Race<'a> {
    /// Creates the race; `None` without a sampler that has both errors and a time.
    pub(crate) fn new(view: &'a View<'a>) -> Option<Self> {
        let structure = view.fastest_structure()?;
        let runner = |sampler: &'a MeasuredSampler<'a>| {
            let time = view.time(&structure, &sampler.name)?;
            if is_repeat(time, &view.times) && view.is_same_image(sampler) {
                return None;
            }
            let runner = Runner::new(view, &structure, sampler)?;
            (!runner.curve.is_empty() && sampler.fault().is_none()).then_some(runner)
        };
        let runners: Vec<Runner> = view.samplers.iter().filter_map(runner).collect();
        let ends = runners.iter().filter_map(|r| Some(r.curve.last()?.1));
        let seconds = ends.reduce(f64::min)?;
        Some(Self {
            seconds,
            structure,
            view,
            runners,
        })
    }

    /// Returns the error that samples and seconds are counted to: that of the rule that ends cells, else the least
    /// that all of the race reach, rounded up to two digits.
    fn target(&self) -> Option<f64> {
        let stopped = self.view.samplers.iter().flat_map(|s| &s.replicates);
        if let Some(rule) = stopped.filter_map(|r| r.stop.as_ref()).next() {
            return Some(rule.relmse);
        }
        let last = |runner: &Runner| {
            let (spp, _) = runner.curve.last()?;
            let mean = runner.sampler.mean_error_at(Metric::RelMse, *spp)?;
            Some(mean.error.value)
        };
        let most = self.runners.iter().filter_map(last).reduce(f64::max)?;
        let unit = 10f64.powf(most.log10().floor() - 1.0);
        (most > 0.0).then(|| (most / unit).ceil() * unit)
    }

    /// Returns the efficiency of each: error × time at the common spp, errors at the end of the race, samples and
    /// seconds to an error.
    pub(crate) fn values(&self) -> Vec<Value<'static>> {
        let metric = &self.view.figure(Metric::RelMse).title;
        let (common, target) = (self.view.common_spp(), self.target());
        let mut values = Vec::new();
        for sampler in &self.view.samplers {
            let Some(time) = self.view.time(&self.structure, &sampler.name) else {
                continue;
            };
            let Some(runner) = Runner::new(self.view, &self.structure, sampler) else {
                continue;
            };
            let mut add = |what: String, row: &'static Figure, figure: Option<LogFigure>| {
                let key = time.key.clone().with(axis::SUBJECT, what);
                let figure = figure.map(|f| Estimate::of(f.interval(), sampler.is_heavy_tailed()));
                values.extend(Value::known(&key, [(row, figure)]));
            };
            let resolved = |spp: &u32| runner.curve.iter().any(|at| at.0 == *spp);
            if let Some(spp) = common.filter(resolved) {
                let what = format!("{metric} × seconds at {spp} spp");
                add(what, &figure::ERROR_SECONDS, runner.error_seconds(spp));
            }
            let what = format!("{metric} after {} s", format::number(self.seconds));
            let fair = sampler.fault().is_none();
            let end = runner.error_after(self.seconds).filter(|_| fair);
            add(what, &figure::ERROR_AT_TIME, end);
            if let Some(target) = target {
                let to = format!("to {metric} {}", format::significant(target, 2));
                let spp = sampler.spp_to(Metric::RelMse, target);
                let seconds = runner.seconds_to(target);
                add(format!("spp {to}"), &figure::SPP_TO_ERROR, spp);
                add(format!("seconds {to}"), &figure::SECONDS_TO_ERROR, seconds);
            }
        }
        values
    }

    /// Returns the error of a sampler when the race ends.
    #[cfg(test)]
    pub(crate) fn error_of(&self, sampler: &str) -> Option<raystone_record::Interval> {
        let is_it = |runner: &&Runner| runner.sampler.name == sampler;
        let runner = self.runners.iter().find(is_it)?;
        Some(runner.error_after(self.seconds)?.interval())
    }

    /// Returns the ruling on the least error at the end of the race.
    pub(crate) fn ruling(&self) -> Ruling {
        let contender = |runner: &Runner| {
            let log = runner.error_after(self.seconds)?;
            Some(Contender {
                name: runner.sampler.name.clone(),
                figure: log.interval(),
                log: Some(log).filter(|_| runner.is_ranked()),
            })
        };
        rank(
            self.view,
            self.runners.iter().filter_map(contender).collect(),
        )
    }
}
