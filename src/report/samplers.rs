//! Statistics of the replicates of a sampler.

use super::data::{FULL_CELLS, Measured, View};
use super::format;
use raystone_record::figure::{self, Figure};
use raystone_record::replicates::{Replicates, Without};
use raystone_record::{BiasRecord, ErrorRecord, Interval, Key, SpectrumRecord, TimeRecord, axis};
use raystone_stats::bias::BiasVerdict;
use raystone_stats::comparison::LogFigure;
use raystone_stats::heavy_tails::is_heavy;
use raystone_stats::statistics::{
    LEAST_FOR_MEDIAN, jackknife_interval, log_log_fit, mean_interval, positive_interval,
    positive_mean_interval,
};

use std::sync::OnceLock;

/// Label of an error for which the reference is too noisy: its estimate is not clearly above 0.
pub(crate) const UNRESOLVED: &str = "below what the reference can resolve";

/// Label of an interval that a single pixel dominates.
pub(crate) const HEAVY_TAILED: &str =
    "a single pixel, of which the replicates may have missed what is bright, decides over it";

/// The part of the least measured error that the reference's own may be.
pub(crate) const REFERENCE_SHARE: f64 = 0.01;

/// A sampler under one scene, integrator, triangle test and box test.
#[derive(Debug)]
pub struct MeasuredSampler<'a> {
    /// The sampler and the images it draws for.
    pub key: Key,
    /// `sequence × decorrelation`, with all that distinguishes it from others, see `names`.
    pub name: String,
    /// Its replicates.
    pub replicates: Vec<&'a ErrorRecord>,
    /// Mean errors, relMSE and RMSE, computed on demand.
    pub means: [OnceLock<Vec<MeanError>>; 2],
    /// Verdict on its bias.
    pub bias: Option<BiasRecord>,
    /// The spectrum of its error.
    pub spectrum: Option<&'a SpectrumRecord>,
}

/// An error metric that the report shows: free of the reference's own noise on average.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Metric {
    /// Relative mean squared error, by which samplers are ranked.
    RelMse,
    /// Root of the mean squared error, the mean being over replicates, too.
    Rmse,
}

impl Metric {
    /// Returns its stem in file names, the start of the recorded metric's versioned id, and that of the metric used instead
    /// for a reference of one image.
    const fn words(self) -> [&'static str; 3] {
        match self {
            Self::RelMse => ["relmse", "relmse-unbiased/", "relmse/"],
            Self::Rmse => ["rmse", "mse-unbiased/", "mse/"],
        }
    }

    /// Returns its row in the table of figures: that of the recorded metric of this id.
    fn figure_of(self, id: &str) -> &'static Figure {
        match (self, id.contains("-unbiased/")) {
            (Self::RelMse, true) => &figure::RELMSE_UNBIASED,
            (Self::RelMse, false) => &figure::RELMSE,
            (Self::Rmse, true) => &figure::RMSE_UNBIASED,
            (Self::Rmse, false) => &figure::RMSE,
        }
    }

    /// Returns the row of its slope.
    pub(crate) fn slope_figure(self) -> &'static Figure {
        match self {
            Self::RelMse => &figure::RELMSE_SLOPE,
            Self::Rmse => &figure::RMSE_SLOPE,
        }
    }

    /// Returns its stem in file names.
    pub(crate) fn stem(self) -> &'static str {
        self.words()[0]
    }

    /// Returns the interval shown for a recorded mean. No true error is negative, so intervals end at 0. Negative
    /// means have no root: they are shown as 0 and not resolved.
    fn shown(self, recorded: Interval) -> Interval {
        let root = |x: f64| x.max(0.0).sqrt();
        match self {
            Self::RelMse => Interval {
                low: recorded.low.max(recorded.value.min(0.0)),
                ..recorded
            },
            Self::Rmse => Interval {
                value: root(recorded.value),
                low: root(recorded.low),
                high: root(recorded.high),
            },
        }
    }
}

