//! The search as a measurement: `specular:search` on the axis of integrators, which needs no scene.

use crate::device::Solver;
use crate::judge::{Judged, MAP, Summary, failures, judged, jumps, quantile, summary};
use crate::newton::{Search, Solved};
use crate::oracle::Oracle;
use crate::path::{Form, Setup};
use crate::real::{Real, V3};
use crate::reflector::Shape;
use crate::scene::{Mirror, Vertex, pixel, random_begins, setup, spread_begins, vertices};
use crate::solve::{Begin, Merit, Step, Stop, reflect_vertex};
use glam::DVec3;
use rayon::prelude::*;
use raystone_bench::run::{Absent, At, Cost, Measurement, Preparation, Prepared, Registries, Work};
use raystone_bench::timing::{Measured, Samples};
use raystone_config::{Axis, Catalogue, Cell, Experiment, Plan, SPECULAR};
use raystone_core::parameters;
use raystone_core::params::{Entry, Parameters as _};
use raystone_gpu::{Elapsed, GpuError, probe_arithmetic};
use raystone_image::Picture;
use raystone_record::Reading;
use raystone_record::figure::{Better, Figure, Shown, Spread};
use std::sync::Arc;

pub(crate) mod known;

/// The name on the axis of integrators, after [`SPECULAR`].
const NAME: &str = "search";
/// Vertices that are followed while the eye moves.
const FOLLOWED: usize = 100;

parameters! {
    /// Numbers of a search.
    enum Precision {
        /// of 64 bits, on the host
        Double = "f64",
        /// of 32 bits, on the host
        Single = "f32",
        /// of 32 bits, by the kernel, which is timed
        Device = "device",
    }

    /// searches for the points of a smooth reflector at which vertices are seen from an eye (Roger 2008, chapter 2): iterations, failures and errors in pixels against an oracle
    struct Load {
        /// reflector
        reflector: Shape = Shape::Sphere;
        /// height of bumps; of `bumpy` alone
        amplitude: f64 = 0.05, in 0.0..=0.1;
        /// their frequency in radians per unit; of `bumpy` alone
        frequency: f64 = 4.0, in 1.0..=16.0;
        /// how the next place is found
        step: Step = Step::Secant;
        /// formula of the gradient
        gradient: Form = Form::Transposed;
        /// when the search ends; Newton's method always ends by `moved`
        stop: Stop = Stop::Area;
        /// what a step of Newton's method has to lower
        merit: Merit = Merit::Length;
        /// where the search begins
        begin: Begin = Begin::Arc;
        /// places at which Newton's method begins in turn; above 1 they are spread over the reflector
        starts: u32 = 1, in 1..=64;
        /// iterations at most
        most: u32 = 60, in 1..=1000;
        /// a determinant below 10^-singular of its terms counts as none; 0 for 12 in f64 and 6 in f32
        singular: u32 = 0, in 0..=14;
        /// numbers of the search
        precision: Precision = Precision::Double;
        /// distance of vertices from the surface, of `concave` from the centre; 0 for a mixture
        distance: f64 = 0.0, in 0.0..=1000.0;
        /// vertices
        vertices: u32 = 2000, in 16..=1048576;
    }
}

const fn figure(id: &'static str, title: &'static str, unit: &'static str, shown: Shown) -> Figure {
    Figure::new(id, title, unit, Better::Lower, shown, Spread::Exact)
}

static FIGURES: [Figure; 16] = [
    figure(
        "specular-iterations/v1",
        "iterations, mean",
        "",
        Shown::Digits(3),
    ),
    figure(
        "specular-iterations-middle/v1",
        "in the middle of the reflector",
        "",
        Shown::Digits(3),
    ),
    figure(
        "specular-iterations-silhouette/v1",
        "at its silhouette",
        "",
        Shown::Digits(3),
    ),
    figure(
        "specular-iterations-99/v1",
        "iterations of 99 %, greatest",
        "",
        Shown::Count,
    ),
    figure(
        "specular-iterations-most/v1",
        "iterations, greatest",
        "",
        Shown::Count,
    ),
    figure(
        "specular-wrong/v1",
        "more than a pixel from any point of reflection",
        "",
        Shown::Percent,
    ),
    figure(
        "specular-other/v1",
        "more than a pixel from that of the shortest path",
        "",
        Shown::Percent,
    ),
    figure(
        "specular-error/v1",
        "error of 90 %, greatest",
        "px",
        Shown::Digits(2),
    ),
    figure(
        "specular-capped/v1",
        "used up their iterations",
        "",
        Shown::Percent,
    ),
    figure("specular-singular/v1", "singular exits", "", Shown::Percent),
    Figure::new(
        "specular-points/v1",
        "points told apart of those there are",
        "",
        Better::Higher,
        Shown::Percent,
        Spread::Exact,
    ),
    figure(
        "specular-jump/v1",
        "greatest jump as the eye turns by 0.01°",
        "px",
        Shown::Digits(2),
    ),
    figure(
        "specular-jumping/v1",
        "vertices that jump by more than a pixel",
        "",
        Shown::Percent,
    ),
    figure(
        "specular-apart/v1",
        "f32 from f64, of 90 %, greatest",
        "px",
        Shown::Digits(2),
    ),
    figure(
        "specular-apart-share/v1",
        "f32 more than a pixel from f64",
        "",
        Shown::Percent,
    ),
    Figure::new(
        "specular-ns/v1",
        "time",
        "ns per vertex",
        Better::Lower,
        Shown::Digits(3),
        Spread::Median,
    ),
];

