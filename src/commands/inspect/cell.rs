//! One cell of the folder of a run: its records, the reasons why it is up to date or not, and the command to measure
//! it alone.

use super::Inspect;
use anyhow::{Result, bail};
use raystone::config::{Axis, Cell};
use raystone::measure::record::{CellRecord, Outcome};
use raystone::run::{Inventory, RunOptions, State};
use raystone::text::{did_you_mean, shell_word};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;
use std::process::ExitCode;

pub(super) fn inspect(command: &Inspect, name: &str) -> Result<ExitCode> {
    let registries = raystone::registries();
    let inventory = Inventory::read(&command.path, &registries)?;
    let state = find(&inventory, &command.path, name)?;
    let options = RunOptions {
        program: raystone::PROGRAM,
        allow_outside: command.experiment.values.allow_outside,
        ..RunOptions::default()
    };
    let stale = inventory.stale(state, &registries, &options)?;
    let text = in_words(&inventory, state, stale.as_deref())?;
    let fields = as_json(&inventory, state, stale);
    command.output.show("inspect", fields, &text)?;
    Ok(ExitCode::SUCCESS)
}

/// Returns the cell of this name, or whose name alone holds it.
fn find<'i>(inventory: &'i Inventory, dir: &Path, name: &str) -> Result<&'i State> {
    let states = &inventory.states;
    if let Some(state) = states.iter().find(|state| state.unit.name == name) {
        return Ok(state);
    }
    let holds = |state: &&State| state.unit.name.contains(name);
    let found: Vec<&State> = states.iter().filter(holds).collect();
    match found.as_slice() {
        [one] => Ok(one),
        [] => {
            let names = states.iter().map(|state| state.unit.name.as_str());
            let near = did_you_mean(name, names);
            bail!("{} has no cell `{name}`{near}", dir.display())
        }
        several => {
            let names = several.iter().map(|state| state.unit.name.as_str());
            let names: Vec<&str> = names.take(8).collect();
            let more = if several.len() > names.len() {
                "; …"
            } else {
                ""
            };
            bail!(
                "`{name}` is a part of {} names: {}{more}",
                several.len(),
                names.join("; ")
            )
        }
    }
}

fn in_words(inventory: &Inventory, state: &State, stale: Option<&str>) -> Result<String> {
    let mut text = format!("{}\n\n", state.unit.name);
    writeln!(text, "kind          {}", state.unit.measurement.plural())?;
    for (axis, variant) in variants(&state.unit.cell) {
        writeln!(text, "{:<13} {variant}", axis.name())?;
    }
    if let Some(record) = &state.record {
        writeln!(text, "\n{}", outcome(record))?;
        let inputs = &record.inputs;
        for (what, value) in [
            ("program", &inputs.program),
            ("settings", &inputs.settings),
            ("scene", &inputs.scene),
            ("kernels", &inputs.kernels),
            ("timed on", &inputs.device),
        ] {
            if !value.is_empty() {
                writeln!(text, "{what:<13} {value}")?;
            }
        }
        let modules = inventory.modules(inputs);
        if !modules.is_empty() {
            writeln!(text, "made of       {}", modules.join(", "))?;
        }
    }
    match stale {
        None => writeln!(text, "\nup to date: `--resume` keeps it")?,
        Some(why) => writeln!(text, "\nnot up to date: {why}")?,
    }
    writeln!(text, "\nalone: {}", command(inventory, &state.unit.cell))?;
    Ok(text)
}

fn as_json(inventory: &Inventory, state: &State, stale: Option<String>) -> Value {
    let modules = state.record.as_ref().map(|r| inventory.modules(&r.inputs));
    json!({
        "cell": state.unit.name,
        "kind": state.unit.kind(),
        "key": variants(&state.unit.cell).map(|(a, v)| (a.name(), v)).collect::<BTreeMap<_, _>>(),
        "record": state.record,
        "modules": modules,
        "up_to_date": stale.is_none(),
        "why_not": stale,
        "alone": command(inventory, &state.unit.cell),
    })
}

fn variants(cell: &Cell) -> impl Iterator<Item = (Axis, &str)> {
    Axis::ALL
        .into_iter()
        .filter_map(|axis| Some((axis, cell.get(axis)?.label.as_str())))
}

fn outcome(record: &CellRecord) -> String {
    match record.outcome {
        Outcome::Done => "measured".to_owned(),
        Outcome::Failed => format!("failed: {}", record.reason),
        Outcome::LeftOut => format!("left out: {}", record.reason),
    }
}

/// Returns the command that measures a cell alone: a filter on each axis that matters to it.
fn command(inventory: &Inventory, cell: &Cell) -> String {
    let run = &inventory.run;
    let mut command = format!("raystone run {}", shell_word(&run.experiment));
    for value in &run.overrides {
        command += &format!(" --set {}", shell_word(value));
    }
    let axes = &inventory.experiment.axes;
    for (axis, label) in variants(cell).filter(|(axis, _)| axes[*axis].len() > 1) {
        // A name fits all its variants.
        let is_name = axes[axis]
            .iter()
            .any(|v| v.name == label && v.label != label);
        let label = format!("{label}{}", if is_name { "()" } else { "" });
        command += &format!(" --only {}", shell_word(&format!("{axis}={label}")));
    }
    command
}
