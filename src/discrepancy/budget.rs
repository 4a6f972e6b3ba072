//! The time budget of a measure.

use super::DiscrepancyError;
use std::time::{Duration, Instant};

/// A time span that starts at its creation.
#[derive(Debug, Clone, Copy)]
pub struct Budget {
    begin: Instant,
    span: Duration,
}

impl Budget {
    /// A budget of this span, starting now.
    pub fn new(span: Duration) -> Self {
        Self {
            begin: Instant::now(),
            span,
        }
    }

    /// A budget of this many seconds, starting now; negative and NaN count as 0.
    pub fn seconds(seconds: f64) -> Self {
        let limit = Duration::from_secs(u64::MAX / 4);
        let span = Duration::try_from_secs_f64(seconds);
        let otherwise = if seconds > 0.0 { limit } else { Duration::ZERO };
        Self::new(span.unwrap_or(otherwise).min(limit))
    }

    /// A budget of this fraction (0 to 1) of the time left now.
    pub(super) fn part(&self, fraction: f64) -> Self {
        Self::new(self.left().mul_f64(fraction))
    }

    /// Remaining time.
    pub fn left(&self) -> Duration {
        self.span.saturating_sub(self.begin.elapsed())
    }

    /// True if the time is spent.
    pub fn is_spent(&self) -> bool {
        self.left().is_zero()
    }

    /// Fails with `OverBudget` once the time is spent.
    pub(super) fn check(&self, measure: &'static str) -> Result<(), DiscrepancyError> {
        if self.is_spent() {
            let seconds = self.span.as_secs_f64();
            return Err(DiscrepancyError::OverBudget { measure, seconds });
        }
        Ok(())
    }
}