/// Adds the measurement.
///
/// # Errors
/// It is there already.
pub fn register(registries: &mut Registries) -> Result<(), String> {
    registries.measurements.add(&Searches)
}

struct Searches;

impl Measurement for Searches {
    fn name(&self) -> &'static str {
        "specular:search"
    }

    fn plural(&self) -> &'static str {
        "searches for points of reflection"
    }

    fn figures(&self) -> &'static [Figure] {
        &FIGURES
    }

    fn declare(&self, catalogue: &mut Catalogue) {
        catalogue[Axis::Integrator].push(Entry {
            name: format!("{SPECULAR}{NAME}"),
            description: Load::ABOUT.to_owned(),
            schema: Load::schema(),
        });
    }

    fn cells(&self, _: &Experiment, plan: &Plan) -> Vec<Cell> {
        let mut cells = plan.benches_on(&[Axis::Integrator, Axis::Kernels]);
        cells.retain(|cell| cell[Axis::Integrator].name.strip_prefix(SPECULAR) == Some(NAME));
        cells
    }

    fn unit_name(&self, cell: &Cell) -> String {
        cell.to_string()
    }

    fn settings(&self, experiment: &Experiment, _: &str) -> String {
        format!("{:?} {:?}", experiment.run.seed, experiment.timing)
    }

    fn cost(&self, cell: &Cell, cost: &Cost) -> Work {
        let load = Load::from_checked(&cell[Axis::Integrator].params);
        let host = Work::other(0.3 + 3e-4 * f64::from(load.vertices));
        if load.precision == Precision::Device {
            return Work::kernels(1) + cost.timed(Work::rays(8 * load.vertices)) + host;
        }
        host
    }

    fn prepare<'a>(&'a self, at: &'a At<'a>, cells: &'a [Cell]) -> Preparation<'a> {
        let mut worlds: Vec<Arc<World>> = Vec::new();
        Box::new(cells.iter().map(move |cell| {
            at.say(cell.to_string());
            let load = Load::from_checked(&cell[Axis::Integrator].params);
            contradiction(&load).map_or(Ok(()), |reason| Err(Absent::Refused(reason)))?;
            let known = worlds.iter().find(|world| world.is_of(&load));
            let world = match known {
                Some(world) => Arc::clone(world),
                None => {
                    let seed = u64::from(at.experiment.run.seed);
                    let world = World::new(&load, seed).map_err(Absent::Refused)?;
                    let world = Arc::new(world);
                    worlds.push(Arc::clone(&world));
                    world
                }
            };
            Ok(Box::new(Ready::new(at, cell, &load, &world)?) as Box<dyn Prepared>)
        }))
    }
}

/// Why parameters contradict each other; the reason says what to change.
fn contradiction(load: &Load) -> Option<String> {
    let is_secant = load.step == Step::Secant;
    let default = Load::default();
    let is_bent = load.amplitude != default.amplitude || load.frequency != default.frequency;
    let reason = if load.reflector != Shape::Bumpy && is_bent {
        "`amplitude` and `frequency` are those of bumps: give `reflector = \"bumpy\"`, or leave them out"
    } else if is_secant && load.stop == Stop::Moved {
        "`stop = \"moved\"` is a rule of Newton's method: secants end by `area`, `edge` or `edge-and-gradient`"
    } else if !is_secant && !matches!(load.stop, Stop::Area | Stop::Moved) {
        "Newton's method has no triangle whose edges could end it: leave `stop` out"
    } else if is_secant && load.merit == Merit::Gradient {
        "`merit` is what steps of Newton's method have to lower: secants lower nothing, leave it out"
    } else if is_secant && load.starts > 1 {
        "`starts` above 1 is for Newton's method: secants begin with one triangle"
    } else if load.starts > 1 && load.begin == Begin::Random {
        "several `starts` are spread over the reflector, so that `begin = \"random\"` contradicts them: leave one out"
    } else if load.step == Step::Newton
        && !matches!(load.gradient, Form::Transposed | Form::Intrinsic)
    {
        "the exact Hessian is that of the exact gradient: give `gradient = \"intrinsic\"` or leave it out"
    } else if !is_secant && load.singular != 0 {
        "`singular` is the threshold of secants: leave it out"
    } else {
        return None;
    };
    Some(reason.to_owned())
}

