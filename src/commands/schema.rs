//! `raystone schema`.

use super::output::print;
use anyhow::Result;
use clap::Args;
use raystone::export::record_schema;
use std::process::ExitCode;

/// Print the JSON Schema of the records of a run
#[derive(Args)]
pub struct Schema {}

impl Schema {
    pub fn execute(self) -> Result<ExitCode> {
        print(&format!("{:#}\n", record_schema()))?;
        Ok(ExitCode::SUCCESS)
    }
}
