//! Structures: build, validate, gate, time, count, draw.

use super::RunError;
use super::session::Session;
use super::world::World;
use crate::accel::StructureStats;
use crate::accel::tracer::{count_work, kernel_hash};
use crate::accel::{
    AccelError, Ask, BuildLog, BuiltAccel, Counters, Query, RayBatch, Space, Traced, Tracer,
};
use crate::config::StructureCell;
use crate::gpu::{Elapsed, Gpu, GpuError};
use crate::image::Picture;
use crate::image::viridis;
use crate::measure::gate::{fault_text, gate, timed_fault};
use crate::measure::memory::peak_bytes;
use crate::measure::rays::{RaySet, primary_pixels, primary_rays};
use crate::measure::record::{
    Body, ClassTiming, CountersPerRay, GateVerdict, Key, Line, Ran, StructureRecord, axis,
};
use crate::measure::timing::{
    Measured, Watch, empty_ms, interleave, millions_per_second, without_overhead,
};
use crate::text::cell_hash;
use std::time::Instant;

/// A structure that passed its gate.
pub(super) struct Gated {
    pub cell: StructureCell,
    pub traced: Traced,
    /// Whether its timed kernels run with the driver's checks.
    pub runtime_checks: bool,
    /// Million primary and bounce rays per second, for choosing the fastest.
    pub speed: f64,
    record: Line<StructureRecord>,
    /// Counted cost of every pixel's primary ray.
    costs: Vec<f32>,
}

/// A structure that was built and uploaded, but not gated.
struct Built {
    traced: Traced,
    /// What `validate` says.
    structural: Option<String>,
    record: Line<StructureRecord>,
}

/// What a build came to, or the record alone of one that failed.
type Tried = Result<Built, Box<Line<StructureRecord>>>;

/// A structure with its record, or the record alone of one that failed.
type Outcome = Result<(Traced, Line<StructureRecord>), Box<Line<StructureRecord>>>;

/// Builds, validates, uploads and gates one structure.
pub(super) fn build_and_gate(
    session: &mut Session,
    world: &World,
    cell: &StructureCell,
) -> Result<Outcome, RunError> {
    match build(session, world, cell) {
        Ok(built) => gate_with(session, world, &built, cell),
        Err(record) => Ok(Err(record)),
    }
}

/// Builds, validates and uploads: what does not depend on kernels.
fn build(session: &mut Session, world: &World, cell: &StructureCell) -> Tried {
    let accel = &cell.accel;
    let mut record = empty_record(world, cell, session.experiment.runtime_checks);
    let Some(kind) = session.registries.accel.get(&accel.name) else {
        record.body.failure = Some(format!("no structure is called {accel}"));
        return Err(Box::new(record));
    };
    let mut log = BuildLog::with_gpu(world.gpu);
    let (built, peak) = session.clock.time("build", || {
        peak_bytes(|| kind.build(&world.soup, &accel.params, &mut log))
    });
    record.body.build_peak_bytes = peak;
    record.body.build_ms = log.total_ms();
    record.body.build = log.phases;
    let updated = built.and_then(|mut built| {
        let update_ms = session
            .clock
            .time("build", || update_ms(&mut *built, world))?;
        Ok((built, update_ms))
    });
    let built = match updated {
        Ok((built, update_ms)) => {
            record.body.update_ms = update_ms;
            built
        }
        Err(error) => {
            record.body.failure = Some(error.to_string());
            return Err(Box::new(record));
        }
    };
    record.body.space = built.space();
    record.body.stats = built.stats();
    record.body.figures = (session.registries.figures).of_structure(&*built, &world.soup);
    let structural = session
        .clock
        .time("gate", || built.validate(&world.soup))
        .err()
        .map(|e| e.to_string());
    let traced = match Traced::upload(world.gpu, &*built) {
        Ok(traced) => traced,
        Err(error) => {
            record.body.failure = Some(error.to_string());
            return Err(Box::new(record));
        }
    };
    Ok(Built {
        traced,
        structural,
        record,
    })
}

