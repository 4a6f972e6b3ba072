//! Photons to an image of fog, by one strategy of scatter: times, what is dropped, and the error against a quadrature.

#[cfg(test)]
mod break_even;
mod checks;
mod ready;
mod scene;
#[cfg(test)]
mod tests;

use super::{cells_of, declare};
use crate::adaptive::{Adaptive, Filter, Mode, Smoothing, break_even};
use crate::photons::{ImportanceMap, Order, Points, Warp, ordered, point_set};
use crate::pipeline::{Generality, Mirror, PipelineError};
use crate::scatter::{ScatterError, Strategy};
use crate::voxels::VoxelError;
use crate::{Phase, phase};
use glam::{DVec3, Vec3};
use raystone_bench::run::{Absent, At, Cost, Measurement, Preparation, Prepared, Work};
use raystone_config::{Axis, Catalogue, Cell, Experiment, Plan};
use raystone_core::parameters;
use raystone_core::params::{Choice as _, Parameters as _};
use raystone_record::figure::{Better, Figure, Shown, Spread};
use ready::Ready;
pub(super) use ready::known;
use scene::Scene;
use std::rc::Rc;

/// The name on the axis of integrators, after [`MEDIA`].
const NAME: &str = "pipeline";
/// Scattering and absorption of the fog.
const FOG: [f32; 2] = [1.2, 0.3];
/// The lamp.
const LAMP: DVec3 = DVec3::new(0.3, 2.0, 0.4);
const INTENSITY: Vec3 = Vec3::new(2.0, 1.6, 1.0);
/// Radiance of the zenith of a sky, for a lamp of intensity 1.
const SKY: f32 = 0.03;
/// How the fog scatters.
const PHASE: Phase = Phase {
    kind: phase::HENYEY_GREENSTEIN,
    anisotropy: 0.4,
};
/// Pixels along each axis of the image whose error is taken.
const IMAGE: u32 = 32;
/// Seconds of a deposit on a software adapter with two cores.
const SECONDS_PER_DEPOSIT: f64 = 4e-8;
/// Photons reach this many voxels for each along an axis, at most on average.
const REACH: u32 = 3;

parameters! {
    /// What a lamp shines into.
    enum Content {
        /// fog that is the same everywhere
        Fog = "fog",
        /// a dense ball in fog, with its shadow
        Shadow = "shadow",
        /// a cloud in nothing
        Cloud = "cloud",
        /// a ball of clear glass in fog, with its caustic
        Ball = "ball",
        /// a cube of clear glass in fog, which noise disturbs
        Cube = "cube",
        /// a lens of Luneburg in fog that is the same everywhere
        Lens = "lens",
        /// a torus of clear glass in fog, from a mesh
        Torus = "torus",
        /// a closed mesh of clear glass in fog
        Mesh = "mesh",
    }

    /// How a medium scatters.
    enum Scatters {
        /// by Henyey and Greenstein's function
        Forward = "forward",
        /// the same in all directions
        Isotropic = "isotropic",
    }

    /// photons of a lamp through a medium into a grid of radiance, evenly or by a map of importance, by one strategy of scatter, and an image of it (Pfeuti 2009)
    // Many fields: one for each parameter.
    struct Load {
        /// how energy is added to the grid
        strategy: Strategy = Strategy::Swap;
        /// attempts to compare and swap; 0 for as many as it takes
        attempts: u32 = 10, in 0..=1000;
        /// what the lamp shines into
        content: Content = Content::Fog;
        /// the mesh: a built-in scene or a file, whose materials are not read
        mesh: String = String::new();
        /// points of the lamp's square
        points: Points = Points::Hammersley;
        /// order of the list of points
        order: Order = Order::Natural;
        /// photons along each axis of the square
        photons: u32 = 128, in 8..=1024;
        /// voxels along each axis
        side: u32 = 32, in 2..=256;
        /// how photons are spread over the square
        mode: Mode = Mode::Reference;
        /// pilots along each axis of the square and cells of the map: a power of two
        pilots: u32 = 64, in 4..=256;
        /// cells of the pilots' grid along each axis
        pilot_cells: u32 = 16, in 2..=64;
        /// share of lit cells that are sampled as edges: those with the greatest gradients
        edges: f64 = 0.15, in 0.0..=1.0;
        /// share of lit cells that are sampled as shadows: those with the least radiance
        shadows: f64 = 0.05, in 0.0..=1.0;
        /// what the map has everywhere beside the discs of these cells, each of height 1
        background: f64 = 1.0, in 0.001..=1000.0;
        /// greatest density of photons, relative to even ones; 0 for any
        most_density: f64 = 0.0, in 0.0..=1000.0;
        /// above 0, the complement of the map: what it leaves of so many times as many even photons
        complement: f64 = 0.0, in 0.0..=1000.0;
        /// how points follow the map
        warp: Warp = Warp::Inversion;
        /// how the grid is smoothed
        filter: Filter = Filter::None;
        /// level of the constant filter
        level: u32 = 1, in 0..=6;
        /// photons that a cell of the count filter has to hold
        least: u32 = 1, in 1..=1000;
        /// weight for which the weight filter is a level wider; an even photon has 1
        weight_step: f64 = 1.0, in 0.01..=1000.0;
        /// true to read σ even where it is known to be the same: what generality costs
        general: bool = false;
        /// true to follow ways as in a medium that bends light, even where none does
        general_ways: bool = false;
        /// true to have rays of the view step through voxels in which nothing scatters
        general_steps: bool = false;
        /// true to have photons that miss the medium in the list, too, where ways are straight
        general_list: bool = false;
        /// true to have photons leave energy in voxels that no view reads, too, where ways are straight and nothing is smoothed
        general_deposits: bool = false;
        /// true to have the view look for a mirror even where nothing is reflected, where light is refracted
        general_mirror: bool = false;
        /// true to sum directions of light even where the phase function is isotropic
        general_directions: bool = false;
        /// the part of light that the glass reflects: that of a sky, where the index is halfway
        reflectivity: f64 = 0.0, in 0.0..=1.0;
        /// how the medium scatters: forward, by Henyey and Greenstein's function with 0.4, or the same in all directions
        scatters: Scatters = Scatters::Forward;
    }
}

