//! Running an experiment: the one place where all parts meet.
//!
//! config → scene → accel → gpu → integrator → measure → records. Reports are made from the records alone,
//! by others.

mod adaptive;
mod animation;
mod coherence;
mod compactions;
mod cost;
mod driver;
mod errors;
mod folder;
mod images;
mod inputs;
mod inventory;
mod kernels;
mod known_images;
mod ledger;
mod measurement;
mod merge;
mod orders;
mod paths;
mod peers;
mod primary;
mod progress;
mod recorder;
mod reference;
mod reference_file;
mod registries;
mod render;
mod resume;
mod session;
mod shard;
mod streams;
mod structure_times;
mod structures;
mod times;
mod trial;
mod words;
mod world;

pub use cost::{Cost, Work};
pub use folder::{Existing, Interrupt, Interrupted, lock_folder, records_in};
pub use inputs::place;
pub use inventory::{Inventory, State};
pub use kernels::{Kernels, kernel_library};
pub use known_images::verify_images;
pub use measurement::{Absent, At, Measurement, MeasurementRegistry, Preparation, Prepared, Unit};
pub use merge::{Merged, merge};
pub use registries::Registries;
pub use render::{Pictures, Rendering, render};
pub use shard::shards;

pub use crate::words::dump_stream;
use inputs::Current;
use kernels::Device;
use measurement::Run;
use raystone_config::{Axis, Cell, Experiment, Plan, REFERENCE_PARTS, Shard};
use raystone_core::params::Variant;
use raystone_core::program::Program;
use raystone_gpu::{AdapterChoice, ArithmeticProbe, GpuError};
use raystone_image::FileFormat;
use raystone_record::{GateVerdict, PathsRecord};
use raystone_scene as scene;
use session::Session;
use std::collections::HashMap;
use std::path::PathBuf;
use thiserror::Error;
use world::{Loaded, NoWorld, World, load_options};

/// What an experiment does not say.
#[derive(Debug, Clone, Default)]
pub struct RunOptions {
    /// The program that measures, as records name it.
    pub program: Program,
    /// Folder for records and images; made if missing.
    pub out: PathBuf,
    /// What to do where that folder holds results.
    pub existing: Existing,
    /// Ends the run early.
    pub interrupt: Interrupt,
    /// Is told what went wrong beside the measuring, at once.
    pub warn: Option<fn(&str)>,
    /// Is told how the run goes on, line by line.
    pub tell: Option<fn(&str)>,
    /// Which adapter.
    pub adapter: AdapterChoice,
    /// Whether, and in which format, linear radiance is written beside the pictures of a run.
    pub images: Option<&'static FileFormat>,
    /// Folder in which rendered references are kept for later runs; `None`: each run renders its own.
    pub cache: Option<PathBuf>,
    /// Whether models may name files outside their folder: see [`raystone_scene::LoadOptions`].
    pub allow_outside: bool,
    /// The part of the plan that is run; `None`: all of it.
    pub shard: Option<Shard>,
    /// Whether to wait for another run that writes the folder.
    pub wait: bool,
    /// Whether the first cell that fails ends the run.
    pub fail_fast: bool,
    /// Whether to draw a progress bar on standard error.
    pub progress: bool,
    /// Whether the run is to end with exit code 0 whatever fails: recorded, and said in the report.
    pub lenient: bool,
    /// Destroys the device when the turn of this cell comes: for tests of the recovery.
    pub lose_device_at: Option<String>,
    /// How often every timed kernel is compiled, in turns over the rounds; 0 and 1: once. See [`raystone_gpu::Gpu::compiled_apart`].
    pub compilations: usize,
    /// What to take the adapter's arithmetic for, instead of probing it: for tests of what depends on it.
    pub arithmetic: Option<ArithmeticProbe>,
}

/// How a run ended.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RunSummary {
    /// Cells (or gates) that failed.
    pub failed: usize,
    /// Cells left out with a reason.
    pub skipped: usize,
    /// Cells of an earlier run that still held.
    pub kept: usize,
    /// Whether a scene could not be loaded (exit code 2).
    pub bad_input: bool,
    /// Folder of the records.
    pub out: PathBuf,
}

/// Why a run could not start or go on. A cell that fails is a record, not an error.
#[derive(Debug, Error)]
pub enum RunError {
    /// No usable adapter (exit code 3).
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// Bad usage or input (exit code 2).
    #[error("{0}")]
    Input(String),
    /// Something that ended a run before its end; what was measured is kept.
    #[error("{source}; what was measured is in {}", folder.display())]
    EndedEarly {
        /// The folder of the records.
        folder: PathBuf,
        /// What ended it.
        source: Box<RunError>,
    },
    /// [`Interrupt::now`] was called.
    #[error("the run was interrupted")]
    Interrupted,
    /// A result that is known to be wrong (exit code 1).
    #[error("{0}")]
    Wrong(String),
}

impl RunError {
    /// Whether somebody asked for the end.
    pub fn is_interruption(&self) -> bool {
        matches!(self, Self::Interrupted)
    }

    /// The exit code of the program: 1 a wrong result, 2 bad usage or input, 3 no usable adapter.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Wrong(_)
            | Self::Gpu(
                GpuError::LoopsCut { .. } | GpuError::Kernels(_) | GpuError::Samples { .. },
            ) => 1,
            Self::Gpu(
                GpuError::NoAdapter
                | GpuError::UnknownAdapter { .. }
                | GpuError::NoDevice { .. }
                | GpuError::LoopsUnsound { .. },
            ) => 3,
            Self::EndedEarly { source, .. } => source.exit_code(),
            _ => 2,
        }
    }
}

