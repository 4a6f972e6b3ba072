//! How long a plan would take, roughly.

use super::Registries;
use raystone_config::{Axis, Cell, Experiment, Plan, Unit, UnitKind};
use raystone_core::params::{ParamValue, Variant};
use raystone_sampling::dimensions::{FIRST_BOUNCE, PER_BOUNCE};
use std::collections::BTreeMap;
use std::fmt;
use std::ops::AddAssign;

/// Rays per second of a software adapter with two cores: a round figure for incoherent rays.
const RAYS_PER_SECOND: f64 = 2e6;
/// Seconds to compose, compile and warm up a kernel.
const SECONDS_PER_KERNEL: f64 = 0.3;
/// Classes of recorded rays that are timed, and those with shadow rays in other orders.
const RAY_CLASSES: [u64; 2] = [5, 8];
/// Elements per second that such an adapter compacts, all passes of a turn and its check together: as round.
const ELEMENTS_PER_SECOND: f64 = 3e7;
/// Bounces of a usual path: in a closed room paths take four to six rays, most under a sky two.
const USUAL_BOUNCES: u32 = 2;

/// Work that grows with the size of a plan.
#[derive(Debug, Clone, Copy, Default)]
struct Work {
    rays: u64,
    elements: u64,
    kernels: u64,
    warmup_s: f64,
}

impl Work {
    fn seconds(&self) -> f64 {
        self.rays as f64 / RAYS_PER_SECOND
            + self.elements as f64 / ELEMENTS_PER_SECOND
            + self.kernels as f64 * SECONDS_PER_KERNEL
            + self.warmup_s
    }
}

impl AddAssign for Work {
    fn add_assign(&mut self, other: Self) {
        self.rays += other.rays;
        self.elements += other.elements;
        self.kernels += other.kernels;
        self.warmup_s += other.warmup_s;
    }
}

/// What a plan asks for, and what that would take on a software adapter with two cores.
pub struct Estimate<'a> {
    experiment: &'a Experiment,
    plan: &'a Plan,
    /// Rays of a sample by label of the integrator.
    rays_per_sample: BTreeMap<&'a str, u64>,
    /// Of all units and references.
    whole: Work,
}

impl<'a> Estimate<'a> {
    /// Counts the rays and kernels of a plan with these [units](Plan::units).
    pub fn new(
        experiment: &'a Experiment,
        plan: &'a Plan,
        units: &[Unit],
        registries: &Registries,
    ) -> Self {
        let integrators = experiment.axes[Axis::Integrator].iter();
        let rays = |i: &'a Variant| (i.label.as_str(), rays_per_sample(registries, i));
        let mut estimate = Self {
            experiment,
            plan,
            rays_per_sample: integrators.map(rays).collect(),
            whole: Work::default(),
        };
        for unit in units {
            estimate.whole += estimate.of_unit(unit);
        }
        estimate.whole.rays += estimate.references();
        estimate
    }

    /// Seconds that a unit takes, without what several share.
    pub fn seconds_of(&self, unit: &Unit) -> f64 {
        self.of_unit(unit).seconds()
    }

    /// Seconds that the whole plan takes.
    pub fn seconds(&self) -> f64 {
        self.whole.seconds()
    }

    /// Seconds of an image.
    pub(super) fn image_seconds(&self, integrator: &Variant, spp: u32) -> f64 {
        self.rays_seconds(self.image(integrator, spp))
    }

    /// Seconds of so many rays.
    pub(super) fn rays_seconds(&self, rays: u64) -> f64 {
        rays as f64 / RAYS_PER_SECOND
    }

    /// Rays of an image.
    fn image(&self, integrator: &Variant, spp: u32) -> u64 {
        let [width, height] = self.experiment.run.resolution.map(u64::from);
        let rays = self.rays_per_sample.get(integrator.label.as_str());
        width * height * u64::from(spp) * rays.copied().unwrap_or(1)
    }

