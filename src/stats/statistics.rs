//! Statistics of samples: location, spread, intervals, slopes, Pareto fronts; see also
//! [`crate::hypothesis`].
//!
//! An undefined figure is `None`, never NaN: every function here returns `None` for an empty slice
//! or non-finite samples. Intervals use Student's t and order statistics, because replicates are
//! few: for eight samples, a percentile bootstrap covers the mean in 89 % of cases instead of 95 %.
//! Positive figures use logarithms, since they are skewed: for four samples of χ² with two degrees
//! of freedom, Student's interval covers the mean in 88 % of cases, that on logarithms in 94 %. No
//! interval covers what samples do not show: if one image in ten has a firefly that outweighs all
//! else, four images contain one in a third of cases.

use crate::interval::{ALPHA, Interval, Spread};

/// Minimum sample size for a 95 % interval of a median: the range of n samples covers it with
/// probability 1 − 2^(1−n), 94 % for five.
pub const LEAST_FOR_MEDIAN: usize = 6;

/// Minimum points for a slope; a line through fewer has no residuals.
pub(crate) const LEAST_FOR_SLOPE: usize = 3;

/// Relative difference attributed to rounding alone. Sums of 4,000 f64 numbers err by less, and no
/// measured noise is so small: radiance has 24 bits, and times up to ten seconds are whole
/// nanoseconds.
pub const ROUNDING: f64 = 1e-12;

/// Arithmetic mean.
pub fn mean(samples: &[f64]) -> Option<f64> {
    finite(samples).then(|| raw_mean(samples))
}

/// Median; the mean of the middle two for an even count.
pub fn median(samples: &[f64]) -> Option<f64> {
    finite(samples).then(|| raw_median(samples))
}

/// Unbiased sample variance (divided by n − 1), two passes; `None` below two samples.
pub fn variance(samples: &[f64]) -> Option<f64> {
    let centre = mean(samples)?;
    let sum: f64 = samples.iter().map(|x| (x - centre).powi(2)).sum();
    (samples.len() > 1).then(|| sum / (samples.len() - 1) as f64)
}

/// 95 % interval of an estimate with several independent sources of noise. Each source consists of
/// the estimates that leave out one of its parts, see `jackknife` and [`Spread::together`]. Noise
/// from the interaction of two sources counts for both, so the interval is rather too wide.
///
/// Sources of fewer than two estimates are ignored; without any, the width is 0. `None` if not
/// finite.
pub fn jackknife_interval(value: f64, sources: &[Vec<f64>]) -> Option<Interval> {
    if !value.is_finite() || !sources.iter().flatten().all(|x| x.is_finite()) {
        return None;
    }
    let spreads: Vec<Spread> = sources
        .iter()
        .filter_map(|s| Spread::jackknife(s))
        .collect();
    let whole = Spread::together(&spreads);
    // Differences within the rounding of the sums count as equal.
    if whole.is_rounding(value.abs()) {
        return Some(Interval::exact(value));
    }
    Some(whole.interval(value))
}

/// [`jackknife_interval`] of a positive figure, on logarithms: symmetric in ratios, never negative,
/// and with better coverage of right-skewed figures. If the value or an estimate is not positive,
/// it falls back to the plain interval.
pub fn positive_interval(value: f64, sources: &[Vec<f64>]) -> Option<Interval> {
    let positive = |x: &f64| *x > 0.0;
    if !positive(&value) || !sources.iter().flatten().all(positive) {
        return jackknife_interval(value, sources);
    }
    let log = |estimates: &Vec<f64>| estimates.iter().map(|x| x.ln()).collect();
    let logs: Vec<Vec<f64>> = sources.iter().map(log).collect();
    let interval = jackknife_interval(value.ln(), &logs)?;
    // The exponential of a logarithm may differ in the last digit.
    let end = |log: f64| {
        if log == interval.value {
            value
        } else {
            log.exp()
        }
    };
    Some(Interval {
        value,
        low: end(interval.low),
        high: end(interval.high),
    })
}

