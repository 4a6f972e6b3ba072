//! What is said of a run beside its experiment, and how it ended.

use super::folder::{Existing, Interrupt};
use raystone_config::Shard;
use raystone_core::program::Program;
use raystone_gpu::{AdapterChoice, ArithmeticProbe};
use raystone_image::FileFormat;
use std::path::PathBuf;

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