/// Metrics beside those that samplers are ranked by: figure and recorded id. They hold the noise of the
/// reference.
pub(crate) const FURTHER_METRICS: [(&Figure, &str); 7] = [
    (&figure::MAE, "mae/v1"),
    (
        &figure::RELMSE_TRIMMED,
        "relmse-trimmed/top=0.1%/eps=1e-2/v1",
    ),
    (&figure::MSE_LUMINANCE, "mse-luminance/v1"),
    (&figure::SMAPE, "smape/eps=1e-2/v1"),
    (&figure::PSNR, "psnr/tone-mapped/v1"),
    (&figure::SSIM, "ssim/tone-mapped/v1"),
    (&figure::FLIP, "flip/tone-mapped/ppd=67/v1"),
];

/// Mean error at one number of samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeanError {
    /// Samples per pixel.
    pub spp: u32,
    /// Mean over replicates. The interval follows from their spread and from that of the reference's
    /// parts; it has no width for a single replicate.
    pub error: Interval,
    /// True if the estimate is clearly above 0 for the noise of this reference. Otherwise only the upper end has a
    /// meaning.
    pub resolved: bool,
    /// True if the interval is unreliable, since a single pixel dominates it: see [`raystone_stats::heavy_tails`]. Never set for roots of
    /// the MSE, to which dark pixels contribute little.
    pub heavy_tailed: bool,
}

impl<'a> MeasuredSampler<'a> {
    /// Returns `true` if no seed changes it, so that its one replicate is exact.
    pub(crate) fn is_deterministic(&self) -> bool {
        let first = self.replicates.first();
        first.is_some_and(|replicate| !replicate.randomised)
    }

    /// Returns `true` if it may be compared with others: one image has no known spread, not even that of a deterministic sampler,
    /// which is lucky or not in this one scene. Nor is a spread known that is dominated by a pixel which replicates seldom hit.
    pub fn is_ranked(&self) -> bool {
        self.all().have_spread() && !self.is_heavy_tailed()
    }

    /// Returns `true` if a single pixel dominates the interval of its relMSE at the most samples, so that neither this interval
    /// nor its consequences are reliable.
    pub(crate) fn is_heavy_tailed(&self) -> bool {
        let means = self.mean_errors(Metric::RelMse);
        means.last().is_some_and(|mean| mean.heavy_tailed)
    }

    /// Returns the reason why it may not win, however small its error.
    pub fn fault(&self) -> Option<String> {
        let bad: usize = self.replicates.iter().map(|r| r.non_finite_pixels).sum();
        if bad > 0 {
            return Some(format!("{bad} NaN or infinite pixels"));
        }
        let is_biased = |bias: &&BiasRecord| bias.verdict == BiasVerdict::Biased;
        let bias = self.bias.as_ref().filter(is_biased)?;
        let design = if bias.by_design { " by design" } else { "" };
        let tiles = format!("{} of {} tiles rejected", bias.rejected, bias.tiles);
        let of_image = bias.p.map_or(String::new(), |p| {
            let (z, p) = (format::optional(bias.z), format::number(p));
            format!(", image z = {z} (p = {p})")
        });
        let weighted = bias.weighted_p.map_or(String::new(), |p| {
            format!(", weighted mean p = {}", format::number(p))
        });
        Some(format!("biased{design}: {tiles}{of_image}{weighted}"))
    }

    /// Returns the fault, unless the sampler is meant to have it.
    pub fn failure(&self) -> Option<String> {
        let by_design = self.bias.as_ref().is_some_and(|bias| bias.by_design);
        let finite = self.replicates.iter().all(|r| r.non_finite_pixels == 0);
        self.fault().filter(|_| !(by_design && finite))
    }

