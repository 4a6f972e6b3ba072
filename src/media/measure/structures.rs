//! Structures over volumes: each answer is checked, then rays are walked through all of them in the same rounds.

use super::{cells_of, declare, name_of};
use crate::measure::failed;
use crate::medium::{Homogeneity, Medium};
use crate::rays::{SegmentRay, random_and_hard};
use crate::segments::{Walked, Walker, exact_depth, first_difference, walk_ray, wrong_segment};
use crate::{Volume, procedures, structure};
use glam::DVec3;
use raystone_bench::run::{Absent, At, Cost, Measurement, Preparation, Prepared, Work};
use raystone_bench::timing::{Measured, Samples};
use raystone_config::{Axis, Catalogue, Cell, Experiment, Plan};
use raystone_core::parameters;
use raystone_core::params::{Entry, ParamValue, Parameters as _, Params, Variant};
use raystone_gpu::{Elapsed, GpuError, probe_arithmetic};
use raystone_record::Reading;
use raystone_record::figure::{Better, Figure, Shown, Spread};
use std::sync::Arc;

parameters! {
    /// What a volume holds.
    pub(crate) enum Content {
        /// a ball of glass in fog
        GlassBall = "glass-ball",
        /// a cube of glass in fog, disturbed by noise
        NoisyCube = "noisy-cube",
        /// a gyroid of glass in fog
        Gyroid = "gyroid",
        /// a cloud in nothing
        Cloud = "cloud",
    }

    /// What rays are walked through.
    pub(crate) struct Load {
        /// what the volume holds
        content: Content = Content::Cloud;
        /// voxels along each axis
        side: u32 = 64, in 8..=512;
        /// rays, half of them hard
        rays: u32 = 16384, in 64..=1 << 20;
        /// true to keep levels in which no cube is homogeneous, of structures with a pyramid
        general_levels: bool = false;
        homogeneity: Homogeneity;
    }
}

impl Content {
    /// The volume with so many voxels along each axis.
    pub(crate) fn volume(self, side: u32) -> Result<Volume, crate::MediaError> {
        match self {
            Self::GlassBall => procedures::glass_ball(side),
            Self::NoisyCube => procedures::noisy_cube(side),
            Self::Gyroid => procedures::gyroid(side),
            Self::Cloud => procedures::cloud(side),
        }
    }
}

static FIGURES: [Figure; 6] = [
    Figure::new(
        "media-steps/v1",
        "steps",
        "per ray",
        Better::Lower,
        Shown::Digits(3),
        Spread::Exact,
    ),
    Figure::new(
        "media-fetches/v1",
        "fetches",
        "per ray",
        Better::Lower,
        Shown::Digits(3),
        Spread::Exact,
    ),
    Figure::new(
        "media-step-ns/v1",
        "time",
        "ns per step",
        Better::Lower,
        Shown::Digits(3),
        Spread::Median,
    ),
    Figure::new(
        "media-ray-ns/v1",
        "time",
        "ns per ray",
        Better::Lower,
        Shown::Digits(3),
        Spread::Median,
    ),
    Figure::new(
        "media-build-ms/v1",
        "build on the host",
        "ms",
        Better::Lower,
        Shown::Digits(3),
        Spread::Single,
    ),
    Figure::new(
        "media-bytes/v1",
        "structure",
        "",
        Better::Lower,
        Shown::Bytes,
        Spread::Exact,
    ),
];

/// The parameter of structures that keep all levels of a pyramid.
const WHOLE: &str = "whole";
/// Voxels whose answers are compared with the field, about.
const CHECKED_VOXELS: usize = 4096;
/// Rays whose answers are compared with the scalar twin, to the bit.
const TWIN_RAYS: usize = 2048;
/// Rays whose segments are judged in f64.
const JUDGED_RAYS: usize = 512;
/// Greatest difference of transmittances.
const TOLERANCE: f64 = 1e-6;

pub(super) struct Structures;

