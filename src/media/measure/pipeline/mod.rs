//! Photons to an image of fog, by one strategy of scatter: times, what is dropped, and the error against a quadrature.

mod checks;
#[cfg(test)]
mod tests;

use super::{cells_of, declare};
use crate::medium::{Homogeneity, Medium};
use crate::photons::{Points, point_set};
use crate::pipeline::{Part, Pipeline, PipelineError, Rendered, Source, camera};
use crate::scatter::{Adding, ScatterError, Strategy, Tallies};
use crate::{Phase, Volume, phase, structure};
use checks::{Judge, Judged, truth_of};
use glam::{DVec3, Vec3};
use raystone_bench::run::{Absent, At, Cost, Measurement, Preparation, Prepared, Work};
use raystone_bench::timing::{Measured, Samples};
use raystone_config::{Axis, Catalogue, Cell, Experiment, Plan};
use raystone_core::parameters;
use raystone_core::params::Parameters as _;
use raystone_gpu::{Elapsed, Gpu, GpuError};
use raystone_image::{Image, Picture, automatic_exposure, tone_map};
use raystone_record::Reading;
use raystone_record::figure::{Better, Figure, Shown, Spread};
use std::rc::Rc;

/// The name on the axis of integrators, after [`MEDIA`].
const NAME: &str = "pipeline";
/// Scattering and absorption of the fog.
const FOG: [f32; 2] = [1.2, 0.3];
/// The lamp.
const LAMP: DVec3 = DVec3::new(0.3, 2.0, 0.4);
const INTENSITY: Vec3 = Vec3::new(2.0, 1.6, 1.0);
/// How the fog scatters.
const PHASE: Phase = Phase {
    kind: phase::HENYEY_GREENSTEIN,
    anisotropy: 0.4,
};
/// Pixels along each axis of the image whose error is taken.
const IMAGE: u32 = 32;
/// Pixels of the page along each axis of a pixel of the image.
const ENLARGED: u32 = 6;
/// Photons reach this many voxels for each along an axis, at most on average.
const REACH: u32 = 3;

parameters! {
    /// photons of a lamp through fog into a grid of radiance, by one strategy of scatter, and an image of it (Pfeuti 2009)
    struct Load {
        /// how energy is added to the grid
        strategy: Strategy = Strategy::Swap;
        /// attempts to compare and swap; 0 for as many as it takes
        attempts: u32 = 10, in 0..=1000;
        /// points of the lamp's square
        points: Points = Points::Hammersley;
        /// photons along each axis of the square
        photons: u32 = 128, in 8..=1024;
        /// voxels along each axis
        side: u32 = 32, in 2..=256;
    }
}

static FIGURES: [Figure; 7] = [
    Figure::new(
        "scatter-deposit-ns/v1",
        "photons to grid",
        "ns per deposit",
        Better::Lower,
        Shown::Digits(3),
        Spread::Median,
    ),
    Figure::new(
        "scatter-view-ns/v1",
        "grid to image",
        "ns per ray",
        Better::Lower,
        Shown::Digits(3),
        Spread::Median,
    ),
    Figure::new(
        "scatter-dropped/v1",
        "energy dropped",
        "",
        Better::Lower,
        Shown::Digits(3),
        Spread::Exact,
    ),
    Figure::new(
        "scatter-retries/v1",
        "retries",
        "per deposit",
        Better::Lower,
        Shown::Digits(3),
        Spread::Single,
    ),
    Figure::new(
        "scatter-rmse/v1",
        "RMSE of the image, relative to its mean",
        "",
        Better::Lower,
        Shown::Digits(3),
        Spread::Exact,
    ),
    Figure::new(
        "scatter-bias/v1",
        "mean error of the image, relative",
        "",
        Better::Lower,
        Shown::Digits(3),
        Spread::Exact,
    ),
    Figure::new(
        "scatter-bytes/v1",
        "written by photons",
        "",
        Better::Lower,
        Shown::Bytes,
        Spread::Exact,
    ),
];

pub(super) struct Photons;

