//! Statistics of measured samples: location, spread, bootstrap intervals, slopes and Pareto fronts.
//! Tests of hypotheses are in [`super::hypothesis`].
//!
//! A figure that does not exist is `None`, never NaN: every function here answers `None` for an
//! empty slice and for samples that are not all finite.

use super::record::Interval;

/// Resamples behind every bootstrap interval.
pub const BOOTSTRAP_RESAMPLES: usize = 1000;

/// Seed of every bootstrap, so that a report made twice from the same records is the same.
const BOOTSTRAP_SEED: u64 = 0x5EED_0B00;

/// PCG32 (XSH RR 64/32; O'Neill 2014): small, seeded, the same on every machine.
#[derive(Debug, Clone)]
pub struct Pcg32 {
    state: u64,
    increment: u64,
}

impl Pcg32 {
    /// A generator; equal seeds give equal numbers.
    pub fn new(seed: u64) -> Self {
        Self::with_stream(seed, 0)
    }

    /// A generator of one of 2⁶³ independent streams, seeded as in the author's C library.
    pub fn with_stream(seed: u64, stream: u64) -> Self {
        let increment = (stream << 1) | 1;
        let mut generator = Self {
            state: seed.wrapping_add(increment),
            increment,
        };
        generator.next_u32();
        generator
    }

    /// Next 32 random bits.
    pub fn next_u32(&mut self) -> u32 {
        let old = self.state;
        self.state = old
            .wrapping_mul(6364136223846793005)
            .wrapping_add(self.increment);
        let shifted = (((old >> 18) ^ old) >> 27) as u32;
        shifted.rotate_right((old >> 59) as u32)
    }

    /// An index below `n`, `1 ≤ n ≤ 2³²`; its bias of at most `n·2⁻³²` does not matter here.
    pub fn below(&mut self, n: usize) -> usize {
        ((u64::from(self.next_u32()) * n as u64) >> 32) as usize
    }

    /// A number in `[0, 1)` with 32 random bits.
    pub fn uniform(&mut self) -> f64 {
        f64::from(self.next_u32()) / 2f64.powi(32)
    }
}

/// Arithmetic mean.
pub fn mean(samples: &[f64]) -> Option<f64> {
    finite(samples).then(|| raw_mean(samples))
}

/// Median; the mean of the middle two for an even count.
pub fn median(samples: &[f64]) -> Option<f64> {
    finite(samples).then(|| raw_median(samples))
}

/// Median absolute deviation from the median, in the unit of the samples (not scaled to a standard
/// deviation: multiply by 1.4826 for normal samples).
pub fn median_absolute_deviation(samples: &[f64]) -> Option<f64> {
    let centre = median(samples)?;
    let deviations: Vec<f64> = samples.iter().map(|x| (x - centre).abs()).collect();
    median(&deviations)
}

/// Unbiased sample variance (divided by n − 1), two passes; `None` below two samples.
pub fn variance(samples: &[f64]) -> Option<f64> {
    let centre = mean(samples)?;
    let sum: f64 = samples.iter().map(|x| (x - centre).powi(2)).sum();
    (samples.len() > 1).then(|| sum / (samples.len() - 1) as f64)
}

/// `estimator` of the samples with its 95 % percentile-bootstrap interval (Efron 1979),
/// [`BOOTSTRAP_RESAMPLES`] resamples with a fixed seed. The interval of a single sample has no
/// width: nothing is known of its spread.
///
/// `estimator` gets a non-empty slice in no particular order.
pub fn bootstrap_interval(samples: &[f64], estimator: impl Fn(&[f64]) -> f64) -> Option<Interval> {
    if !finite(samples) {
        return None;
    }
    let mut resample = vec![0.0; samples.len()];
    let estimates = resampled(samples.len(), |draw| {
        resample.iter_mut().for_each(|x| *x = samples[draw()]);
        Some(estimator(&resample))
    });
    percentile_interval(estimator(samples), estimates)
}

/// [`mean`] with its interval.
pub fn bootstrap_mean(samples: &[f64]) -> Option<Interval> {
    bootstrap_interval(samples, raw_mean)
}

/// [`median`] with its interval.
pub fn bootstrap_median(samples: &[f64]) -> Option<Interval> {
    bootstrap_interval(samples, raw_median)
}

