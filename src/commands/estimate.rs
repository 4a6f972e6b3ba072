//! How long a plan would take, roughly.

use raystone::config::{Axis, Cell, Experiment, Plan};
use raystone::params::{ParamValue, Variant};
use raystone::run::Registries;
use raystone::sampling::dimensions::{FIRST_BOUNCE, PER_BOUNCE};
use std::fmt;

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

/// Work of a plan that grows with its size.
pub struct Estimate {
    rays: u64,
    elements: u64,
    kernels: u64,
    warmup_s: f64,
}

impl Estimate {
    /// Counts the rays and kernels of a plan.
    pub fn new(experiment: &Experiment, plan: &Plan, registries: &Registries) -> Self {
        let [width, height] = experiment.resolution;
        let pixels = u64::from(width) * u64::from(height);
        let image = |integrator: &Variant, spp: u32| {
            pixels * u64::from(spp) * rays_per_sample(registries, integrator)
        };
        let errors = plan.samplers.iter().map(|cell| {
            u64::from(plan.renders(cell)) * image(&cell[Axis::Integrator], experiment.spp.max())
        });
        // One for each world and integrator, unless it is read from a file.
        let part = |cell: &Cell| cell.on(&[&Cell::WORLD[..], &[Axis::Integrator]].concat());
        let mut references: Vec<Cell> = Vec::new();
        for cell in plan.samplers.iter().map(part) {
            if !references.contains(&cell) {
                references.push(cell);
            }
        }
        let rendered = experiment.reference.file.is_none();
        let references = references
            .iter()
            .filter(|_| rendered)
            .map(|cell| image(&cell[Axis::Integrator], experiment.reference.spp));
        let timing = &experiment.timing;
        let rounds = u64::from(timing.rounds);
        let times = plan
            .times
            .iter()
            .map(|cell| rounds * image(&cell[Axis::Integrator], timing.spp));
        let recorded = u64::from(experiment.gate.rays) + rounds * u64::from(timing.rays);
        let elements = plan.compactions.iter().map(|cell| {
            match cell[Axis::Integrator].params.0.get("elements") {
                Some(ParamValue::Integer(count)) => rounds * u64::try_from(*count).unwrap_or(0),
                _ => 0,
            }
        });
        let structures = plan.structures.len() as u64;
        let full_cells = plan.times.len() as u64;
        let kernels = 2 * structures + full_cells + plan.compactions.len() as u64;
        let classes = RAY_CLASSES[usize::from(experiment.gate.shadow_orders)];
        let warmups = classes * structures + full_cells + plan.compactions.len() as u64;
        // Peers answer the same rays without a judge's part.
        let peers = plan.peers.len() as u64 * rounds * u64::from(timing.rays);
        Self {
            rays: errors.sum::<u64>()
                + references.sum::<u64>()
                + times.sum::<u64>()
                + structures * classes * recorded
                + classes * peers,
            elements: elements.sum(),
            kernels,
            warmup_s: warmups as f64 * f64::from(timing.min_warmup_ms) / 1e3,
        }
    }

    fn seconds(&self) -> f64 {
        self.rays as f64 / RAYS_PER_SECOND
            + self.elements as f64 / ELEMENTS_PER_SECOND
            + self.kernels as f64 * SECONDS_PER_KERNEL
            + self.warmup_s
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

impl fmt::Display for Estimate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "estimate: about {} on a software adapter with two cores, from {} million rays at \
             {} million a second, {} million elements to be compacted at {} million a second, \
             {} kernels at {SECONDS_PER_KERNEL} s each, and {:.0} s of \
             warm-up. These are round figures, nothing was measured here: a GPU needs a small part \
             of it. Loading, building, the judge and the report come on top.",
            duration(self.seconds()),
            millions(self.rays),
            RAYS_PER_SECOND / 1e6,
            millions(self.elements),
            ELEMENTS_PER_SECOND / 1e6,
            self.kernels,
            self.warmup_s,
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

    fn estimate(overrides: &[&str]) -> Estimate {
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
        Estimate::new(&experiment, &plan, &registries)
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
