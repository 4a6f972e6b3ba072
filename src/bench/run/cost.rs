//! Cost estimate of a plan, used by `--dry-run`, the remaining time, and balanced shards.

use raystone_config::{Axis, Cell, Experiment, Plan, REFERENCE_PARTS};
use raystone_core::params::Variant;
use raystone_core::text::plural;
use raystone_render::IntegratorRegistry;
use raystone_sampling::dimensions::{FIRST_BOUNCE, PER_BOUNCE};
use std::collections::BTreeMap;
use std::ops::{Add, AddAssign, Mul};

/// Rays per second of a software adapter with two cores: a round figure for incoherent rays.
const RAYS_PER_SECOND: f64 = 2e6;
/// Seconds for the driver to compile a new kernel, including composition and the first run.
const SECONDS_PER_KERNEL: f64 = 0.3;
/// Elements per second compacted by such an adapter, with passes and check: a round figure.
const ELEMENTS_PER_SECOND: f64 = 3e7;
/// Number of timed classes of recorded rays, without and with other shadow ray orders.
const RAY_CLASSES: [f64; 2] = [5.0, 8.0];
/// Bounces of a typical path: in a closed room paths take four to six rays, under a sky mostly two.
const USUAL_BOUNCES: u32 = 2;
/// Seconds to load a scene and check its reference tracer, and per megabyte of the model.
const SECONDS_PER_WORLD: [f64; 2] = [1.0, 0.3];
/// Seconds to build a structure, per megabyte of the model's file.
const BUILD_SECONDS: f64 = 0.15;

/// Work, by the quantities that determine its time.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Work {
    /// Rays.
    pub rays: f64,
    /// Stream elements compacted.
    pub elements: f64,
    /// Kernels compiled.
    pub kernels: f64,
    /// Seconds of other work.
    pub other_s: f64,
}

impl Work {
    /// Work of tracing rays.
    pub fn rays(count: u32) -> Self {
        Self {
            rays: f64::from(count),
            ..Self::default()
        }
    }

    /// Work of compiling kernels.
    pub fn kernels(count: u32) -> Self {
        Self {
            kernels: f64::from(count),
            ..Self::default()
        }
    }

    /// Work of a given time.
    pub fn other(seconds: f64) -> Self {
        Self {
            other_s: seconds,
            ..Self::default()
        }
    }

    /// Expected seconds on a software adapter with two cores.
    pub fn seconds(&self) -> f64 {
        self.rays / RAYS_PER_SECOND
            + self.elements / ELEMENTS_PER_SECOND
            + self.kernels * SECONDS_PER_KERNEL
            + self.other_s
    }

    /// Describes the work for `--dry-run`.
    pub fn describe(&self) -> String {
        let at = |count: f64, what: &str, per_second: f64| {
            let (count, rate) = (millions(count), per_second / 1e6);
            format!("{count} million {what} at {rate} million a second, ")
        };
        let parts = [
            (self.rays, at(self.rays, "rays", RAYS_PER_SECOND)),
            (
                self.elements,
                at(
                    self.elements,
                    "elements to be compacted",
                    ELEMENTS_PER_SECOND,
                ),
            ),
            (
                self.kernels,
                format!(
                    "{} that the driver compiles in {SECONDS_PER_KERNEL} s each, ",
                    plural(self.kernels as usize, "kernel")
                ),
            ),
        ];
        let parts = parts.into_iter().filter(|(count, _)| *count > 0.0);
        let parts: String = parts.map(|(_, text)| text).collect();
        let and = if parts.is_empty() { "" } else { "and " };
        format!(
            "estimate: about {} on a software adapter with two cores, from {parts}{and}{:.0} s of \
             loading, building, checks and warm-up. These are round figures, nothing was measured here: a GPU needs a \
             small part of it. The report comes on top.",
            duration(self.seconds()),
            self.other_s,
        )
    }
}

impl Add for Work {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            rays: self.rays + other.rays,
            elements: self.elements + other.elements,
            kernels: self.kernels + other.kernels,
            other_s: self.other_s + other.other_s,
        }
    }
}

impl AddAssign for Work {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Mul<f64> for Work {
    type Output = Self;

