//! Statistics of measured samples: location, spread, intervals, slopes and Pareto fronts.
//! Tests of hypotheses are in [`super::hypothesis`].
//!
//! A figure that does not exist is `None`, never NaN: every function here answers `None` for an
//! empty slice and for samples that are not all finite. Intervals are those of Student's t and of
//! order statistics, because replicates are few: of eight samples a percentile bootstrap covers the
//! mean in 89 % of all cases and not in 95 %.

use super::hypothesis::student_t_quantile;
use super::record::Interval;
pub use crate::random::Pcg32;

/// Share of intervals that miss the truth.
const ALPHA: f64 = 0.05;

/// From so many samples on there is a 95 % interval of a median: the range of fewer covers it in
/// 2^(1−n) of all cases less than always, which is 94 % for five.
pub const LEAST_FOR_MEDIAN: usize = 6;

/// A line through fewer points has no residuals that could speak against it.
pub const LEAST_FOR_SLOPE: usize = 3;

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

/// 95 % interval of an estimate with several independent sources of noise. Each source gives the
/// estimates that leave out one of its `n` parts (the delete-one jackknife, Quenouille 1956, Tukey
/// 1958); variances add, and Student's t has the degrees of freedom of Welch and Satterthwaite. Noise
/// that two sources only make together counts for both, so the interval is rather too wide.
///
/// A source of fewer than two estimates says nothing; without any the interval has no width. `None`
/// if something is not finite.
pub fn jackknife_interval(value: f64, sources: &[Vec<f64>]) -> Option<Interval> {
    let spread = |estimates: &Vec<f64>| {
        let n = estimates.len() as f64;
        Some((variance(estimates)? * (n - 1.0).powi(2) / n, n - 1.0))
    };
    if !value.is_finite() || !sources.iter().flatten().all(|x| x.is_finite()) {
        return None;
    }
    let spreads: Vec<(f64, f64)> = sources.iter().filter_map(spread).collect();
    let whole: f64 = spreads.iter().map(|s| s.0).sum();
    // Estimates that differ by the rounding of their sums are equal.
    if whole.sqrt() <= 4.0 * f64::EPSILON * value.abs() {
        return Some(Interval::exact(value));
    }
    // As shares of the whole variance, so that tiny variances do not underflow when squared.
    let shares = spreads
        .iter()
        .map(|(v, freedom)| (v / whole).powi(2) / freedom);
    let half = student_t_quantile(ALPHA, 1.0 / shares.sum::<f64>()) * whole.sqrt();
    Some(Interval {
        value,
        low: value - half,
        high: value + half,
    })
}

/// The samples without the first, without the second, …: what [`jackknife_interval`] is made from.
/// Nothing for a single sample.
pub fn leave_one_out<T: Clone>(samples: &[T]) -> impl Iterator<Item = Vec<T>> {
    let count = if samples.len() > 1 { samples.len() } else { 0 };
    (0..count).map(|left_out| [&samples[..left_out], &samples[left_out + 1..]].concat())
}

/// `estimator` of the samples with its 95 % interval by the jackknife; of one sample without width.
fn interval_of(samples: &[f64], estimator: fn(&[f64]) -> f64) -> Option<Interval> {
    let estimates = leave_one_out(samples).map(|rest| estimator(&rest));
    finite(samples).then(|| jackknife_interval(estimator(samples), &[estimates.collect()]))?
}

/// [`mean`] with its 95 % interval, which is Student's; the interval of one sample has no width.
pub fn mean_interval(samples: &[f64]) -> Option<Interval> {
    interval_of(samples, raw_mean)
}

/// Root of the mean of squares with its 95 % interval, not below 0; of one square without width.
pub fn root_mean_interval(squares: &[f64]) -> Option<Interval> {
    let interval = interval_of(squares, |squares| raw_mean(squares).sqrt())?;
    Some(Interval {
        low: interval.low.max(0.0),
        ..interval
    })
}

