//! Measuring again, side by side, what looks worse.
//!
//! Two sets of kernels of one program are measured in one process, in the same rounds. Two programs are run in turns: each
//! round runs both, the order alternating, and a round is one pair of medians, so that what processes differ in by chance
//! (memory, the hour) is part of the noise that the rounds show.

use raystone_bench::run::{Registries, RunError, RunOptions, kernel_library, run};
use raystone_config::{Axis, Cell, ConfigError, Experiment, Plan};
use raystone_record::{KernelFolder, RunRecord, all_of, axis};
use raystone_report::compare::judge::{IN_TURNS, TimeRatio};
use raystone_report::compare::side::{EMBEDDED, Side, SideError};
use raystone_report::compare::taken::{Evidence, Taken, taken};
use raystone_report::compare::{Confirmed, Finding, Identity};
use raystone_stats::statistics::median;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// So many rounds at least, fifteen of each compilation: by them a slowdown of 2 % is found on a busy machine (docs/compare.md).
/// With fewer than 21 no permutation test passes a correction for some dozens of cells.
pub const LEAST_ROUNDS: u32 = 105;

/// So often every timed kernel of either side is compiled, in turns over the rounds. Of some hundred compilations of equal text one
/// or two took a third longer in all their rounds (Mesa 25, LLVM 15), by where their code came to lie: one of seven moves no median.
pub const COMPILATIONS: usize = 7;

/// Lines of a program that failed which are passed on.
const LAST_LINES: usize = 5;

