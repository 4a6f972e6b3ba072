//! `raystone merge`.

use super::failure::FAILED;
use super::output::{print, warn};
use anyhow::Result;
use clap::Args;
use raystone::report::write_report;
use raystone::run::{Registries, merge};
use std::path::PathBuf;
use std::process::ExitCode;

/// Join the folders of shards to one, with its report
#[derive(Args)]
pub struct Merge {
    /// Folders that `raystone run --shard` wrote
    #[arg(required = true)]
    dirs: Vec<PathBuf>,
    /// Folder for the joined records, pictures and report
    #[arg(long, short, value_name = "DIR")]
    out: PathBuf,
    /// Where shards ran on several devices: take the times of those alone whose description holds this text
    #[arg(long, value_name = "TEXT")]
    device: Option<String>,
}

impl Merge {
    pub fn execute(self) -> Result<ExitCode> {
        let registries = Registries::default();
        let merged = merge(&self.dirs, &self.out, self.device.as_deref(), &registries)?;
        for note in &merged.notes {
            warn(note);
        }
        let page = write_report(&self.out)?.html;
        print(&format!(
            "{} cells of {} folders\n\nreport: {}\n",
            merged.cells,
            self.dirs.len(),
            page.display()
        ))?;
        Ok(match merged.incomplete {
            true => ExitCode::from(FAILED),
            false => ExitCode::SUCCESS,
        })
    }
}