    /// Returns a metric's row in the table of figures.
    pub(crate) fn figure(&self, metric: Metric) -> &'static Figure {
        let [_, unbiased, _] = metric.words();
        metric.figure_of(self.metric_id(metric).unwrap_or(unbiased))
    }

    /// Returns the full id of a metric as recorded.
    pub(crate) fn metric_id(&self, metric: Metric) -> Option<&'a str> {
        let errors = self.replicates.iter().flat_map(|r| &r.errors);
        let ids = errors.flat_map(|error| error.metrics.keys());
        let [.., unbiased, plain] = metric.words();
        let id = |prefix| ids.clone().find(|id| id.starts_with(prefix));
        id(unbiased).or_else(|| id(plain)).map(String::as_str)
    }

    /// Returns mean errors by growing spp, over the replicates that have them; computed once all replicates are
    /// there.
    pub(crate) fn mean_errors(&self, metric: Metric) -> Vec<MeanError> {
        let place = &self.means[usize::from(metric == Metric::Rmse)];
        place.get_or_init(|| self.computed_means(metric)).clone()
    }

    fn computed_means(&self, metric: Metric) -> Vec<MeanError> {
        let Some(id) = self.metric_id(metric) else {
            return Vec::new();
        };
        let errors = self.replicates.iter().flat_map(|r| &r.errors);
        let mut spps: Vec<u32> = errors.map(|e| e.spp).collect();
        spps.sort_unstable();
        spps.dedup();
        let mean_at = |spp| {
            let estimate = |without| self.all().mean(id, spp, without);
            let value = estimate(Without::Nothing)?;
            let by_reference = jackknife_interval(value, &self.all().of_reference(id, estimate)?)?;
            let exact = by_reference.low == by_reference.high;
            let sources = self.all().sources(id, estimate)?;
            let error = metric.shown(positive_interval(value, &sources)?);
            let tail = self.all().tail(spp).filter(|_| self.all().have_spread());
            Some(MeanError {
                spp,
                error,
                resolved: by_reference.low > 0.0 || exact && value >= 0.0,
                heavy_tailed: metric == Metric::RelMse
                    && tail.is_some_and(|tail| is_heavy(tail, error)),
            })
        };
        spps.into_iter().filter_map(mean_at).collect()
    }

    /// Returns the highest spp.
    pub(crate) fn highest_spp(&self) -> Option<u32> {
        Some(self.replicates.first()?.errors.last()?.spp)
    }

    /// Returns the figures of [`FURTHER_METRICS`] at this spp: means over replicates.
    pub(crate) fn further(
        &self,
        spp: u32,
    ) -> [(&'static Figure, Option<Interval>); FURTHER_METRICS.len()] {
        let of = |id: &str| -> Vec<f64> {
            let errors = self.replicates.iter().flat_map(|r| &r.errors);
            let errors = errors.filter(|error| error.spp == spp);
            let values = errors.filter_map(|error| error.metrics.get(id).copied());
            values.collect()
        };
        FURTHER_METRICS.map(|(figure, id)| {
            // These are no errors, and may be negative.
            let is_likeness = [&figure::PSNR, &figure::SSIM]
                .map(|f| &f.id)
                .contains(&&figure.id);
            let interval = if is_likeness {
                mean_interval
            } else {
                positive_mean_interval
            };
            (figure, interval(&of(id)))
        })
    }

    /// Returns the mean error at this spp.
    pub fn mean_error_at(&self, metric: Metric, spp: u32) -> Option<MeanError> {
        let mut means = self.mean_errors(metric).into_iter();
        means.find(|mean| mean.spp == spp)
    }

    /// Returns the error interpolated between those at two numbers of samples, at this fraction of the way on
    /// logarithms. `None` unless both are positive, also with any part left out.
    pub(crate) fn log_error(
        &self,
        metric: Metric,
        spps: [u32; 2],
        share: f64,
    ) -> Option<LogFigure> {
        let id = self.metric_id(metric)?;
        let power = if metric == Metric::Rmse { 0.5 } else { 1.0 };
        self.all().log_figure(id, |without| {
            let [a, b] = spps.map(|spp| self.all().mean(id, spp, without));
            let (a, b) = (power * a?.ln(), power * b?.ln());
            // 0 has no logarithm, but is itself.
            Some(if a == b { a } else { a + share * (b - a) })
        })
    }

    /// Returns the samples per pixel at which the error falls to `target`, between the two neighbours where its mean
    /// does: by interpolation on logarithms. `None` where it is above or below at all numbers of samples.
    pub(crate) fn spp_to(&self, metric: Metric, target: f64) -> Option<LogFigure> {
        let id = self.metric_id(metric)?;
        let means = self.mean_errors(metric);
        let means: Vec<&MeanError> = means.iter().filter(|mean| mean.resolved).collect();
        let falls = |pair: &&[&MeanError]| {
            let [a, b] = [0, 1].map(|i| pair[i].error.value);
            a >= target && target >= b && a > b && b > 0.0
        };
        let spps = means.windows(2).find(falls)?;
        let spps = [spps[0].spp, spps[1].spp];
        let target = match metric {
            Metric::RelMse => target,
            Metric::Rmse => target * target,
        };
        self.all().log_figure(id, |without| {
            let [a, b] = spps.map(|spp| self.all().mean(id, spp, without));
            let (a, b) = (a?.ln(), b?.ln());
            let [x, y] = spps.map(|spp| f64::from(spp).ln());
            Some(x + (y - x) * (target.ln() - a) / (b - a))
        })
    }

    /// Returns the slope of log error against log spp, over the spp that every replicate has and the reference
    /// resolves.
    pub fn slope(&self, metric: Metric) -> Option<Interval> {
        let id = self.metric_id(metric)?;
        let everywhere = |spp| self.all().all_have(id, spp);
        let means = self.mean_errors(metric);
        let fitted = means.iter().filter(|m| m.resolved && everywhere(m.spp));
        let spps: Vec<u32> = fitted.map(|mean| mean.spp).collect();
        let estimate = |without| {
            let point = |&spp: &u32| {
                let mean = self.all().mean(id, spp, without)?;
                Some((f64::from(spp), mean))
            };
            let points: Vec<(f64, f64)> = spps.iter().filter_map(point).collect();
            let slope = log_log_fit(&points)?;
            // The root's slope is half of the square's.
            Some(slope * if metric == Metric::Rmse { 0.5 } else { 1.0 })
        };
        let sources = self.all().sources(id, estimate)?;
        jackknife_interval(estimate(Without::Nothing)?, &sources)
    }

    fn all(&self) -> Replicates<'_> {
        Replicates(&self.replicates)
    }
}

