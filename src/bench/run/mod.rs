//! Runs an experiment: the one place where all parts meet.
//!
//! config → scene → accel → gpu → integrator → measure → records. Reports use only records.

mod adaptive;
mod alone;
mod animation;
mod built_in;
mod coherence;
mod compactions;
mod cost;
mod device;
mod device_trees;
mod driver;
mod error;
mod errors;
mod folder;
mod images;
mod inputs;
mod inventory;
mod kernels;
mod known_images;
pub mod known_plan;
mod known_scenes;
mod known_settings;
mod known_turns;
mod ledger;
mod measurement;
mod merge;
mod offsets;
mod options;
mod orders;
mod path_orders;
mod paths;
mod peers;
mod primary;
mod progress;
mod promised;
mod rasterised;
mod recorder;
mod reference;
mod reference_file;
mod registries;
mod render;
mod replicates;
mod resume;
mod session;
mod shard;
mod streams;
mod structure_times;
mod structures;
mod times;
mod trial;
mod twins;
mod uniform;
mod units;
mod words;
mod world;

pub use adaptive::LEAST_FOR_TILES;
pub use alone::{VerifiedMeasurement, verify_measurements};
pub use cost::{Cost, Work};
pub use error::RunError;
pub use folder::{Existing, Interrupt, Interrupted, lock_folder, records_in};
pub use images::{Estimator, attributes};
pub use inputs::place;
pub use inventory::{Inventory, State};
pub use kernels::{Kernels, kernel_library};
pub use known_images::verify_images;
pub use measurement::{Absent, At, Measurement, Preparation, Prepared, Through};
pub use merge::{Merged, merge};
pub use options::{RunOptions, RunSummary};
pub use reference_file::check_reference;
pub use registries::Registries;
pub use render::{Pictures, Rendering, render};
pub use shard::shards;
pub use units::{MeasurementRegistry, Unit};

pub use crate::words::dump_stream;
use built_in::{Run, run_of};
use device::Device;
use inputs::Current;
use raystone_config::{Axis, Cell, Experiment, Plan, REFERENCE_PARTS, Shard};
use raystone_core::params::Variant;
use raystone_record::{GateVerdict, PathsRecord};
use raystone_scene as scene;
use session::Session;
use std::collections::HashMap;
use std::path::PathBuf;
pub use words::{VerifiedSampler, verify_samplers};
use world::{Loaded, NoWorld, World};
pub use world::{load_options, table_bytes};

/// Verdict on one structure, for `raystone verify`.
#[derive(Debug, Clone)]
pub struct Verified {
    /// Scene, tests, structure and kernels.
    pub cell: Cell,
    /// Verdict, or why there is none.
    pub verdict: Result<GateVerdict, String>,
    /// True if the scene could not be loaded (exit code 2).
    pub bad_input: bool,
    /// True if there is no verdict because the driver ends loops too early for the structure.
    pub refused: bool,
    /// Verdicts on integrators, through the first passing structure with its kernels.
    pub paths: Vec<(Cell, PathsRecord)>,
}

