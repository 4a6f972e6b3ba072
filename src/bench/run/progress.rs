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
use std::thread;
use std::time::{Duration, Instant};

const STEPS: u64 = 1000;
/// Interval of progress lines without a terminal.
const BETWEEN_LINES: Duration = Duration::from_secs(10);
const BETWEEN_LOOKS: Duration = Duration::from_millis(500);
/// Share of a run that counts as done at the expected pace.
const PRIOR: f64 = 0.1;

#[derive(Debug)]
struct Shared {
    start: Instant,
    /// Expected seconds in total, 0 where nothing says so, and of finished steps.
    expected_s: f64,
    done_s: f64,
    told: Instant,
    /// What is under way.
    message: String,
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

    /// The next line for those without a terminal, if it is time for one.
    fn line(&mut self) -> Option<String> {
        if self.message.is_empty() || self.told.elapsed() < BETWEEN_LINES {
            return None;
        }
        self.told = Instant::now();
        let [so_far, left] = [self.start.elapsed().as_secs_f64(), self.left_s()].map(duration);
        let message = &self.message;
        if self.expected_s == 0.0 {
            return Some(format!("after {so_far}: {message}"));
        }
        let share = 100.0 * self.share();
        Some(format!(
            "{share:.0} % after {so_far}, about {left} left: {message}"
        ))
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
            message: String::new(),
        }));
        let bar = if options.progress {
            ProgressBar::new(STEPS)
        } else {
            ProgressBar::hidden()
        };
        set_style(&bar, "{elapsed} · {wide_msg}", &shared);
        if options.progress {
            bar.enable_steady_tick(Duration::from_millis(500));
        }
        let tell = options.tell.filter(|_| !options.progress);
        if let Some(tell) = tell {
            tell_meanwhile(&shared, &bar, tell);
        }
        Self { bar, shared, tell }
    }

    /// Sets the expected total time in seconds.
    pub(super) fn expect(&self, seconds: f64) {
        let template = "{bar:32} {percent}% · {elapsed} · about {left} left · {wide_msg}";
        set_style(&self.bar, template, &self.shared);
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
        lock(&self.shared).message.clone_from(&message);
        if let Some(tell) = self.tell {
            tell_if_due(&self.shared, tell);
        }
        self.bar.set_message(message);
    }
}

/// Styles a bar, with the remaining time as `left`.
fn set_style(bar: &ProgressBar, template: &str, shared: &Arc<Mutex<Shared>>) {
    let of = Arc::clone(shared);
    let left = move |_: &ProgressState, out: &mut dyn Write| {
        let _ = out.write_str(&duration(lock(&of).left_s()));
    };
    let style = ProgressStyle::with_template(template);
    bar.set_style(style.map_or_else(
        |_| ProgressStyle::default_bar(),
        |style| style.with_key("left", left),
    ));
}

fn tell_if_due(shared: &Mutex<Shared>, tell: fn(&str)) {
    let line = lock(shared).line();
    if let Some(line) = line {
        tell(&line);
    }
}

/// Tells lines while a step lasts, until the run has ended.
fn tell_meanwhile(shared: &Arc<Mutex<Shared>>, bar: &ProgressBar, tell: fn(&str)) {
    let (shared, bar) = (Arc::downgrade(shared), bar.downgrade());
    let until_the_end = move || {
        loop {
            thread::sleep(BETWEEN_LOOKS);
            match (shared.upgrade(), bar.upgrade()) {
                (Some(shared), Some(bar)) if !bar.is_finished() => tell_if_due(&shared, tell),
                _ => return,
            }
        }
    };
    // Where there are no threads, lines come between steps alone.
    let _ = thread::Builder::new().spawn(until_the_end);
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
            message: String::new(),
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
    fn a_step_that_lasts_is_told_while_it_does() {
        static TOLD: Mutex<Vec<String>> = Mutex::new(Vec::new());
        let told = || TOLD.lock().unwrap().clone();
        let progress = Progress::new(&RunOptions {
            tell: Some(|line| TOLD.lock().unwrap().push(line.to_owned())),
            ..RunOptions::default()
        });
        progress.expect(10.0);
        let make_due = || {
            let mut shared = lock(&progress.shared);
            shared.told = Instant::now().checked_sub(BETWEEN_LINES).unwrap();
        };
        // Before the first message there is nothing to tell.
        make_due();
        thread::sleep(2 * BETWEEN_LOOKS);
        assert!(told().is_empty());
        progress.say("timing".to_owned());
        progress.add(4.0);
        let before = told().len();
        make_due();
        // A busy machine may take its time.
        let limit = Instant::now() + Duration::from_secs(60);
        while told().len() == before && Instant::now() < limit {
            thread::sleep(BETWEEN_LOOKS / 10);
        }
        let lines = told();
        assert!(lines.len() > before);
        assert!(
            lines.iter().all(|line| line.ends_with(" left: timing")),
            "{lines:?}"
        );
        assert!(
            lines[lines.len() - 1].starts_with("40 % after "),
            "{lines:?}"
        );
        progress.bar.finish_and_clear();
        make_due();
        thread::sleep(2 * BETWEEN_LOOKS);
        assert_eq!(told(), lines);
    }

    #[test]
    fn without_an_expected_time_a_line_promises_none() {
        let due = |expected_s: f64| {
            let mut shared = shared(expected_s, 0.0, 30);
            shared.message = "checking".to_owned();
            shared.told -= BETWEEN_LINES;
            shared.line().unwrap()
        };
        assert_eq!(due(0.0), "after 30 s: checking");
        assert!(due(60.0).starts_with("0 % after 30 s, about "));
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
