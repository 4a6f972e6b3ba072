//! `raystone report`.

use super::failure::Failure;
use super::output::print;
use clap::Args;
use raystone::report::write_report;
use std::path::PathBuf;
use std::process::ExitCode;

/// Write the report of a run again, from its records
#[derive(Args)]
pub struct Report {
    /// Folder that a run wrote: the one with records.jsonl
    dir: PathBuf,
}

impl Report {
    pub fn execute(self) -> Result<ExitCode, Failure> {
        let paths = write_report(&self.dir)?;
        for warning in &paths.warnings {
            eprintln!("warning: {warning}");
        }
        print(&format!("report: {}\n", paths.html.display()))?;
        Ok(ExitCode::SUCCESS)
    }
}