/// Why nothing was measured again.
#[derive(Debug, thiserror::Error)]
pub enum ConfirmError {
    /// The experiment does not fit this program.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The run failed.
    #[error(transparent)]
    Run(#[from] RunError),
    /// Its records cannot be read.
    #[error(transparent)]
    Side(#[from] SideError),
    /// Nothing tells this program how to measure the base again.
    #[error("{0}")]
    Impossible(String),
}

/// Measures an experiment with two folders of kernels in the same rounds (`embedded` stands for the program's own), and
/// gives the two sides. With `cells` only times, and only those in the scenes of these cells.
///
/// # Errors
/// The experiment does not fit, or the run fails as a whole.
pub fn measure_kernels(
    (text, file): (&str, &str),
    overrides: &[String],
    folders: [&str; 2],
    rounds: u32,
    cells: Option<&[&Finding]>,
    registries: &Registries,
    options: &RunOptions,
) -> Result<[Side; 2], ConfirmError> {
    let catalogue = registries.catalogue();
    let named = folders.map(|folder| if folder == EMBEDDED { "" } else { folder });
    let axes = toml::Value::from(named.map(str::to_owned).to_vec());
    let mut overrides = overrides.to_vec();
    overrides.push(format!("axes.kernels={axes}"));
    let least = Experiment::parse(text, file, &overrides, &catalogue)?
        .timing
        .rounds;
    overrides.push(format!("timing.rounds={}", least.max(rounds)));
    let experiment = Experiment::parse(text, file, &overrides, &catalogue)?;
    let mut plan = Plan::new(&experiment, &[], |s, d| registries.is_randomised(s, d))?;
    if let Some(cells) = cells {
        restrict(&mut plan, cells);
    }
    let options = RunOptions {
        compilations: COMPILATIONS,
        ..options.clone()
    };
    let summary = run(&experiment, &plan, registries, &options)?;
    let side = Side::read(&summary.out)?;
    let axis = &experiment.axes[Axis::Kernels];
    let label = |folder: &str| {
        let known = axis.iter().find(|variant| variant.name == folder);
        known.map_or_else(|| folder.to_owned(), |variant| variant.label.clone())
    };
    let labels = named.map(label);
    Ok(side.of_kernels(Some([&labels[0], &labels[1]]))?)
}

/// Keeps what is timed in the scenes of these cells: the cells, and beside them the controls.
fn restrict(plan: &mut Plan, cells: &[&Finding]) {
    let scenes: BTreeSet<&str> = cells.iter().map(|f| f.key.label(axis::SCENE)).collect();
    let is_there = |cell: &Cell| scenes.contains(&*cell[Axis::Scene].label);
    plan.scenes.retain(|scene| scenes.contains(&*scene.label));
    plan.structures.retain(is_there);
    let full = cells.iter().any(|f| f.figure.id == "ms-per-spp/v1");
    plan.times.retain(|cell| full && is_there(cell));
    let compacted = cells.iter().any(|f| f.figure.id == "compaction-ns/v1");
    plan.benches.retain(|_| compacted);
    plan.samplers.clear();
    plan.streams.clear();
    plan.peers.clear();
    plan.skipped.clear();
}

/// The experiment of a run: text, file, and what was laid over it.
fn experiment(run: &RunRecord) -> (String, String, Vec<String>) {
    const MARK: &str = "# --set ";
    let lines: Vec<&str> = run.experiment_text.lines().collect();
    let from_end = lines
        .iter()
        .rev()
        .take_while(|line| line.starts_with(MARK))
        .count();
    let (text, sets) = lines.split_at(lines.len() - from_end);
    let sets = sets.iter().map(|line| line[MARK.len()..].to_owned());
    (
        text.join("\n") + "\n",
        run.experiment.clone(),
        sets.collect(),
    )
}

/// Measures both sides again in this process, if they are this program with other folders of kernels. The folders must
/// be those of the runs.
///
/// # Errors
/// They are not, or the run fails.
pub fn in_this_process(
    sides: [&Side; 2],
    cells: &[&Finding],
    registries: &Registries,
    options: &RunOptions,
) -> Result<Confirmed, ConfirmError> {
    let runs = sides.map(|side| all_of::<RunRecord>(&side.lines).next().map(|run| run.body));
    let [Some(base), Some(candidate)] = runs else {
        return Err(impossible("the records do not say what was run"));
    };
    let here = (options.program.version, options.program.commit);
    for run in [base, candidate] {
        let there = &run.environment;
        if (&*there.version, there.commit.as_deref()) != here {
            return Err(impossible(
                "a side was measured by another program than this; name that of the base with --base-program",
            ));
        }
    }
    let [old, new] = [base, candidate].map(|run| folder(&run.kernels, registries));
    let (old, new) = (old?, new?);
    if old == new {
        return Err(impossible(
            "both sides are this program with the same kernels",
        ));
    }
    let (text, file, sets) = experiment(candidate);
    let sides = measure_kernels(
        (&text, &file),
        &sets,
        [&old, &new],
        LEAST_ROUNDS,
        Some(cells),
        registries,
        options,
    )?;
    Ok(ratios(&sides))
}

fn impossible(text: impl Into<String>) -> ConfirmError {
    ConfirmError::Impossible(text.into())
}

fn failed(what: &Path, error: &std::io::Error) -> ConfirmError {
    impossible(format!("{}: {error}", what.display()))
}

/// The one folder of kernels of a run, if it is as it was.
fn folder(kernels: &[KernelFolder], registries: &Registries) -> Result<String, ConfirmError> {
    match kernels {
        [] => Ok(EMBEDDED.to_owned()),
        [one] => match kernel_library(Path::new(&one.folder), registries) {
            Ok(library) if library.hash() == one.hash => Ok(one.folder.clone()),
            Ok(_) => Err(impossible(format!(
                "the kernels in {} are no more those of the run",
                one.folder
            ))),
            Err(error) => Err(impossible(error.to_string())),
        },
        _ => Err(impossible("a run has several folders of kernels")),
    }
}

/// The ratio of each time that both sides have.
fn ratios([a, b]: &[Side; 2]) -> Confirmed {
    let theirs: BTreeMap<_, Taken> = taken(b).into_iter().map(|t| (t.identity(), t)).collect();
    let pairs = taken(a).into_iter().filter_map(|old| {
        let new = theirs.get(&old.identity())?;
        let ratio = TimeRatio::new(&old.evidence, &new.evidence, true, a.compilations())?;
        Some((old.identity(), ratio))
    });
    pairs.collect()
}

/// Runs the programs of base and candidate in turns over the cells, each as the experiment of its own run says. Cells that fail have no
/// times, and end no run.
///
/// # Errors
/// A program cannot be started, does not end well, or leaves no records.
pub fn in_turns(
    programs: [&Path; 2],
    sides: [&Side; 2],
    cells: &[&Finding],
    rounds: u32,
    folder: &Path,
    adapter: Option<&str>,
) -> Result<Confirmed, ConfirmError> {
    let mut turns = Vec::new();
    for (index, (program, side)) in programs.into_iter().zip(sides).enumerate() {
        let run = all_of::<RunRecord>(&side.lines).next();
        let run = run.ok_or_else(|| impossible("the records do not say what was run"))?;
        let (text, _, sets) = experiment(run.body);
        let file = folder.join(format!("experiment-{index}.toml"));
        std::fs::write(&file, text).map_err(|e| failed(&file, &e))?;
        turns.push((program, file, sets));
    }
    let mut medians: [BTreeMap<_, Vec<f64>>; 2] = Default::default();
    let out = folder.join("run");
    for round in 0..rounds as usize {
        for turn in [0, 1] {
            let which = (round + turn) % 2;
            let (program, file, sets) = &turns[which];
            let mut command = Command::new(program);
            command.arg("run").arg(file).arg("--out").arg(&out);
            command.args(["--force", "--quiet", "--lenient"]);
            command.args(sets.iter().flat_map(|set| ["--set", set]));
            // Errors are not what is asked for.
            command.args(["--set", "run.replicates=2"]);
            command.args(only(cells).iter().flat_map(|only| ["--only", only]));
            command.args(adapter.iter().flat_map(|adapter| ["--adapter", adapter]));
            command.stdin(Stdio::null()).stdout(Stdio::null());
            let ended = command.output().map_err(|e| failed(program, &e))?;
            if !ended.status.success() {
                return Err(impossible(ended_badly(program, &ended)));
            }
            for (identity, ms) in times(&out)? {
                medians[which].entry(identity).or_default().push(ms);
            }
            std::fs::remove_dir_all(&out).map_err(|e| failed(&out, &e))?;
        }
    }
    let [base, candidate] = medians;
    let whole = |ms: &Vec<f64>| ms.len() == rounds as usize;
    let pairs = base
        .into_iter()
        .filter(|(_, ms)| whole(ms))
        .filter_map(|(identity, old)| {
            let new = candidate.get(&identity).filter(|ms| whole(ms))?;
            let ratios: Vec<f64> = old.iter().zip(new).map(|(a, b)| b / a).collect();
            Some((identity, TimeRatio::of_rounds(&ratios, IN_TURNS)?))
        });
    Ok(pairs.collect())
}

/// How a program ended, and its last words.
fn ended_badly(program: &Path, ended: &Output) -> String {
    let words = String::from_utf8_lossy(&ended.stderr);
    let lines: Vec<&str> = words.lines().filter(|l| !l.trim().is_empty()).collect();
    let last = &lines[lines.len().saturating_sub(LAST_LINES)..];
    let said = if last.is_empty() {
        "it said nothing".to_owned()
    } else {
        last.join("; ")
    };
    format!("{} ended with {}: {said}", program.display(), ended.status)
}

/// The median of each time of a run.
fn times(out: &Path) -> Result<BTreeMap<Identity, f64>, ConfirmError> {
    let side = Side::read(out)?;
    let side = side.alone();
    let medians = taken(&side).into_iter().filter_map(|taken| {
        let ms = match &taken.evidence {
            Evidence::Times {
                adapter,
                processors,
            } if processors.is_empty() => adapter,
            Evidence::Times { processors, .. } => processors,
            _ => return None,
        };
        Some((taken.identity(), median(ms)?))
    });
    Ok(medians.collect())
}

/// What leaves little but the cells to run; an axis whose names a pattern cannot hold is not narrowed.
fn only(cells: &[&Finding]) -> Vec<String> {
    let axes = [axis::SCENE, axis::ACCEL];
    let of = |axis: &str| -> Vec<String> {
        let names: BTreeSet<&str> = cells.iter().map(|f| f.key.name(axis)).collect();
        let plain =
            |name: &&str| !name.is_empty() && !name.contains([',', '=', '*', '?', '[', '!']);
        if names.iter().all(plain) {
            names.iter().map(|name| format!("{axis}={name}")).collect()
        } else {
            Vec::new()
        }
    };
    axes.iter().flat_map(|axis| of(axis)).collect()
}
