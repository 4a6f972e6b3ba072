//! Time of full cells, at few samples per pixel, in interleaved rounds; and the proof by hash that
//! every structure gives the same image.

use super::cost::{Cost, Work};
use super::error::{Fault, RunError};
use super::images::{self, Estimator};
use super::measurement::Measurement;
use super::paths;
use super::reference_file::image_hash;
use super::session::{End, Session, failure_hash};
use super::structures::{Gated, image_settings};
use super::world::World;
use crate::timing::{Measured, Samples, Watch, interleave};
use raystone_accel::Space;
use raystone_config::{Axis, Cell, Experiment, Plan};
use raystone_gpu::{Elapsed, Gpu, GpuError, slow_slice};
use raystone_record::{Body, Key, Line, Outcome, Ran, TimeRecord};
use raystone_render::{RAY_COUNT_CLASSES, Renderer, TRACED_CLASSES};
use raystone_stats::rates::rate_fault;
use raystone_stats::statistics::{median, median_interval};
use std::cell::RefCell;
use std::collections::BTreeMap;

/// Times of full cells.
pub(super) struct Times;

impl Measurement for Times {
    fn name(&self) -> &'static str {
        "time"
    }

    fn plural(&self) -> &'static str {
        "times of full cells"
    }

    fn cells(&self, _: &Experiment, plan: &Plan) -> Vec<Cell> {
        plan.times.clone()
    }

    fn unit_name(&self, cell: &Cell) -> String {
        cell.to_string()
    }

    fn rounds_of(&self, cell: &Cell) -> (&'static str, Cell) {
        let mut axes = Cell::SAMPLER.to_vec();
        axes.retain(|axis| *axis != Axis::Kernels);
        (self.name(), cell.on(&axes))
    }

    fn settings(&self, experiment: &Experiment, _: &str) -> String {
        format!(
            "{:?}",
            (
                image_settings(experiment),
                &experiment.timing,
                &experiment.run.spp
            )
        )
    }

    fn cost(&self, cell: &Cell, cost: &Cost) -> Work {
        let image = cost.image(&cell[Axis::Integrator], cost.experiment.timing.spp);
        Work::kernels(1) + cost.timed(image)
    }
}

/// A full cell, compiled.
struct Timed<'a> {
    cell: Cell,
    renderer: Renderer<'a>,
    spp: u32,
    seed: u32,
    runtime_checks: bool,
    space: Space,
    watch: Watch,
    /// Milliseconds of its stages, measurement by measurement.
    stages: RefCell<Vec<BTreeMap<String, f64>>>,
}

impl Measured for Timed<'_> {
    fn measure(&self) -> Result<Elapsed, GpuError> {
        self.renderer.reset()?;
        self.renderer.add_samples(0, self.spp, self.seed)?;
        self.renderer.check()?;
        let elapsed = self.renderer.spent().measured()?;
        self.stages.borrow_mut().push(self.renderer.stages());
        let pixels = self.renderer.image()?.pixels;
        self.watch.note(blake3::hash(bytemuck::cast_slice(&pixels)));
        Ok(elapsed)
    }

    fn device(&self) -> Option<&Gpu> {
        Some(self.renderer.gpu())
    }
}

/// What does not depend on the structure, per sampler, integrator and space in which structures meet
/// triangles: the counted rays, and the hash of the image of the run that counted them, which was
/// rendered once into fresh buffers.
type Shared = BTreeMap<String, (Counted, String)>;

/// Rays by class, and paths by bounce.
#[derive(Clone)]
struct Counted {
    rays: [u64; RAY_COUNT_CLASSES.len()],
    live_paths: Vec<u64>,
}

fn key(cell: &Cell, space: Space) -> String {
    format!("{} in {space:?}", cell.on(&Cell::SAMPLER))
}

