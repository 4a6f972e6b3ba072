//! `raystone run`.

use super::arguments::{DeviceArguments, ExperimentArguments, plan};
use super::failure::{BAD_INPUT, FAILED, ended};
use super::output::{self, OutputArguments, print, print_json, screen};
use super::report::findings;
use super::signals;
use anyhow::Result;
use clap::Args;
use raystone::config::{Experiment, Plan, Shard};
use raystone::image::FileFormat;
use raystone::measure::record::read_records;
use raystone::report::data::RunData;
use raystone::report::{failed_checks, write_report};
use raystone::run::{
    Cost, Existing, Kernels, Registries, RunError, RunOptions, RunSummary, check_reference,
    render_references,
};
use raystone::store::user_folder;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Run an experiment file and write its records and report
#[derive(Args)]
pub struct Run {
    /// Experiment file (TOML), see docs/experiments.md
    file: PathBuf,
    #[command(flatten)]
    folder: FolderArguments,
    /// Run one of N parts of the plan, as 3/8; `raystone merge` joins them [default folder: results/NAME/shard-K-of-N]
    #[arg(long, value_name = "K/N")]
    shard: Option<Shard>,
    /// Render the references alone and keep them where runs find them; with --shard, a part of their samples
    #[arg(long, conflicts_with_all = ["no_cache", "resume", "force", "number", "dry_run"])]
    references: bool,
    #[command(flatten)]
    failures: FailureArguments,
    #[command(flatten)]
    experiment: ExperimentArguments,
    /// Image to compare with in place of a rendered reference, of the run's resolution: .exr, .hdr, .pfm, .npy;
    /// short for --set reference.file=FILE
    #[arg(long, value_name = "FILE")]
    reference: Option<PathBuf>,
    /// Also write linear radiance (reference, first replicate, mean and variance of all) in this format: exr,
    /// hdr, pfm, npy
    #[arg(long, value_name = "FORMAT", value_parser = linear_format)]
    images: Option<&'static FileFormat>,
    /// Render references even if an earlier run kept them (in $RAYSTONE_CACHE, else ~/.cache/raystone; at most 1 GiB),
    /// and keep none
    #[arg(long)]
    no_cache: bool,
    /// Print the cells and an estimate of the time; start nothing
    #[arg(long)]
    dry_run: bool,
    #[command(flatten)]
    device: DeviceArguments,
    /// No progress bar and no tables: print the report's path only
    #[arg(long, short)]
    quiet: bool,
    #[command(flatten)]
    output: OutputArguments,
}

/// The folder that a run writes.
#[derive(Args)]
struct FolderArguments {
    /// Folder for records, images and the report [default: results/NAME of the run, numbered]
    #[arg(long, short, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace the results that the folder holds, once the new ones are whole
    #[arg(long, conflicts_with = "number")]
    force: bool,
    /// Go on with the results that the folder holds: cells that still hold (same kernels, scene, parameters, program) are kept, all
    /// others are measured
    #[arg(long, conflicts_with_all = ["number", "force"])]
    resume: bool,
    /// Where another run is writing the folder, wait until it ends instead of ending
    #[arg(long)]
    wait: bool,
    /// Where the folder holds results or is being written, take the first free one of DIR-2, DIR-3, …
    #[arg(long)]
    number: bool,
}

impl FolderArguments {
    fn existing(&self) -> Existing {
        match (self.resume, self.force) {
            (true, _) => Existing::Resume,
            (_, true) => Existing::Replace,
            _ if self.number || self.out.is_none() => Existing::Number,
            _ => Existing::Refuse,
        }
    }
}

/// What becomes of failures.
#[derive(Args)]
struct FailureArguments {
    /// End with the first cell that fails; `--resume` goes on later
    #[arg(long, conflicts_with = "keep_going")]
    fail_fast: bool,
    /// Go on after cells that fail (the default)
    #[arg(long)]
    keep_going: bool,
    /// End with exit code 0 even if gates, cells or checks fail; the report says so
    #[arg(long)]
    lenient: bool,
}

impl Run {
    pub fn execute(self) -> Result<ExitCode> {
        let registries = raystone::registries();
        let catalogue = registries.catalogue();
        let mut overrides = Vec::from_iter(self.device.kernels_override());
        overrides.extend(self.reference.as_deref().map(reference_override));
        overrides.extend(self.experiment.values.set.iter().cloned());
        let experiment = Experiment::load(&self.file, &overrides, &catalogue)?;
        let plan = plan(&experiment, &self.experiment.only, &registries)?;
        if self.dry_run {
            Kernels::load(&plan.kernels, &registries)?;
            check_reference(&experiment)?;
            let units = registries.measurements.units(&experiment, &plan);
            let cost = Cost::new(&experiment, &plan, &registries.integrators);
            let cells = plan.describe();
            let text = format!("{}\n{}\n", cells.trim_end(), cost.whole(&units).describe());
            let fields = super::inspect::plan::as_json(&plan, &units, &cost);
            self.output.show("run", fields, &text)?;
            return Ok(ExitCode::SUCCESS);
        }
        let default = || default_folder(&experiment.name, self.shard);
        let out = self.folder.out.clone().unwrap_or_else(default);
        let mut options = self
            .device
            .options(out, &self.experiment.values, self.quiet);
        options.existing = self.folder.existing();
        options.images = self.images;
        options.shard = self.shard;
        options.wait = self.folder.wait;
        options.fail_fast = self.failures.fail_fast && !self.failures.keep_going;
        options.lenient = self.failures.lenient;
        options.cache = user_folder().filter(|_| !self.no_cache);
        if self.references {
            return references(&experiment, &plan, &registries, (&options, &self.output));
        }
        carry_out(
            "run",
            &experiment,
            &plan,
            &registries,
            &options,
            &self.output,
            self.quiet,
        )
    }
}

