//! Sets of rays of one kind in a room of any size, traced through any structure: times with and without building it, and
//! for trees over the rays what each level of a descent does.

mod descent;
pub(crate) mod readings;
mod ready;
mod refitted;
mod room;
mod world;

pub use descent::fault_of_passes;
use ready::Ready;
use room::Lobes;
pub use room::{Vertex, mirrored, on_mirror, room};
use world::World;

use crate::run::{Absent, At, Cost, Measurement, Preparation, Prepared, Work};
use rayon::prelude::*;
use raystone_accel::{BuiltAccel as _, Hit, Ray};
use raystone_config::{Axis, Catalogue, Cell, Experiment, Plan, RAYS};
use raystone_core::parameters;
use raystone_core::params::{Entry, Parameters as _, Variant};
use raystone_record::RayClass;
use raystone_record::figure::Figure;
use raystone_sampling::{Coordinate, Demand, Sampler, to_unit};
use raystone_verify::rays::RaySet;
use std::sync::Arc;

parameters! {
    /// The room, and the image whose rays are traced.
    pub(crate) struct Room {
        /// squares along each edge of a wall; the room has 36 n² - 48 n triangles
        squares: u32 = 24, in 4..=256, where multiple_of(2);
        /// pixels along each edge of the image, which come along a Morton curve
        side: u32 = 128, in 16..=2048, where power_of_two();
        /// how far the balls have moved since the first frame, scene units; trees of that frame are refitted, too
        moved: f64 = 0.0, in 0.0..=0.5;
    }

    /// The rays of the camera.
    pub(crate) struct Primary {
        room: Room;
    }

    /// Rays that leave a mirror, and then what these hit.
    pub(crate) struct Bounce {
        room: Room;
        /// waves of the mirror's normals per unit of length; 0: a smooth mirror
        waves: f64 = 0.0, in 0.0..=1000.0;
        /// number of the reflection; the first leaves the mirror
        bounce: u32 = 1, in 1..=6;
        /// half-angle of the lobe around the mirror's direction, degrees; the sampler of the cell chooses in it
        spread: f64 = 0.0, in 0.0..=90.0;
    }

    /// Rays between a point light and what a mirror shows.
    pub(crate) struct Shadow {
        room: Room;
        /// waves of the mirror's normals per unit of length; 0: a smooth mirror
        waves: f64 = 0.0, in 0.0..=1000.0;
        /// whether they begin at the light
        reversed: bool = false;
    }
}

/// The rays of a cell.
enum Kind {
    Primary(Primary),
    Bounce(Bounce),
    Shadow(Shadow),
}

impl Kind {
    fn of(cell: &Cell) -> Option<Self> {
        let Variant { name, params, .. } = &cell[Axis::Integrator];
        Some(match name.strip_prefix(RAYS)? {
            "primary" => Self::Primary(Primary::from_checked(params)),
            "bounce" => Self::Bounce(Bounce::from_checked(params)),
            "shadow" => Self::Shadow(Shadow::from_checked(params)),
            _ => return None,
        })
    }

    fn room(&self) -> &Room {
        match self {
            Self::Primary(Primary { room })
            | Self::Bounce(Bounce { room, .. })
            | Self::Shadow(Shadow { room, .. }) => room,
        }
    }

    fn rays(&self) -> u32 {
        self.room().side.pow(2)
    }

    fn class(&self) -> RayClass {
        match self {
            Self::Primary(_) => RayClass::Primary,
            Self::Bounce(_) => RayClass::Bounce,
            Self::Shadow(_) => RayClass::Shadow,
        }
    }

    /// Whether a sampler chooses directions.
    fn is_sampled(&self) -> bool {
        matches!(self, Self::Bounce(bounce) if bounce.spread > 0.0)
    }