/// Gates what was built with the kernels of a cell.
fn gate_with(
    session: &mut Session,
    world: &World,
    built: &Built,
    cell: &StructureCell,
) -> Result<Outcome, RunError> {
    let gpu = world.device.of(&cell.kernels)?;
    let traced = built.traced.clone();
    let mut record = built.record.clone();
    record.key = key(world, cell);
    let checks = session.experiment.runtime_checks;
    let gated = session.clock.time("gate", || {
        let verdict = gate_twice(checks, world, gpu, &traced)?;
        Ok::<_, GpuError>((
            verdict,
            kernel_hash(gpu, &world.buffers.triangles, &traced)?,
        ))
    });
    match gated {
        Err(error) => {
            record.body.refused = error.is_refusal();
            record.body.failure = Some(error.to_string());
        }
        Ok((mut verdict, hash)) => {
            record.ran.kernel_hash = hash;
            verdict.passed &= built.structural.is_none();
            verdict.structural.clone_from(&built.structural);
            if verdict.passed {
                verdict.elsewhere = super::trial::fault(session, world, gpu, cell)
                    .unwrap_or_else(|e| Some(e.to_string()));
                verdict.passed = verdict.elsewhere.is_none();
            }
            if !verdict.passed {
                let judge_fault = world.judge.of(traced.space).first_wrong.as_deref();
                record.body.failure = Some(fault_text(&verdict, judge_fault));
            }
            record.body.gate = Some(verdict);
        }
    }
    Ok(match record.body.failure {
        Some(_) => Err(Box::new(record)),
        None => Ok((traced, record)),
    })
}

/// Updates of which the median is taken.
const UPDATES: usize = 5;

/// Milliseconds of wall time to take the transforms of the scene's instances over once more, as if all
/// had moved; the gate then judges what an update leaves. `None` for structures without updates.
fn update_ms(built: &mut dyn BuiltAccel, world: &World) -> Result<Option<f64>, AccelError> {
    let mut samples = Vec::new();
    if world.soup.placed.is_none() {
        return Ok(None);
    }
    for _ in 0..UPDATES {
        let start = Instant::now();
        match built.update(&world.soup) {
            None => return Ok(None),
            Some(updated) => updated?,
        }
        samples.push(start.elapsed().as_secs_f64() * 1e3);
    }
    samples.sort_by(f64::total_cmp);
    Ok(Some(samples[UPDATES / 2]))
}

/// The gate with the driver's checks; without them only if that passed.
fn gate_twice(
    runtime_checks: bool,
    world: &World,
    gpu: &Gpu,
    traced: &Traced,
) -> Result<GateVerdict, GpuError> {
    let run = |checks| {
        gate(
            gpu,
            &world.buffers.triangles,
            &world.soup,
            traced,
            &world.judge,
            &world.probe,
            checks,
        )
    };
    let checked = run(true)?;
    if runtime_checks || !checked.passed {
        Ok(checked)
    } else {
        run(false)
    }
}

fn key(world: &World, cell: &StructureCell) -> Key {
    (world.key(&cell.kernels)).with_variant(axis::ACCEL, &cell.accel)
}

fn empty_record(
    world: &World,
    cell: &StructureCell,
    runtime_checks: bool,
) -> Line<StructureRecord> {
    let ran = Ran {
        unchecked: !runtime_checks,
        ..Ran::default()
    };
    let record = StructureRecord {
        refused: false,
        space: Space::World,
        build: Vec::new(),
        build_ms: 0.0,
        build_peak_bytes: None,
        update_ms: None,
        stats: StructureStats::default(),
        figures: Default::default(),
        gate: None,
        timings: Vec::new(),
        heat_map: None,
        heat_map_max: None,
        failure: None,
    };
    Line::new(key(world, cell), ran, record)
}

/// A ray class through a structure, measured.
struct Timed<'a> {
    structure: usize,
    set: &'a RaySet,
    batch: RayBatch,
    watch: Watch,
}

impl Measured for Timed<'_> {
    fn measure(&self) -> Result<Elapsed, GpuError> {
        let elapsed = self.batch.trace()?;
        self.watch.note(self.batch.digest()?);
        Ok(elapsed)
    }
}

impl Timed<'_> {
    /// What is wrong with the timed answers; no figure is printed then.
    fn fault(&self, world: &World, space: Space) -> Result<Option<String>, GpuError> {
        let exact = world.probe.is_exact();
        let last = timed_fault(&self.batch, self.set, &world.soup, space, exact)?;
        let fault = self.watch.fault().into_iter().chain(last);
        Ok(fault.reduce(|a, b| format!("{a}; {b}")))
    }
}