/// The samples without the first, the second, …, for [`jackknife_interval`]; empty for one.
pub fn leave_one_out<T: Clone>(samples: &[T]) -> impl Iterator<Item = Vec<T>> {
    let count = if samples.len() > 1 { samples.len() } else { 0 };
    (0..count).map(|left_out| [&samples[..left_out], &samples[left_out + 1..]].concat())
}

/// `estimator` of the samples with its 95 % jackknife interval; zero width for one sample.
fn interval_of(samples: &[f64], estimator: fn(&[f64]) -> f64) -> Option<Interval> {
    let estimates = leave_one_out(samples).map(|rest| estimator(&rest));
    finite(samples).then(|| jackknife_interval(estimator(samples), &[estimates.collect()]))?
}

/// [`mean`] with its 95 % Student interval; zero width for one sample.
pub fn mean_interval(samples: &[f64]) -> Option<Interval> {
    interval_of(samples, raw_mean)
}

/// [`mean`] of positive samples with its 95 % [`positive_interval`]; zero width for one sample.
pub fn positive_mean_interval(samples: &[f64]) -> Option<Interval> {
    let estimates = leave_one_out(samples).map(|rest| raw_mean(&rest)).collect();
    finite(samples).then(|| positive_interval(raw_mean(samples), &[estimates]))?
}

/// Root mean square with its 95 % [`positive_interval`]; zero width for one square.
pub fn root_mean_interval(squares: &[f64]) -> Option<Interval> {
    let root = |squares: &[f64]| raw_mean(squares).sqrt();
    let estimates = leave_one_out(squares).map(|rest| root(&rest)).collect();
    let interval = finite(squares).then(|| positive_interval(root(squares), &[estimates]))??;
    Some(Interval {
        low: interval.low.max(0.0),
        ..interval
    })
}

/// [`median`] with the 95 % interval of its order statistics, interpolated (Hettmansperger and
/// Sheather 1986); assumes only a continuous distribution. Below [`LEAST_FOR_MEDIAN`] samples it is
/// their range, which covers less.
pub fn median_interval(samples: &[f64]) -> Option<Interval> {
    let value = median(samples)?;
    let mut sorted = samples.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let n = sorted.len();
    // Coverage of the interval from the k-th smallest to the k-th largest: 1 − 2 P(X < k), where X
    // is binomial with n coin tosses.
    let mut log_chance = -(n as f64) * std::f64::consts::LN_2;
    let mut coverage = 1.0 - 2.0 * log_chance.exp();
    let (mut k, mut share) = (1, 0.0);
    while coverage >= 1.0 - ALPHA {
        log_chance += ((n - k + 1) as f64 / k as f64).ln();
        let next = coverage - 2.0 * log_chance.exp();
        if next < 1.0 - ALPHA {
            let part = (coverage - (1.0 - ALPHA)) / (coverage - next);
            share = (n - k) as f64 * part / (k as f64 + (n as f64 - 2.0 * k as f64) * part);
            break;
        }
        (coverage, k) = (next, k + 1);
    }
    let between = |outer: f64, inner: f64| outer + share * (inner - outer);
    Some(Interval {
        value,
        low: between(sorted[k - 1], sorted[k.min(n - 1)]),
        high: between(sorted[n - k], sorted[(n - k).saturating_sub(1)]),
    })
}

/// Slope of the least-squares line through (ln x, ln ȳ), where ȳ is the mean over replicates of y
/// at x, with its 95 % interval from a jackknife over whole replicates. Plain Monte Carlo RMSE has
/// slope −0.5.
///
/// Each curve is one replicate as (x, y) pairs. Points where x or y is not positive and finite are
/// ignored. `None` below `LEAST_FOR_SLOPE` different x. A single curve gives zero width.
pub fn log_log_slope(curves: &[Vec<(f64, f64)>]) -> Option<Interval> {
    let all: Vec<&[(f64, f64)]> = curves.iter().map(Vec::as_slice).collect();
    let slope = slope_of_mean_curve(&all)?;
    let estimates: Option<Vec<f64>> = leave_one_out(&all)
        .map(|rest| slope_of_mean_curve(&rest))
        .collect();
    jackknife_interval(slope, &[estimates?])
}