impl Measurement for Structures {
    fn name(&self) -> &'static str {
        "media:structures"
    }

    fn plural(&self) -> &'static str {
        "structures over volumes"
    }

    fn figures(&self) -> &'static [Figure] {
        &FIGURES
    }

    fn declare(&self, catalogue: &mut Catalogue) {
        for entry in structure::registry().entries() {
            declare::<Load>(catalogue, &entry.name, &entry.description);
        }
    }

    fn cells(&self, _: &Experiment, plan: &Plan) -> Vec<Cell> {
        let registry = structure::registry();
        cells_of(plan, &[Axis::Integrator, Axis::Kernels], |name| {
            registry.find(name).is_some()
        })
    }

    fn unit_name(&self, cell: &Cell) -> String {
        cell.to_string()
    }

    fn settings(&self, experiment: &Experiment, _: &str) -> String {
        format!("{:?}", (experiment.run.seed, experiment.timing))
    }

    fn cost(&self, cell: &Cell, cost: &Cost) -> Work {
        let load = Load::of(&cell[Axis::Integrator]);
        let voxels = f64::from(load.side).powi(3);
        Work::kernels(2) + cost.timed(Work::rays(load.rays)) + Work::other(2e-6 * voxels)
    }

    fn prepare<'a>(&'a self, at: &'a At<'a>, cells: &'a [Cell]) -> Preparation<'a> {
        let mut last: Option<(Content, u32, Arc<Volume>)> = None;
        Box::new(cells.iter().map(move |cell| {
            at.say(cell.to_string());
            let load = Load::of(&cell[Axis::Integrator]);
            // Before minutes are spent on what the device cannot bind.
            at.gpu(cell)?
                .zeroed("field", 4 * u64::from(load.side).pow(3))?;
            let volume = match &last {
                Some((content, side, volume)) if (*content, *side) == (load.content, load.side) => {
                    Arc::clone(volume)
                }
                _ => Arc::new(load.content.volume(load.side).map_err(failed)?),
            };
            last = Some((load.content, load.side, Arc::clone(&volume)));
            let ready = Ready::new(at, cell, &load, &volume)?;
            Ok(Box::new(ready) as Box<dyn Prepared>)
        }))
    }
}

impl Load {
    fn of(variant: &Variant) -> Self {
        Self::from_checked(&variant.params)
    }

    /// Parameters of the structure itself.
    fn of_structure(&self, entry: &Entry) -> Result<Params, Absent> {
        let mut params = Params::default();
        if self.general_levels {
            if entry.schema.iter().all(|parameter| parameter.name != WHOLE) {
                let name = &entry.name;
                return Err(Absent::Refused(format!(
                    "`{name}` has no pyramid whose levels could be left out or kept"
                )));
            }
            let whole = (WHOLE.to_owned(), ParamValue::Flag(true));
            params.0.extend([whole]);
        }
        Ok(params)
    }
}

/// A structure on the device that passed its checks.
struct Ready {
    walker: Walker,
    rays: f64,
    steps: f64,
    fetches: f64,
    build_ms: f64,
    bytes: f64,
}

impl Ready {
    fn new(at: &At, cell: &Cell, load: &Load, volume: &Volume) -> Result<Self, Absent> {
        let gpu = at.gpu(cell)?;
        let registry = structure::registry();
        let kind = name_of(cell).and_then(|name| registry.find(name));
        let Some(kind) = kind else {
            return Err(Absent::Failed("there is no such structure".to_owned()));
        };
        let made = kind.make(&load.of_structure(&kind.entry)?);
        let structure = made.map_err(|error| Absent::Failed(error.to_string()))?;
        let medium = Medium::new(volume, structure, load.homogeneity);
        (medium.validate((medium.field.len() / CHECKED_VOXELS) | 1)).map_err(failed)?;
        let seed = u64::from(at.experiment.run.seed);
        let rays = random_and_hard(volume, &medium, load.rays as usize, seed);
        let (walked, _) = Walker::new(gpu, &medium, &rays, true)?.walk()?;
        let exact = probe_arithmetic(gpu)?.is_exact();
        if let Some(wrong) = fault(&medium, &rays, &walked, exact) {
            return Err(Absent::Failed(wrong));
        }
        Ok(Self {
            walker: Walker::new(gpu, &medium, &rays, false)?,
            rays: f64::from(load.rays),
            steps: mean_of(&walked, |w| w.steps),
            fetches: mean_of(&walked, |w| w.fetches),
            build_ms: medium.build_ms,
            bytes: medium.bytes() as f64,
        })
    }
}

/// What is wrong with the answers of a structure: a difference from the scalar twin (on an adapter that computes like the host), a segment that
/// f64 refutes, a transmittance beside that of all voxels.
fn fault(medium: &Medium, rays: &[SegmentRay], walked: &[Walked], exact: bool) -> Option<String> {
    let some = &rays[..TWIN_RAYS.min(rays.len())];
    let differs = exact
        .then(|| first_difference(medium, some, walked))
        .flatten();
    let judged = &rays[..JUDGED_RAYS.min(rays.len())];
    let wrong = || judged.iter().find_map(|ray| wrong_segment(medium, ray, 2));
    let off = || {
        judged.iter().zip(walked).find_map(|(ray, walked)| {
            let exact = (-exact_depth(medium, ray)).exp();
            let found = (-f64::from(walked.depth)).exp();
            let text = || format!("a transmittance of {found} where voxels have {exact}: {ray:?}");
            ((found - exact).abs() > TOLERANCE).then(text)
        })
    };
    differs.or_else(wrong).or_else(off)
}

