//! The gate tests itself: named faults are planted one at a time in kernels, in the output of builders, and in the
//! tables of samplers, and the project's own checks must turn red for each of them (mutation testing: R. DeMillo, R.
//! Lipton, F. Sayward, "Hints on test data selection", 1978).
//!
//! A check that no fault can turn red proves nothing, and neither does one that is red without a
//! fault: the same run therefore puts every sound subject through every check, and a mutant counts as
//! killed only if its sound subject is green.
//!
//! Kernels are changed through an override folder, as a user would with `--kernels`: the folder of each mutant
//! remains, so that a survivor can be examined with every other command.

use crate::checks::{Bench, Check};
use crate::plant::Plant;
use crate::report::{ControlOutcome, Outcome, Report, Verdict};
use crate::subject::Subject;
use crate::table::mutants;
use crate::world::World;
use raystone::accel::AccelError;
use raystone::gpu::{AdapterChoice, Gpu, GpuError, KernelLibrary, probe_arithmetic};
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;
use thiserror::Error;

/// At least this part of the faults must be killed.
pub const LEAST_KILLED: f64 = 0.95;

/// A named fault.
#[derive(Debug, Clone, Copy)]
pub struct Mutant {
    /// Name as a user types it.
    pub name: &'static str,
    /// One line: the fault.
    pub what: &'static str,
    /// The place of the fault.
    pub plant: Plant,
    /// The subject of the checks.
    pub subject: Subject,
    /// The check that should turn red.
    pub expected: Check,
    /// The reason why no check can see it, if none can.
    pub equivalent: Option<&'static str>,
    /// True if it may keep a kernel from ending: a check that waits in vain has then seen it.
    pub hangs: bool,
}

/// A reason why a mutation run ends without a verdict.
#[derive(Debug, Error)]
pub enum MutantError {
    /// The fault does not apply any more.
    #[error(
        "stale mutant `{name}`: {problem}; adapt its row in tests/mutants/table to what stands there now"
    )]
    Stale {
        /// Name of the mutant.
        name: String,
        /// The text expected and the text found.
        problem: String,
    },
    /// No mutant of this name.
    #[error("there is no mutant `{0}`; `raystone stress --mutants` without names runs all of them")]
    Unknown(String),
    /// The mutated kernel cannot be run at all, or the device is gone: nothing is proven.
    #[error("mutant `{name}`: {source}")]
    Gpu {
        /// Name of the mutant.
        name: String,
        /// The error.
        source: GpuError,
    },
    /// Checks could not be carried out, with the reason.
    #[error("mutant `{name}`: {problem}")]
    Failed {
        /// Name of the mutant.
        name: String,
        /// The reason.
        problem: String,
    },
}

