//! Sets of rays of one kind in a room of any size, traced through any structure: times with and without building it, and
//! for trees over the rays what each level of a descent does.

mod readings;
mod room;

pub use room::{Vertex, mirrored, on_mirror, room};

use crate::run::{Absent, At, Cost, Measurement, Preparation, Prepared, Work};
use crate::timing::{Measured, Samples, Watch};
use rayon::prelude::*;
use raystone_accel::{
    AccelError, Anatomy, Ask, BuildLog, BuiltAccel as _, BuiltBvh, BvhParameters, Hit, Ray,
    RayBatch, RayHierarchy, Space, StreamCounts, Structure as _, Traced, Tracer, TriangleBuffers,
    TriangleSoup,
};
use raystone_config::{Axis, Catalogue, Cell, Experiment, Plan, RAYS};
use raystone_core::parameters;
use raystone_core::params::{Entry, Parameters as _, Variant};
use raystone_gpu::{Elapsed, Gpu, GpuError, probe_arithmetic};
use raystone_record::figure::Figure;
use raystone_record::{RayClass, Reading};
use raystone_sampling::{Coordinate, Demand, to_unit};
use raystone_verify::gate::timed_fault;
use raystone_verify::rays::RaySet;
use std::sync::Arc;
use std::time::Instant;

parameters! {
    /// The room, and the image whose rays are traced.
    pub(crate) struct Room {
        /// squares along each edge of a wall; the room has 36 n² - 48 n triangles
        squares: u32 = 24, in 4..=256, where multiple_of(2);
        /// pixels along each edge of the image, which come along a Morton curve
        side: u32 = 128, in 16..=2048, where power_of_two();
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
        /// half-angle of the lobe around the mirror's direction, degrees
        spread: f64 = 0.0, in 0.0..=90.0;
        /// sequence of the numbers that choose a direction in a lobe
        sequence: Variant = Variant::plain("pixel-hash"), where entry_of("sequence");
        /// decorrelation of these numbers from pixel to pixel
        decorrelation: Variant = Variant::plain("none"), where entry_of("decorrelation");
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

    fn set(&self, at: &At, world: &World) -> Result<RaySet, Absent> {
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
                room::bounced(seen, (bounce.bounce, spread), &bounce.draw(at)?, host)
            }
        };
        let truth = |ray: &Ray| match ray.is_ray() {
            true => twin.closest_hit(ray, &mut Default::default()),
            false => Hit::miss(ray),
        };
        Ok(RaySet {
            class: self.class(),
            truth: rays.par_iter().map(truth).collect(),
            shadow: Vec::new(),
            rays,
        })
    }
}

/// Samples of a pixel, and the one whose numbers are taken: the first of some sequences is no direction but the axis.
const SAMPLES: u32 = 16;
const SAMPLE: u32 = 5;

impl Bounce {
    /// Two numbers in [0, 1) for a pixel and a reflection.
    fn draw(&self, at: &At) -> Result<impl Fn(u32, u32) -> [f32; 2] + Sync + use<>, Absent> {
        let demand = Demand {
            samples: Some(SAMPLES),
            dimensions: 2 * self.bounce,
            width: Some(self.room.side),
        };
        let registry = &at.registries.samplers;
        let sampler = registry.sampler(&self.sequence, &self.decorrelation, &demand);
        let sampler = sampler.map_err(|error| Absent::Refused(error.to_string()))?;
        let seed = at.experiment.run.seed;
        Ok(move |pixel, number| {
            [2 * number, 2 * number + 1].map(|dimension| {
                to_unit(sampler.sample_u32(Coordinate {
                    pixel,
                    sample: SAMPLE,
                    dimension,
                    seed,
                }))
            })
        })
    }
}

/// A room on the host, with what judges answers in it.
struct World {
    squares: u32,
    soup: TriangleSoup,
    judge: BuiltBvh,
}

impl World {
    fn new(squares: u32) -> Result<Self, Absent> {
        let soup = room::room(squares);
        let parameters = BvhParameters::default();
        let judge = BuiltBvh::build(&soup, &parameters, &mut BuildLog::default());
        let judge = judge.map_err(|error| Absent::Failed(error.to_string()))?;
        Ok(Self {
            squares,
            soup,
            judge,
        })
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
        let mut cells = plan.benches_on(&[Axis::Integrator, Axis::Accel, Axis::Kernels]);
        cells.retain(|cell| Kind::of(cell).is_some());
        cells
    }

    fn unit_name(&self, cell: &Cell) -> String {
        cell.to_string()
    }

    fn settings(&self, experiment: &Experiment, _: &str) -> String {
        let run = &experiment.run;
        format!("{:?}", (run.seed, run.runtime_checks, experiment.timing))
    }

    fn cost(&self, cell: &Cell, cost: &Cost) -> Work {
        let rays = Kind::of(cell).map_or(0, |kind| kind.rays());
        Work::kernels(4) + cost.timed(Work::rays(rays))
    }

