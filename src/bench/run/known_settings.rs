//! Which settings of an experiment the figures of each measurement depend on, by hand: a run that goes on keeps what a forgotten
//! one would have changed, and nothing fails.

use super::inputs::{Current, kernel_set};
use super::kernels::Kernels;
use super::merge::{Merged, choose};
use super::registries::Registries;
use super::resume::Earlier;
use super::units::Unit;
use raystone_config::{Experiment, Plan};
use raystone_record::{Body, CellRecord, Line, Outcome, SkippedRecord};
use std::collections::{BTreeMap, HashMap};

const TEXT: &str = r#"
    [run]
    name = "known"
    resolution = [80, 60]
    replicates = 3
    spp = [2, 4]
    [axes]
    scene = ["cornell-box"]
    accel = ["bvh"]
    sequence = ["pixel-hash"]
    integrator = ["path"]
    [camera]
    eye = [0, 0, 5]
    target = [0, 0, 0]
    [coherence]
    groups = 2
    [animation]
    frames = 3
"#;

const IMAGE: [&str; 5] = [
    "run.seed=2",
    "run.resolution=[80, 61]",
    "run.runtime_checks=false",
    "camera.eye=[0, 1, 5]",
    "camera.fov=41",
];
const TIMING: [&str; 3] = [
    "timing.rounds=7",
    "timing.min_warmup_ms=1",
    "timing.max_warmup_ms=1000",
];

/// Measurements, and changes of the experiment that change what they measure.
const DEPENDS: [(&str, &[&str]); 15] = [
    ("structure", &IMAGE),
    ("structure", &TIMING),
    (
        "structure",
        &["timing.rays=2048", "gate.rays=1024", "gate.oracle_rays=16"],
    ),
    ("peer", &TIMING),
    ("peer", &["timing.rays=2048", "run.seed=2"]),
    ("sampler", &IMAGE),
    (
        "sampler",
        &[
            "run.replicates=4",
            "run.spp=[2, 8]",
            "reference.spp=800",
            "reference.seed=5",
            "reference.sequence=\"sobol\"",
            "run.stop={ relmse = 0.1, confidence = 0.9 }",
        ],
    ),
    ("time", &IMAGE),
    ("time", &TIMING),
    ("time", &["timing.spp=2", "run.spp=[2, 8]"]),
    (
        "coherence",
        &[
            "run.seed=2",
            "run.resolution=[80, 61]",
            "run.spp=[2, 8]",
            "camera.fov=41",
            "coherence.groups=3",
            "coherence.l1_kib=64",
        ],
    ),
    (
        "animation",
        &[
            "run.seed=2",
            "timing.rounds=7",
            "animation.frames=4",
            "gate.rays=1024",
        ],
    ),
    (
        "stream",
        &[
            "run.seed=2",
            "discrepancy.points=512",
            "discrepancy.seeds=4",
        ],
    ),
    ("rays", &["run.seed=2", "timing.rounds=7"]),
    ("compaction", &["run.seed=2", "timing.rounds=7"]),
];

/// Compares settings, and what makes a cell stale.
///
/// # Errors
/// A change that is not noticed.
pub(super) fn check() -> Result<(), String> {
    let registries = Registries::default();
    let before = settings(&registries, "run.name=\"known\"")?;
    for (measurement, change) in DEPENDS
        .iter()
        .flat_map(|(measurement, changes)| changes.iter().map(move |change| (measurement, change)))
    {
        let after = settings(&registries, change)?;
        let [before, after] = [&before, &after].map(|settings| settings.get(measurement));
        if before.is_none() || before == after {
            return Err(unnoticed(&format!("`{change}` of {measurement}")));
        }
    }
    stale(&registries)
}

fn unnoticed(what: &str) -> String {
    format!(
        "{what} changes nothing in a known plan: a run that goes on with this program would keep figures that do not hold any \
         more; build it anew, and report what stays wrong"
    )
}

/// The settings that each measurement depends on.
fn settings(
    registries: &Registries,
    change: &str,
) -> Result<BTreeMap<&'static str, String>, String> {
    let experiment = parsed(registries, change)?;
    let kernels = Kernels::load(&[], registries).map_err(|error| error.to_string())?;
    Ok(Current::new(&experiment, None, registries, &kernels).settings)
}

fn parsed(registries: &Registries, change: &str) -> Result<Experiment, String> {
    let changes = [change.to_owned()];
    let parsed = Experiment::parse(
        TEXT,
        "a known experiment",
        &changes,
        &registries.catalogue(),
    );
    parsed.map_err(|error| error.to_string())
}