    fn set(&self, draw: Option<&Draw>, world: &World) -> Result<RaySet, Absent> {
        let twin = world.judge.cpu_twin(&world.soup);
        let twin = twin.ok_or_else(|| Absent::Failed("the reference has no twin".to_owned()))?;
        let host = (&world.soup, &*twin);
        let side = self.room().side;
        let rays = match self {
            Self::Primary(_) => room::primary(side),
            Self::Shadow(Shadow {
                waves, reversed, ..
            }) => room::shadows(&room::on_mirror(side, *waves as f32), *reversed, host),
            Self::Bounce(bounce) => {
                let seen = room::on_mirror(side, bounce.waves as f32);
                let spread = bounce.spread.to_radians() as f32;
                let draw =
                    |pixel, number| draw.map_or([0.0; 2], |draw| draw.at(pixel, SAMPLE, number));
                room::bounced(seen, (bounce.bounce, spread), &draw, host)
            }
        };
        let truth = |ray: &Ray| {
            if ray.is_ray() {
                twin.closest_hit(ray, &mut Default::default())
            } else {
                Hit::miss(ray)
            }
        };
        Ok(RaySet {
            class: self.class(),
            truth: rays.par_iter().map(truth).collect(),
            shadow: Vec::new(),
            rays,
        })
    }
}

/// Samples of a pixel, and the one whose rays are traced: the first of some sequences is no direction but the axis.
const SAMPLES: u32 = 16;
const SAMPLE: u32 = 5;

/// Where the numbers that choose directions in lobes come from.
struct Draw {
    sampler: Sampler,
    seed: u32,
}

impl Draw {
    /// The sampler of a cell; `None` where nothing is chosen.
    fn new(at: &At, cell: &Cell, kind: &Kind) -> Result<Option<Self>, Absent> {
        let Kind::Bounce(bounce) = kind else {
            return Ok(None);
        };
        let pair = cell.get(Axis::Sequence).zip(cell.get(Axis::Decorrelation));
        let Some((sequence, decorrelation)) = pair.filter(|_| kind.is_sampled()) else {
            return Ok(None);
        };
        let demand = Demand {
            samples: Some(SAMPLES),
            dimensions: 2 * bounce.bounce,
            width: Some(bounce.room.side),
        };
        let sampler = at
            .registries
            .samplers
            .sampler(sequence, decorrelation, &demand);
        let sampler = sampler.map_err(|error| Absent::Refused(error.to_string()))?;
        let seed = at.experiment.run.seed;
        Ok(Some(Self { sampler, seed }))
    }

    /// Two numbers in [0, 1) for a pixel, a sample and a reflection.
    fn at(&self, pixel: u32, sample: u32, number: u32) -> [f32; 2] {
        [2 * number, 2 * number + 1].map(|dimension| {
            to_unit(self.sampler.sample_u32(Coordinate {
                pixel,
                sample,
                dimension,
                seed: self.seed,
            }))
        })
    }
}

impl Bounce {
    /// RMSE over the pixels that see the mirror of the brightness that its lobes see; `None` for later reflections.
    fn error(&self, draw: &Draw, world: &World) -> Option<f64> {
        let twin = world
            .judge
            .cpu_twin(&world.soup)
            .filter(|_| self.bounce == 1)?;
        let lobes = Lobes {
            from: &room::on_mirror(self.room.side, self.waves as f32),
            spread: self.spread.to_radians() as f32,
            host: (&world.soup, &*twin),
        };
        let truth = world.truth(self, || lobes.truth());
        let found = lobes.means(SAMPLES, &|pixel, sample| draw.at(pixel, sample, 0));
        let squares = found.iter().zip(&*truth);
        let squares = squares.map(|(x, truth)| (x - truth).powi(2));
        Some((squares.sum::<f64>() / truth.len() as f64).sqrt())
    }
}

/// Kinds of rays through structures.
pub(crate) struct RaySets;

