//! The clock of the host. Everything below runs reads it here, so that a port has one place to change.

use std::time::{self, Duration};

/// A moment of a clock that never runs backwards.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Instant(time::Instant);

impl Instant {
    /// The moment of the call.
    pub fn now() -> Self {
        Self(time::Instant::now())
    }

    /// How long it is ago.
    pub fn elapsed(&self) -> Duration {
        self.0.elapsed()
    }
}