/// A reason why a check was not carried out.
#[derive(Debug, Error)]
pub enum CheckError {
    #[error(transparent)]
    Gpu(#[from] GpuError),
    #[error(transparent)]
    Accel(#[from] AccelError),
    #[error("{0}")]
    Stale(String),
    #[error("{0}")]
    Other(String),
}

impl CheckError {
    fn of(self, name: &str) -> MutantError {
        let name = name.to_owned();
        match self {
            Self::Gpu(source) => MutantError::Gpu { name, source },
            Self::Stale(problem) => MutantError::Stale { name, problem },
            other => MutantError::Failed {
                name,
                problem: other.to_string(),
            },
        }
    }
}

/// Options of a mutation run.
#[derive(Debug, Clone)]
pub struct Options {
    /// The adapter.
    pub adapter: AdapterChoice,
    /// Folder of the changed kernels, with one folder for each mutant.
    pub folder: PathBuf,
    /// Names of mutants; all if empty.
    pub names: Vec<String>,
}

/// Plants the faults one after the other (in parallel, a device each) and returns the checks that turn red.
/// `progress` is called for each mutant as soon as it is decided.
///
/// # Errors
/// An unknown name, a fault that no longer applies (the whole table is checked, whatever is selected), no adapter, or
/// a check that cannot be carried out.
pub fn run(options: &Options, progress: &(dyn Fn(&Outcome) + Sync)) -> Result<Report, MutantError> {
    check_table()?;
    run_selected(options, select(&options.names)?, progress)
}

/// The same with these mutants.
pub fn run_selected(
    options: &Options,
    selected: Vec<Mutant>,
    progress: &(dyn Fn(&Outcome) + Sync),
) -> Result<Report, MutantError> {
    let start = Instant::now();
    let subjects = subjects_of(&selected);
    let world = World::new(options, &selected).map_err(|e| e.of("(none)"))?;
    let jobs: Vec<Job> = subjects
        .into_iter()
        .map(Job::Control)
        .chain(selected.into_iter().map(Job::Mutant))
        .collect();
    let done = in_parallel(&jobs, |job| match job {
        Job::Control(subject) => control(options, &world, *subject).map(Done::Control),
        Job::Mutant(mutant) => {
            let outcome = decide(options, &world, mutant)?;
            progress(&outcome);
            Ok(Done::Mutant(outcome))
        }
    })?;
    let mut report = Report::new(&world);
    for one in done {
        match one {
            Done::Control(outcome) => report.controls.push(outcome),
            Done::Mutant(outcome) => report.mutants.push(outcome),
        }
    }
    report.distrust_red_controls();
    report.seconds = start.elapsed().as_secs_f64();
    Ok(report)
}

/// Does all jobs on as many threads as there are, and returns the results in the order of the jobs.
/// Not by rayon: builders use it, and a thread that waits for a builder's part would meanwhile begin
/// another job, whose time would count for both.
fn in_parallel<T: Sync, R: Send>(
    jobs: &[T],
    work: impl Fn(&T) -> Result<R, MutantError> + Sync,
) -> Result<Vec<R>, MutantError> {
    let next = AtomicUsize::new(0);
    let one_thread = || {
        let mut done = Vec::new();
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(job) = jobs.get(index) else {
                return Ok(done);
            };
            let result = work(job).inspect_err(|_| next.store(jobs.len(), Ordering::Relaxed))?;
            done.push((index, result));
        }
    };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let mut done = Vec::with_capacity(jobs.len());
    std::thread::scope(|scope| {
        let threads: Vec<_> = (0..threads).map(|_| scope.spawn(one_thread)).collect();
        for thread in threads {
            let part = thread.join();
            done.extend(part.unwrap_or_else(|panic| std::panic::resume_unwind(panic))?);
        }
        Ok(())
    })?;
    done.sort_by_key(|(index, _)| *index);
    Ok(done.into_iter().map(|(_, result)| result).collect())
}

enum Job {
    Control(Subject),
    Mutant(Mutant),
}

enum Done {
    Control(ControlOutcome),
    Mutant(Outcome),
}

/// Checks that every fault of the table still applies to the embedded kernels, and that these can be read with it, without running any.
///
/// # Errors
/// The first stale mutant.
pub fn check_table() -> Result<(), MutantError> {
    check_rows(&mutants())
}

/// The same of these rows.
pub fn check_rows(rows: &[Mutant]) -> Result<(), MutantError> {
    let folder = tempfile::tempdir();
    let folder = folder.map_err(|e| CheckError::Other(e.to_string()).of("(none)"))?;
    for mutant in rows {
        let library = mutant.plant.library(&folder.path().join(mutant.name));
        let read = library.and_then(|library| Ok(library.check(&[])?));
        read.map_err(|e| e.of(mutant.name))?;
    }
    Ok(())
}

fn select(names: &[String]) -> Result<Vec<Mutant>, MutantError> {
    let all = mutants();
    if names.is_empty() {
        return Ok(all);
    }
    let find = |name: &String| all.iter().find(|m| m.name == name).copied();
    let found = names.iter().map(|name| {
        let unknown = || MutantError::Unknown(name.clone());
        find(name).ok_or_else(unknown)
    });
    found.collect()
}

fn subjects_of(mutants: &[Mutant]) -> Vec<Subject> {
    let mut subjects: Vec<Subject> = Vec::new();
    for mutant in mutants {
        if !subjects.contains(&mutant.subject) {
            subjects.push(mutant.subject);
        }
    }
    subjects
}

/// Opens a device with these kernels; returns it with `true` if it computes like the host.
pub fn open(options: &Options, kernels: KernelLibrary) -> Result<(Gpu, bool), GpuError> {
    let gpu = raystone::gpu::open(&options.adapter, kernels)?;
    let exact = probe_arithmetic(&gpu)?.is_exact();
    Ok((gpu, exact))
}

/// Puts a sound subject through every check.
fn control(
    options: &Options,
    world: &World,
    subject: Subject,
) -> Result<ControlOutcome, MutantError> {
    let start = Instant::now();
    let label = subject.label();
    let failed = |e: CheckError| e.of(&format!("none, {label}"));
    let (gpu, exact) = open(options, KernelLibrary::default()).map_err(|e| failed(e.into()))?;
    let bench = Bench::new(&gpu, exact, world, &Plant::Nothing);
    let mut outcome = ControlOutcome::new(&subject);
    for check in subject.checks() {
        match bench.carry_out(*check, &subject).map_err(failed)? {
            _ if !check.is_possible(exact) => {}
            None => outcome.green.push(*check),
            Some(evidence) => outcome.red.push((*check, evidence)),
        }
    }
    outcome.ms = start.elapsed().as_secs_f64() * 1e3;
    Ok(outcome)
}

/// Returns the verdict of a check, if it is decisive.
///
/// # Errors
/// It could not be carried out.
pub fn judged(
    by: Check,
    finding: Result<Option<String>, CheckError>,
) -> Result<Option<Verdict>, CheckError> {
    match finding {
        // No proof: a busy machine and a driver at fault do that to sound kernels, too.
        Err(CheckError::Gpu(e @ (GpuError::Timeout { .. } | GpuError::Lost(_)))) => {
            let evidence = e.to_string();
            Ok(Some(Verdict::TimedOut { by, evidence }))
        }
        other => Ok(other?.map(|evidence| Verdict::Killed { by, evidence })),
    }
}

/// Runs the checks of a mutant, cheapest first, until one turns red.
fn decide(options: &Options, world: &World, mutant: &Mutant) -> Result<Outcome, MutantError> {
    let start = Instant::now();
    let failed = |e: CheckError| e.of(mutant.name);
    let folder = options.folder.join(mutant.name);
    let library = mutant.plant.library(&folder).map_err(failed)?;
    let (gpu, exact) = open(options, library).map_err(|e| failed(e.into()))?;
    let bench = Bench::new(&gpu, exact, world, &mutant.plant);
    let mut verdict = Verdict::Survived;
    for check in mutant.subject.checks() {
        if !check.is_possible(exact) {
            continue;
        }
        let finding = bench.carry_out(*check, &mutant.subject);
        if let Some(decided) = judged(*check, finding).map_err(failed)? {
            verdict = decided;
            break;
        }
    }
    let ms = start.elapsed().as_secs_f64() * 1e3;
    Ok(Outcome::new(mutant, verdict, ms))
}
