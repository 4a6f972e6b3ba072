//! An experiment before it runs: its cells, their shards, and the time that they may take.

use super::Inspect;
use crate::commands::arguments::plan;
use anyhow::Result;
use raystone::config::{Axis, Experiment, Plan as Cells, Skipped};
use raystone::report::format::plural;
use raystone::run::{Cost, Unit, shards};
use raystone::text::shell_word;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::process::ExitCode;

pub(super) fn inspect(command: &Inspect) -> Result<ExitCode> {
    let registries = raystone::registries();
    let overrides = &command.experiment.values.set;
    let experiment = Experiment::load(&command.path, overrides, &registries.catalogue())?;
    let cells = plan(&experiment, &command.experiment.only, &registries)?;
    let units = registries.measurements.units(&experiment, &cells);
    let cost = Cost::new(&experiment, &cells, &registries.integrators);
    let of = usize::from(command.shards.unwrap_or(1));
    let numbers = shards(&units, of, |unit| cost.seconds_of(unit));
    let mut fields = as_json(&cells, &units, &cost);
    let entries = fields["cells"].as_array_mut().into_iter().flatten();
    for (entry, number) in entries.zip(&numbers) {
        entry["shard"] = json!(number);
    }
    fields["shards"] = json!(of);
    let mut text = String::new();
    if command.cells {
        for (unit, number) in units.iter().zip(&numbers) {
            writeln!(text, "{number}/{of}\t{}\t{}", unit.kind(), unit.name)?;
        }
    } else {
        let left_out: usize = cells.skipped.iter().map(|s| s.cells).sum();
        let count = units.len();
        let (cells, shards) = (plural(count, "cell"), plural(of, "shard"));
        writeln!(text, "{cells}, {left_out} left out; {shards}:\n")?;
        describe(&mut text, (&units, &numbers), of, &cost)?;
        writeln!(text, "\n{}", how_to_run(command, of))?;
    }
    command.output.show("inspect", fields, &text)?;
    Ok(ExitCode::SUCCESS)
}

/// Describes the cells of each shard, with the expected time.
fn describe(
    text: &mut String,
    (units, numbers): (&[Unit], &[usize]),
    of: usize,
    cost: &Cost,
) -> Result<()> {
    let mut empty = 0;
    let seconds: Vec<f64> = units.iter().map(|unit| cost.seconds_of(unit)).collect();
    for number in 1..=of {
        let own = |place: &usize| numbers[*place] == number;
        let own: Vec<usize> = (0..units.len()).filter(own).collect();
        if own.is_empty() {
            empty += 1;
            continue;
        }
        let mut counts: Vec<(&str, usize)> = Vec::new();
        for unit in own.iter().map(|place| &units[*place]) {
            let plural = unit.measurement.plural();
            match counts.iter_mut().find(|(known, _)| *known == plural) {
                Some((_, count)) => *count += 1,
                None => counts.push((plural, 1)),
            }
        }
        let kinds = counts
            .iter()
            .map(|(plural, count)| format!("{plural}: {count}"));
        let kinds = kinds.collect::<Vec<_>>().join(", ");
        let sum: f64 = own.iter().map(|place| seconds[*place]).sum();
        writeln!(text, "  {number}/{of}  about {:>7}  {kinds}", duration(sum))?;
    }
    if empty > 0 {
        writeln!(
            text,
            "\n{} nothing to do: what is timed in the same rounds stays together.",
            match empty {
                1 => "1 shard has".to_owned(),
                more => format!("{more} shards have"),
            }
        )?;
    }
    Ok(())
}

fn how_to_run(command: &Inspect, of: usize) -> String {
    let file = shell_word(&command.path.to_string_lossy());
    let values = command.experiment.values.set.iter();
    let filters = command.experiment.only.iter();
    let also: String = (values.map(|value| format!(" --set {}", shell_word(value))))
        .chain(filters.map(|filter| format!(" --only {}", shell_word(filter))))
        .collect();
    format!(
        "Times are estimates for a software adapter with two cores; references and checks, which every shard \
         needs on its own, come on top.\n\n\
         Run each, wherever:  raystone run {file}{also} --shard K/{of} --resume --out DIR/K\n\
         and join them:       raystone merge DIR/* --out ALL"
    )
}

/// Returns every cell of a plan with its kind and expected seconds, and those left out.
pub fn as_json(plan: &Cells, units: &[Unit], cost: &Cost) -> Value {
    let cell = |unit: &Unit| {
        let axes = Axis::ALL.into_iter();
        let axes = axes.filter_map(|axis| Some((axis.name(), unit.cell.get(axis)?.label.as_str())));
        let key: BTreeMap<_, _> = axes.collect();
        json!({ "cell": unit.name, "kind": unit.kind(), "key": key, "seconds": cost.seconds_of(unit) })
    };
    let left_out = |s: &Skipped| json!({ "cell": s.cell, "reason": s.reason, "cells": s.cells });
    json!({
        "cells": units.iter().map(cell).collect::<Vec<_>>(),
        "seconds": cost.whole(units).seconds(),
        "left_out": plan.skipped.iter().map(left_out).collect::<Vec<_>>(),
    })
}

/// Returns a time with the precision of an estimate.
fn duration(seconds: f64) -> String {
    match seconds {
        ..100.0 => format!("{:.0} s", seconds.ceil()),
        ..6000.0 => format!("{:.0} min", (seconds / 60.0).ceil()),
        _ => format!("{:.1} h", seconds / 3600.0),
    }
}
