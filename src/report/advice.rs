//! What the advisor would have chosen, beside what was measured; and records as samples to fit it on.

use crate::data::{Measured, RunData, SceneGroup};
use crate::document::{Table, TableCell, Tone};
use crate::format;
use raystone_advice::{AdviceTable, Choice, Demand, Sample, Trial, trial};
use raystone_record::{Line, StructureRecord, axis};
use raystone_stats::statistics::median;
use std::collections::BTreeMap;

/// Numbers of rays for which structures are compared: from a glance to many pictures.
pub const BUDGETS: [f64; 4] = [1e5, 1e6, 1e7, 1e8];
/// A regret from which a choice is shown as bad.
const BAD: f64 = 0.1;

/// The demands of all [`BUDGETS`], in equal parts of all classes.
pub fn demands() -> Vec<Demand> {
    let demand = |rays| Demand {
        rays,
        classes: Vec::new(),
    };
    BUDGETS.map(demand).to_vec()
}

/// The structures of these lines that passed the gate and were timed, as samples, with the name of the adapter.
pub fn samples(lines: &[Line]) -> (String, Vec<Sample>) {
    let data = RunData::new(lines);
    let adapter = data.run.map(|run| run.environment.adapter.clone());
    let samples = data.scenes.iter().flat_map(of_scene).collect();
    (adapter.unwrap_or_default(), samples)
}

/// Those of one scene; none where records are older than features are, or where tests, kernels or loads were varied.
fn of_scene(scene: &SceneGroup) -> Vec<Sample> {
    let Some(features) = scene.record.and_then(|record| record.features) else {
        return Vec::new();
    };
    let of_structure = |structure: &Measured<StructureRecord>| {
        // Where another axis was varied, too, the name says more than the label.
        let label = structure.key.label(axis::ACCEL);
        let choice = Choice::of_label(label).filter(|_| structure.structure == label)?;
        let timed = structure.fault().is_none() && !structure.timings.is_empty();
        let (build_ms, ns) = costs(structure);
        timed.then(|| Sample {
            scene: scene.name.to_owned(),
            features,
            choice,
            build_ms,
            ns,
        })
    };
    scene.structures.iter().filter_map(of_structure).collect()
}

/// Milliseconds of the build, and nanoseconds of a ray by class. Where rays are traced by the processors, both are time of all
/// processors together, which other work on the machine does not disturb; else that of the clock.
fn costs(structure: &StructureRecord) -> (f64, BTreeMap<String, f64>) {
    let cpu_ms: Option<f64> = structure.build.iter().map(|phase| phase.cpu_ms).sum();
    let is_software = structure
        .timings
        .iter()
        .all(|timing| !timing.cpu_ms.is_empty());
    let cpu_ms = cpu_ms.filter(|_| is_software);
    let ns = structure.timings.iter().filter_map(|timing| {
        let ns = match cpu_ms {
            Some(_) => median(&timing.cpu_ms)? * 1e6 / timing.rays as f64,
            None => 1e3 / timing.mrays_s.value,
        };
        Some((timing.class.name().to_owned(), ns))
    });
    (cpu_ms.unwrap_or(structure.build_ms), ns.collect())
}

/// What would have been chosen for each budget among the structures of a scene, and what it would have cost; empty where
/// the choice is between fewer than two.
pub(crate) fn table(data: &RunData, scene: &SceneGroup) -> Table {
    let adapter = data.run.map_or("", |run| &run.environment.adapter);
    let samples = of_scene(scene);
    let Ok((advice, _)) = AdviceTable::built_in(adapter) else {
        return Table::default();
    };
    let known = samples
        .iter()
        .filter(|s| advice.choices.iter().any(|c| c.choice == s.choice));
    if known.count() < 2 {
        return Table::default();
    }
    let measured: Vec<&Sample> = samples.iter().collect();
    let demands = demands();
    let trials = demands
        .iter()
        .filter_map(|d| trial(&advice, scene.name, &measured, d));
    let seen = if advice.scenes.iter().any(|known| known == scene.name) {
        "the scene is one of those"
    } else {
        "the scene is none of those"
    };
    let caption = format!(
        "What `accel = \"auto\"` would have chosen among these for so many rays of all classes, and the cost of build and rays over that of the cheapest: a table fitted on {} scenes ({}; {seen})",
        advice.scenes.len(),
        advice.adapter,
    );
    let mut table = Table::new(
        caption,
        &["rays", ":cheapest as measured", ":advised", "dearer by"],
    );
    table.rows = trials.map(row).collect();
    table
}

fn row(trial: Trial) -> Vec<TableCell> {
    let dearer = TableCell::from(percent(trial.regret));
    let tone = if trial.regret > BAD {
        Tone::Bad
    } else {
        Tone::Good
    };
    vec![
        format::count(trial.rays as u64).into(),
        trial.best.label().into(),
        trial.advised.label().into(),
        dearer.toned(tone),
    ]
}

fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}
