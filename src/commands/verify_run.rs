//! `raystone verify-run`.

use super::failure::FAILED;
use super::output::{print, warn};
use anyhow::Result;
use clap::Args;
use raystone::run::{Inventory, Registries};
use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

/// Check that a folder holds every cell of its plan: what is missing, what failed, what does not fit
#[derive(Args)]
pub struct VerifyRun {
    /// Folder that a run or `raystone merge` wrote
    dir: PathBuf,
}

impl VerifyRun {
    pub fn execute(self) -> Result<ExitCode> {
        let inventory = Inventory::read(&self.dir, &Registries::default())?;
        for warning in &inventory.warnings {
            warn(warning);
        }
        let all = inventory.states.len();
        let settled = inventory.states.iter().filter(|s| s.is_settled()).count();
        let mut text = format!("{settled} of {all} cells are measured or left out with a reason\n");
        for state in inventory.missing() {
            writeln!(text, "missing       {}", state.unit.name)?;
        }
        for (state, record) in inventory.failed() {
            writeln!(text, "failed        {}: {}", state.unit.name, record.reason)?;
        }
        for name in &inventory.contradicted {
            writeln!(
                text,
                "contradicted  {name}: measured twice with different inputs"
            )?;
        }
        for name in &inventory.foreign {
            writeln!(text, "not planned   {name}")?;
        }
        if let Some(reason) = &inventory.interrupted {
            writeln!(text, "the run ended early: {reason}")?;
        }
        let whole =
            settled == all && inventory.contradicted.is_empty() && inventory.foreign.is_empty();
        if !whole {
            writeln!(
                text,
                "\n`raystone run … --resume` measures what is missing or failed; `raystone explain {} CELL` tells about one",
                self.dir.display()
            )?;
        }
        print(&text)?;
        Ok(match whole {
            true => ExitCode::SUCCESS,
            false => ExitCode::from(FAILED),
        })
    }
}