/// Runs a plan and writes `records.jsonl` and images to `options.out`, locked against other runs.
/// Earlier results stay there until the run has ended.
///
/// # Errors
/// No adapter, unreadable kernels, or a folder not writable or with results; records stay.
pub fn run(
    experiment: &Experiment,
    plan: &Plan,
    registries: &Registries,
    options: &RunOptions,
) -> Result<RunSummary, RunError> {
    let kernels = Kernels::load(&plan.kernels, registries)?;
    let is_resumed = options.existing == Existing::Resume;
    // Without an adapter no folder is touched; a run with nothing to do needs none.
    let device = (!is_resumed).then(|| kernels.open(options));
    let device = device.transpose()?;
    let mut session = Session::new(experiment, plan, registries, options)?;
    session.keep_shard();
    let earlier = session.recorder.take_earlier();
    earlier
        .check_whole(&session.ledger.units, &options.out)
        .inspect_err(|_| session.recorder.abandon())?;
    let file = session.reference_file.as_ref();
    let mut current = Current::new(experiment, file, registries, &kernels);
    if !earlier.is_empty() {
        current.scenes = scene_hashes(&plan.scenes, options, earlier.table_bytes());
        let kept = earlier.kept(&session.ledger.units, &current);
        if session.open_beside(&kept) == 0 {
            session.recorder.abandon();
            return Ok(RunSummary {
                kept: kept.cells.len(),
                out: options.out.clone(),
                ..RunSummary::default()
            });
        }
    }
    let device = match device {
        Some(device) => device,
        None => kernels
            .open(options)
            .inspect_err(|_| session.recorder.abandon())?,
    };
    let kept = session.begin(&device, &kernels, (&earlier, current));
    let out = kept.and_then(|kept| Ok((kept, measure(&mut session, device, &kernels)?)));
    let (kept, out) = out.map_err(|error| match options.interrupt.now(&reason(&error)) {
        Interrupted::Kept(folder) => RunError::EndedEarly {
            folder,
            source: Box::new(error),
        },
        _ => error,
    })?;
    Ok(RunSummary {
        failed: session.ledger.failed,
        skipped: session.ledger.skipped,
        bad_input: session.ledger.bad_input,
        kept,
        out,
    })
}

/// Why a run ended early, for its last record.
fn reason(error: &RunError) -> String {
    match error {
        RunError::Interrupted => "SIGINT".to_owned(),
        error => error.to_string(),
    }
}

/// Current content hash of each scene, for an adapter with this binding limit.
fn scene_hashes<'s>(
    scenes: impl IntoIterator<Item = &'s Variant>,
    options: &RunOptions,
    table_bytes: u64,
) -> HashMap<String, Result<String, String>> {
    let load = load_options(options, table_bytes);
    let hash = |scene: &Variant| {
        let loaded = scene::load(scene, &load);
        let hash = loaded.map(|s| s.hash).map_err(|e| e.to_string());
        (scene.label.clone(), hash)
    };
    scenes.into_iter().map(hash).collect()
}

/// Measures everything, writes the records, and moves them to their folder.
fn measure(
    session: &mut Session,
    mut device: Device,
    kernels: &Kernels,
) -> Result<PathBuf, RunError> {
    let (plan, options) = (session.plan, session.options);
    for scene in &plan.scenes {
        // A lost device fails its cell; a new one continues. Every iteration finishes a cell.
        loop {
            run_scene(session, &device, scene)?;
            if device.gpu.lost().is_none() {
                break;
            }
            device = kernels.open(options)?;
            session.recorder.use_device(&device.gpu);
        }
    }
    loop {
        run_alone(session, &device)?;
        if device.gpu.lost().is_none() {
            break;
        }
        device = kernels.open(options)?;
        session.recorder.use_device(&device.gpu);
    }
    session.write_end()
}

/// Measurements without a scene.
fn run_alone(session: &mut Session, device: &Device) -> Result<(), RunError> {
    let at = At {
        experiment: session.experiment,
        registries: session.registries,
        stage: None,
        device,
        traced: Vec::new(),
        refused: Vec::new(),
        progress: session.progress.clone(),
    };
    for measurement in session.registries.measurements.iter() {
        match run_of(measurement) {
            Run::Alone(run) => run(session, device)?,
            Run::CellByCell => driver::run(session, measurement, &at, None)?,
            Run::First | Run::OfWorld(_) => {}
        }
        if device.gpu.lost().is_some() {
            break;
        }
    }
    Ok(())
}

