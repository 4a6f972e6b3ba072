//! What changes and steps led to, in words.

use raystone_core::clock::Instant;
use std::fmt;

/// What was done for a change of the screen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Work {
    /// A scene was read, and uploaded.
    Loaded,
    /// A structure was built, validated and uploaded.
    Built,
    /// A structure followed a scene that moved.
    Followed,
    /// Kernels were composed and compiled, or found compiled.
    Compiled,
    /// Samples were begun anew.
    Restarted,
    /// What was there is used further.
    Kept,
    /// A structure was not built, or its kernels not compiled: the image has the reason in its place.
    Failed,
}

/// One thing that was done for a change of the screen.
#[derive(Debug, Clone, PartialEq)]
pub struct Done {
    /// What was done.
    pub work: Work,
    /// To what, in words.
    pub what: String,
    /// How long it took, milliseconds.
    pub ms: f64,
}

impl fmt::Display for Done {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { work, what, ms } = self;
        let took = if *ms < 10.0 {
            format!("{ms:.1} ms")
        } else {
            format!("{ms:.0} ms")
        };
        match work {
            Work::Loaded => write!(f, "{what} loaded in {took}"),
            Work::Built => write!(f, "{what} built in {took}"),
            Work::Followed => write!(f, "{what} followed in {took}"),
            Work::Compiled => write!(f, "{what} compiled in {took}"),
            Work::Restarted => write!(f, "{what} begun anew"),
            Work::Kept => write!(f, "{what} kept"),
            Work::Failed => write!(f, "{what} failed after {took}"),
        }
    }
}

/// What a step led to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// There is something new to show.
    Shown,
    /// There is more to do, and nothing new to show.
    Worked,
    /// The step was given up because its caller said so.
    Stopped,
    /// All is done until the screen changes.
    Idle,
}

/// Notes what was done since `clock`.
pub(crate) fn note(done: &mut Vec<Done>, work: Work, what: String, clock: Instant) {
    let ms = clock.elapsed().as_secs_f64() * 1e3;
    done.push(Done { work, what, ms });
}