impl Load {
    fn phase(&self) -> Phase {
        match self.scatters {
            Scatters::Forward => PHASE,
            Scatters::Isotropic => Phase::ISOTROPIC,
        }
    }

    fn generality(&self) -> Generality {
        Generality {
            extinction: self.general,
            curves: self.general_ways,
            empty: self.general_steps,
            missed: self.general_list,
            unread: self.general_deposits,
            mirror: self.general_mirror,
            directions: self.general_directions,
        }
    }

    /// The glass as a mirror, of a sky whose colour is that of a lamp of this intensity.
    fn mirror(&self, intensity: Vec3) -> Option<Mirror> {
        (self.reflectivity > 0.0).then(|| Mirror {
            index: (1.0 + scene::GLASS) / 2.0,
            part: self.reflectivity as f32,
            zenith: SKY * intensity,
        })
    }

    /// The pipeline that is run.
    fn chosen(&self) -> Mode {
        self.mode.at(self.photons.pow(2), self.filter, self.points)
    }

    /// What was chosen and why, where that is left to the program.
    fn choice(&self) -> Option<String> {
        let name = self.chosen().name();
        let why = match break_even(self.filter, self.points) {
            Some(least) => format!("pilots pay from {least} photons on"),
            None => "pilots pay at no number of photons".to_owned(),
        };
        let (photons, filter) = (self.photons.pow(2), self.filter.name());
        (self.mode == Mode::Auto).then(|| {
            format!(
                "{name}, for {photons} photons: with the filter `{filter}` and these points {why}"
            )
        })
    }

    fn adaptive(&self, seed: u64) -> Option<Adaptive> {
        (self.chosen() == Mode::Adaptive).then_some(Adaptive {
            pilots: self.pilots,
            cells: self.pilot_cells,
            edges: self.edges,
            shadows: self.shadows,
            background: self.background,
            most_density: self.most_density,
            complement: self.complement,
            warp: self.warp,
            seed,
        })
    }

    /// The greatest density of photons, which are as even as their points where nothing sends them elsewhere.
    fn greatest_of(&self, map: &ImportanceMap) -> f64 {
        match self.warp {
            Warp::None => 1.0,
            _ => map.greatest(),
        }
    }

    /// True if points are sent to cells by a table, which undoes how even they are.
    fn is_shuffled(&self) -> bool {
        self.chosen() == Mode::Adaptive && self.warp == Warp::Alias
    }

    fn smoothing(&self) -> Smoothing {
        Smoothing {
            filter: self.filter,
            level: self.level,
            least: self.least,
            weight_step: self.weight_step,
            ..Smoothing::default()
        }
    }

    /// So many photons along each axis of the square, in the order of the list.
    fn points(&self, photons: u32, seed: u64) -> Result<Vec<([f64; 2], f64)>, Absent> {
        let set = point_set(self.points, photons, seed).map_err(Absent::Failed)?;
        let set = ordered(set, self.order, photons, seed);
        Ok(set.into_iter().map(|point| (point, 1.0)).collect())
    }
}

/// A figure that is counted or computed, without a unit; less is better.
const fn exact(id: &'static str, title: &'static str) -> Figure {
    Figure::new(
        id,
        title,
        "",
        Better::Lower,
        Shown::Digits(3),
        Spread::Exact,
    )
}

