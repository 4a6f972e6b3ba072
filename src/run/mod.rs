//! Running an experiment: the one place where all parts meet.
//!
//! config → scene → accel → gpu → integrator → measure → records. Reports are made from the records alone,
//! by others.

mod adaptive;
mod animation;
mod coherence;
mod compactions;
mod errors;
mod folder;
mod images;
mod kernels;
mod known_images;
mod orders;
mod paths;
mod peers;
mod primary;
mod reference;
mod reference_cache;
mod reference_file;
mod registries;
mod render;
mod session;
mod streams;
mod structure_times;
mod structures;
mod times;
mod trial;
mod words;
mod world;

pub use folder::{Existing, Interrupt, Interrupted, lock_folder};
pub use kernels::{Kernels, kernel_library};
pub use known_images::verify_images;
pub use reference_cache::user_cache;
pub use registries::Registries;
pub use render::{Pictures, Rendering, render};

use crate::config::{Cell, Experiment, Plan};
use crate::gpu::{AdapterChoice, ArithmeticProbe, GpuError};
use crate::image::FileFormat;
use crate::measure::record::{GateVerdict, PathsRecord};
pub use crate::measure::words::dump_stream;
use crate::params::Variant;
use kernels::Device;
use session::Session;
use std::path::PathBuf;
use thiserror::Error;
use world::{Absent, Loaded, World};

/// What an experiment does not say.
#[derive(Debug, Clone, Default)]
pub struct RunOptions {
    /// Folder for records and images; made if missing.
    pub out: PathBuf,
    /// What to do where that folder holds results.
    pub existing: Existing,
    /// Ends the run early.
    pub interrupt: Interrupt,
    /// Is told what went wrong beside the measuring, at once.
    pub warn: Option<fn(&str)>,
    /// Which adapter.
    pub adapter: AdapterChoice,
    /// Whether, and in which format, linear radiance is written beside the pictures of a run.
    pub images: Option<&'static FileFormat>,
    /// Folder in which rendered references are kept for later runs; `None`: each run renders its own.
    pub cache: Option<PathBuf>,
    /// Whether models may name files outside their folder: see [`crate::scene::LoadOptions`].
    pub allow_outside: bool,
    /// Whether to draw a progress bar on standard error.
    pub progress: bool,
    /// Whether the run is to end with exit code 0 whatever fails: recorded, and said in the report.
    pub lenient: bool,
    /// Destroys the device when the turn of this cell comes: for tests of the recovery.
    pub lose_device_at: Option<String>,
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
    let device = Device::open(options, &kernels)?;
    let mut session = Session::new(experiment, plan, registries, options)?;
    let out = measure(&mut session, device, &kernels).map_err(|error| {
        match options.interrupt.now(&error.to_string()) {
            Interrupted::Kept(folder) => RunError::EndedEarly {
                folder,
                source: Box::new(error),
            },
            _ => error,
        }
    })?;
    Ok(RunSummary {
        failed: session.failed,
        skipped: session.skipped,
        bad_input: session.bad_input,
        out,
    })
}

/// Writes every record, and puts them in their place: the folder.
fn measure(
    session: &mut Session,
    mut device: Device,
    kernels: &Kernels,
) -> Result<PathBuf, RunError> {
    session.write_start(crate::gpu::capture(&device.gpu), kernels.folders())?;
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
        }
    }
    loop {
        streams::run(session, &device)?;
        if device.gpu.lost().is_none() {
            compactions::run(session, &device)?;
        }
        if device.gpu.lost().is_none() {
            break;
        }
        device = Device::open(options, kernels)?;
    }
    session.write_end()
}

fn run_scene(session: &mut Session, device: &Device, variant: &Variant) -> Result<(), RunError> {
    let failed = format!("scene {variant}: failed");
    if session.is_done(&failed) {
        return Ok(());
    }
    let loaded = match Loaded::new(session, variant) {
        Ok(loaded) => loaded,
        Err(fault) => {
            session.bad_input = true;
            return session.write_failure(&failed, fault.of_cell()?);
        }
    };
    for cell in session.plan.worlds(variant) {
        // After a lost device worlds that are complete are not built again.
        let done = format!("world {cell}: done");
        if session.is_done(&done) {
            continue;
        }
        run_world(session, device, &loaded, &cell)?;
        if device.gpu.lost().is_some() {
            break;
        }
        session.finish(done);
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
    if session.is_done(&failed) {
        return Ok(());
    }
    let world = match World::new(session, device, loaded, cell) {
        Ok(world) => world,
        Err(Absent::BadInput(reason)) => {
            session.bad_input = true;
            return session.write_failure(&failed, reason);
        }
        Err(Absent::NotKept(reason)) => {
            session.finish(failed);
            return session.write_skipped(&session.plan.all_on(cell, reason));
        }
    };
    session.progress.inc(session::SCENE_STEPS);
    let gpu = &device.gpu;
    let gated = structures::run(session, &world)?;
    if gpu.lost().is_none() {
        errors::run(session, &world, &gated)?;
    }
    if gpu.lost().is_none() {
        times::run(session, &world, &gated)?;
    }
    coherence::run(session, &world, &gated)?;
    if gpu.lost().is_none() {
        animation::run(session, &world, &gated)?;
    }
    Ok(())
}

/// Runs the gate alone on every structure of a plan, with `rays` rays of each class; integrators are judged on all `trials`, too
/// ([`crate::measure::trial_scenes`]), or on those alone that are of the plan's scenes.
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
    session.judges_trials = trials;
    let mut verified = Vec::new();
    for scene in &plan.scenes {
        let loaded = match Loaded::new(&mut session, scene) {
            Ok(loaded) => Ok(loaded),
            Err(fault) => Err(fault.of_cell()?),
        };
        for part in plan.worlds(scene) {
            let world = match &loaded {
                Ok(loaded) => World::new(&mut session, &device, loaded, &part),
                Err(reason) => Err(Absent::BadInput(reason.clone())),
            };
            for cell in plan.structures.iter().filter(|c| c.is_on(&part)) {
                verified.push(verify_cell(&mut session, &world, cell)?);
            }
        }
    }
    session.progress.finish_and_clear();
    Ok(verified)
}

fn verify_cell(
    session: &mut Session,
    world: &Result<World, Absent>,
    cell: &Cell,
) -> Result<Verified, RunError> {
    let mut verified = Verified {
        cell: cell.clone(),
        verdict: Err("no verdict".to_owned()),
        bad_input: matches!(world, Err(Absent::BadInput(_))),
        refused: false,
        paths: Vec::new(),
    };
    match world {
        Err(Absent::BadInput(reason) | Absent::NotKept(reason)) => {
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
