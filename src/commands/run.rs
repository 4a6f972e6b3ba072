//! `raystone run`.

use super::arguments::{DeviceArguments, ExperimentArguments, check_models};
use super::estimate::Estimate;
use super::failure::{BAD_INPUT, FAILED, Failure};
use super::output::print;
use clap::Args;
use raystone::config::{Experiment, Plan};
use raystone::measure::record::{Line, Record};
use raystone::report::read_records;
use raystone::run::{Kernels, Registries, RunSummary};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Run an experiment file and write its records and report
#[derive(Args)]
pub struct Run {
    /// Experiment file (TOML), see docs/experiments.md
    file: PathBuf,
    /// Folder for records, images and the report [default: results/NAME of the run]
    #[arg(long, short, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    experiment: ExperimentArguments,
    /// Print the cells and an estimate of the time; start nothing
    #[arg(long)]
    dry_run: bool,
    #[command(flatten)]
    device: DeviceArguments,
    /// No progress bar and no tables: print the report's path only
    #[arg(long, short)]
    quiet: bool,
}

impl Run {
    pub fn execute(self) -> Result<ExitCode, Failure> {
        let registries = Registries::default();
        let catalogue = registries.catalogue();
        let mut overrides = Vec::from_iter(self.device.kernels_override());
        overrides.extend(self.experiment.set.iter().cloned());
        let experiment = Experiment::load(&self.file, &overrides, &catalogue)?;
        let is_randomised =
            |sequence: &_, decorrelation: &_| registries.is_randomised(sequence, decorrelation);
        let plan = Plan::new(&experiment, &self.experiment.only, is_randomised)?;
        check_models(&plan.scenes, &catalogue)?;
        if self.dry_run {
            Kernels::load(&plan.kernels, &registries)?;
            let estimate = Estimate::new(&experiment, &plan);
            print(&format!("{}\n{estimate}\n", plan.describe().trim_end()))?;
            return Ok(ExitCode::SUCCESS);
        }
        let out = self.out.unwrap_or_else(|| default_folder(&experiment.name));
        let options = self.device.options(out, self.quiet);
        let summary = raystone::run::run(&experiment, &plan, &registries, &options)?;
        tell(&summary, &options.out, self.quiet)
    }
}

fn tell(summary: &RunSummary, out: &Path, quiet: bool) -> Result<ExitCode, Failure> {
    let mut text = String::new();
    if !quiet && !summary.tables.is_empty() {
        text += summary.tables.trim_end();
        text += "\n\n";
    }
    if let Some(report) = &summary.report {
        text += &match quiet {
            true => format!("{}\n", report.display()),
            false => format!("report: {}\n", report.display()),
        };
    }
    print(&text)?;
    if summary.failed == 0 && !summary.bad_input {
        return Ok(ExitCode::SUCCESS);
    }
    let lines = read_records(out)?.lines;
    for failure in lines.iter().filter_map(failure) {
        eprintln!("failed: {failure}");
    }
    eprintln!(
        "{} failed",
        match summary.failed {
            1 => "1 gate or cell".to_owned(),
            failed => format!("{failed} gates or cells"),
        }
    );
    Ok(ExitCode::from(if summary.bad_input {
        BAD_INPUT
    } else {
        FAILED
    }))
}

/// The cell of a record and why it failed, if it did.
fn failure(line: &Line) -> Option<String> {
    match &line.record {
        Record::Failed(failed) => Some(format!("{}: {}", failed.cell, failed.reason)),
        Record::Structure(cell) => {
            let reason = cell.failure.as_ref()?;
            Some(format!("{}, {}: {reason}", cell.scene, cell.accel))
        }
        Record::Time(cell) => Some(format!(
            "{}, {}, {}, {} × {}: {}",
            cell.scene,
            cell.accel,
            cell.integrator,
            cell.sequence,
            cell.decorrelation,
            cell.failure.as_ref()?
        )),
        _ => None,
    }
}

/// `results/NAME`, where a name such as `../a b` cannot lead out of `results`.
fn default_folder(name: &str) -> PathBuf {
    let plain = |c: char| match c {
        '-' | '_' | '.' => c,
        c if c.is_alphanumeric() => c,
        _ => '-',
    };
    let name: String = name.chars().map(plain).collect();
    let name = name.trim_start_matches('.');
    let folder = if name.is_empty() { "run" } else { name };
    PathBuf::from("results").join(folder)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_folder_lies_below_results() {
        for (name, folder) in [
            ("quick", "results/quick"),
            ("../../etc/x y", "results/-..-etc-x-y"),
            ("..", "results/run"),
            ("λ-grid", "results/λ-grid"),
        ] {
            assert_eq!(default_folder(name), Path::new(folder), "{name}");
        }
    }
}