/// A cell holds as it was measured, and not after a change of any of its inputs.
fn stale(registries: &Registries) -> Result<(), String> {
    let experiment = parsed(registries, "run.name=\"known\"")?;
    let plan = Plan::new(&experiment, &[], |s, d| registries.is_randomised(s, d));
    let plan = plan.map_err(|error| error.to_string())?;
    let kernels = Kernels::load(&plan.kernels, registries).map_err(|error| error.to_string())?;
    let units = registries.measurements.units(&experiment, &plan);
    let unit = units.iter().find(|unit| unit.kind() == "structure");
    let unit = unit.ok_or_else(|| unnoticed("the absence of structures"))?;
    let mut current = Current::new(&experiment, None, registries, &kernels);
    current.scenes = HashMap::from([("cornell-box".to_owned(), Ok("a hash".to_owned()))]);
    current.device = Some("a device".to_owned());
    let module = |text: &str| BTreeMap::from([("accel/bvh/roped".to_owned(), text.to_owned())]);
    let set = kernel_set("", module("another text"));
    let sets = current.changed(&HashMap::from([(&*set.id, &set)]));
    let record = CellRecord {
        unit: unit.name.clone(),
        outcome: Outcome::Done,
        reason: String::new(),
        run_began_unix_s: 0,
        inputs: current.inputs(unit),
        lines: Vec::new(),
    };
    if let Some(why) = current.stale(unit, &record, &sets) {
        return Err(format!(
            "a known cell does not hold any more ({why}), though nothing changed: this program would measure everything \
             again; build it anew, and report what stays wrong"
        ));
    }
    let mut inputs = [(); 5].map(|()| record.inputs.clone());
    inputs[0].program.push('x');
    inputs[1].settings.push('x');
    inputs[2].scene.push('x');
    inputs[3].device.push('x');
    inputs[4].kernels.clone_from(&set.id);
    kept(unit, &current, &record)?;
    let names = ["program", "set of settings", "scene", "device", "kernel"];
    for (what, inputs) in names.into_iter().zip(inputs) {
        let record = CellRecord {
            inputs,
            ..record.clone()
        };
        if current.stale(unit, &record, &sets).is_none() {
            return Err(unnoticed(&format!("another {what}")));
        }
    }
    Ok(())
}

/// Of a cell that was measured twice, its last line is kept and counts once; one that failed at last is measured again; and of two folders that
/// are joined the one in which it did not fail has it.
fn kept(unit: &Unit, current: &Current, record: &CellRecord) -> Result<(), String> {
    let hash = "a line";
    let mut record = record.clone();
    record.lines = vec![hash.to_owned()];
    let line = |body| Line::about_all(body);
    let measured = line(Body::Skipped(SkippedRecord {
        cell: unit.name.clone(),
        reason: String::new(),
    }));
    let measured = measured.hashed(hash);
    let cell = line(Body::Cell(record.clone()));
    let failed = line(Body::Cell(CellRecord {
        outcome: Outcome::Failed,
        ..record
    }));
    let units = std::slice::from_ref(unit);
    let count = |lines: Vec<Line>| {
        let kept = Earlier::new(lines).kept(units, current);
        [kept.cells.len(), kept.stale.len(), kept.lines.len()]
    };
    let all = [&failed, &measured, &cell, &measured, &cell].map(Line::clone);
    let joined = [vec![failed.clone()], vec![measured.clone(), cell.clone()]];
    let chosen = choose(
        &joined.map(Earlier::new),
        units,
        None,
        &mut Merged::default(),
    );
    let chosen = chosen.map_err(|e| e.to_string())?;
    if !chosen[0].is_empty() || chosen[1].len() != 1 {
        return Err(
            "of two folders the one in which a known cell failed is taken: this program would join failures; build it anew, and \
             report what stays wrong"
                .to_owned(),
        );
    }
    let found = [count(all.to_vec()), count(vec![measured, cell, failed])];
    let expected = [[1, 0, 2], [0, 1, 0]];
    (found == expected).then_some(()).ok_or_else(|| {
        format!(
            "of a known cell that was measured twice, and of one that failed, cells, stale ones and lines that are kept are {found:?}, and \
             should be {expected:?}: a run that goes on with this program would count lines twice, or keep failures; build it anew, and \
             report what stays wrong"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_each_measurement_depends_on_is_noticed() {
        assert_eq!(check(), Ok(()));
    }
}
