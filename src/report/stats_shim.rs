//! Bootstrap intervals and log–log slopes.

use crate::measure::record::Interval;

/// Resamples of every bootstrap.
const RESAMPLES: usize = 1000;

/// Mean with the 95 % percentile bootstrap interval; three NaNs for no samples.
pub fn bootstrap_mean(samples: &[f64]) -> Interval {
    bootstrap(samples, mean)
}

/// Median with the 95 % percentile bootstrap interval; three NaNs for no samples.
pub fn bootstrap_median(samples: &[f64]) -> Interval {
    bootstrap(samples, median)
}

/// Slope of the mean curve on log–log axes (least squares), with the 95 % interval of a bootstrap
/// over replicates. Each curve is one replicate, `(x, y)` with the same x in all; points with x or
/// mean y not positive are skipped. `None` with fewer than two usable points.
pub fn log_log_slope(curves: &[Vec<(f64, f64)>]) -> Option<Interval> {
    let all: Vec<usize> = (0..curves.len()).collect();
    let value = slope_of_mean(curves, &all)?;
    let mut state = Pcg32(7);
    let slopes = (0..RESAMPLES).filter_map(|_| {
        let picked: Vec<usize> = all.iter().map(|_| state.below(all.len())).collect();
        slope_of_mean(curves, &picked)
    });
    Some(percentile_interval(value, slopes.collect()))
}

fn slope_of_mean(curves: &[Vec<(f64, f64)>], picked: &[usize]) -> Option<f64> {
    let points = curves.iter().map(Vec::len).min()?;
    let logs: Vec<(f64, f64)> = (0..points)
        .map(|i| {
            let sum: f64 = picked.iter().map(|&c| curves[c][i].1).sum();
            (curves[picked[0]][i].0, sum / picked.len() as f64)
        })
        .filter(|&(x, y)| x > 0.0 && y > 0.0)
        .map(|(x, y)| (x.ln(), y.ln()))
        .collect();
    if logs.len() < 2 {
        return None;
    }
    let n = logs.len() as f64;
    let mean_x = logs.iter().map(|p| p.0).sum::<f64>() / n;
    let mean_y = logs.iter().map(|p| p.1).sum::<f64>() / n;
    let covariance: f64 = logs.iter().map(|p| (p.0 - mean_x) * (p.1 - mean_y)).sum();
    let variance: f64 = logs.iter().map(|p| (p.0 - mean_x).powi(2)).sum();
    (variance > 0.0).then(|| covariance / variance)
}

fn bootstrap(samples: &[f64], estimator: fn(&[f64]) -> f64) -> Interval {
    let mut state = Pcg32(1);
    let mut resample = vec![0.0; samples.len()];
    let estimates = (0..RESAMPLES).map(|_| {
        resample.fill_with(|| samples[state.below(samples.len())]);
        estimator(&resample)
    });
    percentile_interval(estimator(samples), estimates.collect())
}

fn percentile_interval(value: f64, mut estimates: Vec<f64>) -> Interval {
    estimates.sort_by(f64::total_cmp);
    let at = |share: f64| {
        let index = (share * (estimates.len() as f64 - 1.0)).round() as usize;
        estimates.get(index).copied().unwrap_or(value)
    };
    Interval {
        value,
        low: at(0.025),
        high: at(0.975),
    }
}

fn mean(samples: &[f64]) -> f64 {
    samples.iter().sum::<f64>() / samples.len() as f64
}

fn median(samples: &[f64]) -> f64 {
    let mut sorted = samples.to_vec();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    match sorted.len() {
        0 => f64::NAN,
        n if n % 2 == 1 => sorted[middle],
        _ => (sorted[middle - 1] + sorted[middle]) / 2.0,
    }
}

/// PCG-XSH-RR (O'Neill 2014).
struct Pcg32(u64);

impl Pcg32 {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        let word = ((((self.0 >> 18) ^ self.0) >> 27) as u32).rotate_right((self.0 >> 59) as u32);
        ((u64::from(word) * n as u64) >> 32) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slope_of_a_power_law_is_its_exponent() {
        let curve: Vec<(f64, f64)> = (0..6)
            .map(|i| (2f64.powi(i), 3.0 * 2f64.powi(i).powf(-0.9)))
            .collect();
        let slope = log_log_slope(&[curve]).unwrap();
        assert!((slope.value + 0.9).abs() < 1e-12);
        assert_eq!(slope.low, slope.high);
        assert!(log_log_slope(&[vec![(1.0, 2.0)]]).is_none());
        assert!(log_log_slope(&[]).is_none());
    }

    #[test]
    fn the_interval_of_a_mean_holds_it_and_has_the_right_width() {
        let samples: Vec<f64> = (0..100).map(f64::from).collect();
        let interval = bootstrap_mean(&samples);
        assert_eq!(interval.value, 49.5);
        // 1.96 standard errors: 28.87 / 10 × 1.96 = 5.66 on each side.
        assert!(
            (interval.high - interval.low - 11.3).abs() < 1.5,
            "{interval:?}"
        );
        assert_eq!(bootstrap_median(&[3.0, 1.0, 2.0]).value, 2.0);
    }
}
