//! Running an experiment: the one place where all parts meet.
//!
//! config → scene → accel → gpu → integrator → measure → records; the report is made from the
//! records alone.

pub mod environment;
mod errors;
mod registries;
mod session;
mod streams;
mod structures;
mod times;
mod world;

pub use registries::Registries;
pub use streams::dump_stream;

use crate::config::{Experiment, Plan, Variant};
use crate::gpu::{AdapterChoice, Gpu, GpuError};
use crate::integrator::Renderer;
use crate::measure::picture::{automatic_exposure, tone_map, write_png};
use crate::measure::record::GateVerdict;
use session::Session;
use std::path::PathBuf;
use thiserror::Error;
use world::World;

/// What an experiment does not say.
#[derive(Debug, Clone, Default)]
pub struct RunOptions {
    /// Folder for records, images and the report; made if missing.
    pub out: PathBuf,
    /// Which adapter.
    pub adapter: AdapterChoice,
    /// Folder whose kernels replace the embedded ones.
    pub kernels: Option<PathBuf>,
    /// Whether to draw a progress bar on standard error.
    pub progress: bool,
    /// Destroys the device when the turn of this cell comes: for tests of the recovery.
    pub lose_device_at: Option<String>,
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
    /// Checks of the report that failed, with what they found (exit code 1).
    pub failed_checks: Vec<String>,
    /// The report's page.
    pub report: Option<PathBuf>,
    /// Tables for the terminal.
    pub tables: String,
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
}

impl RunError {
    /// The exit code of the program: 2 bad usage or input, 3 no usable adapter.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Gpu(
                GpuError::NoAdapter | GpuError::UnknownAdapter { .. } | GpuError::NoDevice { .. },
            ) => 3,
            _ => 2,
        }
    }
}

/// One structure's verdict, for `raystone verify`.
#[derive(Debug, Clone)]
pub struct Verified {
    /// Scene.
    pub scene: Variant,
    /// Structure.
    pub accel: Variant,
    /// Verdict, or why there is none.
    pub verdict: Result<GateVerdict, String>,
}

/// Opens the adapter with the kernels of the options.
///
/// # Errors
/// No adapter, or the kernel folder cannot be read.
pub fn open_gpu(options: &RunOptions) -> Result<Gpu, RunError> {
    let mut kernels = crate::gpu::KernelLibrary::default();
    if let Some(folder) = &options.kernels {
        kernels = kernels
            .with_folder(folder)
            .map_err(|e| RunError::Input(e.to_string()))?;
    }
    Ok(crate::gpu::open(&options.adapter, kernels)?)
}

/// Runs a plan, writes `records.jsonl`, images and the report to `options.out`.
///
/// # Errors
/// No adapter, or a folder that cannot be written.
pub fn run(
    experiment: &Experiment,
    plan: &Plan,
    registries: &Registries,
    options: &RunOptions,
) -> Result<RunSummary, RunError> {
    let mut gpu = open_gpu(options)?;
    let mut session = Session::new(experiment, plan, registries, options)?;
    session.write_start(environment::capture(&gpu))?;
    for scene in &plan.scenes {
        // A lost device fails the cell that lost it; the rest goes on with a fresh one. Every turn
        // of this loop finishes at least one cell.
        loop {
            run_scene(&mut session, &gpu, scene)?;
            if gpu.lost().is_none() {
                break;
            }
            gpu = open_gpu(options)?;
        }
    }
    loop {
        streams::run(&mut session, &gpu)?;
        if gpu.lost().is_none() {
            break;
        }
        gpu = open_gpu(options)?;
    }
    session.write_end()?;
    let report =
        crate::report::write_report(&options.out).map_err(|e| RunError::Input(e.to_string()))?;
    let lines =
        crate::report::read_records(&options.out).map_err(|e| RunError::Input(e.to_string()))?;
    Ok(RunSummary {
        failed: session.failed,
        skipped: session.skipped,
        bad_input: session.bad_input,
        report: Some(report.html),
        failed_checks: crate::report::failed_checks(&lines.lines),
        tables: crate::report::terminal_tables(&lines.lines),
    })
}

