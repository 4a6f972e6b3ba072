//! Options of a run besides its experiment, and its outcome.

use super::folder::{Existing, Interrupt};
use raystone_config::Shard;
use raystone_core::program::Program;
use raystone_gpu::{AdapterChoice, ArithmeticProbe};
use raystone_image::FileFormat;
use std::path::PathBuf;

/// Options of a run that are not part of the experiment.
// Many fields: one for each option.
#[derive(Debug, Clone, Default)]
pub struct RunOptions {
    /// The measuring program, for records.
    pub program: Program,
    /// Output folder for records and images; created if missing.
    pub out: PathBuf,
    /// Handling of existing results in that folder.
    pub existing: Existing,
    /// Interrupts the run.
    pub interrupt: Interrupt,
    /// Called immediately with warnings.
    pub warn: Option<fn(&str)>,
    /// Called with lines of progress.
    pub tell: Option<fn(&str)>,
    /// Adapter to use.
    pub adapter: AdapterChoice,
    /// Format in which linear radiance is written next to a run's pictures; `None`: it is not.
    pub images: Option<&'static FileFormat>,
    /// Folder that caches rendered references for later runs; `None`: each run renders its own.
    pub cache: Option<PathBuf>,
    /// True if models may name files outside their folder: see [`raystone_scene::LoadOptions`].
    pub allow_outside: bool,
    /// The part of the plan to run; `None`: all of it.
    pub shard: Option<Shard>,
    /// True to wait for another run that is writing the folder.
    pub wait: bool,
    /// True to end the run at the first failed cell.
    pub fail_fast: bool,
    /// True for a progress bar on standard error.
    pub progress: bool,
    /// True to exit with code 0 whatever fails; failures are still recorded and reported.
    pub lenient: bool,
    /// Destroys the device when this cell is reached, to test recovery.
    pub lose_device_at: Option<String>,
    /// Number of compilations of every timed kernel, in turns over the rounds; 0 and 1: one. See
    /// [`raystone_gpu::Gpu::compiled_apart`].
    pub compilations: usize,
    /// Assumed arithmetic of the adapter instead of probing it, for tests.
    pub arithmetic: Option<ArithmeticProbe>,
}

/// Outcome of a run.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RunSummary {
    /// Number of failed cells or structure checks.
    pub failed: usize,
    /// Number of skipped cells.
    pub skipped: usize,
    /// Number of still valid cells of an earlier run.
    pub kept: usize,
    /// True if a scene could not be loaded (exit code 2).
    pub bad_input: bool,
    /// Folder of the records.
    pub out: PathBuf,
}