impl Measurement for Photons {
    fn name(&self) -> &'static str {
        "media:pipeline"
    }

    fn plural(&self) -> &'static str {
        "photon pipelines"
    }

    fn figures(&self) -> &'static [Figure] {
        &FIGURES
    }

    fn declare(&self, catalogue: &mut Catalogue) {
        declare::<Load>(catalogue, NAME, Load::ABOUT);
    }

    fn cells(&self, _: &Experiment, plan: &Plan) -> Vec<Cell> {
        cells_of(plan, &[Axis::Integrator, Axis::Kernels], |name| {
            name == NAME
        })
    }

    fn unit_name(&self, cell: &Cell) -> String {
        cell.to_string()
    }

    fn settings(&self, experiment: &Experiment, _: &str) -> String {
        format!("{:?}", (experiment.run.seed, experiment.timing))
    }

    fn cost(&self, cell: &Cell, cost: &Cost) -> Work {
        let load = Load::from_checked(&cell[Axis::Integrator].params);
        let rays = load.photons * load.photons + IMAGE * IMAGE;
        Work::kernels(3) + cost.timed(Work::rays(rays)) + Work::other(0.5)
    }

    fn prepare<'a>(&'a self, at: &'a At<'a>, cells: &'a [Cell]) -> Preparation<'a> {
        Box::new(cells.iter().map(move |cell| {
            at.say(cell.to_string());
            let load = Load::from_checked(&cell[Axis::Integrator].params);
            let ready = Ready::new(at, cell, &load)?;
            Ok(Box::new(ready) as Box<dyn Prepared>)
        }))
    }
}

impl From<PipelineError> for Absent {
    fn from(error: PipelineError) -> Self {
        match error {
            PipelineError::Gpu(error) | PipelineError::Scatter(ScatterError::Gpu(error)) => {
                error.into()
            }
            // Not a fault of the strategy: the device or the load does not allow it.
            PipelineError::Scatter(error) => Self::Refused(error.to_string()),
            error => Self::Failed(error.to_string()),
        }
    }
}

/// Passes of one kind.
struct Passes {
    pipeline: Rc<Pipeline>,
    part: Part,
}

impl Measured for Passes {
    fn measure(&self) -> Result<Elapsed, GpuError> {
        self.pipeline.replay(self.part)
    }
}

/// A pipeline that passed its checks.
struct Ready {
    halves: [Passes; 2],
    picture: Option<Picture>,
    bytes: f64,
    tallies: Tallies,
    judged: Judged,
}

impl Ready {
    fn new(at: &At, cell: &Cell, load: &Load) -> Result<Self, Absent> {
        let gpu = at.gpu(cell)?;
        let [scattering, absorption] = FOG;
        let mut volume = Volume::new([load.side; 3], |_| [scattering, absorption, 1.0])?;
        volume.phase = PHASE;
        let made = structure::registry()
            .find("level-map")
            .map(|kind| kind.make(&Default::default()));
        let Some(Ok(structure)) = made else {
            return Err(Absent::Failed("there is no level map".to_owned()));
        };
        let medium = Medium::new(&volume, structure, Homogeneity::default());
        let seed = u64::from(at.experiment.run.seed);
        let points = point_set(load.points, load.photons, seed).map_err(Absent::Failed)?;
        let points = points.into_iter().map(|point| (point, 1.0)).collect();
        let adding = Adding {
            attempts: load.attempts,
            ..Adding::new(
                load.strategy,
                load.photons * load.photons * load.side.saturating_mul(REACH) / 2,
            )
        };
        let source = lamp();
        let rays = view();
        let mut pipeline = begun(gpu, (&volume, &medium), adding)?;
        turn_to(&mut pipeline, source, &rays)?;
        pipeline.set_points(points);
        let rendered = pipeline.render()?;
        ran("other points", &rendered, true)?;
        let truth = truth_of(&volume, &medium, LAMP, &rays);
        let judge = Judge {
            volume: &volume,
            medium: &medium,
            source: &source,
            rays: &rays,
            truth: &truth,
            side: load.side,
            unit: pipeline.unit(),
            smoothing: Default::default(),
            adaptive: None,
        };
        let judged = judge.check(&pipeline, &rendered).map_err(Absent::Failed)?;
        let bytes = pipeline.bytes() as f64;
        let pipeline = Rc::new(pipeline);
        let halves = [Part::Photons, Part::View].map(|part| Passes {
            pipeline: Rc::clone(&pipeline),
            part,
        });
        Ok(Self {
            halves,
            picture: drawn(&rendered.image),
            bytes,
            tallies: rendered.tallies,
            judged,
        })
    }
}

