//! The folder of a run: cells of its plan that are missing or wrong.

use super::Inspect;
use crate::commands::failure::ended;
use crate::commands::output::warn;
use anyhow::Result;
use raystone::run::Inventory;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::Path;
use std::process::ExitCode;

pub(super) fn inspect(command: &Inspect) -> Result<ExitCode> {
    let inventory = Inventory::read(&command.path, &raystone::registries())?;
    for warning in &inventory.warnings {
        warn(warning);
    }
    let all = inventory.states.len();
    let settled = inventory.states.iter().filter(|s| s.is_settled()).count();
    let whole = settled == all && inventory.contradicted.is_empty() && inventory.foreign.is_empty();
    let text = in_words(&inventory, &command.path, [settled, all], whole)?;
    let fields = as_json(&inventory, [settled, all], whole);
    command.output.show("inspect", fields, &text)?;
    Ok(ended(whole))
}

fn in_words(
    inventory: &Inventory,
    dir: &Path,
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
            "\n`raystone run … --resume` measures what is missing or failed; `raystone inspect {} CELL` tells about one",
            dir.display()
        )?;
    }
    Ok(text)
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