/// Everything about the structures of a scene; returns those that may be used further.
pub(super) fn run(session: &mut Session, world: &World) -> Result<Vec<Gated>, RunError> {
    let cells: Vec<StructureCell> = session
        .plan
        .structures
        .iter()
        .filter(|c| c.scene == *world.variant)
        .cloned()
        .collect();
    let mut gated = Vec::new();
    // The last structure that was built: it serves all kernels.
    let mut last: Option<(StructureCell, Tried)> = None;
    for cell in cells {
        if session.is_done(&cell.to_string()) && !session.is_done(&passed(&cell)) {
            continue;
        }
        session.say(format!("{cell}: build and gate"));
        session.lose_device_on_request(world.gpu, &cell.to_string());
        // What cannot serve goes before the next is built.
        let same = last
            .take()
            .filter(|(other, _)| is_same_structure(other, &cell));
        let built = match same {
            Some((_, built)) => built,
            None => build(session, world, &cell),
        };
        let outcome = match &built {
            Ok(built) => gate_with(session, world, built, &cell)?,
            Err(record) => Err(Box::new(Line {
                key: key(world, &cell),
                ..Line::clone(record)
            })),
        };
        match outcome {
            Ok((traced, record)) => gated.push(Gated {
                runtime_checks: !record.ran.unchecked,
                traced,
                speed: 0.0,
                record: hashed(world, &cell, record),
                cell: cell.clone(),
                costs: Vec::new(),
            }),
            Err(record) => write_failed(session, world, &cell, *record)?,
        }
        last = Some((cell, built));
        session.progress.inc(2);
        if world.gpu.lost().is_some() {
            return Ok(Vec::new());
        }
    }
    drop(last);
    time_all(session, world, &mut gated)?;
    draw_heat_maps(session, world, &mut gated)?;
    for structure in &gated {
        let cell = structure.cell.to_string();
        if !session.is_done(&cell) {
            session.write(&structure.record.clone().with_body(Body::Structure))?;
            session.finish(cell);
            session.finish(passed(&structure.cell));
        }
    }
    Ok(gated)
}

/// Marks a structure that passed: it is built again after a lost device.
fn passed(cell: &StructureCell) -> String {
    format!("{cell}: passed")
}

fn is_same_structure(a: &StructureCell, b: &StructureCell) -> bool {
    a.accel.name == b.accel.name && a.accel.params == b.accel.params
}

fn hashed(
    world: &World,
    cell: &StructureCell,
    record: Line<StructureRecord>,
) -> Line<StructureRecord> {
    let params = serde_json::to_string(&cell.accel).unwrap_or_default();
    let hash = cell_hash(&[
        ("scene", &world.scene.hash),
        ("accel", &params),
        ("intersection", &format!("{:?}", world.soup.intersection)),
        ("kernel", &record.ran.kernel_hash),
        ("version", env!("CARGO_PKG_VERSION")),
    ]);
    record.hashed(hash)
}

fn write_failed(
    session: &mut Session,
    world: &World,
    cell: &StructureCell,
    record: Line<StructureRecord>,
) -> Result<(), RunError> {
    if record.body.refused {
        return session.write_refused(cell.to_string(), record.body.failure.unwrap_or_default());
    }
    session.failed += 1;
    session.finish(cell.to_string());
    session.write(&hashed(world, cell, record).with_body(Body::Structure))
}

/// Records the structure under which the device was lost; the others get their turn on a new one.
fn fail_lost(
    session: &mut Session,
    world: &World,
    gated: &mut Vec<Gated>,
    structure: usize,
    error: GpuError,
) -> Result<(), RunError> {
    let mut lost = gated.swap_remove(structure);
    gated.clear();
    lost.record.body.failure = Some(error.to_string());
    write_failed(session, world, &lost.cell, lost.record)
}