    fn of_unit(&self, unit: &Unit) -> Work {
        let (cell, experiment) = (&unit.cell, self.experiment);
        let timing = &experiment.timing;
        let rounds = u64::from(timing.rounds);
        let warmup_s = f64::from(timing.min_warmup_ms) / 1e3;
        let integrator = &cell[Axis::Integrator];
        let classes = RAY_CLASSES[usize::from(experiment.gate.shadow_orders)];
        let timed_rays = rounds * u64::from(timing.rays);
        match unit.kind {
            UnitKind::Structure => Work {
                rays: classes * (u64::from(experiment.gate.rays) + timed_rays),
                kernels: 2,
                warmup_s: classes as f64 * warmup_s,
                elements: 0,
            },
            // Peers answer the same rays without a judge's part.
            UnitKind::Peer => Work {
                rays: classes * timed_rays,
                ..Work::default()
            },
            UnitKind::Sampler => Work {
                rays: u64::from(self.plan.renders(cell))
                    * self.image(integrator, experiment.run.spp.max()),
                ..Work::default()
            },
            UnitKind::Time => Work {
                rays: rounds * self.image(integrator, timing.spp),
                kernels: 1,
                warmup_s,
                elements: 0,
            },
            UnitKind::Compaction => Work {
                elements: match integrator.params.0.get("elements") {
                    Some(ParamValue::Integer(count)) => rounds * u64::try_from(*count).unwrap_or(0),
                    _ => 0,
                },
                kernels: 1,
                warmup_s,
                rays: 0,
            },
            UnitKind::Coherence | UnitKind::Animation | UnitKind::Stream => Work::default(),
        }
    }

    /// Rays of the references: one for each world and integrator, unless it is read from a file.
    fn references(&self) -> u64 {
        let part = |cell: &Cell| cell.on(&[&Cell::WORLD[..], &[Axis::Integrator]].concat());
        let mut references = BTreeMap::new();
        if self.experiment.reference.file.is_none() {
            for cell in self.plan.samplers.iter().map(part) {
                references.entry(cell.identity()).or_insert(cell);
            }
        }
        let spp = self.experiment.reference.spp;
        let rays = |cell: &Cell| self.image(&cell[Axis::Integrator], spp);
        references.values().map(rays).sum()
    }
}

/// Rays that one sample usually takes: one from the camera, and at each bounce one onwards and one
/// to a light.
fn rays_per_sample(registries: &Registries, integrator: &Variant) -> u64 {
    let known = registries.integrators.configured(integrator);
    let dimensions = known.map_or(FIRST_BOUNCE, |known| known.facts.dimensions);
    let bounces = dimensions.saturating_sub(FIRST_BOUNCE).div_ceil(PER_BOUNCE);
    1 + 2 * u64::from(bounces.min(USUAL_BOUNCES))
}

impl fmt::Display for Estimate<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "estimate: about {} on a software adapter with two cores, from {} million rays at \
             {} million a second, {} million elements to be compacted at {} million a second, \
             {} kernels at {SECONDS_PER_KERNEL} s each, and {:.0} s of \
             warm-up. These are round figures, nothing was measured here: a GPU needs a small part \
             of it. Loading, building, the judge and the report come on top.",
            duration(self.seconds()),
            millions(self.whole.rays),
            RAYS_PER_SECOND / 1e6,
            millions(self.whole.elements),
            ELEMENTS_PER_SECOND / 1e6,
            self.whole.kernels,
            self.whole.warmup_s,
        )
    }
}

/// A count in millions, with a decimal where it is small.
fn millions(count: u64) -> String {
    let millions = count as f64 / 1e6;
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
        let units = plan.units(&experiment);
        let estimate = Estimate::new(&experiment, &plan, &units, &registries);
        let parts: f64 = units.iter().map(|unit| estimate.seconds_of(unit)).sum();
        let references = estimate.references() as f64 / RAYS_PER_SECOND;
        assert!((parts + references - estimate.seconds()).abs() < 1e-9);
        estimate.whole
    }

    #[test]
    fn rays_of_a_small_plan_are_counted_by_hand() {
        let small = estimate(&[]);
        // Two replicates of 8 samples, the reference, three rounds, and the recorded rays.
        let images = 10_000 * (2 * 8 + 10 + 3);
        assert_eq!(small.rays, images + 5 * (4000 + 3 * 2000));
        assert_eq!(small.kernels, 3);
        assert!((small.warmup_s - 0.6).abs() < 1e-9);
        assert!(estimate(&["run.replicates=4"]).rays > small.rays);
        assert_eq!(small.elements, 0);
        let peers = estimate(&["axes.peer=obvhs-bvh2,obvhs-cwbvh"]);
        assert_eq!(peers.rays, small.rays + 5 * 2 * 3 * 2000);
        let compaction = estimate(&["axes.integrator=compaction:roger"]);
        assert_eq!(compaction.elements, 3 << 20);
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
        assert_eq!([millions(450_000), millions(284_300_000)], ["0.5", "284"]);
    }
}
