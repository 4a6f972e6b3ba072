//! Sets of rays of one kind in a room of any size, traced through any structure: times with and without building it, and
//! for trees over the rays what each level of a descent does.

pub(crate) mod readings;
mod room;

use room::Lobes;
pub use room::{Vertex, mirrored, on_mirror, room};

use crate::coherence::{Memory, of_rays, together};
use crate::run::{Absent, At, Cost, Measurement, Preparation, Prepared, Work};
use crate::timed_rays::TimedRays;
use crate::timing::{Measured, Samples};
use rayon::prelude::*;
use raystone_accel::{
    AccelError, Access, Anatomy, Ask, BuildLog, BuiltAccel, BuiltBvh, BvhParameters,
    DivideAndConquer, Division, DivisionLevel, Hit, Ray, RayHierarchy, Space, StreamCounts,
    Structure as _, Traced, Tracer, TriangleBuffers, TriangleSoup,
};
use raystone_config::{Axis, Catalogue, Cell, Coherence, Experiment, Plan, RAYS};
use raystone_core::parameters;
use raystone_core::params::{Entry, Parameters as _, Variant};
use raystone_gpu::{Gpu, probe_arithmetic};
use raystone_record::figure::Figure;
use raystone_record::{RayClass, Reading};
use raystone_sampling::{Coordinate, Demand, Sampler, to_unit};
use raystone_verify::rays::RaySet;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

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

/// A room on the host, with what judges answers in it.
struct World {
    room: Room,
    /// The triangles, and those of the first frame if they have moved.
    soup: TriangleSoup,
    first: Option<TriangleSoup>,
    judge: BuiltBvh,
    exact: bool,
    truth: Mutex<Option<Truth>>,
}

/// What lobes see.
struct Truth {
    /// Edge of the image, waves and half-angle.
    of: [f64; 3],
    /// Pixel by pixel.
    brightness: Arc<Vec<f64>>,
}

impl World {
    fn new(gpu: &Gpu, room: &Room) -> Result<Self, Absent> {
        let still = room::room(room.squares);
        let (soup, first) = match room.moved > 0.0 {
            true => (room::moved(&still, room.moved as f32), Some(still)),
            false => (still, None),
        };
        let parameters = BvhParameters::default();
        let judge = BuiltBvh::build(&soup, &parameters, &mut BuildLog::default());
        let judge = judge.map_err(|error| Absent::Failed(error.to_string()))?;
        Ok(Self {
            room: room.clone(),
            soup,
            first,
            judge,
            exact: probe_arithmetic(gpu)?.is_exact(),
            truth: Mutex::default(),
        })
    }

    /// Whether it has the triangles of a room.
    fn is_of(&self, room: &Room) -> bool {
        (self.room.squares, self.room.moved) == (room.squares, room.moved)
    }

