//! How far a run is: a bar on a terminal, lines elsewhere.
//!
//! Every step has an expected time, loading, judging and compiling included, from which the share that is done follows. What is left is
//! the time so far over that share: a step that takes longer than expected makes the rest longer, and nothing is called nearly done that is
//! not.

use super::estimate::Estimate;
use super::{RunOptions, session::Session};
use indicatif::{ProgressBar, ProgressState, ProgressStyle};
use raystone_config::{
    Axis, Cell, Experiment, Plan, REFERENCE_PARTS, Unit, UnitKind, is_compaction,
};
use std::collections::BTreeSet;
use std::fmt::Write;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Steps of the bar.
const STEPS: u64 = 1000;
/// Between two lines where there is no terminal.
const BETWEEN_LINES: Duration = Duration::from_secs(10);
/// The first part of a run is too short to go by.
const FIRST_SECONDS: f64 = 2.0;

/// Expected seconds of the steps of a run, on a software adapter with two cores.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Weights {
    /// A scene is loaded and its judge is checked.
    pub world: f64,
    /// A structure is built and judged.
    pub gate: f64,
    /// A class of rays is traced once.
    pub rays: f64,
    /// A full cell is compiled.
    pub compile: f64,
    /// A full cell is timed once.
    pub image: f64,
    /// A replicate is rendered.
    pub replicate: f64,
    /// A part of a reference is rendered.
    pub reference_part: f64,
    /// A stream is measured.
    pub stream: f64,
    /// A compaction is judged, or timed once.
    pub compaction: f64,
    /// A cell is modelled.
    pub model: f64,
    /// A structure is taken through all frames.
    pub animation: f64,
}

impl Weights {
    pub(super) fn new(
        experiment: &Experiment,
        plan: &Plan,
        units: &[Unit],
        estimate: &Estimate,
    ) -> Self {
        let megabytes =
            |scene: &str| std::fs::metadata(scene).map_or(0.0, |m| m.len() as f64 / 1e6);
        let sizes = plan.scenes.iter().map(|scene| megabytes(&scene.name));
        let megabytes = sizes.sum::<f64>() / plan.scenes.len().max(1) as f64;
        let integrators = &experiment.axes[Axis::Integrator];
        let rendering: Vec<_> = integrators.iter().filter(|i| !is_compaction(i)).collect();
        let image = |spp| {
            let seconds = rendering.iter().map(|i| estimate.image_seconds(i, spp));
            seconds.sum::<f64>() / rendering.len().max(1) as f64
        };
        let timing = &experiment.timing;
        let rounds = f64::from(timing.rounds) + 1.0;
        let warmup = f64::from(timing.min_warmup_ms) / 1e3 / rounds;
        let rays = |count: u32| estimate.rays_seconds(u64::from(count));
        let compactions = plan.compactions.len().max(1) as f64;
        let of_compactions = units
            .iter()
            .filter(|unit| unit.kind == UnitKind::Compaction);
        let of_compactions: f64 = of_compactions.map(|unit| estimate.seconds_of(unit)).sum();
        Self {
            world: 1.0 + 0.3 * megabytes,
            gate: 0.6 + 5.0 * rays(experiment.gate.rays) + 0.15 * megabytes,
            rays: rays(timing.rays) + warmup,
            compile: 0.3,
            image: image(timing.spp) + warmup,
            replicate: image(experiment.run.spp.max()),
            reference_part: image(experiment.reference.spp / REFERENCE_PARTS),
            stream: 0.6,
            compaction: of_compactions / compactions / (rounds + 1.0),
            model: 1.0,
            animation: experiment.animation.map_or(0.0, |a| f64::from(a.frames)),
        }
    }

