//! Running an experiment: the one place where all parts meet.
//!
//! config → scene → accel → gpu → integrator → measure → records; the report is made from the
//! records alone.

mod registries;

pub use registries::Registries;

use crate::config::{Experiment, Plan, Variant};
use crate::gpu::{AdapterChoice, Gpu, GpuError};
use crate::measure::record::GateVerdict;
use std::path::PathBuf;
use thiserror::Error;

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
}

/// How a run ended.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RunSummary {
    /// Cells (or gates) that failed.
    pub failed: usize,
    /// Cells left out with a reason.
    pub skipped: usize,
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
            Self::Gpu(GpuError::NoAdapter | GpuError::UnknownAdapter { .. } | GpuError::NoDevice { .. }) => 3,
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
        kernels = kernels.with_folder(folder).map_err(|e| RunError::Input(e.to_string()))?;
    }
    Ok(crate::gpu::open(&options.adapter, kernels)?)
}

/// Runs a plan, writes `records.jsonl`, images and the report to `options.out`.
///
/// # Errors
/// No adapter, or a folder that cannot be written.
pub fn run(
    _experiment: &Experiment,
    _plan: &Plan,
    _registries: &Registries,
    _options: &RunOptions,
) -> Result<RunSummary, RunError> {
    Err(RunError::Input("not yet".to_owned()))
}

/// Runs the gate alone on every structure of a plan, with `rays` rays of each class.
///
/// # Errors
/// No adapter.
pub fn verify(
    _experiment: &Experiment,
    _plan: &Plan,
    _registries: &Registries,
    _options: &RunOptions,
    _rays: usize,
) -> Result<Vec<Verified>, RunError> {
    Err(RunError::Input("not yet".to_owned()))
}

/// One image for `raystone render`: the first scene, structure, sampler and integrator of the axes,
/// at `experiment.spp.max()` samples; returns the tone-mapped picture written to `file`.
///
/// # Errors
/// No adapter, a scene that does not load, a structure that cannot be built.
pub fn render(
    _experiment: &Experiment,
    _registries: &Registries,
    _options: &RunOptions,
    _file: &std::path::Path,
) -> Result<(), RunError> {
    Err(RunError::Input("not yet".to_owned()))
}
