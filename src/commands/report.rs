//! `raystone report`.

use super::output::{OutputArguments, print, print_json, warn};
use anyhow::Result;
use clap::Args;
use raystone::export::{checks_json, values_json};
use raystone::measure::record::read_records;
use raystone::report::data::RunData;
use raystone::report::sections::belief::checks;
use raystone::report::values::values;
use raystone::report::write_report;
use raystone::run::records_in;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Write the report of a run again from its records
#[derive(Args)]
pub struct Report {
    /// Folder that a run or the stress suite wrote, with records.jsonl
    dir: PathBuf,
    #[command(flatten)]
    output: OutputArguments,
}

impl Report {
    pub fn execute(self) -> Result<ExitCode> {
        let dir = &records_in(&self.dir);
        let paths = write_report(dir)?;
        for warning in &paths.warnings {
            warn(warning);
        }
        if self.output.json {
            print_json("report", findings(dir, &paths.html)?)?
        } else {
            print(&format!("report: {}\n", paths.html.display()))?
        }
        Ok(ExitCode::SUCCESS)
    }
}

/// Returns the page, figures and checks of a run, as JSON.
pub fn findings(dir: &Path, page: &Path) -> Result<Value> {
    let records = read_records(dir)?;
    let data = RunData::new(&records.lines);
    Ok(json!({
        "report": page,
        "run": data.run,
        "figures": values_json(&values(&data)),
        "checks": checks_json(&checks(&data)),
        "warnings": records.warnings,
    }))
}