fn run_scene(session: &mut Session, device: &Device, variant: &Variant) -> Result<(), RunError> {
    let failed = format!("scene {variant}: failed");
    let is_on = |unit: &Unit| unit.cell.get(Axis::Scene) == Some(variant);
    if session.ledger.is_done(&failed) || !session.ledger.open_units().any(is_on) {
        return Ok(());
    }
    let loaded = match Loaded::new(session, &device.gpu, variant) {
        Ok(loaded) => loaded,
        Err(fault) => {
            session.ledger.bad_input = true;
            return session.fail_all(&failed, is_on, fault.of_cell()?);
        }
    };
    for cell in session.plan.worlds(variant) {
        // After a lost device, completed worlds are not rebuilt.
        let done = format!("world {cell}: done");
        if session.ledger.is_done(&done)
            || !session
                .ledger
                .open_units()
                .any(|unit| unit.cell.is_on(&cell))
        {
            continue;
        }
        session.go_on()?;
        run_world(session, device, &loaded, &cell)?;
        if device.gpu.lost().is_some() {
            break;
        }
        session.ledger.finish(done);
    }
    Ok(())
}

fn run_world(
    session: &mut Session,
    device: &Device,
    loaded: &Loaded,
    cell: &Cell,
) -> Result<(), RunError> {
    let failed = format!("scene {cell}: failed");
    if session.ledger.is_done(&failed) {
        return Ok(());
    }
    let world = match World::new(session, device, loaded, cell) {
        Ok(world) => world,
        Err(NoWorld::BadInput(reason)) => {
            session.ledger.bad_input = true;
            return session.fail_all(&failed, |unit| unit.cell.is_on(cell), reason);
        }
        Err(NoWorld::NotKept(reason)) => {
            session.ledger.finish(failed);
            return session.leave_out(cell, reason);
        }
    };
    session.progress.add(session.cost.world(cell).seconds());
    let unfit = session.registries.unfit_for_images(cell);
    if let Some(reason) = unfit.map_err(RunError::Input)? {
        session.leave_out_images(cell, reason)?;
    }
    let gated = structures::run(session, &world)?;
    let at = At {
        experiment: session.experiment,
        registries: session.registries,
        stage: Some(&world.stage),
        device,
        traced: gated.iter().map(|g| (&g.cell, &g.traced)).collect(),
        refused: session.ledger.refused_structures(session.plan),
        progress: session.progress.clone(),
    };
    for measurement in session.registries.measurements.iter() {
        session.go_on()?;
        if device.gpu.lost().is_some() {
            break;
        }
        match run_of(measurement) {
            Run::OfWorld(run) => run(session, &world, &gated)?,
            Run::CellByCell => driver::run(session, measurement, &at, Some(cell))?,
            Run::First | Run::Alone(_) => {}
        }
    }
    Ok(())
}

/// Renders the references of a plan, or a shard's parts of them, into `options.cache`, where runs
/// find them. Returns the number of rendered parts, and the references that have none.
///
/// # Errors
/// No adapter, or no cache.
pub fn render_references(
    experiment: &Experiment,
    plan: &Plan,
    registries: &Registries,
    options: &RunOptions,
) -> Result<(usize, Vec<String>), RunError> {
    if options.cache.is_none() {
        return Err(RunError::Input(
            "there is no folder to keep references in: set RAYSTONE_CACHE".to_owned(),
        ));
    }
    let device = Kernels::load(&plan.kernels, registries)?.open(options)?;
    let mut session = Session::unrecorded(experiment, plan, registries, options);
    session.reference_file = reference_file::ReferenceFile::load(experiment)?;
    let shard = options.shard.unwrap_or(Shard { number: 1, of: 1 });
    let (mut rendered, mut failures) = (0, Vec::new());
    let mut part = 0;
    for scene in &plan.scenes {
        let loaded = match Loaded::new(&mut session, &device.gpu, scene) {
            Ok(loaded) => loaded,
            Err(fault) => {
                failures.push(format!("{scene}: {}", fault.of_cell()?));
                continue;
            }
        };
        for cell in plan.worlds(scene) {
            let world = World::new(&mut session, &device, &loaded, &cell)?;
            if !world.soup.intersection.triangle.is_exact() {
                continue;
            }
            for wanted in references_of(plan, &cell) {
                let own: Vec<usize> = (0..REFERENCE_PARTS as usize)
                    .filter(|number| (part + number) % shard.of == shard.number - 1)
                    .collect();
                part += REFERENCE_PARTS as usize;
                if own.is_empty() {
                    continue;
                }
                let made = reference::reference_structure(&mut session, &world, &[]);
                let made = made.and_then(|traced| {
                    reference::keep_parts(&mut session, &world, &traced, &wanted, own.into_iter())
                });
                match made {
                    Ok(count) => rendered += count,
                    Err(fault) => failures.push(format!("{wanted}: {}", fault.of_cell()?)),
                }
            }
        }
    }
    session.progress.bar.finish_and_clear();
    Ok((rendered, failures))
}

