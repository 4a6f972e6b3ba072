//! Growth of times with the number of elements: n or n log n.
//!
//! Both models have two constants, t = a + b·n and t = a + b·n·log₂ n, fitted by least squares of
//! relative residuals, since times span orders of magnitude. With equally many constants, the
//! difference of Akaike's criteria, with or without the correction for few points, is m·ln(R₁/R₂),
//! where R are the sums of squares over m sizes (Burnham and Anderson, "Model selection and
//! multimodel inference", 2002, section 2.4). It is computed per round of measurements, so its
//! spread is known, and a model is named only if the whole interval supports it.

use crate::interval::Interval;
use crate::statistics::{LEAST_FOR_MEDIAN, ROUNDING, median, median_interval};

/// Minimum number of sizes to distinguish two models of two constants.
pub(crate) const LEAST_SIZES: usize = 5;
/// Criteria closer than this support both models (Burnham and Anderson 2002, section 2.6).
const NO_DIFFERENCE: f64 = 2.0;

/// A model of growth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Model {
    /// t = a + b·n.
    Linear,
    /// t = a + b·n·log₂ n.
    Linearithmic,
}

impl Model {
    /// Name for texts.
    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "n",
            Self::Linearithmic => "n log n",
        }
    }

    fn term(self, n: f64) -> f64 {
        match self {
            Self::Linear => n,
            Self::Linearithmic => n * n.log2(),
        }
    }

    /// Root mean square of the relative residuals of the best fit to (n, t); `None` for fewer than
    /// `LEAST_SIZES` points or non-positive ones.
    pub fn residual(self, points: &[(f64, f64)]) -> Option<f64> {
        let usable = |p: &(f64, f64)| p.0 > 0.0 && p.1 > 0.0 && p.0.is_finite() && p.1.is_finite();
        if points.len() < LEAST_SIZES || !points.iter().all(usable) {
            return None;
        }
        // Of a/t + b·x/t = 1 for all points.
        let rows = || points.iter().map(|(n, t)| (1.0 / t, self.term(*n) / t));
        let sum = |term: fn((f64, f64)) -> f64| rows().map(term).sum::<f64>();
        let (aa, ab, bb) = (sum(|r| r.0 * r.0), sum(|r| r.0 * r.1), sum(|r| r.1 * r.1));
        let (a1, b1) = (sum(|r| r.0), sum(|r| r.1));
        let det = aa * bb - ab * ab;
        if det <= 0.0 {
            return None;
        }
        let (a, b) = ((a1 * bb - b1 * ab) / det, (b1 * aa - a1 * ab) / det);
        let squares = rows().map(|(x, y)| (a * x + b * y - 1.0).powi(2));
        Some((squares.sum::<f64>() / points.len() as f64).sqrt())
    }
}

/// Comparison of the two models.
#[derive(Debug, Clone, PartialEq)]
pub struct Growth {
    /// Median over rounds of the relative residuals of t = a + b·n.
    pub linear: f64,
    /// Median over rounds of the relative residuals of t = a + b·n·log₂ n.
    pub linearithmic: f64,
    /// Criterion of n minus that of n log n, positive if n log n fits better, over rounds.
    pub difference: Interval,
    /// The model supported by the interval.
    pub better: Option<Model>,
}

/// Compares the models on several rounds of times, each a curve of (n, t).
pub fn growth(rounds: &[Vec<(f64, f64)>]) -> Option<Growth> {
    let of = |model: Model| -> Option<Vec<f64>> {
        rounds.iter().map(|round| model.residual(round)).collect()
    };
    let (linear, linearithmic) = (of(Model::Linear)?, of(Model::Linearithmic)?);
    let difference = |((a, b), round): ((&f64, &f64), &Vec<(f64, f64)>)| {
        // Residuals at rounding level are equally good.
        2.0 * round.len() as f64 * (a.max(ROUNDING) / b.max(ROUNDING)).ln()
    };
    let pairs = linear.iter().zip(&linearithmic).zip(rounds);
    let interval = median_interval(&pairs.map(difference).collect::<Vec<_>>())?;
    let better = match interval {
        _ if rounds.len() < LEAST_FOR_MEDIAN => None,
        Interval { low, .. } if low > NO_DIFFERENCE => Some(Model::Linearithmic),
        Interval { high, .. } if high < -NO_DIFFERENCE => Some(Model::Linear),
        _ => None,
    };
    Some(Growth {
        linear: median(&linear)?,
        linearithmic: median(&linearithmic)?,
        difference: interval,
        better,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use raystone_core::random::Pcg32;

    /// Rounds of times at 2^14 … 2^22 elements, each perturbed by up to `noise`.
    fn rounds(count: usize, noise: f64, time: impl Fn(f64) -> f64) -> Vec<Vec<(f64, f64)>> {
        let mut random = Pcg32::new(3);
        let mut round = || {
            let sizes = (14..=22).map(|k| f64::from(1 << k));
            sizes
                .map(|n| (n, time(n) * (1.0 + noise * random.signed())))
                .collect()
        };
        (0..count).map(|_| round()).collect()
    }

    #[test]
    fn each_model_is_named_for_what_it_made() {
        for noise in [0.0, 0.02] {
            let linear = growth(&rounds(9, noise, |n| 0.3 + 1e-6 * n)).unwrap();
            assert_eq!(linear.better, Some(Model::Linear), "{linear:?}");
            let log = growth(&rounds(9, noise, |n| 0.3 + 1e-7 * n * n.log2())).unwrap();
            assert_eq!(log.better, Some(Model::Linearithmic), "{log:?}");
            assert!(log.difference.low > 0.0 && linear.difference.high < 0.0);
            assert!(linear.linear < linear.linearithmic);
        }
    }

    #[test]
    fn nothing_is_named_in_noise_or_of_few_rounds_or_sizes() {
        let noisy = growth(&rounds(9, 0.6, |n| 1e-6 * n)).unwrap();
        assert_eq!(noisy.better, None, "{noisy:?}");
        let few = growth(&rounds(5, 0.0, |n| 1e-6 * n)).unwrap();
        assert_eq!(few.better, None);
        let mut short = rounds(9, 0.0, |n| 1e-6 * n);
        short
            .iter_mut()
            .for_each(|round| round.truncate(LEAST_SIZES - 1));
        assert_eq!(growth(&short), None);
        assert_eq!(growth(&rounds(9, 0.0, |_| 0.0)), None);
    }
}