fn run_scene(session: &mut Session, gpu: &Gpu, variant: &Variant) -> Result<(), RunError> {
    let cell = format!("scene {variant}: failed");
    if session.is_done(&cell) {
        return Ok(());
    }
    let world = match World::new(session, gpu, variant)? {
        Ok(world) => world,
        Err(reason) => {
            session.bad_input = true;
            return session.write_failure(&cell, reason);
        }
    };
    let gated = structures::run(session, &world)?;
    if gpu.lost().is_none() {
        errors::run(session, &world, &gated)?;
    }
    if gpu.lost().is_none() {
        times::run(session, &world, &gated)?;
    }
    Ok(())
}

/// Runs the gate alone on every structure of a plan, with `rays` rays of each class.
///
/// # Errors
/// No adapter.
pub fn verify(
    experiment: &Experiment,
    plan: &Plan,
    registries: &Registries,
    options: &RunOptions,
    rays: u32,
) -> Result<Vec<Verified>, RunError> {
    let gpu = open_gpu(options)?;
    let mut experiment = experiment.clone();
    experiment.gate.rays = rays;
    experiment.timing.rays = rays;
    let mut session = Session::unrecorded(&experiment, plan, registries, options);
    let mut verified = Vec::new();
    for scene in &plan.scenes {
        let accels = plan
            .structures
            .iter()
            .filter(|c| c.scene == *scene)
            .map(|c| &c.accel);
        let world = World::new(&mut session, &gpu, scene)?;
        for accel in accels {
            let verdict = match &world {
                Err(reason) => Err(reason.clone()),
                Ok(world) => match structures::build_and_gate(&mut session, world, accel) {
                    Ok((_, record)) => record.gate.ok_or_else(|| "no verdict".to_owned()),
                    Err(record) => {
                        let reason = record.failure.unwrap_or_default();
                        record.gate.ok_or(reason)
                    }
                },
            };
            verified.push(Verified {
                scene: scene.clone(),
                accel: accel.clone(),
                verdict,
            });
        }
    }
    session.progress.finish_and_clear();
    Ok(verified)
}

/// One image for `raystone render`: the first scene, structure, sampler and integrator of the axes,
/// at `experiment.spp.max()` samples, tone-mapped and written to `file`.
///
/// # Errors
/// No adapter, a scene that does not load, a structure that cannot be built or fails its gate.
pub fn render(
    experiment: &Experiment,
    plan: &Plan,
    registries: &Registries,
    options: &RunOptions,
    file: &std::path::Path,
) -> Result<(), RunError> {
    let gpu = open_gpu(options)?;
    let mut session = Session::unrecorded(experiment, plan, registries, options);
    let cell = plan
        .times
        .first()
        .ok_or_else(|| RunError::Input("there is nothing to render".to_owned()))?;
    let world = World::new(&mut session, &gpu, &cell.scene)?.map_err(RunError::Input)?;
    let built = structures::build_and_gate(&mut session, &world, &cell.accel);
    let (traced, _) =
        built.map_err(|record| RunError::Input(record.failure.unwrap_or_default()))?;
    let pair = (&cell.sequence, &cell.decorrelation);
    let sampler = errors::sampler_for(&session, pair, &cell.integrator, experiment.spp.max());
    let sampler = sampler.map_err(RunError::Input)?;
    let job =
        errors::job(&session, &world, &sampler, &cell.integrator, true).map_err(RunError::Input)?;
    let renderer = Renderer::new(&gpu, &world.buffers, &traced, &job, false)?;
    let snapshots = renderer.render(&[experiment.spp.max()], experiment.seed)?;
    session.progress.finish_and_clear();
    let Some(snapshot) = snapshots.first() else {
        return Ok(());
    };
    let picture = tone_map(&snapshot.image, automatic_exposure(&snapshot.image));
    write_png(file, &picture).map_err(|e| RunError::Input(e.to_string()))
}