/// Rank correlation τ-b of pairs (Kendall 1945), which handles ties: 1 for the same order, −1 for
/// the reverse. `None` below two pairs, or if one of both is constant.
pub fn kendall_tau(pairs: &[[f64; 2]]) -> Option<f64> {
    if !finite(&pairs.concat()) {
        return None;
    }
    let (mut sum, mut distinct) = (0, [0_i64; 2]);
    for (i, a) in pairs.iter().enumerate() {
        for b in &pairs[..i] {
            let signs = [0, 1].map(|k| a[k].total_cmp(&b[k]) as i64);
            sum += signs[0] * signs[1];
            distinct = [0, 1].map(|k| distinct[k] + signs[k].abs());
        }
    }
    let [x, y] = distinct.map(|n| n as f64);
    (x > 0.0 && y > 0.0).then(|| sum as f64 / (x * y).sqrt())
}

/// Indices of the non-dominated points, smaller being better in both coordinates, by increasing
/// first coordinate. Includes equal points on the front; never points with a NaN.
pub fn pareto_front(points: &[(f64, f64)]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..points.len())
        .filter(|&i| !points[i].0.is_nan() && !points[i].1.is_nan())
        .collect();
    order.sort_by(|&i, &j| {
        let (a, b) = (points[i], points[j]);
        a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
    });
    let mut front: Vec<usize> = Vec::new();
    for i in order {
        let joins = front
            .last()
            .is_none_or(|&last| points[i].1 < points[last].1 || points[i] == points[last]);
        if joins {
            front.push(i);
        }
    }
    front
}

fn finite(samples: &[f64]) -> bool {
    !samples.is_empty() && samples.iter().all(|x| x.is_finite())
}

fn raw_mean(samples: &[f64]) -> f64 {
    samples.iter().sum::<f64>() / samples.len() as f64
}

fn raw_median(samples: &[f64]) -> f64 {
    let mut sorted = samples.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    match sorted.len() % 2 {
        1 => sorted[middle],
        _ => 0.5 * (sorted[middle - 1] + sorted[middle]),
    }
}

/// Slope of the least-squares line through (ln x, ln y), as in [`log_log_slope`], without an interval.
pub fn log_log_fit(points: &[(f64, f64)]) -> Option<f64> {
    slope_of_mean_curve(&[points])
}

/// Weights of each ln y in the slope of the least-squares line through (ln x, ln y): the slope is
/// the weighted sum. `None` unless all x are positive and two of them differ.
pub(crate) fn slope_weights(x: &[f64]) -> Option<Vec<f64>> {
    let logs: Vec<f64> = x.iter().map(|x| x.ln()).collect();
    let centre = mean(&logs)?;
    let square: f64 = logs.iter().map(|x| (x - centre).powi(2)).sum();
    (square > 0.0).then(|| logs.iter().map(|x| (x - centre) / square).collect())
}

fn slope_of_mean_curve(curves: &[&[(f64, f64)]]) -> Option<f64> {
    let usable = |v: f64| v.is_finite() && v > 0.0;
    let mut points: Vec<(f64, f64)> = curves.iter().flat_map(|c| c.iter().copied()).collect();
    points.retain(|p| usable(p.0) && usable(p.1));
    points.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let means = points.chunk_by(|a, b| a.0 == b.0).map(|same_x| {
        let sum: f64 = same_x.iter().map(|p| p.1).sum();
        (same_x[0].0, sum / same_x.len() as f64)
    });
    let (x, y): (Vec<f64>, Vec<f64>) = means.unzip();
    let weights = slope_weights(&x).filter(|_| x.len() >= LEAST_FOR_SLOPE)?;
    Some(
        weights
            .iter()
            .zip(y)
            .map(|(weight, y)| weight * y.ln())
            .sum(),
    )
}