    fn prepare<'a>(&'a self, at: &'a At<'a>, cells: &'a [Cell]) -> Preparation<'a> {
        let mut last: Option<Arc<World>> = None;
        Box::new(cells.iter().map(move |cell| {
            let absent = || Absent::Failed("there are no such rays".to_owned());
            let kind = Kind::of(cell).ok_or_else(absent)?;
            let squares = kind.room().squares;
            let world = match last.take().filter(|world| world.squares == squares) {
                Some(world) => world,
                None => Arc::new(World::new(squares)?),
            };
            last = Some(Arc::clone(&world));
            let ready = Ready::new(at, cell, &kind, world)?;
            Ok(Box::new(ready) as Box<dyn Prepared>)
        }))
    }
}

/// Builds, of which the fastest counts: the first touches pages for the first time.
const BUILDS: usize = 3;

/// What a descent did, by its twin and by the device.
struct Descent {
    anatomy: Option<Anatomy>,
    streams: Vec<StreamCounts>,
}

/// A structure on the device, with rays for it.
struct Ready {
    batch: RayBatch,
    set: RaySet,
    world: Arc<World>,
    space: Space,
    exact: bool,
    live: usize,
    build_ms: f64,
    bytes: u64,
    descent: Option<Descent>,
    watch: Watch,
}

impl Ready {
    fn new(at: &At, cell: &Cell, kind: &Kind, world: Arc<World>) -> Result<Self, Absent> {
        let gpu = at.gpu(cell)?;
        let text = |error: AccelError| Absent::Failed(error.to_string());
        let accel = &cell[Axis::Accel];
        let structure = at.registries.accel.named("structure", &accel.name);
        let structure = structure.map_err(Absent::Failed)?;
        let soup = &world.soup;
        let build = || {
            let start = Instant::now();
            let built = structure.build(soup, &accel.params, &mut BuildLog::with_gpu(gpu));
            built.map(|built| (start.elapsed().as_secs_f64() * 1e3, built))
        };
        let (mut build_ms, built) = build().map_err(text)?;
        for _ in 1..BUILDS {
            build_ms = build_ms.min(build().map_err(text)?.0);
        }
        built.validate(soup).map_err(text)?;
        let set = kind.set(at, &world)?;
        let triangles = TriangleBuffers::upload(gpu, soup)?;
        let traced = Traced::upload(gpu, &*built)?;
        let ask = Ask {
            runtime_checks: at.experiment.run.runtime_checks,
            ..set.query().into()
        };
        let tracer = Tracer::new(gpu, &triangles, &traced, ask)?;
        let exact = probe_arithmetic(gpu)?.is_exact();
        let descent = match accel.name == RayHierarchy::NAME {
            true => Some(Descent::new(gpu, &tracer, &set, (soup, accel), exact)?),
            false => None,
        };
        Ok(Self {
            batch: tracer.batch(&set.rays)?,
            live: set.rays.iter().filter(|ray| ray.is_ray()).count(),
            build_ms,
            bytes: built.stats().bytes,
            space: built.space(),
            exact,
            descent,
            set,
            world,
            watch: Watch::default(),
        })
    }
}

impl Descent {
    fn new(
        gpu: &Gpu,
        tracer: &Tracer,
        set: &RaySet,
        (soup, accel): (&TriangleSoup, &Variant),
        exact: bool,
    ) -> Result<Self, Absent> {
        let streams = RayHierarchy::streams(gpu, tracer, &set.rays)?;
        // There is none of sorted rays, and of parts.
        let anatomy = Anatomy::new(soup, &accel.params, &set.rays).ok();
        let is_whole = streams.iter().all(|level| level.walked == 0);
        if let Some(anatomy) = anatomy.as_ref().filter(|_| exact && is_whole) {
            for (level, (twin, own)) in anatomy.levels.iter().zip(&streams).enumerate() {
                if twin.pairs != u64::from(own.pairs) {
                    return Err(Absent::Failed(format!(
                        "level {level} has {} pairs on the device and {} in the scalar twin",
                        own.pairs, twin.pairs
                    )));
                }
            }
        }
        Ok(Self { anatomy, streams })
    }
}

impl Measured for Ready {
    fn measure(&self) -> Result<Elapsed, GpuError> {
        let elapsed = self.batch.trace()?;
        self.watch.note(self.batch.digest()?);
        Ok(elapsed)
    }

    fn device(&self) -> Option<&Gpu> {
        Some(self.batch.gpu())
    }
}

impl Prepared for Ready {
    fn timed(&self) -> Vec<&dyn Measured> {
        vec![self]
    }

    fn readings(&self, samples: Vec<Samples>) -> Result<Vec<Reading>, String> {
        let soup = &self.world.soup;
        let wrong = timed_fault(&self.batch, &self.set, soup, self.space, self.exact);
        if let Some(wrong) = self.watch.fault().or(wrong.map_err(|e| e.to_string())?) {
            return Err(wrong);
        }
        let samples = samples.into_iter().next().unwrap_or_default();
        let mut found = readings::times(&samples, self.live as f64, self.build_ms)?;
        found.extend(readings::counts(self.live, self.bytes));
        if let Some(descent) = &self.descent {
            found.extend(readings::descent(descent, self.live as f64));
        }
        Ok(found)
    }
}

#[cfg(test)]
mod tests;