/// Times every class through every structure in interleaved rounds, then counts the work.
fn time_all(session: &mut Session, world: &World, gated: &mut Vec<Gated>) -> Result<(), RunError> {
    session.say(format!("{}: timing structures", world.variant));
    let mut failures: Vec<Option<String>> = vec![None; gated.len()];
    let mut timed = Vec::new();
    for structure in 0..gated.len() {
        let gpu = world.device.of(&gated[structure].cell.kernels)?;
        let sets = &world.judge.of(gated[structure].traced.space).sets;
        for set in sets.iter().filter(|set| set.is_timed()) {
            let Gated {
                traced,
                runtime_checks,
                ..
            } = &gated[structure];
            let ask = Ask {
                runtime_checks: *runtime_checks,
                ..set.query().into()
            };
            let tracer = Tracer::new(gpu, &world.buffers.triangles, traced, ask);
            match tracer.and_then(|tracer| tracer.batch(&set.rays)) {
                Ok(batch) => timed.push(Timed {
                    structure,
                    set,
                    batch,
                    watch: Watch::default(),
                }),
                Err(error) if world.gpu.lost().is_some() => {
                    return fail_lost(session, world, gated, structure, error);
                }
                Err(error) => failures[structure] = Some(error.to_string()),
            }
        }
    }
    let (timing, seed) = (
        session.experiment.timing,
        u64::from(session.experiment.seed),
    );
    let progress = session.progress.clone();
    let samples = match session.clock.time("gpu", || {
        interleave(&timed, &timing, seed, || progress.inc(1))
    }) {
        Ok(samples) => samples,
        Err((index, error)) => {
            return fail_lost(session, world, gated, timed[index].structure, error);
        }
    };
    for (item, result) in timed.iter().zip(samples) {
        let set = item.set;
        let structure = &mut gated[item.structure];
        let gpu = world.device.of(&structure.cell.kernels)?;
        let fault = match item.fault(world, structure.traced.space) {
            Ok(fault) => fault.map(|fault| format!("{:?} rays: {fault}", set.class)),
            Err(error) => Some(error.to_string()),
        };
        let outcome = result.and_then(|samples| {
            let empty = session
                .clock
                .time("gpu", || empty_ms(|| item.batch.trace_nothing()))?;
            let work = session.clock.time("gpu", || {
                count_work(
                    gpu,
                    &world.buffers.triangles,
                    &structure.traced,
                    set.query(),
                    &set.rays,
                )
            })?;
            let ms = without_overhead(&samples.ms, empty);
            let rate = millions_per_second(&ms, set.rays.len() as f64);
            Ok(rate.map(|mrays_s| ClassTiming {
                class: set.class,
                rays: set.rays.len(),
                hit_fraction: set.hit_fraction(),
                ms,
                wall_ms: samples.wall_ms,
                mrays_s,
                counters: work.as_deref().map(per_ray),
            }))
        });
        match (outcome, fault) {
            (Ok(timing), None) => structure.record.body.timings.extend(timing),
            (Ok(_), Some(fault)) => failures[item.structure] = Some(fault),
            (Err(error), _) => failures[item.structure] = Some(error.to_string()),
        }
        structure.record.ran.features = item.batch.tracer().features();
    }
    let mut kept = Vec::new();
    for (mut structure, failure) in gated.drain(..).zip(failures) {
        if let Some(failure) = failure {
            structure.record.body.failure = Some(failure);
            structure.record.body.timings.clear();
            write_failed(session, world, &structure.cell.clone(), structure.record)?;
        } else {
            structure.speed = structure
                .record
                .body
                .timings
                .iter()
                .map(|t| t.mrays_s.value.ln())
                .sum::<f64>();
            kept.push(structure);
        }
    }
    *gated = kept;
    Ok(())
}

fn per_ray(work: &[Counters]) -> CountersPerRay {
    let mean = |get: fn(&Counters) -> u32| {
        work.iter().map(|c| f64::from(get(c))).sum::<f64>() / work.len().max(1) as f64
    };
    CountersPerRay {
        nodes: mean(|c| c.nodes),
        box_tests: mean(|c| c.box_tests),
        triangle_tests: mean(|c| c.triangle_tests),
        stack_high_water: work.iter().map(|c| c.stack_high_water).max().unwrap_or(0),
    }
}

/// Cost of every pixel's primary ray as a picture, one scale for all structures of a scene. The
/// scale ends at the 99th percentile of the costliest structure but brute force, whose cost is the
/// same everywhere and would leave the others black.
fn draw_heat_maps(
    session: &mut Session,
    world: &World,
    gated: &mut [Gated],
) -> Result<(), RunError> {
    let [width, height] = session.experiment.resolution;
    let rays = primary_rays(world.camera, width, height);
    let pixels = primary_pixels(width, height);
    for structure in gated.iter_mut() {
        let gpu = world.device.of(&structure.cell.kernels)?;
        let work = session.clock.time("gpu", || {
            count_work(
                gpu,
                &world.buffers.triangles,
                &structure.traced,
                Query::Closest,
                &rays,
            )
        });
        let Ok(Some(work)) = work else { continue };
        structure.costs = vec![0.0; rays.len()];
        for (pixel, counters) in pixels.iter().zip(&work) {
            structure.costs[*pixel as usize] = (counters.nodes + counters.triangle_tests) as f32;
        }
    }
    let percentile = |costs: &[f32]| {
        let mut sorted = costs.to_vec();
        sorted.sort_unstable_by(f32::total_cmp);
        sorted.get(sorted.len() * 99 / 100).copied().unwrap_or(0.0)
    };
    let others = gated.iter().filter(|g| g.cell.accel.name != "brute-force");
    let scale = others.map(|g| percentile(&g.costs)).fold(1.0, f32::max);
    for structure in gated.iter_mut().filter(|s| !s.costs.is_empty()) {
        let picture = Picture {
            width,
            height,
            pixels: structure.costs.iter().map(|c| viridis(c / scale)).collect(),
        };
        let names = ["heat", &world.variant.label, &structure.cell.accel.label];
        structure.record.body.heat_map = session.picture(&names, &picture)?;
        structure.record.body.heat_map_max = Some(f64::from(scale));
    }
    Ok(())
}