    /// Expected seconds of these units, with the worlds and references that they need.
    pub(super) fn of<'u>(
        &self,
        units: impl Iterator<Item = &'u Unit>,
        experiment: &Experiment,
        plan: &Plan,
    ) -> f64 {
        let rounds = f64::from(experiment.timing.rounds) + 1.0;
        let (mut worlds, mut references) = (BTreeSet::new(), BTreeSet::new());
        let mut seconds = 0.0;
        for unit in units {
            let cell = &unit.cell;
            if cell.get(Axis::Scene).is_some() {
                worlds.insert(cell.on(&Cell::WORLD).identity());
            }
            seconds += match unit.kind {
                UnitKind::Structure => self.gate + 5.0 * rounds * self.rays,
                UnitKind::Peer => 5.0 * rounds * self.rays,
                UnitKind::Sampler => {
                    let part = [&Cell::WORLD[..], &[Axis::Integrator]].concat();
                    references.insert(cell.on(&part).identity());
                    f64::from(plan.renders(cell)) * self.replicate
                }
                UnitKind::Time => self.compile + rounds * self.image,
                UnitKind::Coherence => self.model,
                UnitKind::Animation => self.animation,
                UnitKind::Stream => self.stream,
                UnitKind::Compaction => (rounds + 1.0) * self.compaction,
            };
        }
        let parts = references.len() as f64 * f64::from(REFERENCE_PARTS);
        seconds + worlds.len() as f64 * self.world + parts * self.reference_part
    }
}

#[derive(Debug)]
struct Shared {
    start: Instant,
    /// Expected seconds of all, and of what is done.
    expected_s: f64,
    done_s: f64,
    /// When a line was told.
    told: Instant,
}

impl Shared {
    /// The share that is done, below 1 as long as the run goes on.
    fn share(&self) -> f64 {
        (self.done_s / self.expected_s.max(1e-9)).clamp(0.0, 0.995)
    }

    /// Seconds that are left: by the time so far, and in the beginning by what was expected.
    fn left_s(&self) -> f64 {
        let so_far = self.start.elapsed().as_secs_f64();
        let by_time = so_far * (1.0 - self.share()) / self.share().max(1e-9);
        let expected = (self.expected_s - self.done_s).max(1.0);
        match self.done_s {
            // A first step that takes long says that all of them will.
            done if done < FIRST_SECONDS.min(0.05 * self.expected_s) => expected.max(so_far),
            _ => by_time.max(1.0),
        }
    }
}

/// The progress of a run; clones are one.
#[derive(Debug, Clone)]
pub(super) struct Progress {
    pub bar: ProgressBar,
    shared: Arc<Mutex<Shared>>,
    tell: Option<fn(&str)>,
}

impl Progress {
    /// A bar if the options ask for one, else lines if they say where to.
    pub(super) fn new(options: &RunOptions) -> Self {
        let shared = Arc::new(Mutex::new(Shared {
            start: Instant::now(),
            expected_s: 0.0,
            done_s: 0.0,
            told: Instant::now(),
        }));
        let bar = match options.progress {
            true => ProgressBar::new(STEPS),
            false => ProgressBar::hidden(),
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

    /// Sets what all of the run is expected to take, seconds.
    pub(super) fn expect(&self, seconds: f64) {
        let mut shared = lock(&self.shared);
        shared.expected_s = seconds;
        shared.start = Instant::now();
    }

    /// A step that was expected to take so many seconds is done.
    pub(super) fn add(&self, seconds: f64) {
        let mut shared = lock(&self.shared);
        shared.done_s += seconds;
        let position = (shared.share() * STEPS as f64) as u64;
        // The bar draws, and asks for what is left.
        drop(shared);
        self.bar.set_position(position);
    }

    /// Tells what is being done.
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

/// A time as people say it.
fn duration(seconds: f64) -> String {
    let seconds = seconds.round() as u64;
    match seconds {
        ..=99 => format!("{seconds} s"),
        100..=5999 => format!("{} min {:02} s", seconds / 60, seconds % 60),
        _ => format!("{} h {:02} min", seconds / 3600, seconds / 60 % 60),
    }
}

/// Sets what the open units of a run are expected to take.
pub(super) fn expect(session: &mut Session) {
    let (experiment, plan) = (session.experiment, session.plan);
    let estimate = Estimate::new(experiment, plan, &session.units, session.registries);
    session.weights = Weights::new(experiment, plan, &session.units, &estimate);
    let seconds = session.weights.of(session.open_units(), experiment, plan);
    session.progress.expect(seconds);
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
        // Half of it took 50 s: about as long again.
        assert!((shared(10.0, 5.0, 50).left_s() - 50.0).abs() < 0.5);
        // Before anything is known, what was expected; a first step that hangs makes it longer.
        assert!((shared(60.0, 0.0, 0).left_s() - 60.0).abs() < 0.5);
        assert!(shared(60.0, 0.0, 300).left_s() >= 299.0);
        // Everything is done as expected, and yet the run goes on.
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
