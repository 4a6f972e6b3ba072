//! `raystone verify-run`.

use super::failure::FAILED;
use super::output::{OutputArguments, print, print_json, warn};
use anyhow::Result;
use clap::Args;
use raystone::run::{Inventory, Registries};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

/// Check that a folder holds every cell of its plan: what is missing, what failed, what does not fit
#[derive(Args)]
pub struct VerifyRun {
    /// Folder that a run or `raystone merge` wrote
    dir: PathBuf,
    #[command(flatten)]
    output: OutputArguments,
}

impl VerifyRun {
    pub fn execute(self) -> Result<ExitCode> {
        let inventory = Inventory::read(&self.dir, &Registries::default())?;
        for warning in &inventory.warnings {
            warn(warning);
        }
        let all = inventory.states.len();
        let settled = inventory.states.iter().filter(|s| s.is_settled()).count();
        let whole =
            settled == all && inventory.contradicted.is_empty() && inventory.foreign.is_empty();
        match self.output.json {
            true => print_json("verify-run", as_json(&inventory, [settled, all], whole))?,
            false => print(&self.in_words(&inventory, [settled, all], whole)?)?,
        }
        Ok(match whole {
            true => ExitCode::SUCCESS,
            false => ExitCode::from(FAILED),
        })
    }

    fn in_words(
        &self,
        inventory: &Inventory,
        [settled, all]: [usize; 2],
        whole: bool,
    ) -> Result<String> {
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
        if !whole {
            writeln!(
                text,
                "\n`raystone run … --resume` measures what is missing or failed; `raystone explain {} CELL` tells about one",
                self.dir.display()
            )?;
        }
        Ok(text)
    }
}

fn as_json(inventory: &Inventory, [settled, all]: [usize; 2], whole: bool) -> Value {
    let missing = inventory.missing().map(|state| state.unit.name.as_str());
    let failed = inventory.failed();
    let failed =
        failed.map(|(state, record)| json!({ "cell": state.unit.name, "reason": record.reason }));
    json!({
        "cells": all,
        "settled": settled,
        "whole": whole,
        "missing": missing.collect::<Vec<_>>(),
        "failed": failed.collect::<Vec<_>>(),
        "contradicted": inventory.contradicted,
        "not_planned": inventory.foreign,
        "interrupted": inventory.interrupted,
    })
}
