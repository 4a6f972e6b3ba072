//! A figure with its interval, and the noise that the interval follows from.

use crate::hypothesis::{student_t_quantile, student_t_two_sided};
use crate::statistics::{ROUNDING, variance};
use serde::{Deserialize, Serialize};

/// Share of intervals that miss the truth.
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
    /// A figure whose interval has no width: it is exact, or nothing is known of its spread.
    pub fn exact(value: f64) -> Self {
        Self {
            value,
            low: value,
            high: value,
        }
    }

    /// The same figure in another unit.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        Self {
            value: factor * self.value,
            low: factor * self.low,
            high: factor * self.high,
        }
    }
}

/// What one source of noise makes of an estimate, which is taken to have Student's distribution about the truth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// Variance of the estimate.
    pub variance: f64,
    /// Degrees of freedom that the variance is known with, at least 1.
    pub freedom: f64,
}

impl Spread {
    /// Of the mean of some samples; fewer than two say nothing.
    pub fn of_mean(samples: &[f64]) -> Option<Self> {
        let n = samples.len() as f64;
        Some(Self {
            variance: variance(samples)? / n,
            freedom: n - 1.0,
        })
    }

    /// From the estimates that leave out one of `n` parts each: the delete-one jackknife (Quenouille 1956,
    /// Tukey 1958). Fewer than two say nothing.
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

    /// With so many times the variance.
    #[must_use]
    pub fn times(self, factor: f64) -> Self {
        Self {
            variance: factor * self.variance,
            ..self
        }
    }

    /// Of independent sources together: variances add, and degrees of freedom are those of Welch and
    /// Satterthwaite. Of none there is no variance.
    pub fn together(sources: &[Self]) -> Self {
        let variance: f64 = sources.iter().map(|s| s.variance).sum();
        // As shares of the whole variance, so that tiny variances do not underflow when squared.
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

    /// Of a difference of two independent estimates: both together, with no more degrees of freedom than the side has
    /// that knows less (Hsu 1938). Two samples may lie close together by chance; by Welch and Satterthwaite alone
    /// their variance then counts for little, and the many degrees of freedom of the other side for all.
    #[must_use]
    pub fn of_difference(a: Self, b: Self) -> Self {
        let both = Self::together(&[a, b]);
        Self {
            freedom: both.freedom.min(a.freedom).min(b.freedom),
            ..both
        }
    }

    /// Whether it is no more than the rounding of sums makes of numbers of this size.
    pub(crate) fn is_rounding(self, size: f64) -> bool {
        self.variance.sqrt() <= ROUNDING * size
    }

    /// What the estimate is off by with probability `chance` at most.
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

    /// Probability of a difference this large or larger in either direction if there is none. It is one of logarithms, or a
    /// part of something, so that 1 is its natural size.
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