/// A pipeline that has shown another light, of few points, by another phase function to another view.
fn begun(
    gpu: &Gpu,
    (volume, medium): (&Volume, &Medium),
    adding: Adding,
) -> Result<Pipeline, PipelineError> {
    let beam = Source::Beam {
        middle: DVec3::new(0.5, 0.5, -0.5),
        direction: DVec3::Z,
        half: 0.3,
        power: Vec3::ONE,
    };
    let few = [[0.2, 0.3], [0.7, 0.6]].map(|point| (point, 1.0)).to_vec();
    let mut of_volume = volume.clone();
    of_volume.phase = Phase::ISOTROPIC;
    let mut pipeline = Pipeline::new(gpu, (&of_volume, medium), adding, beam, few)?;
    pipeline.set_view(&camera(
        DVec3::new(0.5, 0.9, -2.0),
        DVec3::splat(0.5),
        0.2,
        4,
    ));
    pipeline.render()?;
    Ok(pipeline)
}

/// Changes light, phase function and view one after the other: each has to run its passes again, and no others.
fn turn_to(pipeline: &mut Pipeline, source: Source, rays: &[(DVec3, DVec3)]) -> Result<(), Absent> {
    pipeline.set_source(source);
    ran("another light", &pipeline.render()?, true)?;
    pipeline.set_phase(PHASE);
    ran("another phase function", &pipeline.render()?, false)?;
    pipeline.set_view(rays);
    ran("another view", &pipeline.render()?, false)
}

/// Whether what ran after a change was the view, and the photons before it if they had to.
fn ran(change: &str, rendered: &Rendered, photons: bool) -> Result<(), Absent> {
    let has = |name: &str| rendered.passes.iter().any(|pass| pass == name);
    if has("gather") && has("photons") == photons {
        return Ok(());
    }
    let wanted = if photons {
        "photons and view"
    } else {
        "the view alone"
    };
    Err(Absent::Failed(format!(
        "after {change} the passes {:?} ran, where {wanted} have to",
        rendered.passes
    )))
}

/// The lamp, whose colours differ.
fn lamp() -> Source {
    Source::Point {
        position: LAMP,
        intensity: INTENSITY,
    }
}

/// Rays of the image.
fn view() -> Vec<(DVec3, DVec3)> {
    camera(DVec3::new(0.6, 0.4, -1.6), DVec3::splat(0.5), 0.35, IMAGE)
}

/// The image as a picture, each pixel as a square; `None` without an image.
fn drawn(image: &[Vec3]) -> Option<Picture> {
    let side = IMAGE * ENLARGED;
    let pixel = |at: u32| {
        let [x, y] = [at % side, at / side].map(|c| c / ENLARGED);
        image[(y * IMAGE + x) as usize].to_array()
    };
    let pixels = (0..side * side).map(pixel).collect();
    let image = Image::new(side, side, pixels).ok()?;
    Some(tone_map(&image, automatic_exposure(&image)))
}

impl Prepared for Ready {
    fn timed(&self) -> Vec<&dyn Measured> {
        self.halves
            .iter()
            .map(|half| half as &dyn Measured)
            .collect()
    }

    fn readings(&self, samples: Vec<Samples>) -> Result<Vec<Reading>, String> {
        let mut samples = samples.into_iter();
        let mut next = || samples.next().unwrap_or_default();
        let [deposit, view, dropped, retries, rmse, bias, bytes] = &FIGURES;
        let deposits = self.tallies.deposits as f64;
        Ok(vec![
            next().ns_per_item(deposit, deposits)?,
            next().ns_per_item(view, f64::from(IMAGE * IMAGE))?,
            Reading::exact(dropped, self.judged.dropped),
            Reading::exact(retries, self.tallies.retries as f64 / deposits),
            Reading::exact(rmse, self.judged.rmse),
            Reading::exact(bias, self.judged.bias),
            Reading::exact(bytes, self.bytes),
        ])
    }

    fn picture(&self) -> Option<Picture> {
        self.picture.clone()
    }
}