/// All full cells of a world.
pub(super) fn run(session: &mut Session, world: &World, gated: &[Gated]) -> Result<(), RunError> {
    let cells = session.plan.times.iter();
    let cells = cells.filter(|c| c.is_on(&world.cell) && !session.ledger.is_done(&c.to_string()));
    let mut timed = Vec::new();
    for cell in cells.cloned().collect::<Vec<_>>() {
        session.go_on()?;
        let name = cell.to_string();
        timed.extend(prepare(session, world, gated, cell)?);
        session.recorder.note_kernels(&name);
        if world.gpu.lost().is_some() {
            return Ok(());
        }
    }
    if timed.is_empty() {
        return Ok(());
    }
    session.say(format!("{}: timing full cells", world.cell));
    let timing = session.experiment.timing;
    let seed = u64::from(session.experiment.run.seed);
    let cost = &session.cost;
    let image = |item: &Timed| cost.image(&item.cell[Axis::Integrator], timing.spp);
    let steps: f64 = timed
        .iter()
        .map(|item| cost.step_s(cost.timed(image(item))))
        .sum();
    let step_s = steps / timed.len().max(1) as f64;
    let progress = session.progress.clone();
    let samples = session.clock.time("gpu", || {
        interleave(&timed, &timing, seed, || progress.add(step_s))
    });
    let samples = match samples {
        Ok(samples) => samples,
        Err((index, error)) => {
            return fail(session, &timed[index].cell, error.to_string());
        }
    };
    let mut shared = Shared::default();
    for (item, samples) in timed.iter().zip(samples) {
        let structure = gated.iter().find(|g| item.cell.is_on(&g.cell));
        let record = match samples {
            Err(error) if error.is_refusal() => {
                session.write_refused(item.cell.to_string(), error.to_string())?;
                continue;
            }
            Err(error) => Err(error.to_string()),
            Ok(samples) => finish(session, world, structure, item, samples, &mut shared),
        };
        let record = record.and_then(|line| with_orders(session, world, structure, item, line));
        match record {
            Ok(record) => write(session, world, item, record)?,
            Err(reason) => fail(session, &item.cell, reason)?,
        }
    }
    Ok(())
}

/// Compiles a cell. One that cannot be timed has its record then.
fn prepare<'a>(
    session: &mut Session,
    world: &'a World,
    gated: &[Gated],
    cell: Cell,
) -> Result<Option<Timed<'a>>, RunError> {
    let text = cell.to_string();
    let Some(structure) = gated.iter().find(|g| cell.is_on(&g.cell)) else {
        match refusal(session, &cell) {
            Some(reason) => session.write_refused(text, reason)?,
            None => {
                let reason = "its structure did not pass the gate".to_owned();
                fail(session, &cell, reason)?;
            }
        }
        return Ok(None);
    };
    session.say(format!("{cell}: compiling"));
    session.lose_device_on_request(world.gpu, &text);
    let unfit = images::unfit(session, &cell, &structure.traced);
    if let Some(reason) = unfit {
        session.write_refused(text, reason)?;
        return Ok(None);
    }
    // Errors, whose cells judge integrators, are those of the single kernel.
    if cell.is_unusual(Axis::Organisation) {
        match paths::check(session, world, &structure.traced, &cell) {
            Ok(()) => {}
            Err(Fault::Cell(reason)) => return fail(session, &cell, reason).map(|()| None),
            Err(Fault::Run(error)) => return Err(error),
        }
    }
    let compiled = compile(session, world, structure, cell.clone());
    session.progress.add(Work::kernels(1).seconds());
    match compiled {
        Ok(item) => Ok(Some(item)),
        Err(reason) => fail(session, &cell, reason).map(|()| None),
    }
}

fn write(
    session: &mut Session,
    world: &World,
    item: &Timed,
    record: Line<TimeRecord>,
) -> Result<(), RunError> {
    let checked = &session.checked.integrator_lines;
    let checked = checked.get(&paths::key(world, &item.cell)).cloned();
    let end = End {
        failure: record.body.failure.clone(),
        scene: &world.scene.hash,
        of: &[("device", &format!("{:?}", world.gpu.info))],
        lines: checked.into_iter().collect(),
        ..End::default()
    };
    session.conclude(&item.cell.to_string(), record.with_body(Body::Time), end)
}