/// What several searches share: vertices with all their points of reflection.
struct World {
    mirror: Mirror,
    oracle: Oracle,
    distance: f64,
    seed: u64,
    count: u32,
    vertices: Vec<Vertex>,
}

/// Bumps only where there are some, so that other reflectors are equal whatever their parameters are.
fn mirror_of(load: &Load) -> Mirror {
    let is_bumpy = load.reflector == Shape::Bumpy;
    Mirror {
        shape: load.reflector,
        amplitude: if is_bumpy { load.amplitude } else { 0.0 },
        frequency: if is_bumpy { load.frequency } else { 1.0 },
    }
}

/// Vertices that are judged; all are timed.
fn judged_count(load: &Load) -> u32 {
    load.vertices.min(20_000)
}

impl World {
    fn new(load: &Load, seed: u64) -> Result<Self, String> {
        let mirror = mirror_of(load);
        let oracle = mirror.oracle();
        let count = judged_count(load);
        let vertices = vertices(&mirror, &oracle, load.distance, count as usize, seed)?;
        Ok(Self {
            mirror,
            oracle,
            distance: load.distance,
            seed,
            count,
            vertices,
        })
    }

    fn is_of(&self, load: &Load) -> bool {
        self.mirror == mirror_of(load)
            && self.distance == load.distance
            && self.count == judged_count(load)
    }
}

fn search_of<T: Real>(load: &Load) -> Search<T> {
    let is_double = load.precision == Precision::Double;
    let exponent = match load.singular {
        0 if is_double => 12,
        0 => 6,
        given => given,
    };
    Search {
        is_newton: load.step != Step::Secant,
        is_exact: load.step == Step::Newton,
        stop: load.stop.word(),
        merit: load.merit.word(),
        is_given: load.begin == Begin::Random,
        starts: load.starts,
        most: load.most,
        singular: T::of(0.1_f64.powi(exponent as i32)),
        difference: T::of(if is_double { 1e-6 } else { 1e-3 }),
    }
}

/// Directions at which searches begin, of all or of each vertex.
fn begins(load: &Load, world: &World) -> Vec<DVec3> {
    let begins = match load.begin {
        Begin::Random => random_begins(&world.mirror, world.vertices.len(), world.seed),
        Begin::Arc if load.starts > 1 => spread_begins(&world.mirror, load.starts as usize),
        Begin::Arc => Vec::new(),
    };
    // What the device gets.
    begins.iter().map(|u| u.as_vec3().as_dvec3()).collect()
}

/// Those of one vertex.
fn begins_of<T: Real>(load: &Load, all: &[DVec3], k: usize) -> Vec<V3<T>> {
    let own = match load.begin {
        Begin::Random => &all[3 * k..3 * k + 3],
        Begin::Arc => all,
    };
    own.iter().map(|u| V3::of(*u)).collect()
}

fn solved<T: Real>(load: &Load, world: &World, begins: &[DVec3]) -> Vec<Solved<T>> {
    let setup: Setup<T> = setup(&world.mirror, load.gradient, 0.0);
    let search = search_of(load);
    let each = world.vertices.par_iter().enumerate().map(|(k, vertex)| {
        reflect_vertex(setup, search, V3::of(vertex.v), &begins_of(load, begins, k))
    });
    each.collect()
}

/// The greatest jump of each followed vertex.
fn followed<T: Real>(load: &Load, world: &World, begins: &[DVec3]) -> Vec<f64> {
    let search = search_of::<T>(load);
    let some = world.vertices.par_iter().take(FOLLOWED).enumerate();
    let each = some.map(|(k, vertex)| {
        let own = begins_of(load, begins, k);
        let solve = |setup: &Setup<T>, v| reflect_vertex(*setup, search, v, &own);
        jumps(&world.mirror, &world.oracle, vertex, solve, load.gradient)
    });
    each.collect()
}

/// A search that was judged, and on the device waits to be timed.
struct Ready {
    summary: Summary,
    jumps: Vec<f64>,
    /// Pixels between the points that f32 and f64 find.
    apart: Option<Vec<f64>>,
    several: bool,
    map: Vec<[u8; 3]>,
    solver: Option<Solver>,
    count: u32,
}