/// Why something has no figures.
pub(crate) enum Fault {
    /// One cell is at fault, which gets a record of it.
    Cell(String),
    /// Nothing can go on.
    Run(RunError),
}

impl From<String> for Fault {
    fn from(reason: String) -> Self {
        Self::Cell(reason)
    }
}

impl From<RunError> for Fault {
    fn from(error: RunError) -> Self {
        Self::Run(error)
    }
}

impl Fault {
    /// The reason that is one cell's, or what ends the run.
    fn of_cell(self) -> Result<String, RunError> {
        match self {
            Self::Cell(reason) => Ok(reason),
            Self::Run(error) => Err(error),
        }
    }
}

/// One structure's verdict, for `raystone verify`.
#[derive(Debug, Clone)]
pub struct Verified {
    /// Scene, tests, structure and kernels.
    pub cell: Cell,
    /// Verdict, or why there is none.
    pub verdict: Result<GateVerdict, String>,
    /// Whether the scene could not be loaded (exit code 2).
    pub bad_input: bool,
    /// Whether there is none because the driver ends loops too early for the structure.
    pub refused: bool,
    /// Verdicts on integrators, through the first structure that passed with its kernels.
    pub paths: Vec<(Cell, PathsRecord)>,
}

/// Runs a plan, writes `records.jsonl` and images to `options.out`, which another run cannot write
/// meanwhile. Earlier results there stay until the run has ended.
///
/// # Errors
/// No adapter, kernels that cannot be read, or a folder that cannot be written or holds results; the
/// records so far are kept.
pub fn run(
    experiment: &Experiment,
    plan: &Plan,
    registries: &Registries,
    options: &RunOptions,
) -> Result<RunSummary, RunError> {
    let kernels = Kernels::load(&plan.kernels, registries)?;
    let is_resumed = options.existing == Existing::Resume;
    // Without an adapter no folder is touched; a run that has nothing to do needs none.
    let device = (!is_resumed).then(|| Device::open(options, &kernels));
    let device = device.transpose()?;
    let mut session = Session::new(experiment, plan, registries, options)?;
    session.keep_shard();
    let earlier = session.recorder.take_earlier();
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
        None => Device::open(options, &kernels).inspect_err(|_| session.recorder.abandon())?,
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

/// The content of each scene as it is now, for an adapter that binds so many bytes.
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

/// Writes every record, and puts them in their place: the folder.
fn measure(
    session: &mut Session,
    mut device: Device,
    kernels: &Kernels,
) -> Result<PathBuf, RunError> {
    let (plan, options) = (session.plan, session.options);
    for scene in &plan.scenes {
        // A lost device fails the cell that lost it; the rest goes on with a fresh one. Every turn
        // of this loop finishes at least one cell.
        loop {
            run_scene(session, &device, scene)?;
            if device.gpu.lost().is_none() {
                break;
            }
            device = Device::open(options, kernels)?;
            session.recorder.use_device(&device.gpu);
        }
    }
    loop {
        run_alone(session, &device)?;
        if device.gpu.lost().is_none() {
            break;
        }
        device = Device::open(options, kernels)?;
        session.recorder.use_device(&device.gpu);
    }
    session.write_end()
}

/// What is measured without a scene.
fn run_alone(session: &mut Session, device: &Device) -> Result<(), RunError> {
    let at = At {
        experiment: session.experiment,
        registries: session.registries,
        stage: None,
        device,
        gated: &[],
    };
    for entry in session.registries.measurements.entries() {
        match entry.run {
            Run::Alone(run) => run(session, device)?,
            Run::CellByCell => driver::run(session, entry.measurement, &at, None)?,
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
        // After a lost device worlds that are complete are not built again.
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
    let gated = structures::run(session, &world)?;
    let at = At {
        experiment: session.experiment,
        registries: session.registries,
        stage: Some(&world.stage),
        device,
        gated: &gated,
    };
    for entry in session.registries.measurements.entries() {
        session.go_on()?;
        if device.gpu.lost().is_some() {
            break;
        }
        match entry.run {
            Run::OfWorld(run) => run(session, &world, &gated)?,
            Run::CellByCell => driver::run(session, entry.measurement, &at, Some(cell))?,
            Run::First | Run::Alone(_) => {}
        }
    }
    Ok(())
}

/// Renders the references of a plan and keeps them in `options.cache`, where runs find them: all parts, or those that are a shard's. How many
/// were rendered, and which references have none.
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
    let device = Device::open(options, &Kernels::load(&plan.kernels, registries)?)?;
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

/// What samplers of a world are compared under: the world with each integrator.
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

/// Runs the gate alone on every structure of a plan, with `rays` rays of each class; integrators are judged on all `trials`, too
/// ([`raystone_verify::trial_scenes`]), or on those alone that are of the plan's scenes.
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
    let device = Device::open(options, &Kernels::load(&plan.kernels, registries)?)?;
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
            if let Some(traced) = candidate.traced.as_ref().filter(|t| t.is_inline()) {
                verified.paths = paths::verify(session, world, traced, cell)?;
            }
            let record = candidate.record.body;
            verified.refused = record.refused;
            verified.verdict = record.gate.ok_or(record.failure.unwrap_or_default());
        }
    }
    Ok(verified)
}
