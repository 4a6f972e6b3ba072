//! The host clock. The crates below runs read it here, so that a port has one place to change.

use std::time::{self, Duration};

/// A moment of a monotonic clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Instant(time::Instant);

impl Instant {
    /// The current moment.
    pub fn now() -> Self {
        Self(time::Instant::now())
    }

    /// Time since that moment.
    pub fn elapsed(&self) -> Duration {
        self.0.elapsed()
    }
}
