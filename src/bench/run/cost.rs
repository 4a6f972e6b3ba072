//! What a plan is expected to take: the one model behind `--dry-run`, the time that is left, and shards of equal length.

use super::{Registries, Unit};
use raystone_config::{Axis, Cell, Experiment, Plan, REFERENCE_PARTS};
use raystone_core::params::Variant;
use raystone_sampling::dimensions::{FIRST_BOUNCE, PER_BOUNCE};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::{Add, AddAssign, Mul};

/// Rays per second of a software adapter with two cores: a round figure for incoherent rays.
const RAYS_PER_SECOND: f64 = 2e6;
/// Seconds in which the driver compiles a kernel that it has not met before, with its composition and its first run.
const SECONDS_PER_KERNEL: f64 = 0.3;
/// Elements per second that such an adapter compacts, all passes of a turn and its check together: as round.
const ELEMENTS_PER_SECOND: f64 = 3e7;
/// Classes of recorded rays that are timed, and those with shadow rays in other orders.
const RAY_CLASSES: [f64; 2] = [5.0, 8.0];
/// Bounces of a usual path: in a closed room paths take four to six rays, most under a sky two.
const USUAL_BOUNCES: u32 = 2;
/// Seconds to load a scene and check the reference tracer on it, and for each megabyte of the model's file.
const SECONDS_PER_WORLD: [f64; 2] = [1.0, 0.3];
/// Seconds to build a structure for each megabyte of the model's file.
const BUILD_SECONDS: f64 = 0.15;

/// Work, by what its time is expected from.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Work {
    /// Rays.
    pub rays: f64,
    /// Elements of streams that are compacted.
    pub elements: f64,
    /// Kernels that the driver compiles.
    pub kernels: f64,
    /// Seconds of anything else.
    pub other_s: f64,
}

impl Work {
    /// So many rays.
    pub fn rays(count: u32) -> Self {
        Self {
            rays: f64::from(count),
            ..Self::default()
        }
    }

    /// So many kernels.
    pub fn kernels(count: u32) -> Self {
        Self {
            kernels: f64::from(count),
            ..Self::default()
        }
    }

    /// So many seconds.
    pub fn other(seconds: f64) -> Self {
        Self {
            other_s: seconds,
            ..Self::default()
        }
    }

    /// Seconds that it takes on a software adapter with two cores.
    pub fn seconds(&self) -> f64 {
        self.rays / RAYS_PER_SECOND
            + self.elements / ELEMENTS_PER_SECOND
            + self.kernels * SECONDS_PER_KERNEL
            + self.other_s
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

/// The expected work of a plan and of its steps.
#[derive(Clone)]
pub struct Cost<'a> {
    /// What it is of.
    pub experiment: &'a Experiment,
    pub(super) plan: &'a Plan,
    /// Rays of a sample by label of the integrator.
    rays_per_sample: BTreeMap<&'a str, f64>,
    /// Size of the model's file by name of the scene.
    megabytes: BTreeMap<&'a str, f64>,
}

impl<'a> Cost<'a> {
    /// Of a plan.
    pub fn new(experiment: &'a Experiment, plan: &'a Plan, registries: &Registries) -> Self {
        let integrators = experiment.axes[Axis::Integrator].iter();
        let rays = |i: &'a Variant| (i.label.as_str(), rays_per_sample(registries, i));
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

    /// Seconds that a unit takes, without what several share.
    pub fn seconds_of(&self, unit: &Unit) -> f64 {
        unit.measurement.cost(&unit.cell, self).seconds()
    }

    /// The work of these units, with the scenes and references that they need.
    pub fn whole<'u>(&self, units: impl IntoIterator<Item = &'u Unit>) -> Work {
        let mut whole = Work::default();
        let (mut worlds, mut references) = (BTreeSet::new(), BTreeSet::new());
        for unit in units {
            let cell = &unit.cell;
            whole += unit.measurement.cost(cell, self);
            if cell.get(Axis::Scene).is_some() && worlds.insert(cell.on(&Cell::WORLD).identity()) {
                whole += self.world(cell);
            }
            let part = [&Cell::WORLD[..], &[Axis::Integrator]].concat();
            if unit.measurement.name() == super::errors::NAME
                && references.insert(cell.on(&part).identity())
            {
                whole += self.reference_part(cell) * f64::from(REFERENCE_PARTS);
            }
        }
        whole
    }