/// Why the driver cannot run the structure of a cell, if that is so.
fn refusal(session: &Session, cell: &Cell) -> Option<String> {
    let mut structures = session.plan.structures.iter();
    let structure = structures.find(|s| cell.is_on(s))?;
    session.ledger.refused.get(&structure.to_string()).cloned()
}

fn renderer<'a>(
    session: &mut Session,
    world: &'a World,
    structure: &Gated,
    cell: &Cell,
    checks_and_counts: [bool; 2],
) -> Result<Renderer<'a>, String> {
    let samples = session.timed_samples();
    let seeds = session.experiment.seeds().replicates;
    let estimator = Estimator::new(session, cell, samples)?;
    estimator.renderer(session, world, &structure.traced, &seeds, checks_and_counts)
}

fn compile<'a>(
    session: &mut Session,
    world: &'a World,
    structure: &Gated,
    cell: Cell,
) -> Result<Timed<'a>, String> {
    let checks = structure.runtime_checks;
    Ok(Timed {
        renderer: renderer(session, world, structure, &cell, [checks, false])?,
        cell,
        spp: session.experiment.timing.spp,
        seed: session.experiment.run.seed,
        runtime_checks: checks,
        space: structure.traced.space,
        watch: Watch::default(),
        stages: RefCell::default(),
    })
}

/// What is counted for all cells of the item's key, and the image that theirs must equal: taken from the first of them.
fn first_of(
    session: &mut Session,
    world: &World,
    structure: Option<&Gated>,
    item: &Timed,
    hash: &str,
    shared: &mut Shared,
) -> Result<(Counted, String), String> {
    let key = key(&item.cell, item.space);
    if !shared.contains_key(&key) {
        let structure = structure.ok_or("its structure is gone")?;
        let (counted, image) = count_rays(session, world, structure, item)?;
        // Another kernel: on an adapter that is not exact it rounds otherwise.
        let image = if world.probe.is_exact() {
            image
        } else {
            hash.to_owned()
        };
        shared.insert(key.clone(), (counted, image));
    }
    Ok(shared[&key].clone())
}

/// Figures of a measured cell.
fn finish(
    session: &mut Session,
    world: &World,
    structure: Option<&Gated>,
    item: &Timed,
    samples: Samples,
    shared: &mut Shared,
) -> Result<Line<TimeRecord>, String> {
    if let Some(slow) = slow_slice(item.renderer.longest_slice_ms()) {
        session.tell_warning(&format!("{}: {slow}", item.cell));
    }
    let hash = image_hash(&item.renderer.image().map_err(|e| e.to_string())?);
    let (counted, first) = first_of(session, world, structure, item, &hash, shared)?;
    let rays = counted.rays;
    let total: u64 = rays[..TRACED_CLASSES].iter().sum();
    let spp = f64::from(item.spp);
    let per_spp: Vec<f64> = samples.ms.iter().map(|ms| ms / spp).collect();
    let rate = |ms: &f64| total as f64 / ms * 1e-3;
    let rates: Vec<f64> = samples.ms.iter().map(rate).collect();
    let mrays_s = median_interval(&rates);
    let rate_is_wrong = mrays_s.and_then(|rate| rate_fault(&rate, total as f64, &samples.ms));
    let equal = hash == first;
    let mut faults: Vec<String> = item
        .watch
        .fault()
        .into_iter()
        .chain(rate_is_wrong)
        .collect();
    if !equal && world.probe.is_exact() {
        let text = "its last timed image differs from one that the first structure on this scene (in the same space) rendered into fresh buffers";
        faults.push(text.to_owned());
    }
    let failure = (!faults.is_empty()).then(|| faults.join("; "));
    let mut line = empty_record(session, &item.cell, String::new());
    let record = &mut line.body;
    record.failure = failure;
    if record.failure.is_none() {
        record.ms_per_spp = median_interval(&per_spp);
        record.mrays_s = mrays_s;
        record.ms = samples.ms;
        record.wall_ms = samples.wall_ms;
        if world.gpu.is_software() {
            record.cpu_ms = samples.cpu_ms;
        }
        record.stages = median_stages(&item.stages.borrow());
    }
    record.live_paths = counted.live_paths;
    record.rays = RAY_COUNT_CLASSES
        .iter()
        .zip(rays)
        .filter(|(_, n)| *n > 0)
        .map(|(c, n)| ((*c).to_owned(), n))
        .collect();
    record.image_hash = hash;
    record.image_equal = equal;
    line.ran = Ran {
        kernel_hash: item.renderer.kernel_hash(),
        features: item.renderer.features(),
        left_out: item.renderer.left_out(),
        unchecked: !item.runtime_checks,
    };
    Ok(line)
}