impl View<'_> {
    /// Returns `true` if the images of a sampler are, to the bit, those of the same sampler with the program's own kernels: then
    /// it has no error of its own.
    pub(crate) fn is_same_image(&self, sampler: &MeasuredSampler) -> bool {
        if sampler.key.label(axis::KERNELS).is_empty() {
            return false;
        }
        let hashes = |s: &MeasuredSampler| -> Vec<(u32, String)> {
            let images = s.replicates.iter();
            images
                .map(|r| (r.replicate, r.image_hash.clone()))
                .collect()
        };
        let original = sampler.key.clone().with(axis::KERNELS, "");
        let is_known = sampler.replicates.iter().all(|r| !r.image_hash.is_empty());
        let mut samplers = self.samplers.iter();
        is_known && samplers.any(|s| s.key == original && hashes(s) == hashes(sampler))
    }

    /// Returns a metric's row in the table of figures: all samplers have one reference, and so one kind of metric.
    pub(crate) fn figure(&self, metric: Metric) -> &'static Figure {
        let measured = self.samplers.iter();
        let mut figures = measured.filter(|s| s.metric_id(metric).is_some());
        figures
            .next()
            .map_or(metric.figure_of("-unbiased/"), |s| s.figure(metric))
    }

    /// Returns the reason why the errors of this view may not be ranked: the reference is absent, or too noisy for
    /// the least of them.
    pub(crate) fn reference_fault(&self) -> Option<String> {
        let errors = || {
            let of = |s: &MeasuredSampler| s.mean_errors(Metric::Rmse);
            self.samplers.iter().flat_map(of)
        };
        errors().next()?;
        let Some(reference) = self.reference else {
            return Some("the reference has no record".into());
        };
        // A reference file is trusted: nothing is known of its noise.
        if reference.exact.is_some() || reference.file.is_some() {
            return None;
        }
        if let Some(mean) = errors().find(|mean| !mean.resolved) {
            return Some(format!("an error at {} spp is {UNRESOLVED}", mean.spp));
        }
        let squares = errors().map(|mean| mean.error.value.powi(2));
        let least = squares.reduce(f64::min)?;
        let own = reference.mse.unwrap_or(f64::NAN);
        if own == 0.0 {
            // Rounding apart, equal parts are right only of a scene without noise.
            let noisy = least.sqrt() > 1e-4 * reference.mean;
            let reason = "the parts of the reference do not differ, so that its noise is unknown: its \
                          sampler must be one that seeds change";
            return noisy.then(|| reason.into());
        }
        // Samplers are ranked by relMSE; records of old runs know the reference's MSE alone.
        let (share, what) = match reference.relmse {
            None => (own / least, "mean squared error"),
            Some(own) => {
                let of = |s: &MeasuredSampler| s.mean_errors(Metric::RelMse);
                let all = self.samplers.iter().flat_map(of);
                let least = all.map(|mean| mean.error.value).reduce(f64::min)?;
                (own / least, "relMSE")
            }
        };
        // A share that is no number is a fault, too.
        (share.is_nan() || share > REFERENCE_SHARE).then(|| {
            let enough = f64::from(reference.spp) * share / REFERENCE_SHARE;
            format!(
                "the reference has {} % of the least {what}, more than {} %: \
                 `reference.spp = {}` would be enough",
                format::number(100.0 * share),
                100.0 * REFERENCE_SHARE,
                rounded_up(enough)
            )
        })
    }

    /// Returns the highest spp at which every measured sampler has an error.
    pub(crate) fn common_spp(&self) -> Option<u32> {
        let means = self.samplers.iter().map(|s| s.mean_errors(Metric::RelMse));
        let measured = means.filter(|means| !means.is_empty());
        let sets = measured.map(|means| means.iter().map(|mean| mean.spp).collect());
        let sets: Vec<Vec<u32>> = sets.collect();
        let mut spps = sets.first()?.iter().rev();
        spps.find(|spp| sets.iter().all(|set| set.contains(spp)))
            .copied()
    }
}