static FIGURES: [Figure; 29] = [
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
    exact("scatter-dropped/v1", "energy dropped"),
    Figure::new(
        "scatter-retries/v1",
        "retries",
        "per deposit",
        Better::Lower,
        Shown::Digits(3),
        Spread::Single,
    ),
    exact("scatter-rmse/v1", "RMSE of the image, relative to its mean"),
    exact("scatter-bias/v1", "mean error of the image, relative"),
    Figure::new(
        "scatter-bytes/v1",
        "written by photons",
        "",
        Better::Lower,
        Shown::Bytes,
        Spread::Exact,
    ),
    exact(
        "scatter-noise/v1",
        "RMSE of the image from that of 2²⁰ photons, relative",
    ),
    Figure::new(
        "photon-count/v1",
        "photons that meet the medium",
        "",
        Better::Neither,
        Shown::Count,
        Spread::Exact,
    ),
    Figure::new(
        "photon-pilots/v1",
        "pilots that meet it",
        "",
        Better::Neither,
        Shown::Count,
        Spread::Exact,
    ),
    Figure::new(
        "photon-density/v1",
        "greatest density of photons, relative to even ones",
        "",
        Better::Neither,
        Shown::Digits(3),
        Spread::Exact,
    ),
    exact(
        "photon-equal/v1",
        "photons for the error of the reference pipeline, as a part of its own",
    ),
    exact("photon-equal-all/v1", "the same with pilots"),
    Figure::new(
        "photon-pilots-ms/v1",
        "pilots to their grid",
        "ms",
        Better::Lower,
        Shown::Digits(3),
        Spread::Median,
    ),
    Figure::new(
        "photon-smooth-ms/v1",
        "grid to smooth grid",
        "ms",
        Better::Lower,
        Shown::Digits(3),
        Spread::Median,
    ),
    Figure::new(
        "photon-march-ms/v1",
        "photons to grid",
        "ms",
        Better::Lower,
        Shown::Digits(3),
        Spread::Median,
    ),
    Figure::new(
        "photon-frame-ms/v1",
        "all passes on the device",
        "ms",
        Better::Lower,
        Shown::Digits(3),
        Spread::Median,
    ),
    Figure::new(
        "photon-conflicts/v1",
        "retries of all deposits",
        "",
        Better::Lower,
        Shown::Count,
        Spread::Single,
    ),
    exact(
        "scatter-noise-caustic/v1",
        "the same of pixels that refraction lights",
    ),
    exact("scatter-noise-shadow/v1", "of those that it darkens"),
    exact("scatter-noise-even/v1", "and of the others"),
    exact("scatter-view-steps/v1", "steps of a ray of the view"),
    exact(
        "scatter-flip/v1",
        "mean FLIP of the image from that of 2²⁰ photons",
    ),
    exact(
        "scatter-flip-caustic/v1",
        "the same of pixels that refraction lights",
    ),
    exact("scatter-flip-shadow/v1", "of those that it darkens"),
    exact("scatter-flip-even/v1", "and of the others"),
    exact(
        "scatter-deposits/v1",
        "voxels that a photon leaves energy in",
    ),
    Figure::new(
        "photon-adds/v1",
        "additions to sums, of photons and pilots",
        "",
        Better::Lower,
        Shown::Count,
        Spread::Exact,
    ),
    Figure::new(
        "photon-pilot-adds/v1",
        "those of pilots",
        "",
        Better::Lower,
        Shown::Count,
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
        let load = Load::from_checked(&cell[Axis::Integrator].params);
        match load.choice() {
            Some(_) => format!("{cell}: {}", load.chosen().name()),
            None => cell.to_string(),
        }
    }

    fn settings(&self, experiment: &Experiment, _: &str) -> String {
        format!("{:?}", (experiment.run.seed, experiment.timing))
    }

    fn cost(&self, cell: &Cell, cost: &Cost) -> Work {
        let load = Load::from_checked(&cell[Axis::Integrator].params);
        let rays = load.photons * load.photons + IMAGE * IMAGE;
        let deposits = f64::from(load.photons).powi(2) * f64::from(load.side);
        let (kernels, runs) = match load.chosen() {
            Mode::Adaptive => (8, 30.0),
            _ => (3, 3.0),
        };
        let seconds = 0.5 + runs * deposits * SECONDS_PER_DEPOSIT;
        Work::kernels(kernels) + cost.timed(Work::rays(rays)) + Work::other(seconds)
    }

    fn prepare<'a>(&'a self, at: &'a At<'a>, cells: &'a [Cell]) -> Preparation<'a> {
        let mut scenes: Vec<Rc<Scene>> = Vec::new();
        Box::new(cells.iter().map(move |cell| {
            at.say(cell.to_string());
            let load = Load::from_checked(&cell[Axis::Integrator].params);
            let known = |scene: &&Rc<Scene>| scene.is_of(&load, &cell[Axis::Kernels].label);
            let scene = match scenes.iter().find(known) {
                Some(scene) => Rc::clone(scene),
                None => {
                    let scene = Rc::new(Scene::new(
                        at.gpu(cell)?,
                        &load,
                        &cell[Axis::Kernels].label,
                    )?);
                    scenes.push(Rc::clone(&scene));
                    scene
                }
            };
            let ready = Ready::new(at, cell, &load, &scene)?;
            Ok(Box::new(ready) as Box<dyn Prepared>)
        }))
    }
}

impl From<VoxelError> for Absent {
    fn from(error: VoxelError) -> Self {
        match error {
            VoxelError::Gpu(error) => error.into(),
            error => Self::Failed(error.to_string()),
        }
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