    fn mul(self, factor: f64) -> Self {
        Self {
            rays: self.rays * factor,
            elements: self.elements * factor,
            kernels: self.kernels * factor,
            other_s: self.other_s * factor,
        }
    }
}

/// Expected work of a plan and its steps.
#[derive(Clone)]
pub struct Cost<'a> {
    /// The experiment.
    pub experiment: &'a Experiment,
    /// Its plan.
    pub plan: &'a Plan,
    /// Rays per sample by label of the integrator.
    rays_per_sample: BTreeMap<&'a str, f64>,
    /// Size of the model's file by scene name.
    megabytes: BTreeMap<&'a str, f64>,
}

impl<'a> Cost<'a> {
    /// The cost model of a plan.
    pub fn new(experiment: &'a Experiment, plan: &'a Plan, known: &IntegratorRegistry) -> Self {
        let integrators = experiment.axes[Axis::Integrator].iter();
        let rays = |i: &'a Variant| (i.label.as_str(), rays_per_sample(known, i));
        let megabytes = |scene: &'a Variant| {
            let file = std::fs::metadata(&scene.name);
            (
                scene.name.as_str(),
                file.map_or(0.0, |m| m.len() as f64 / 1e6),
            )
        };
        Self {
            experiment,
            plan,
            rays_per_sample: integrators.map(rays).collect(),
            megabytes: plan.scenes.iter().map(megabytes).collect(),
        }
    }

    fn megabytes(&self, cell: &Cell) -> f64 {
        let known = self.megabytes.get(&*cell[Axis::Scene].name);
        known.copied().unwrap_or(0.0)
    }

    /// Loading a scene and checking the reference tracer on it.
    pub(super) fn world(&self, cell: &Cell) -> Work {
        let [world, megabyte] = SECONDS_PER_WORLD;
        Work::other(world + megabyte * self.megabytes(cell))
    }

    /// Building and checking a structure.
    pub(super) fn gate(&self, cell: &Cell) -> Work {
        Work::rays(self.experiment.gate.rays) * self.ray_classes()
            + Work::kernels(2)
            + Work::other(BUILD_SECONDS * self.megabytes(cell))
    }

    /// Number of timed classes of recorded rays.
    pub(super) fn ray_classes(&self) -> f64 {
        RAY_CLASSES[usize::from(self.experiment.gate.shadow_orders)]
    }

    /// Rendering an image of the experiment's size.
    pub fn image(&self, integrator: &Variant, spp: u32) -> Work {
        let [width, height] = self.experiment.run.resolution.map(f64::from);
        let rays = self.rays_per_sample.get(integrator.label.as_str());
        Work {
            rays: width * height * f64::from(spp) * rays.copied().unwrap_or(1.0),
            ..Work::default()
        }
    }

    /// Rendering one part of a reference; nothing if it is read from a file.
    pub(super) fn reference_part(&self, cell: &Cell) -> Work {
        let reference = &self.experiment.reference;
        if reference.file.is_some() {
            return Work::default();
        }
        let whole = self.image(&cell[Axis::Integrator], reference.spp);
        whole * f64::from(REFERENCE_PARTS).recip()
    }

    /// A timed measurement with `turn` in each round, including warm-up.
    pub fn timed(&self, turn: Work) -> Work {
        let timing = &self.experiment.timing;
        turn * f64::from(timing.rounds) + Work::other(f64::from(timing.min_warmup_ms) / 1e3)
    }

    /// Seconds of one step of [`Self::timed`], counting the warm-up as a step.
    pub(super) fn step_s(&self, timed: Work) -> f64 {
        timed.seconds() / f64::from(self.experiment.timing.rounds + 1)
    }
}

/// Typical rays per sample: one from the camera, and at each bounce one onwards and one to a light.
fn rays_per_sample(known: &IntegratorRegistry, integrator: &Variant) -> f64 {
    let known = known.configured(integrator);
    let dimensions = known.map_or(FIRST_BOUNCE, |known| known.facts.dimensions);
    let bounces = dimensions.saturating_sub(FIRST_BOUNCE).div_ceil(PER_BOUNCE);
    f64::from(1 + 2 * bounces.min(USUAL_BOUNCES))
}

/// A count in millions, with a decimal if small.
fn millions(count: f64) -> String {
    let millions = count / 1e6;
    let decimals = if millions < 10.0 { 1 } else { 0 };
    format!("{millions:.decimals$}")
}

