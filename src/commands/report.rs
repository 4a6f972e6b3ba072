//! `raystone report`.

use super::output::{print, warn};
use anyhow::Result;
use clap::Args;
use raystone::measure::record::{PARTIAL, RECORDS_FILE, STRESS_FILE};
use raystone::report::write_report;
use raystone::stress::record::read;
use raystone::stress::report::write_stress_page;
use std::path::PathBuf;
use std::process::ExitCode;

/// Write the report of a run, or of the stress suite, again from its records
#[derive(Args)]
pub struct Report {
    /// Folder that a run wrote, with records.jsonl, or the stress suite, with stress.jsonl
    dir: PathBuf,
}

impl Report {
    pub fn execute(self) -> Result<ExitCode> {
        let is_suite = self.dir.join(STRESS_FILE).exists();
        if is_suite && !self.dir.join(RECORDS_FILE).exists() {
            let records = read(&self.dir)?;
            let page = write_stress_page(&self.dir, &records)?;
            print(&format!("report: {}\n", page.display()))?;
            return Ok(ExitCode::SUCCESS);
        }
        let partial = self.dir.join(PARTIAL);
        let is_partial = !self.dir.join(RECORDS_FILE).exists() && partial.is_dir();
        let dir = if is_partial { &partial } else { &self.dir };
        let paths = write_report(dir)?;
        for warning in &paths.warnings {
            warn(warning);
        }
        print(&format!("report: {}\n", paths.html.display()))?;
        Ok(ExitCode::SUCCESS)
    }
}