    /// The brightness that these lobes see; samplers and structures share the last one.
    fn truth(&self, of: &Bounce, find: impl FnOnce() -> Vec<f64>) -> Arc<Vec<f64>> {
        let of = [f64::from(of.room.side), of.waves, of.spread];
        let mut last = self.truth.lock().unwrap_or_else(PoisonError::into_inner);
        match &*last {
            Some(truth) if truth.of == of => Arc::clone(&truth.brightness),
            _ => {
                let brightness = Arc::new(find());
                *last = Some(Truth {
                    of,
                    brightness: Arc::clone(&brightness),
                });
                brightness
            }
        }
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

/// Builds, of which the fastest counts: the first touches pages for the first time.
const BUILDS: usize = 3;

/// What passes over rays and triangles did, by the scalar twin and by the device.
enum Descent {
    /// Triangles through a tree over rays.
    Tree {
        anatomy: Option<Anatomy>,
        streams: Vec<StreamCounts>,
    },
    /// Problems, of which the device had no room for the parts of some pairs.
    Division { host: Division, without_room: u64 },
}

/// A tree of the first frame, its boxes fitted to the triangles as they have moved.
struct Refitted {
    rays: TimedRays,
    space: Space,
    /// What fitting and laying out took, the fastest of some.
    ms: f64,
}

impl Refitted {
    /// `None` for a structure that is no layout of one binary tree, and where nothing has moved.
    fn new(at: &At, cell: &Cell, world: &World, set: &RaySet) -> Result<Option<Self>, Absent> {
        let gpu = at.gpu(cell)?;
        let text = |error: AccelError| Absent::Failed(error.to_string());
        let accel = &cell[Axis::Accel];
        let structure = at.registries.accel.named("structure", &accel.name);
        let structure = structure.map_err(Absent::Failed)?;
        let (Some(over), Some(first)) = (structure.over_tree(), &world.first) else {
            return Ok(None);
        };
        let (soup, params) = (&world.soup, &accel.params);
        let log = || BuildLog::with_gpu(gpu);
        let of_first = over.tree(first, params, &mut log()).map_err(text)?;
        let mut fastest: Option<(f64, Box<dyn BuiltAccel>)> = None;
        for _ in 0..BUILDS {
            let mut tree = of_first.clone();
            let start = Instant::now();
            tree.refit(soup).map_err(text)?;
            let built = over
                .lay_out(&tree, soup, params, &mut log())
                .map_err(text)?;
            let ms = start.elapsed().as_secs_f64() * 1e3;
            if fastest.as_ref().is_none_or(|(least, _)| ms < *least) {
                fastest = Some((ms, built));
            }
        }
        let Some((ms, built)) = fastest else {
            return Ok(None);
        };
        built.validate(soup).map_err(text)?;
        let tracer = tracer_of(at, gpu, (&*built, soup), set)?;
        Ok(Some(Self {
            rays: TimedRays::new(tracer.batch(&set.rays)?),
            space: built.space(),
            ms,
        }))
    }
}

fn tracer_of(
    at: &At,
    gpu: &Gpu,
    (built, soup): (&dyn BuiltAccel, &TriangleSoup),
    set: &RaySet,
) -> Result<Tracer, Absent> {
    let triangles = TriangleBuffers::upload(gpu, soup)?;
    let traced = Traced::upload(gpu, built)?;
    let ask = Ask {
        runtime_checks: at.experiment.run.runtime_checks,
        ..set.query().into()
    };
    Ok(Tracer::new(gpu, &triangles, &traced, ask)?)
}

/// A structure on the device, with rays for it.
struct Ready {
    rays: TimedRays,
    refitted: Option<Refitted>,
    set: Arc<RaySet>,
    world: Arc<World>,
    space: Space,
    live: usize,
    error: Option<f64>,
    cycles: Option<f64>,
    build_ms: f64,
    bytes: u64,
    descent: Option<Descent>,
}

impl Ready {
    fn new(
        at: &At,
        cell: &Cell,
        (world, set): (Arc<World>, Arc<RaySet>),
        error: Option<f64>,
    ) -> Result<Self, Absent> {
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
        let tracer = tracer_of(at, gpu, (&*built, soup), &set)?;
        let exact = world.exact;
        let descent = match accel.name.as_str() {
            RayHierarchy::NAME => Some(Descent::of_tree(
                gpu,
                (&tracer, &set),
                (soup, accel),
                exact,
            )?),
            DivideAndConquer::NAME => Some(Descent::of_division(
                gpu,
                (&tracer, &set),
                (soup, accel),
                exact,
            )?),
            _ => None,
        };
        Ok(Self {
            rays: TimedRays::new(tracer.batch(&set.rays)?),
            refitted: Refitted::new(at, cell, &world, &set)?,
            live: readings::live(&set.rays),
            build_ms,
            bytes: built.stats().bytes,
            space: built.space(),
            error,
            cycles: match &at.experiment.coherence {
                Some(settings) => cycles(&*built, soup, &set, settings).map_err(Absent::Failed)?,
                None => None,
            },
            descent,
            set,
            world,
        })
    }
}

/// Predicted cycles per ray in warps of rays that follow each other; `None` for a structure that answers rays together.
fn cycles(
    built: &dyn BuiltAccel,
    soup: &TriangleSoup,
    set: &RaySet,
    settings: &Coherence,
) -> Result<Option<f64>, String> {
    let is_inline = matches!(built.access(), Access::Inline);
    let Some(twin) = built.cpu_twin(soup).filter(|_| is_inline) else {
        return Ok(None);
    };
    let memory = Memory::new(built, soup)?;
    let rays: Vec<Ray> = set
        .rays
        .iter()
        .filter(|ray| ray.is_ray())
        .copied()
        .collect();
    let groups = of_rays(&rays, set.query(), (&*twin, &memory), settings)?;
    let all = together(&groups).into_values().next().unwrap_or_default();
    Ok((all.rays > 0).then(|| all.cost() as f64 / all.rays as f64))
}

impl Descent {
    fn of_tree(
        gpu: &Gpu,
        (tracer, set): (&Tracer, &RaySet),
        (soup, accel): (&TriangleSoup, &Variant),
        exact: bool,
    ) -> Result<Self, Absent> {
        let streams = RayHierarchy::streams(gpu, tracer, &set.rays)?;
        // There is none of sorted rays, and of parts.
        let anatomy = Anatomy::new(soup, &accel.params, &set.rays).ok();
        let is_whole = streams.iter().all(|level| level.walked == 0);
        if let Some(anatomy) = anatomy.as_ref().filter(|_| exact && is_whole) {
            let twin = anatomy.levels.iter().map(|level| level.pairs);
            agree(twin, streams.iter().map(|level| u64::from(level.pairs)))?;
        }
        Ok(Self::Tree { anatomy, streams })
    }

    fn of_division(
        gpu: &Gpu,
        (tracer, set): (&Tracer, &RaySet),
        (soup, accel): (&TriangleSoup, &Variant),
        exact: bool,
    ) -> Result<Self, Absent> {
        let host = Division::new(soup, &accel.params, set.query(), &set.rays);
        let host = host.map_err(|error| Absent::Failed(error.to_string()))?;
        let levels = host.levels.len() as u32;
        let found = DivideAndConquer::division(gpu, tracer, &set.rays, levels)?;
        let without_room = found.iter().map(|level| level.without_room).sum();
        if exact && without_room == 0 {
            let pairs = |levels: &[DivisionLevel]| {
                levels.iter().map(|level| level.pairs).collect::<Vec<_>>()
            };
            agree(pairs(&host.levels), pairs(&found))?;
        }
        Ok(Self::Division { host, without_room })
    }
}

/// Compares pairs level by level.
fn agree(
    twin: impl IntoIterator<Item = u64>,
    device: impl IntoIterator<Item = u64>,
) -> Result<(), Absent> {
    for (level, (twin, device)) in twin.into_iter().zip(device).enumerate() {
        if twin != device {
            return Err(Absent::Failed(format!(
                "level {level} has {device} pairs on the device and {twin} in the scalar twin"
            )));
        }
    }
    Ok(())
}

impl Prepared for Ready {
    fn timed(&self) -> Vec<&dyn Measured> {
        let refitted = self.refitted.iter().map(|tree| &tree.rays as &dyn Measured);
        std::iter::once(&self.rays as &dyn Measured)
            .chain(refitted)
            .collect()
    }

    fn readings(&self, samples: Vec<Samples>) -> Result<Vec<Reading>, String> {
        let soup = &self.world.soup;
        let exact = self.world.exact;
        let wrong = self.rays.fault(&self.set, soup, self.space, exact);
        if let Some(wrong) = wrong.map_err(|e| e.to_string())? {
            return Err(wrong);
        }
        let mut samples = samples.into_iter();
        let own = samples.next().unwrap_or_default();
        let mut found = readings::times(&own, self.live as f64, self.build_ms)?;
        if let Some((tree, samples)) = self.refitted.as_ref().zip(samples.next()) {
            let wrong = tree.rays.fault(&self.set, soup, tree.space, exact);
            if let Some(wrong) = wrong.map_err(|e| e.to_string())? {
                return Err(format!("refitted: {wrong}"));
            }
            found.extend(readings::refitted(&samples, self.live as f64, tree.ms)?);
        }
        let triangles = self.world.soup.records.len();
        found.extend(readings::counts(self.live, triangles, self.bytes));
        found.extend(readings::of_sampler(self.error, self.cycles));
        if let Some(descent) = &self.descent {
            found.extend(readings::descent(descent, self.live as f64));
        }
        Ok(found)
    }
}

#[cfg(test)]
mod tests;
