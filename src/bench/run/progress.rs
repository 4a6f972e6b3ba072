//! Progress of a run: a bar on a terminal, lines elsewhere.
//!
//! Every step has an expected time by [`super::Cost`], including loading, checks and compiling,
//! which determines the finished share. The rest is extrapolated at the pace so far: a step that
//! takes longer than expected lengthens the rest. The first steps say little about the pace, so a
//! share of the whole counts as done at the expected pace.

use super::options::RunOptions;
use indicatif::{ProgressBar, ProgressState, ProgressStyle};
use std::fmt::Write;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

const STEPS: u64 = 1000;
/// Interval of progress lines without a terminal.
const BETWEEN_LINES: Duration = Duration::from_secs(10);
/// Share of a run that counts as done at the expected pace.
const PRIOR: f64 = 0.1;

#[derive(Debug)]
struct Shared {
    start: Instant,
    /// Expected seconds in total, and of finished steps.
    expected_s: f64,
    done_s: f64,
    told: Instant,
}

impl Shared {
    /// Finished share, below 1 while the run continues.
    fn share(&self) -> f64 {
        (self.done_s / self.expected_s.max(1e-9)).clamp(0.0, 0.995)
    }

    /// Remaining seconds: expected time multiplied by the pace so far.
    fn left_s(&self) -> f64 {
        let prior = (PRIOR * self.expected_s).max(1e-9);
        let so_far = self.start.elapsed().as_secs_f64();
        let pace = (so_far + prior) / (self.done_s + prior);
        let left = (self.expected_s - self.done_s).max(0.005 * self.expected_s);
        (pace * left).max(1.0)
    }
}

/// The shared progress of a run; cheap to clone.
#[derive(Debug, Clone)]
pub(super) struct Progress {
    pub bar: ProgressBar,
    shared: Arc<Mutex<Shared>>,
    tell: Option<fn(&str)>,
}

impl Progress {
    /// A bar if requested, else lines if there is a callback.
    pub(super) fn new(options: &RunOptions) -> Self {
        let shared = Arc::new(Mutex::new(Shared {
            start: Instant::now(),
            expected_s: 0.0,
            done_s: 0.0,
            told: Instant::now(),
        }));
        let bar = if options.progress {
            ProgressBar::new(STEPS)
        } else {
            ProgressBar::hidden()
        };
        let template = "{bar:32} {percent}% · {elapsed} · about {left} left · {wide_msg}";
        let style = ProgressStyle::with_template(template);
        let of = Arc::clone(&shared);
        let left = move |_: &ProgressState, out: &mut dyn Write| {
            let _ = out.write_str(&duration(lock(&of).left_s()));
        };
        bar.set_style(match style {
            Ok(style) => style.with_key("left", left),
            Err(_) => ProgressStyle::default_bar(),
        });
        if options.progress {
            bar.enable_steady_tick(Duration::from_millis(500));
        }
        Self {
            bar,
            shared,
            tell: options.tell.filter(|_| !options.progress),
        }
    }

    /// Sets the expected total time in seconds.
    pub(super) fn expect(&self, seconds: f64) {
        let mut shared = lock(&self.shared);
        shared.expected_s = seconds;
        shared.start = Instant::now();
    }

    /// Completes a step of this expected time in seconds.
    pub(super) fn add(&self, seconds: f64) {
        let mut shared = lock(&self.shared);
        shared.done_s += seconds;
        let position = (shared.share() * STEPS as f64) as u64;
        // The bar redraws and queries the remaining time.
        drop(shared);
        self.bar.set_position(position);
    }

    pub(super) fn say(&self, message: String) {
        if let Some(tell) = self.tell {
            let mut shared = lock(&self.shared);
            if shared.told.elapsed() >= BETWEEN_LINES {
                shared.told = Instant::now();
                let share = 100.0 * shared.share();
                let [so_far, left] =
                    [shared.start.elapsed().as_secs_f64(), shared.left_s()].map(duration);
                tell(&format!(
                    "{share:.0} % after {so_far}, about {left} left: {message}"
                ));
            }
        }
        self.bar.set_message(message);
    }
}

fn lock(shared: &Mutex<Shared>) -> MutexGuard<'_, Shared> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

fn duration(seconds: f64) -> String {
    let seconds = seconds.round() as u64;
    match seconds {
        ..=99 => format!("{seconds} s"),
        100..=5999 => format!("{} min {:02} s", seconds / 60, seconds % 60),
        _ => format!("{} h {:02} min", seconds / 3600, seconds / 60 % 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shared(expected_s: f64, done_s: f64, so_far: u64) -> Shared {
        let now = Instant::now();
        Shared {
            start: now.checked_sub(Duration::from_secs(so_far)).unwrap_or(now),
            expected_s,
            done_s,
            told: now,
        }
    }

    #[test]
    fn what_is_left_follows_the_time_so_far_and_is_never_nothing() {
        // Half of it took 50 s: nearly as long again.
        let left = shared(10.0, 5.0, 50).left_s();
        assert!((40.0..50.0).contains(&left), "{left}");
        // At first the expected time; a first step that hangs lengthens it.
        assert!((shared(60.0, 0.0, 0).left_s() - 60.0).abs() < 0.5);
        assert!(shared(60.0, 0.0, 300).left_s() >= 299.0);
        // The first steps took three times as long as expected, which says little about the whole.
        let left = shared(300.0, 6.0, 18).left_s();
        assert!((300.0..420.0).contains(&left), "{left}");
        // Everything is done as expected, and yet the run continues.
        for so_far in [1, 60, 600] {
            let left = shared(10.0, 10.0, so_far).left_s();
            assert!((1.0..10.0).contains(&left), "{left}");
        }
        assert!(shared(0.0, 0.0, 0).left_s() >= 1.0);
    }

    #[test]
    fn times_are_told_as_people_say_them() {
        let told = [3.2, 99.0, 100.0, 3599.0, 6000.0].map(duration);
        assert_eq!(
            told,
            ["3 s", "99 s", "1 min 40 s", "59 min 59 s", "1 h 40 min"]
        );
    }
}