/// Slope of the least-squares line through (ln x, ln ȳ), where ȳ is the mean over replicates of y at
/// that x, with its 95 % interval by a bootstrap over whole replicates. −0.5 is the slope of an RMSE
/// under plain Monte Carlo.
///
/// Each curve is one replicate as (x, y) pairs. Points where x or y is not a positive finite number
/// are left out. `None` if fewer than two different x remain. A single curve gives an interval of no
/// width.
pub fn log_log_slope(curves: &[Vec<(f64, f64)>]) -> Option<Interval> {
    let all: Vec<&[(f64, f64)]> = curves.iter().map(Vec::as_slice).collect();
    let slope = slope_of_mean_curve(&all)?;
    let mut resample = all.clone();
    let estimates = resampled(all.len(), |draw| {
        resample.iter_mut().for_each(|c| *c = all[draw()]);
        slope_of_mean_curve(&resample)
    });
    percentile_interval(slope, estimates)
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

/// Runs `estimate` [`BOOTSTRAP_RESAMPLES`] times; it draws indices below `n` from its argument.
fn resampled(
    n: usize,
    mut estimate: impl FnMut(&mut dyn FnMut() -> usize) -> Option<f64>,
) -> Vec<f64> {
    let mut generator = Pcg32::new(BOOTSTRAP_SEED);
    (0..BOOTSTRAP_RESAMPLES)
        .filter_map(|_| estimate(&mut || generator.below(n)))
        .collect()
}

/// The 2.5 % and 97.5 % quantiles of the estimates around `value`.
fn percentile_interval(value: f64, mut estimates: Vec<f64>) -> Option<Interval> {
    estimates.retain(|x| x.is_finite());
    estimates.sort_unstable_by(f64::total_cmp);
    let last = estimates.len().checked_sub(1)?;
    let quantile = |p: f64| {
        let position = p * last as f64;
        let (k, fraction) = (position as usize, position.fract());
        estimates[k] + fraction * (estimates[(k + 1).min(last)] - estimates[k])
    };
    value.is_finite().then(|| Interval {
        value,
        // An estimator need not lie inside its own percentile interval; a figure must.
        low: quantile(0.025).min(value),
        high: quantile(0.975).max(value),
    })
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
    (logs.len() > 1 && xx > 0.0).then(|| xy / xx)
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
        assert_eq!(
            median_absolute_deviation(&[1.0, 1.0, 2.0, 2.0, 4.0, 6.0, 9.0]),
            Some(1.0)
        );
    }

    #[test]
    fn samples_that_are_empty_or_not_finite_have_no_statistics() {
        for bad in [&[][..], &[1.0, f64::NAN], &[f64::INFINITY, 2.0]] {
            assert_eq!(mean(bad), None);
            assert_eq!(median(bad), None);
            assert_eq!(variance(bad), None);
            assert_eq!(median_absolute_deviation(bad), None);
            assert_eq!(bootstrap_median(bad), None);
        }
        assert_eq!(variance(&[1.0]), None);
    }

    #[test]
    fn the_generator_gives_the_numbers_of_the_reference_implementation() {
        let mut reference = Pcg32::with_stream(42, 54);
        let first: Vec<u32> = (0..6).map(|_| reference.next_u32()).collect();
        let expected = [
            0xa15c02b7, 0x7b47f409, 0xba1d3330, 0x83d2f293, 0xbfa4784b, 0xcbed606e,
        ];
        assert_eq!(first, expected);
        let mut generator = Pcg32::new(42);
        let uniform: Vec<f64> = (0..10_000).map(|_| generator.uniform()).collect();
        assert!((mean(&uniform).unwrap() - 0.5).abs() < 0.01);
        assert!((variance(&uniform).unwrap() - 1.0 / 12.0).abs() < 0.003);
    }

    #[test]
    fn a_bootstrap_interval_has_the_width_that_theory_gives() {
        let mut generator = Pcg32::new(7);
        let samples: Vec<f64> = (0..400).map(|_| generator.uniform()).collect();
        let interval = bootstrap_mean(&samples).unwrap();
        let theory = 2.0 * 1.96 * (1.0f64 / 12.0 / 400.0).sqrt();
        let width = interval.high - interval.low;
        assert!((width / theory - 1.0).abs() < 0.15, "{width} vs {theory}");
        assert!(interval.low < 0.5 && 0.5 < interval.high, "{interval:?}");
        assert_eq!(bootstrap_mean(&samples), Some(interval), "not repeatable");
        let single = bootstrap_median(&[4.0]).unwrap();
        assert_eq!((single.low, single.value, single.high), (4.0, 4.0, 4.0));
    }

    #[test]
    fn intervals_of_the_mean_cover_the_truth_about_as_often_as_promised() {
        let mut generator = Pcg32::new(11);
        let trials = 300;
        let covered = (0..trials)
            .filter(|_| {
                let samples: Vec<f64> = (0..30).map(|_| generator.uniform()).collect();
                let interval = bootstrap_mean(&samples).unwrap();
                interval.low <= 0.5 && 0.5 <= interval.high
            })
            .count();
        let fraction = covered as f64 / f64::from(trials);
        assert!((0.88..0.99).contains(&fraction), "{fraction}");
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
            (0.0, 3.0),
        ];
        let slope = log_log_slope(&[curve]).unwrap();
        assert!((slope.value + 1.0).abs() < 1e-12);
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