/// Reference keys of a world's samplers: the world with each integrator.
fn references_of(plan: &Plan, world: &Cell) -> Vec<Cell> {
    let axes = [&Cell::WORLD[..], &[Axis::Integrator]].concat();
    let mut found: Vec<Cell> = Vec::new();
    for cell in plan.samplers.iter().filter(|cell| cell.is_on(world)) {
        let cell = cell.on(&axes);
        if !found.contains(&cell) {
            found.push(cell);
        }
    }
    found
}

/// Checks every structure of a plan, with `rays` rays of each class. Integrators are also checked
/// on all `trials` ([`raystone_verify::trial_scenes`]), or only on those of the plan's scenes.
///
/// # Errors
/// No adapter.
pub fn verify(
    experiment: &Experiment,
    plan: &Plan,
    registries: &Registries,
    options: &RunOptions,
    rays: u32,
    trials: bool,
) -> Result<Vec<Verified>, RunError> {
    let device = Kernels::load(&plan.kernels, registries)?.open(options)?;
    let mut experiment = experiment.clone();
    experiment.gate.rays = rays;
    experiment.timing.rays = rays;
    let mut session = Session::unrecorded(&experiment, plan, registries, options);
    session.checked.on_all_trials = trials;
    let mut verified = Vec::new();
    for scene in &plan.scenes {
        let loaded = match Loaded::new(&mut session, &device.gpu, scene) {
            Ok(loaded) => Ok(loaded),
            Err(fault) => Err(fault.of_cell()?),
        };
        for part in plan.worlds(scene) {
            let world = match &loaded {
                Ok(loaded) => World::new(&mut session, &device, loaded, &part),
                Err(reason) => Err(NoWorld::BadInput(reason.clone())),
            };
            for cell in plan.structures.iter().filter(|c| c.is_on(&part)) {
                verified.push(verify_cell(&mut session, &world, cell)?);
            }
        }
    }
    session.progress.bar.finish_and_clear();
    Ok(verified)
}

fn verify_cell(
    session: &mut Session,
    world: &Result<World, NoWorld>,
    cell: &Cell,
) -> Result<Verified, RunError> {
    let mut verified = Verified {
        cell: cell.clone(),
        verdict: Err("no verdict".to_owned()),
        bad_input: matches!(world, Err(NoWorld::BadInput(_))),
        refused: false,
        paths: Vec::new(),
    };
    match world {
        Err(NoWorld::BadInput(reason) | NoWorld::NotKept(reason)) => {
            verified.verdict = Err(reason.clone());
        }
        Ok(world) => {
            let candidate = structures::build_and_gate(session, world, cell)?;
            let renders = world.soup.intersection.triangle.is_exact();
            if let Some(traced) = candidate
                .traced
                .as_ref()
                .filter(|t| renders && t.is_inline())
            {
                verified.paths = words::verify(session, world, cell)?;
                verified
                    .paths
                    .extend(paths::verify(session, world, traced, cell)?);
            }
            let record = candidate.record.body;
            verified.refused = record.refused;
            verified.verdict = record.gate.ok_or(record.failure.unwrap_or_default());
        }
    }
    Ok(verified)
}