impl Measurement for RaySets {
    fn name(&self) -> &'static str {
        "rays"
    }

    fn plural(&self) -> &'static str {
        "sets of rays"
    }

    fn figures(&self) -> &'static [Figure] {
        &readings::FIGURES
    }

    fn declare(&self, catalogue: &mut Catalogue) {
        let entry = |name: &str, description: &str, schema| Entry {
            name: format!("{RAYS}{name}"),
            description: description.to_owned(),
            schema,
        };
        catalogue[Axis::Integrator].extend([
            entry(
                "primary",
                "rays of a camera in a closed room",
                Primary::schema(),
            ),
            entry(
                "bounce",
                "rays that a mirror in a closed room reflects",
                Bounce::schema(),
            ),
            entry(
                "shadow",
                "shadow rays of what a mirror shows",
                Shadow::schema(),
            ),
        ]);
    }

    fn cells(&self, _: &Experiment, plan: &Plan) -> Vec<Cell> {
        let own = [Axis::Integrator, Axis::Accel, Axis::Kernels];
        let sampled = [&own[..], &[Axis::Sequence, Axis::Decorrelation]].concat();
        let cells = [(own.to_vec(), false), (sampled, true)].into_iter();
        let cells = cells.flat_map(|(axes, is_sampled)| {
            let cells = plan.benches_on(&axes).into_iter();
            cells.filter(move |cell| {
                Kind::of(cell).is_some_and(|kind| kind.is_sampled() == is_sampled)
            })
        });
        by_rays(cells.collect())
    }

    fn group(&self, cell: &Cell) -> String {
        cell[Axis::Integrator].to_string()
    }

    fn unit_name(&self, cell: &Cell) -> String {
        cell.to_string()
    }

    fn settings(&self, experiment: &Experiment, _: &str) -> String {
        let run = &experiment.run;
        let own = (run.seed, run.runtime_checks, experiment.timing);
        format!("{:?}", (own, &experiment.coherence))
    }

    fn cost(&self, cell: &Cell, cost: &Cost) -> Work {
        let rays = Kind::of(cell).map_or(0, |kind| kind.rays());
        Work::kernels(4) + cost.timed(Work::rays(rays))
    }

    fn prepare<'a>(&'a self, at: &'a At<'a>, cells: &'a [Cell]) -> Preparation<'a> {
        let mut last: Option<Arc<World>> = None;
        let mut last_set: Option<(String, Arc<RaySet>)> = None;
        Box::new(cells.iter().map(move |cell| {
            let absent = || Absent::Failed("there are no such rays".to_owned());
            let kind = Kind::of(cell).ok_or_else(absent)?;
            let world = match last.take().filter(|world| world.is_of(kind.room())) {
                Some(world) => world,
                None => Arc::new(World::new(at.gpu(cell)?, kind.room())?),
            };
            last = Some(Arc::clone(&world));
            let draw = Draw::new(at, cell, &kind)?;
            let name = sampler_of(cell);
            let set = match last_set.take().filter(|(of, _)| *of == name) {
                Some((_, set)) => set,
                None => Arc::new(kind.set(draw.as_ref(), &world)?),
            };
            last_set = Some((name, Arc::clone(&set)));
            let error = match (&kind, &draw) {
                (Kind::Bounce(bounce), Some(draw)) => bounce.error(draw, &world),
                _ => None,
            };
            let ready = Ready::new(at, cell, (world, set), error)?;
            Ok(Box::new(ready) as Box<dyn Prepared>)
        }))
    }
}

/// The sampler of a cell.
fn sampler_of(cell: &Cell) -> String {
    let axes = [Axis::Sequence, Axis::Decorrelation].into_iter();
    let labels = axes.filter_map(|axis| cell.get(axis).map(Variant::to_string));
    labels.collect::<Vec<_>>().join(" ")
}

/// Cells set by set, in the order in which sets and samplers come first, so that structures share rays.
fn by_rays(mut cells: Vec<Cell>) -> Vec<Cell> {
    fn first(known: &mut Vec<String>, name: String) -> usize {
        let place = known.iter().position(|other| *other == name);
        place.unwrap_or_else(|| {
            known.push(name);
            known.len() - 1
        })
    }
    let (mut sets, mut samplers) = (Vec::new(), Vec::new());
    cells.sort_by_cached_key(|cell| {
        let set = first(&mut sets, cell[Axis::Integrator].to_string());
        [set, first(&mut samplers, sampler_of(cell))]
    });
    cells
}

#[cfg(test)]
mod tests;