/// Runs a plan, writes its report, and prints results and failures: of `command`.
pub fn carry_out(
    command: &str,
    experiment: &Experiment,
    plan: &Plan,
    registries: &Registries,
    options: &RunOptions,
    output: &OutputArguments,
    quiet: bool,
) -> Result<ExitCode> {
    signals::watch(options.interrupt.clone())?;
    match raystone::run::run(experiment, plan, registries, options) {
        Err(RunError::Interrupted) => signals::wait_for_end(),
        Err(RunError::EndedEarly { folder, source }) if source.is_interruption() => {
            let page = write_report(&folder)?.html;
            output::tell(&format!(
                "interrupted; `--resume` goes on; report so far: {}",
                page.display()
            ));
            Ok(ExitCode::from(signals::INTERRUPTED))
        }
        Err(RunError::EndedEarly { folder, source }) => {
            write_report(&folder)?;
            Err(RunError::EndedEarly { folder, source }.into())
        }
        summary if output.json => {
            let summary = summary?;
            let page = write_report(&summary.out)?.html;
            print_json(command, findings(&summary.out, &page)?)?;
            tell_failures(&summary, options.lenient)
        }
        summary => tell(&summary?, quiet, options.lenient),
    }
}

/// Renders references alone.
fn references(
    experiment: &Experiment,
    plan: &Plan,
    registries: &Registries,
    (options, shown): (&RunOptions, &OutputArguments),
) -> Result<ExitCode> {
    let (rendered, failures) = render_references(experiment, plan, registries, options)?;
    let folder = options.cache.as_deref().unwrap_or(Path::new("."));
    let text = format!(
        "{} rendered; kept in {}\n",
        plural(rendered, "part of a reference", "parts of references"),
        folder.display()
    );
    let fields = json!({ "rendered": rendered, "failed": failures, "folder": folder });
    shown.show("run", fields, &text)?;
    for failure in &failures {
        output::tell(&format!("failed: {failure}"));
    }
    Ok(ended(failures.is_empty()))
}

/// Returns the image to compare with as an override of an experiment.
fn reference_override(file: &Path) -> String {
    let file = toml::Value::from(file.display().to_string());
    format!("reference.file={file}")
}

/// Returns the format of linear images with this ending.
fn linear_format(text: &str) -> Result<&'static FileFormat, String> {
    let ending = text.trim_start_matches('.').to_ascii_lowercase();
    let found = FileFormat::linear().find(|format| format.ending == ending);
    found.ok_or_else(|| {
        let known: Vec<&str> = FileFormat::linear().map(|format| format.ending).collect();
        format!("linear radiance is written as one of {}", known.join(", "))
    })
}

/// Writes the report of a run, prints its tables, and reports failures.
fn tell(summary: &RunSummary, quiet: bool, lenient: bool) -> Result<ExitCode> {
    if summary.kept > 0 && !quiet {
        output::tell(&format!(
            "{} of an earlier run still hold",
            plural(summary.kept, "cell", "cells")
        ));
    }
    let page = write_report(&summary.out)?.html;
    let lines = read_records(&summary.out)?.lines;
    print(&if quiet {
        format!("{}\n", page.display())
    } else {
        format!(
            "{}\n\nreport: {}\n",
            screen().tables(&lines).trim_end(),
            page.display()
        )
    })?;
    tell_failures(summary, lenient)
}

/// Reports failures; returns the exit code.
fn tell_failures(summary: &RunSummary, lenient: bool) -> Result<ExitCode> {
    let lines = read_records(&summary.out)?.lines;
    let failed_checks = failed_checks(&lines);
    let data = RunData::new(&lines);
    if summary.failed == 0 && !summary.bad_input && failed_checks.is_empty() {
        return Ok(ExitCode::SUCCESS);
    }
    for (cell, reason) in data.failures_by_reason() {
        output::tell(&format!("failed: {cell}: {reason}"));
    }
    for check in &failed_checks {
        output::tell(&format!("failed: {check}"));
    }
    output::tell(&format!(
        "{}, {} failed",
        plural(summary.failed, "gate or cell", "gates or cells"),
        plural(failed_checks.len(), "check", "checks")
    ));
    Ok(match (summary.bad_input, lenient) {
        (true, _) => ExitCode::from(BAD_INPUT),
        (false, true) => ExitCode::SUCCESS,
        (false, false) => ExitCode::from(FAILED),
    })
}

fn plural(count: usize, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

/// Returns `results/NAME`, with a folder for a shard below it; a name such as `../a b` cannot lead out of `results`.
fn default_folder(name: &str, shard: Option<Shard>) -> PathBuf {
    let plain = |c: char| match c {
        '-' | '_' | '.' => c,
        c if c.is_alphanumeric() => c,
        _ => '-',
    };
    let name: String = name.chars().map(plain).collect();
    let name = name.trim_start_matches('.');
    let folder = if name.is_empty() { "run" } else { name };
    let folder = PathBuf::from("results").join(folder);
    match shard {
        Some(shard) => folder.join(format!("shard-{}-of-{}", shard.number, shard.of)),
        None => folder,
    }
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
            assert_eq!(default_folder(name, None), Path::new(folder), "{name}");
        }
        let third = "3/8".parse().ok();
        let folder = Path::new("results/quick/shard-3-of-8");
        assert_eq!(default_folder("quick", third), folder);
    }
}