    /// The whole in words, for `--dry-run`.
    pub fn describe(&self, units: &[Unit]) -> String {
        let whole = self.whole(units);
        format!(
            "estimate: about {} on a software adapter with two cores, from {} million rays at \
             {} million a second, {} million elements to be compacted at {} million a second, \
             {} kernels that the driver compiles in {SECONDS_PER_KERNEL} s each, and {:.0} s of \
             loading, building, checks and warm-up. These are round figures, nothing was measured here: a GPU needs a \
             small part of it. The report comes on top.",
            duration(whole.seconds()),
            millions(whole.rays),
            RAYS_PER_SECOND / 1e6,
            millions(whole.elements),
            ELEMENTS_PER_SECOND / 1e6,
            whole.kernels,
            whole.other_s,
        )
    }

    fn megabytes(&self, cell: &Cell) -> f64 {
        let known = self.megabytes.get(&*cell[Axis::Scene].name);
        known.copied().unwrap_or(0.0)
    }

    /// A scene is loaded, and the reference tracer checked on it.
    pub(super) fn world(&self, cell: &Cell) -> Work {
        let [world, megabyte] = SECONDS_PER_WORLD;
        Work::other(world + megabyte * self.megabytes(cell))
    }

    /// A structure is built and gated.
    pub(super) fn gate(&self, cell: &Cell) -> Work {
        Work::rays(self.experiment.gate.rays) * self.ray_classes()
            + Work::kernels(2)
            + Work::other(BUILD_SECONDS * self.megabytes(cell))
    }

    /// Classes of recorded rays that are timed.
    pub(super) fn ray_classes(&self) -> f64 {
        RAY_CLASSES[usize::from(self.experiment.gate.shadow_orders)]
    }

    /// An image of the experiment's size.
    pub fn image(&self, integrator: &Variant, spp: u32) -> Work {
        let [width, height] = self.experiment.run.resolution.map(f64::from);
        let rays = self.rays_per_sample.get(integrator.label.as_str());
        Work {
            rays: width * height * f64::from(spp) * rays.copied().unwrap_or(1.0),
            ..Work::default()
        }
    }

    /// One of the parts that a reference is rendered in; nothing where it is read from a file.
    pub(super) fn reference_part(&self, cell: &Cell) -> Work {
        let reference = &self.experiment.reference;
        if reference.file.is_some() {
            return Work::default();
        }
        let whole = self.image(&cell[Axis::Integrator], reference.spp);
        whole * f64::from(REFERENCE_PARTS).recip()
    }

    /// Something that is timed, `turn` in each round, with its warm-up.
    pub fn timed(&self, turn: Work) -> Work {
        let timing = &self.experiment.timing;
        turn * f64::from(timing.rounds) + Work::other(f64::from(timing.min_warmup_ms) / 1e3)
    }

    /// Seconds of one of the steps of [`Self::timed`], of which the warm-up is one.
    pub(super) fn step_s(&self, timed: Work) -> f64 {
        timed.seconds() / f64::from(self.experiment.timing.rounds + 1)
    }
}

/// Rays that one sample usually takes: one from the camera, and at each bounce one onwards and one
/// to a light.
fn rays_per_sample(registries: &Registries, integrator: &Variant) -> f64 {
    let known = registries.integrators.configured(integrator);
    let dimensions = known.map_or(FIRST_BOUNCE, |known| known.facts.dimensions);
    let bounces = dimensions.saturating_sub(FIRST_BOUNCE).div_ceil(PER_BOUNCE);
    f64::from(1 + 2 * bounces.min(USUAL_BOUNCES))
}

/// A count in millions, with a decimal where it is small.
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
        Cost::new(&experiment, &plan, &registries).whole(&units)
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