/// Returns the next number above with two significant digits, which leaves some room.
fn rounded_up(value: f64) -> u64 {
    let unit = 10f64.powf((value.max(1.0).log10().floor() - 1.0).max(0.0));
    ((value / unit).floor() + 1.0) as u64 * unit as u64
}

/// Returns the time per sample per pixel, milliseconds, with its noise: none where it was not measured often enough.
pub(crate) fn log_time(time: &Measured<TimeRecord>) -> Option<LogFigure> {
    let often = time.ms.len() >= LEAST_FOR_MEDIAN;
    let known = time.rounds(FULL_CELLS, &time.ms).filter(|_| often);
    let known = known.map(|known| known.scaled(1.0 / f64::from(time.spp)));
    known.or_else(|| Some(LogFigure::exact(time.ms_per_spp?.value)))
}

/// Returns the position of `seconds` on a curve of growing seconds: the indices of the neighbours, and the fraction
/// of the way between them on logarithms; `None` outside the curve.
pub(crate) fn place_on(curve: &[f64], seconds: f64) -> Option<([usize; 2], f64)> {
    let exact = |x: &f64| (x / seconds - 1.0).abs() < 1e-9;
    if let Some(i) = curve.iter().position(exact) {
        return Some(([i, i], 0.0));
    }
    let i = (curve.windows(2)).position(|pair| pair[0] < seconds && seconds < pair[1])?;
    let share = (seconds / curve[i]).ln() / (curve[i + 1] / curve[i]).ln();
    Some(([i, i + 1], share))
}

#[cfg(test)]
#[path = "samplers_tests.rs"]
mod tests;