/// [`median`] with the 95 % interval of its order statistics, between two of which it interpolates
/// (Hettmansperger and Sheather 1986); nothing is assumed of the distribution but that it is
/// continuous. Of fewer than [`LEAST_FOR_MEDIAN`] samples it is their range, which covers less.
pub fn median_interval(samples: &[f64]) -> Option<Interval> {
    let value = median(samples)?;
    let mut sorted = samples.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let n = sorted.len();
    // Coverage of the interval from the k-th least to the k-th greatest: 1 − 2 P(X < k), where X is
    // binomial with n throws of a coin.
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

/// Slope of the least-squares line through (ln x, ln ȳ), where ȳ is the mean over replicates of y at
/// that x, with its 95 % interval by a jackknife over whole replicates. −0.5 is the slope of an RMSE
/// under plain Monte Carlo.
///
/// Each curve is one replicate as (x, y) pairs. Points where x or y is not a positive finite number
/// are left out. `None` if fewer than [`LEAST_FOR_SLOPE`] different x remain. A single curve gives an
/// interval of no width.
pub fn log_log_slope(curves: &[Vec<(f64, f64)>]) -> Option<Interval> {
    let all: Vec<&[(f64, f64)]> = curves.iter().map(Vec::as_slice).collect();
    let slope = slope_of_mean_curve(&all)?;
    let estimates: Option<Vec<f64>> = leave_one_out(&all)
        .map(|rest| slope_of_mean_curve(&rest))
        .collect();
    jackknife_interval(slope, &[estimates?])
}

/// Indices of the points that no other point beats, smaller being better in both coordinates, by
/// increasing first coordinate. Equal points on the front are all kept; points with a NaN never are.
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

fn slope_of_mean_curve(curves: &[&[(f64, f64)]]) -> Option<f64> {
    let usable = |v: f64| v.is_finite() && v > 0.0;
    let mut points: Vec<(f64, f64)> = curves.iter().flat_map(|c| c.iter().copied()).collect();
    points.retain(|p| usable(p.0) && usable(p.1));
    points.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let logs: Vec<(f64, f64)> = points
        .chunk_by(|a, b| a.0 == b.0)
        .map(|same_x| {
            let sum: f64 = same_x.iter().map(|p| p.1).sum();
            (same_x[0].0.ln(), (sum / same_x.len() as f64).ln())
        })
        .collect();
    let n = logs.len() as f64;
    let mean_x = logs.iter().map(|p| p.0).sum::<f64>() / n;
    let mean_y = logs.iter().map(|p| p.1).sum::<f64>() / n;
    let xx: f64 = logs.iter().map(|p| (p.0 - mean_x).powi(2)).sum();
    let xy: f64 = logs.iter().map(|p| (p.0 - mean_x) * (p.1 - mean_y)).sum();
    (logs.len() >= LEAST_FOR_SLOPE && xx > 0.0).then(|| xy / xx)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn median_mean_and_spread_of_known_samples() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), Some(2.5));
        assert_eq!(mean(&[1.0, 2.0, 6.0]), Some(3.0));
        assert_eq!(variance(&[1.0, 2.0, 6.0]), Some(7.0));
    }

    #[test]
    fn samples_that_are_empty_or_not_finite_have_no_statistics() {
        for bad in [&[][..], &[1.0, f64::NAN], &[f64::INFINITY, 2.0]] {
            assert_eq!(mean(bad), None);
            assert_eq!(median(bad), None);
            assert_eq!(variance(bad), None);
            assert_eq!(median_interval(bad), None);
            assert_eq!(mean_interval(bad), None);
        }
        assert_eq!(variance(&[1.0]), None);
    }

    /// About normal, mean 0, variance 1.
    fn normal(generator: &mut Pcg32) -> f64 {
        (0..12).map(|_| generator.uniform()).sum::<f64>() - 6.0
    }

    /// Share of 2,000 trials whose interval holds `truth`.
    fn coverage(truth: f64, mut trial: impl FnMut(&mut Pcg32) -> Interval) -> f64 {
        let mut generator = Pcg32::new(11);
        let covers = |i: Interval| i.low <= truth && truth <= i.high;
        let covered = (0..2000).filter(|_| covers(trial(&mut generator))).count();
        covered as f64 / 2000.0
    }

    #[track_caller]
    fn assert_95(share: f64) {
        assert!((0.93..=0.97).contains(&share), "{share} of the intervals");
    }

    #[test]
    fn the_interval_of_a_mean_is_students() {
        let interval = mean_interval(&[1.0, 2.0, 6.0]).unwrap();
        // t of 2 degrees of freedom at 97.5 % is 4.302653; variance 7.
        let half = 4.302652729911275 * (7.0f64 / 3.0).sqrt();
        assert_eq!(interval.value, 3.0);
        assert!((interval.high - 3.0 - half).abs() < 1e-9, "{interval:?}");
        assert!((3.0 - interval.low - half).abs() < 1e-9, "{interval:?}");
        let single = mean_interval(&[4.0]).unwrap();
        assert_eq!((single.low, single.value, single.high), (4.0, 4.0, 4.0));
    }

    #[test]
    fn intervals_of_means_cover_the_truth_as_often_as_promised() {
        for n in [2, 4, 8, 30] {
            assert_95(coverage(5.0, |g| {
                let samples: Vec<f64> = (0..n).map(|_| 5.0 + normal(g)).collect();
                mean_interval(&samples).unwrap()
            }));
        }
    }

    #[test]
    fn intervals_of_medians_cover_the_truth_as_often_as_promised() {
        // Times have a tail on one side: ln 2 is the median of −ln u.
        for n in [6, 7, 9, 12, 31] {
            assert_95(coverage(2.0f64.ln(), |g| {
                let samples: Vec<f64> = (0..n).map(|_| -(1.0 - g.uniform()).ln()).collect();
                median_interval(&samples).unwrap()
            }));
        }
        let few = median_interval(&[4.0, 1.0, 2.0]).unwrap();
        assert_eq!((few.low, few.value, few.high), (1.0, 2.0, 4.0));
        let same = median_interval(&[3.0; 9]).unwrap();
        assert_eq!((same.low, same.value, same.high), (3.0, 3.0, 3.0));
    }

    #[test]
    fn intervals_of_slopes_cover_the_truth_as_often_as_promised() {
        assert_95(coverage(-1.0, |g| {
            let curve = |_| -> Vec<(f64, f64)> {
                let y = |x: f64, noise: f64| (x, (1.0 + 0.1 * noise) / x);
                (0..5).map(|k| y(2f64.powi(k), normal(g))).collect()
            };
            let curves: Vec<_> = (0..8).map(curve).collect();
            log_log_slope(&curves).unwrap()
        }));
    }

    #[test]
    fn noise_of_two_sources_adds_up() {
        // A mean of eight, less a mean of four that is noisier.
        assert_95(coverage(0.0, |g| {
            let a: Vec<f64> = (0..8).map(|_| normal(g)).collect();
            let b: Vec<f64> = (0..4).map(|_| 2.0 * normal(g)).collect();
            let value = raw_mean(&a) - raw_mean(&b);
            let without_a = leave_one_out(&a).map(|rest| raw_mean(&rest) - raw_mean(&b));
            let without_b = leave_one_out(&b).map(|rest| raw_mean(&a) - raw_mean(&rest));
            jackknife_interval(value, &[without_a.collect(), without_b.collect()]).unwrap()
        }));
        let exact = jackknife_interval(2.0, &[vec![], vec![2.0, 2.0]]).unwrap();
        assert_eq!((exact.low, exact.value, exact.high), (2.0, 2.0, 2.0));
        assert_eq!(jackknife_interval(2.0, &[vec![1.0, f64::NAN]]), None);
    }

    #[test]
    fn a_root_of_a_mean_of_squares_has_an_interval_that_is_not_negative() {
        let interval = root_mean_interval(&[0.0, 0.0, 4.0, 0.0]).unwrap();
        assert_eq!((interval.low, interval.value), (0.0, 1.0));
        let share = coverage(1.0, |g| {
            let squares: Vec<f64> = (0..16).map(|_| normal(g).powi(2)).collect();
            root_mean_interval(&squares).unwrap()
        });
        // Squares are skewed: somewhat less than 95 %.
        assert!((0.91..=0.97).contains(&share), "{share}");
    }

    #[test]
    fn the_slope_of_a_power_law_is_its_exponent() {
        let curve = |factor: f64| -> Vec<(f64, f64)> {
            (0..6)
                .map(|k| 2f64.powi(k))
                .map(|x| (x, factor * x.powf(-0.75)))
                .collect()
        };
        let slope = log_log_slope(&[curve(1.0), curve(2.0), curve(5.0)]).unwrap();
        assert!((slope.value + 0.75).abs() < 1e-12);
        assert!(slope.high - slope.low < 1e-12);
        let mut bent = curve(1.0);
        bent[5].1 *= 3.0;
        let slope = log_log_slope(&[curve(1.0), bent]).unwrap();
        assert!(
            slope.value > -0.74 && slope.high - slope.low > 0.05,
            "{slope:?}"
        );
    }

    #[test]
    fn points_that_have_no_logarithm_are_left_out_of_a_slope() {
        let curve = vec![
            (1.0, 1.0),
            (2.0, 0.0),
            (4.0, 0.25),
            (8.0, f64::NAN),
            (16.0, 0.0625),
            (0.0, 3.0),
        ];
        let slope = log_log_slope(std::slice::from_ref(&curve)).unwrap();
        assert!((slope.value + 1.0).abs() < 1e-12);
        let line_through_two = curve[..4].to_vec();
        assert_eq!(log_log_slope(&[line_through_two]), None);
        assert_eq!(log_log_slope(&[]), None);
        assert_eq!(log_log_slope(&[vec![(2.0, 1.0), (2.0, 3.0)]]), None);
    }

    #[test]
    fn the_pareto_front_has_only_points_that_nothing_beats() {
        let points = [
            (3.0, 1.0),
            (1.0, 3.0),
            (2.0, 2.0),
            (2.0, 3.0), // beaten by (2, 2)
            (3.0, 1.0), // equal to the first: kept
            (4.0, 1.0), // beaten by (3, 1)
            (0.5, f64::NAN),
        ];
        assert_eq!(pareto_front(&points), [1, 2, 0, 4]);
        assert!(pareto_front(&[]).is_empty());
    }
}
