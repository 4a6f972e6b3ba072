//! A figure with its interval, and the noise that determines the interval.

use crate::hypothesis::{student_t_quantile, student_t_two_sided};
use crate::statistics::{ROUNDING, variance};
use serde::{Deserialize, Serialize};

/// Error probability of intervals.
pub(crate) const ALPHA: f64 = 0.05;

/// A figure with its 95 % interval, see [`crate::statistics`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Interval {
    /// The estimate (median for times and rates, mean for errors).
    pub value: f64,
    /// Lower end of the 95 % interval.
    pub low: f64,
    /// Upper end of the 95 % interval.
    pub high: f64,
}

impl From<f64> for Interval {
    fn from(value: f64) -> Self {
        Self::exact(value)
    }
}

impl Interval {
    /// A figure whose interval has no width, because it is exact or its spread is unknown.
    pub fn exact(value: f64) -> Self {
        Self {
            value,
            low: value,
            high: value,
        }
    }

    /// The figure in another unit.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        Self {
            value: factor * self.value,
            low: factor * self.low,
            high: factor * self.high,
        }
    }
}

/// Effect of a source of noise on an estimate, with Student's distribution about the truth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// Variance of the estimate.
    pub variance: f64,
    /// Degrees of freedom of the variance, at least 1.
    pub freedom: f64,
}

impl Spread {
    /// Spread of the mean of samples; `None` for fewer than two.
    pub fn of_mean(samples: &[f64]) -> Option<Self> {
        let n = samples.len() as f64;
        Some(Self {
            variance: variance(samples)? / n,
            freedom: n - 1.0,
        })
    }

    /// Spread from estimates that leave out one of `n` parts each: the delete-one jackknife
    /// (Quenouille 1956, Tukey 1958). `None` for fewer than two.
    pub(crate) fn jackknife(estimates: &[f64]) -> Option<Self> {
        let n = estimates.len() as f64;
        Some(Self::of_mean(estimates)?.times((n - 1.0).powi(2)))
    }

    /// From the distance of an estimate to the end of its 95 % interval.
    pub fn of_half_width(half: f64, freedom: f64) -> Self {
        Self {
            variance: (half / student_t_quantile(ALPHA, freedom)).powi(2),
            freedom,
        }
    }

    /// Scales the variance.
    #[must_use]
    pub fn times(self, factor: f64) -> Self {
        Self {
            variance: factor * self.variance,
            ..self
        }
    }

    /// Combines independent sources: variances add; degrees of freedom are those of Welch and
    /// Satterthwaite. Without sources, the variance is 0.
    pub fn together(sources: &[Self]) -> Self {
        let variance: f64 = sources.iter().map(|s| s.variance).sum();
        // As shares of the total variance, so that tiny variances do not underflow when squared.
        let share = |s: &Self| (s.variance / variance).powi(2) / s.freedom;
        let shares: f64 = sources.iter().map(share).sum();
        Self {
            variance,
            freedom: if shares > 0.0 {
                1.0 / shares
            } else {
                f64::INFINITY
            },
        }
    }

    /// Spread of the difference of two independent estimates: both combined, with at most the
    /// degrees of freedom of the less certain side (Hsu 1938). Two samples may lie close together
    /// by chance; by Welch and Satterthwaite alone, their variance would count little, and the many
    /// degrees of freedom of the other side fully.
    #[must_use]
    pub fn of_difference(a: Self, b: Self) -> Self {
        let both = Self::together(&[a, b]);
        Self {
            freedom: both.freedom.min(a.freedom).min(b.freedom),
            ..both
        }
    }

    /// True if it is no more than rounding of sums of this size.
    pub(crate) fn is_rounding(self, size: f64) -> bool {
        self.variance.sqrt() <= ROUNDING * size
    }

    /// Error bound of the estimate, exceeded with probability at most `chance`.
    pub fn half_width(self, chance: f64) -> f64 {
        student_t_quantile(chance, self.freedom) * self.variance.sqrt()
    }

    /// The 95 % interval of an estimate.
    pub fn interval(self, value: f64) -> Interval {
        let half = self.half_width(ALPHA);
        Interval {
            value,
            low: value - half,
            high: value + half,
        }
    }

    /// Two-sided probability of a difference at least this large if there is none. Differences are
    /// logarithms or fractions, with natural size 1.
    pub fn p(self, gap: f64) -> f64 {
        if gap.abs() <= ROUNDING {
            1.0
        } else if self.is_rounding(gap.abs().max(1.0)) {
            0.0
        } else {
            student_t_two_sided(gap / self.variance.sqrt(), self.freedom)
        }
    }
}
