//! The host clock. The crates below runs read it here, so that a port has one place to change.

#[cfg(not(target_family = "wasm"))]
use std::time::{self, Duration};
#[cfg(target_family = "wasm")]
use web_time::{self as time, Duration};

/// A moment of a monotonic clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Instant(time::Instant);

impl Instant {
    /// The current moment.
    pub fn now() -> Self {
        Self(time::Instant::now())
    }

    /// Seconds since 1970-01-01 UTC; 0 where the system's clock stands before.
    pub fn unix_s() -> u64 {
        let now = time::SystemTime::now().duration_since(time::UNIX_EPOCH);
        now.map_or(0, |since| since.as_secs())
    }

    /// Time since that moment.
    pub fn elapsed(&self) -> Duration {
        self.0.elapsed()
    }
}