/// The median of each stage over all measurements, the first ones among them; nothing where there is one stage alone.
pub(super) fn median_stages(measured: &[BTreeMap<String, f64>]) -> BTreeMap<String, f64> {
    let names = measured.first().into_iter().flat_map(BTreeMap::keys);
    let of = |name: &String| {
        let ms: Vec<f64> = measured
            .iter()
            .filter_map(|m| m.get(name).copied())
            .collect();
        Some((name.clone(), median(&ms)?))
    };
    let stages: BTreeMap<String, f64> = names.filter_map(of).collect();
    match stages.len() {
        0 | 1 => BTreeMap::new(),
        _ => stages,
    }
}

/// The record with the times of orders, where the experiment asks for them, and with what rasterisation changes, where paths begin so: both are
/// of the single kernel.
fn with_orders(
    session: &mut Session,
    world: &World,
    structure: Option<&Gated>,
    item: &Timed,
    mut line: Line<TimeRecord>,
) -> Result<Line<TimeRecord>, String> {
    let is_single = !item.cell.is_unusual(Axis::Organisation);
    if let Some(structure) = structure.filter(|_| is_single && line.body.failure.is_none()) {
        let of_image = (&item.cell, &*line.body.image_hash);
        line.body.orders = super::orders::of_cell(session, world, structure, of_image)?;
        let seen = (&item.cell, &item.renderer);
        line.body.primary = super::primary::of_cell(session, world, structure, seen)?;
    }
    Ok(line)
}

/// Rays per class, from a separate counting run of the same seed, and the hash of its image.
fn count_rays(
    session: &mut Session,
    world: &World,
    structure: &Gated,
    item: &Timed,
) -> Result<(Counted, String), String> {
    let renderer = renderer(session, world, structure, &item.cell, [true, true])?;
    let counted = session.clock.time("gpu", || {
        renderer.reset()?;
        renderer.add_samples(0, item.spp, item.seed)?;
        let counted = Counted {
            rays: renderer.ray_counts()?,
            live_paths: renderer.live_paths()?,
        };
        Ok((counted, image_hash(&renderer.image()?)))
    });
    let counted = counted.map_err(|e: GpuError| e.to_string())?;
    match paths::miscounted(session, world, &structure.traced, &item.cell)? {
        Some(fault) => Err(format!("its counted rays are wrong: {fault}")),
        None => Ok(counted),
    }
}

fn empty_record(session: &Session, cell: &Cell, failure: String) -> Line<TimeRecord> {
    let ran = Ran {
        unchecked: !session.experiment.run.runtime_checks,
        ..Ran::default()
    };
    let record = TimeRecord {
        resolution: session.experiment.run.resolution,
        spp: session.experiment.timing.spp,
        ms: Vec::new(),
        wall_ms: Vec::new(),
        cpu_ms: Vec::new(),
        ms_per_spp: None,
        rays: BTreeMap::new(),
        live_paths: Vec::new(),
        stages: BTreeMap::new(),
        mrays_s: None,
        orders: Vec::new(),
        primary: None,
        image_hash: String::new(),
        image_equal: false,
        failure: Some(failure),
    };
    Line::new(Key::from(cell), ran, record)
}

fn fail(session: &mut Session, cell: &Cell, reason: String) -> Result<(), RunError> {
    session.ledger.failed += 1;
    let record = empty_record(session, cell, reason.clone());
    let name = cell.to_string();
    let hash = failure_hash(&name, &reason);
    session
        .recorder
        .write(&record.hashed(&hash).with_body(Body::Time))?;
    session.close(&name, (Outcome::Failed, &reason), vec![hash], &[])
}