/// A time with the precision of an estimate.
fn duration(seconds: f64) -> String {
    let (unit, name) = match seconds {
        ..100.0 => (1.0, "s"),
        ..6000.0 => (60.0, "min"),
        _ => (3600.0, "h"),
    };
    format!("{:.0} {name}", (seconds / unit).ceil())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::Registries;

    fn estimate(overrides: &[&str]) -> Work {
        let text = "[run]\nreplicates = 2\nresolution = [100, 100]\nspp = { pow2 = [0, 3] }\n\
                    [axes]\nscene = [\"cornell-box\"]\naccel = [\"bvh\"]\n\
                    sequence = [\"pixel-hash\"]\nintegrator = [\"primary\"]\n\
                    [reference]\nspp = 10\n[timing]\nrounds = 3\nrays = 2000\n\
                    min_warmup_ms = 100\n[gate]\nrays = 4000\n";
        let registries = Registries::default();
        let overrides: Vec<_> = overrides.iter().map(|&text| text.to_owned()).collect();
        let experiment =
            Experiment::parse(text, "test", &overrides, &registries.catalogue()).unwrap();
        let plan = Plan::new(&experiment, &[], |s, d| registries.is_randomised(s, d)).unwrap();
        let units = registries.measurements.units(&experiment, &plan);
        Cost::new(&experiment, &plan, &registries.integrators).whole(&units)
    }

    #[test]
    fn the_work_of_a_small_plan_is_counted_by_hand() {
        let small = estimate(&[]);
        // Two replicates of 8 samples, the reference, three rounds, and the recorded rays.
        let images = 10_000.0 * f64::from(2 * 8 + 10 + 3);
        let rays = images + 5.0 * (4000.0 + 3.0 * 2000.0);
        assert!((small.rays - rays).abs() < 1e-6, "{small:?}");
        assert_eq!((small.kernels, small.elements), (3.0, 0.0));
        // Warm-up of five classes and a cell, the world, the words of a sampler.
        assert!(
            (small.other_s - (0.6 + 1.0 + 0.6)).abs() < 1e-9,
            "{small:?}"
        );
        let seconds = rays / RAYS_PER_SECOND + 3.0 * SECONDS_PER_KERNEL + small.other_s;
        assert!((small.seconds() - seconds).abs() < 1e-9);
        assert!(estimate(&["run.replicates=4"]).rays > small.rays);
        // A reference that is read is not rendered.
        let read = estimate(&["reference.file=reference.npy"]);
        assert!((small.rays - read.rays - 10.0 * 10_000.0).abs() < 1e-6);
        let peers = estimate(&["axes.peer=obvhs-bvh2,obvhs-cwbvh"]);
        assert!((peers.rays - small.rays - 5.0 * 2.0 * 3.0 * 2000.0).abs() < 1e-6);
        let compaction = estimate(&["axes.integrator=compaction:roger"]);
        assert_eq!(compaction.elements, f64::from(3 << 20));
    }

    #[test]
    fn paths_take_more_rays_than_camera_rays() {
        let [primary, ao, path] = ["primary", "ao", "path"]
            .map(|name| estimate(&[&format!("axes.integrator={name}")]).rays);
        assert!(primary < ao && ao < path, "{primary} {ao} {path}");
    }

    #[test]
    fn only_work_that_there_is_is_described() {
        let said = Work::other(7.0).describe();
        assert!(said.contains("two cores, from 7 s of loading"), "{said}");
        let work = Work {
            rays: 3e6,
            kernels: 1.0,
            ..Work::other(7.0)
        };
        let said = work.describe();
        let parts = "from 3.0 million rays at 2 million a second, 1 kernel that the driver compiles in 0.3 s each, and 7 s";
        assert!(said.contains(parts), "{said}");
        assert!(!said.contains("elements"), "{said}");
    }

    #[test]
    fn times_are_rounded_up_to_whole_units() {
        assert_eq!(duration(41.2), "42 s");
        assert_eq!(duration(121.0), "3 min");
        assert_eq!(duration(7300.0), "3 h");
        assert_eq!(
            [millions(450_000.0), millions(284_300_000.0)],
            ["0.5", "284"]
        );
    }
}
