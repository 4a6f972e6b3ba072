//! `raystone inspect`: an experiment before it runs, the folder of a run, or one cell of it.

mod cell;
mod folder;
pub mod plan;

use super::arguments::ExperimentArguments;
use super::output::OutputArguments;
use anyhow::{Result, bail};
use clap::Args;
use std::path::PathBuf;
use std::process::ExitCode;

/// Look into an experiment (what it would measure, in which shards, and how long that may take), or into the folder of a run
/// (what is missing, failed or contradicted), or at one cell of it (whether it is up to date, and how to measure it alone)
#[derive(Args)]
pub struct Inspect {
    /// Experiment file (TOML), or folder that `raystone run` or `raystone merge` wrote
    #[arg(value_name = "FILE|DIR")]
    path: PathBuf,
    /// A cell of the folder: its name as reports have it, or a part of it that no other has
    cell: Option<String>,
    /// Number of shards into which the experiment is divided
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=10_000))]
    shards: Option<u16>,
    /// Print every cell of the experiment with the number of its shard
    #[arg(long)]
    cells: bool,
    #[command(flatten)]
    experiment: ExperimentArguments,
    #[command(flatten)]
    output: OutputArguments,
}

impl Inspect {
    pub fn execute(self) -> Result<ExitCode> {
        if !self.path.is_dir() {
            if let Some(cell) = &self.cell {
                bail!(
                    "{} is no folder of a run, so it has no cell `{cell}`; give the folder that the run wrote",
                    self.path.display()
                );
            }
            return plan::inspect(&self);
        }
        let unfit = [
            ("--shards", self.shards.is_some()),
            ("--cells", self.cells),
            ("--set", !self.experiment.values.set.is_empty()),
            ("--only", !self.experiment.only.is_empty()),
        ];
        if let Some((flag, _)) = unfit.into_iter().find(|(_, given)| *given) {
            bail!(
                "{flag} is of experiment files, and {} is a folder",
                self.path.display()
            );
        }
        match &self.cell {
            Some(name) => cell::inspect(&self, name),
            None => folder::inspect(&self),
        }
    }
}