impl Ready {
    fn new(at: &At, cell: &Cell, load: &Load, world: &World) -> Result<Self, Absent> {
        let begins = begins(load, world);
        let exact: Setup<f64> = setup(&world.mirror, load.gradient, 0.0);
        let double: Vec<Solved<f64>> = {
            let load = Load {
                precision: Precision::Double,
                ..load.clone()
            };
            solved(&load, world, &begins)
        };
        if load.precision == Precision::Double {
            let jumps = followed::<f64>(load, world, &begins);
            return Ok(Self::of(load, &judge(&exact, world, &double), jumps));
        }
        let single: Vec<Solved<f32>> = solved(load, world, &begins);
        let mut ready = Self::of(
            load,
            &judge(&exact, world, &single),
            followed::<f32>(load, world, &begins),
        );
        let apart = single.iter().zip(&double).map(|(a, b)| {
            let [a, b] = [a.p.f64(), b.p.f64()].map(|p| pixel(&exact, p));
            (a[0] - b[0]).hypot(a[1] - b[1]).min(crate::scene::PICTURE)
        });
        ready.apart = Some(apart.collect());
        if load.precision == Precision::Device {
            ready.solver = Some(solver(at, cell, load, world, &begins, &single)?);
        }
        Ok(ready)
    }

    fn of(load: &Load, all: &[Judged], jumps: Vec<f64>) -> Self {
        Self {
            summary: summary(all),
            jumps,
            apart: None,
            several: load.starts > 1,
            map: failures(all),
            solver: None,
            count: load.vertices,
        }
    }
}

fn judge<T: Real>(exact: &Setup<f64>, world: &World, all: &[Solved<T>]) -> Vec<Judged> {
    let each = world.vertices.iter().zip(all);
    each.filter_map(|(vertex, one)| judged(exact, vertex, one))
        .collect()
}

/// The kernel with all vertices, after its answers for the judged ones were compared with the twin's.
fn solver(
    at: &At,
    cell: &Cell,
    load: &Load,
    world: &World,
    begins: &[DVec3],
    twin: &[Solved<f32>],
) -> Result<Solver, Absent> {
    let gpu = at.gpu(cell)?;
    let own: Vec<DVec3> = world.vertices.iter().map(|vertex| vertex.v).collect();
    let setup = setup(&world.mirror, load.gradient, 0.0);
    let search = search_of(load);
    let few = Solver::new(gpu, &setup, &search, &own, begins)?;
    let (found, _) = few.solve()?;
    if probe_arithmetic(gpu)?.is_exact() {
        let differing = found.iter().zip(twin).find(|(a, b)| a != b);
        if let Some((found, twin)) = differing {
            return Err(Absent::Failed(format!(
                "{found:?} where the twin has {twin:?}"
            )));
        }
    }
    if load.vertices == world.count {
        return Ok(few);
    }
    let place = |k: u32| (k % world.count) as usize;
    let all: Vec<DVec3> = (0..load.vertices).map(|k| own[place(k)]).collect();
    let begins: Vec<DVec3> = match load.begin {
        Begin::Arc => begins.to_vec(),
        Begin::Random => (0..load.vertices)
            .flat_map(|k| begins[3 * place(k)..3 * place(k) + 3].to_vec())
            .collect(),
    };
    Ok(Solver::new(gpu, &setup, &search, &all, &begins)?)
}

impl Measured for Ready {
    fn measure(&self) -> Result<Elapsed, GpuError> {
        match &self.solver {
            Some(solver) => Ok(solver.solve()?.1),
            None => Ok(Elapsed::default()),
        }
    }
}

impl Prepared for Ready {
    fn timed(&self) -> Vec<&dyn Measured> {
        match self.solver {
            Some(_) => vec![self],
            None => Vec::new(),
        }
    }

    fn readings(&self, samples: Vec<Samples>) -> Result<Vec<Reading>, String> {
        let s = &self.summary;
        let apart = |of: fn(&[f64]) -> f64| self.apart.as_deref().map(of);
        let beyond =
            |all: &[f64]| all.iter().filter(|x| **x > 1.0).count() as f64 / all.len().max(1) as f64;
        let values = [
            Some(s.iterations),
            s.middle,
            s.silhouette,
            Some(s.high),
            Some(s.most),
            Some(s.wrong),
            Some(s.other),
            Some(s.error),
            Some(s.capped),
            Some(s.singular),
            self.several.then_some(s.points),
            Some(self.jumps.iter().copied().fold(0.0, f64::max)),
            Some(beyond(&self.jumps)),
            apart(|all| quantile(all.to_vec(), 0.9)),
            apart(|all| all.iter().filter(|x| **x > 1.0).count() as f64 / all.len().max(1) as f64),
        ];
        let mut readings = Reading::known(FIGURES.iter().zip(values));
        if let Some(samples) = samples.into_iter().next() {
            readings.push(samples.ns_per_item(&FIGURES[15], f64::from(self.count))?);
        }
        Ok(readings)
    }

    fn picture(&self) -> Option<Picture> {
        Some(Picture {
            width: MAP,
            height: MAP,
            pixels: self.map.clone(),
        })
    }
}
