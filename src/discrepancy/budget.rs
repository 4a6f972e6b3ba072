//! Time that a measure may take.

use super::DiscrepancyError;
use std::time::{Duration, Instant};

/// A span of time that began when it was made.
#[derive(Debug, Clone, Copy)]
pub struct Budget {
    begin: Instant,
    span: Duration,
}

impl Budget {
    /// A budget of this span that begins now.
    pub fn new(span: Duration) -> Self {
        Self {
            begin: Instant::now(),
            span,
        }
    }

    /// A budget of so many seconds that begins now; negative and NaN count as 0.
    pub fn seconds(seconds: f64) -> Self {
        let limit = Duration::from_secs(u64::MAX / 4);
        let span = Duration::try_from_secs_f64(seconds);
        let otherwise = if seconds > 0.0 { limit } else { Duration::ZERO };
        Self::new(span.unwrap_or(otherwise).min(limit))
    }

    /// The budget that ends when this fraction (0 to 1) of what is left now is over.
    pub(super) fn part(&self, fraction: f64) -> Self {
        Self::new(self.left().mul_f64(fraction))
    }

    /// Time not yet spent.
    pub fn left(&self) -> Duration {
        self.span.saturating_sub(self.begin.elapsed())
    }

    /// Whether all of it is spent.
    pub fn is_spent(&self) -> bool {
        self.left().is_zero()
    }

    /// `OverBudget` once it is spent.
    pub(super) fn check(&self, measure: &'static str) -> Result<(), DiscrepancyError> {
        if self.is_spent() {
            let seconds = self.span.as_secs_f64();
            return Err(DiscrepancyError::OverBudget { measure, seconds });
        }
        Ok(())
    }
}