impl Measured for Ready {
    fn measure(&self) -> Result<Elapsed, GpuError> {
        Ok(self.walker.walk()?.1)
    }
}

impl Prepared for Ready {
    fn timed(&self) -> Vec<&dyn Measured> {
        vec![self]
    }

    fn readings(&self, samples: Vec<Samples>) -> Result<Vec<Reading>, String> {
        let samples = samples.into_iter().next().unwrap_or_default();
        let [steps, fetches, _, _, build, bytes] = &FIGURES;
        let counted = [
            Reading::exact(steps, self.steps),
            Reading::exact(fetches, self.fetches),
        ];
        let [per_step, per_ray] = times(&samples, self.rays, self.steps)?;
        let built = [
            Reading::exact(build, self.build_ms),
            Reading::exact(bytes, self.bytes),
        ];
        Ok([&counted[..], &[per_step, per_ray], &built].concat())
    }
}

/// Times per step and per ray, of rays with so many steps each.
fn times(samples: &Samples, rays: f64, steps: f64) -> Result<[Reading; 2], String> {
    let [_, _, per_step, per_ray, ..] = &FIGURES;
    Ok([
        samples.ns_per_item(per_step, rays * steps)?,
        samples.ns_per_item(per_ray, rays)?,
    ])
}

/// Two rays of 3 and 5 steps, which a millisecond is spent on: of each figure the name, and what it should be.
pub(super) fn known() -> Result<[(&'static str, f64, f64); 3], String> {
    let walked = [3, 5].map(|steps| Walked {
        depth: 0.0,
        steps,
        fetches: 7,
        digest: 0,
    });
    let steps = mean_of(&walked, |w| w.steps);
    let samples = Samples {
        ms: vec![1.0; 3],
        ..Samples::default()
    };
    let [per_step, per_ray] = times(&samples, 2.0, steps)?.map(|reading| reading.value.value);
    Ok([
        ("number of steps of a ray", steps, 4.0),
        ("time of a step", per_step, 125_000.0),
        ("time of a ray", per_ray, 500_000.0),
    ])
}

/// Structures, and the steps of a ray along x through 16³ equal voxels but for one in the corner: a voxel each, or two cubes of half the
/// grid. Cubes around voxels reach from the first to the fourteenth, which is two from the other, and from the next to the end.
const STEPS: [(&str, f64); 7] = [
    ("dda", 16.0),
    ("level-map", 2.0),
    ("min-max", 2.0),
    ("bricks", 2.0),
    ("sparse-tree", 2.0),
    ("chebyshev", 2.0),
    ("cube-bvh", 2.0),
];

/// Walks it: of each structure its name, the steps, and what they should be.
pub(super) fn known_steps() -> Result<Vec<(&'static str, f64, f64)>, String> {
    let corner = |x: DVec3| {
        if x.min_element() > 15.0 / 16.0 {
            2.0
        } else {
            1.0
        }
    };
    let volume = Volume::new([16; 3], |x| [corner(x), 0.0, 1.0]).map_err(|e| e.to_string())?;
    let registry = structure::registry();
    let steps = |(name, expected): (&'static str, f64)| {
        let kind = registry.find(name).ok_or("there is no such structure")?;
        let made = kind.make(&Params::default()).map_err(|e| e.to_string())?;
        let medium = Medium::new(&volume, made, Homogeneity::default());
        let beside = DVec3::new(-1.0, 2.5 / 16.0, 2.5 / 16.0);
        let ray = SegmentRay::new(&volume, &medium, beside, DVec3::X);
        let steps = ray.map_or(0, |ray| walk_ray(&medium, &ray, |_, _, _| ()).steps);
        Ok((name, f64::from(steps), expected))
    };
    STEPS.into_iter().map(steps).collect()
}

/// Mean of what each ray has.
fn mean_of(walked: &[Walked], of: fn(&Walked) -> u32) -> f64 {
    walked.iter().map(|w| f64::from(of(w))).sum::<f64>() / walked.len() as f64
}
