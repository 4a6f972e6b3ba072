//! `raystone verify`.

use super::arguments::{
    DeviceArguments, ExperimentArguments, as_typed, listed, of_flags, on_axis, plan,
};
use super::failure::{BAD_INPUT, FAILED};
use super::output::{OutputArguments, screen, tell};
use super::verify_images;
use super::verify_others::{Others, verify_others};
use anyhow::{Result, anyhow};
use clap::Args;
use raystone::config::{Axis, Cell, Experiment, Plan, Skipped};
use raystone::measure::record::{
    ClassVerdict, GateVerdict, Key, PathsRecord, ReferenceCheck, Verdict,
};
use raystone::report::document::{Table, TableCell};
use raystone::report::format::count;
use raystone::run::{Registries, Verified, VerifiedSampler};
use raystone::scene::{LoadOptions, load};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

/// Scenes of the gate without an experiment file.
const SCENES: [&str; 2] = ["cornell-box", "displaced-sphere"];
/// Integrators of the gate without an experiment file.
const INTEGRATORS: [&str; 3] = ["primary", "ao", "path"];
/// Organisations of the path tracer in the gate without an experiment file.
const ORGANISATIONS: [&str; 4] = ["single-kernel", "regeneration", "multi-kernel", "wavefront"];
/// The structure that tests every triangle.
const BRUTE_FORCE: &str = "brute-force";
/// Scenes from this size on are left to the other structures, unless brute force is requested.
const BRUTE_FORCE_TRIANGLES: usize = 5_000;

/// Run the gate alone: does every structure answer every ray as the reference tracer does?
///
/// Without a file: every structure (brute force only where a scene has fewer than 5,000 triangles),
/// on `cornell-box` and `displaced-sphere`, and the integrators there and on small trial scenes of every material, light and
/// estimator; every organisation of the path tracer on the first scene. Unless structures or cells are chosen, also the kernels
/// that parameters choose, and those of measurements without a scene.
#[derive(Args)]
pub struct Verify {
    /// Experiment file whose scenes and structures to check
    file: Option<PathBuf>,
    /// Built-in scene or path of a model; may be given many times
    #[arg(long)]
    scene: Vec<String>,
    /// Structures, such as `bvh,cwbvh`; may be given many times
    #[arg(long)]
    accel: Vec<String>,
    /// Rays of each class [default: gate.rays of the experiment]
    #[arg(long, value_name = "N")]
    rays: Option<u32>,
    /// Render known images instead: scenes with answers in closed form, or by quadrature, each held to 0.2 % or better
    #[arg(long, conflicts_with_all = ["file", "scene", "accel", "rays", "set", "only", "json"])]
    images: bool,
    #[command(flatten)]
    experiment: ExperimentArguments,
    #[command(flatten)]
    device: DeviceArguments,
    #[command(flatten)]
    output: OutputArguments,
}

impl Verify {
    pub fn execute(self) -> Result<ExitCode> {
        let registries = Registries::default();
        if self.images {
            return verify_images::execute(&registries, &self.device, &self.experiment.values);
        }
        let (typed, set) = (Vec::from_iter(self.flags()), &self.experiment.values.set);
        let flags = typed.iter().cloned();
        let experiment = match &self.file {
            Some(file) => {
                let overrides: Vec<String> = flags.chain(set.iter().cloned()).collect();
                Experiment::load(file, &overrides, &registries.catalogue())
                    .map_err(|error| anyhow!(as_typed(error.to_string(), &typed)))?
            }
            None => of_flags("verify", all(&registries).chain(flags), set, &registries)?,
        };
        let mut plan = plan(&experiment, &self.experiment.only, &registries)?;
        if self.file.is_none() {
            spare_organisations(&mut plan, set, &registries);
            spare_brute_force(&mut plan, self.experiment.values.allow_outside)?;
        }
        for skipped in &plan.skipped {
            tell(&format!("left out: {}: {}", skipped.cell, skipped.reason));
        }
        // Nothing is written: no folder is needed.
        let options = self
            .device
            .options(PathBuf::new(), &self.experiment.values, false);
        let rays = experiment.gate.rays;
        let trials = self.file.is_none() && self.scene.is_empty();
        let verified =
            raystone::run::verify(&experiment, &plan, &registries, &options, rays, trials)?;
        let samplers = if trials {
            raystone::run::verify_samplers(&plan, &registries, &options)?
        } else {
            Vec::new()
        };
        let others = if trials && self.accel.is_empty() && self.experiment.only.is_empty() {
            verify_others(&self.of_others(), &raystone::registries(), &options)?
        } else {
            Others::default()
        };
        let failed_samplers = samplers.iter().filter(|s| s.fault.is_some()).count();
        let paths: Vec<_> = verified.iter().flat_map(|v| &v.paths).collect();
        let refused = verified.iter().filter(|v| v.refused).count();
        let failed = verified.iter().filter(|v| !passed(v)).count() - refused;
        let failed_paths = paths.iter().filter(|(_, p)| p.fault.is_some()).count();
        let mut text = format!("{}{}", table(&verified), paths_table(&paths));
        text += &ending(verified.len() - refused, failed, refused);
        if !paths.is_empty() {
            let (right, all) = (paths.len() - failed_paths, paths.len());
            text += &format!("{right} of {all} integrators did not fail\n");
        }
        text += &of_samplers(&samplers);
        text += &others.text();
        let mut fields = as_json(&verified, &samplers, &plan.skipped);
        fields["others"] = others.as_json();
        self.output.show("verify", fields, &text)?;
        let bad_input = verified.iter().any(|v| v.bad_input);
        Ok(
            match failed + failed_paths + failed_samplers + others.faults().len() {
                0 => ExitCode::SUCCESS,
                _ if bad_input => ExitCode::from(BAD_INPUT),
                _ => ExitCode::from(FAILED),
            },
        )
    }

    fn flags(&self) -> impl Iterator<Item = String> {
        let rays = self.rays.map(|rays| format!("gate.rays={rays}"));
        let flags = [
            on_axis(Axis::Scene, &self.scene),
            on_axis(Axis::Accel, listed(&self.accel)),
            rays,
            self.device.kernels_override(),
        ];
        flags.into_iter().flatten()
    }

    /// Returns what is laid over the experiments of what is checked beside: kernels, from wherever they are chosen.
    fn of_others(&self) -> Vec<String> {
        let set = self.experiment.values.set.iter();
        let kernels = set.filter(|text| text.starts_with("axes.kernels"));
        let flag = self.device.kernels_override().into_iter();
        flag.chain(kernels.cloned()).collect()
    }
}

/// Returns every structure on the scenes of the gate.
fn all(registries: &Registries) -> impl Iterator<Item = String> {
    let catalogue = registries.catalogue();
    let structures = catalogue[Axis::Accel].iter().map(|entry| &entry.name);
    let axes = [
        on_axis(Axis::Scene, SCENES),
        on_axis(Axis::Accel, structures),
        on_axis(Axis::Integrator, INTEGRATORS),
        on_axis(Axis::Organisation, ORGANISATIONS),
    ];
    axes.into_iter().flatten()
}

/// Leaves other organisations to the first scene and to integrators that can be organised, unless
/// they are asked for.
fn spare_organisations(plan: &mut Plan, set: &[String], registries: &Registries) {
    if !set.iter().any(|text| text.starts_with("axes.organisation")) {
        let first = plan.scenes.first().cloned();
        plan.times.retain(|cell| {
            let is_first = cell.get(Axis::Scene) == first.as_ref();
            let is_usual = !cell.is_unusual(Axis::Organisation);
            is_usual || is_first && registries.integrator(cell).is_ok()
        });
    }
}

/// Leaves out brute force on scenes with many triangles, where other structures are checked.
fn spare_brute_force(plan: &mut Plan, allow_outside: bool) -> Result<()> {
    let mut large = Vec::new();
    for scene in &plan.scenes {
        let cells = || {
            plan.structures
                .iter()
                .filter(|cell| cell[Axis::Scene] == *scene)
        };
        let tries_all = cells().any(|cell| cell[Axis::Accel].name == BRUTE_FORCE);
        if !tries_all || cells().all(|cell| cell[Axis::Accel].name == BRUTE_FORCE) {
            continue;
        }
        let options = LoadOptions {
            textures: false,
            allow_outside,
            ..LoadOptions::default()
        };
        let triangles = load(scene, &options)?.triangles.len();
        if triangles >= BRUTE_FORCE_TRIANGLES {
            large.push((scene.clone(), triangles));
        }
    }
    for (scene, triangles) in large {
        plan.structures
            .retain(|cell| cell[Axis::Scene] != scene || cell[Axis::Accel].name != BRUTE_FORCE);
        plan.skipped.push(Skipped {
            cell: format!("{scene}, {BRUTE_FORCE}"),
            reason: format!(
                "{} triangles, which takes long; --accel {BRUTE_FORCE} alone asks for it",
                count(triangles as u64)
            ),
            cells: 1,
        });
    }
    Ok(())
}

fn passed(verified: &Verified) -> bool {
    verified
        .verdict
        .as_ref()
        .is_ok_and(|verdict| verdict.passed)
}

/// Counts the structures that passed, and those that could not be checked.
fn ending(all: usize, failed: usize, refused: usize) -> String {
    let left_out = match refused {
        0 => String::new(),
        _ => format!("{refused} left out: the driver ends their loops\n"),
    };
    format!("{} of {all} structures passed\n{left_out}", all - failed)
}

/// Counts the samplers that draw what they should, with the faults of the others; empty if none was checked.
fn of_samplers(samplers: &[VerifiedSampler]) -> String {
    let faults: Vec<_> = samplers
        .iter()
        .filter_map(|s| Some((&s.name, s.fault.as_ref()?)))
        .collect();
    let mut text = String::new();
    for (name, fault) in &faults {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{name}: {fault}");
    }
    if !samplers.is_empty() {
        let (right, all) = (samplers.len() - faults.len(), samplers.len());
        text += &format!("{right} of {all} samplers draw what they should\n");
    }
    text
}

/// Returns every structure with its verdict or why there is none, every integrator and every sampler.
fn as_json(verified: &[Verified], samplers: &[VerifiedSampler], skipped: &[Skipped]) -> Value {
    let structures = verified.iter().map(|one| {
        json!({
            "cell": one.cell.to_string(),
            "key": Key::from(&one.cell),
            "passed": passed(one),
            "refused": one.refused,
            "gate": one.verdict.as_ref().ok(),
            "failure": one.verdict.as_ref().err(),
        })
    });
    let paths = verified.iter().flat_map(|one| &one.paths).map(|(cell, paths)| {
        json!({ "cell": cell.to_string(), "verdict": paths.verdict(), "paths": paths })
    });
    let samplers = samplers
        .iter()
        .map(|s| json!({ "sampler": s.name, "passed": s.fault.is_none(), "fault": s.fault }));
    let skipped = skipped
        .iter()
        .map(|s| json!({ "cell": s.cell, "reason": s.reason }));
    json!({
        "structures": structures.collect::<Vec<Value>>(),
        "integrators": paths.collect::<Vec<Value>>(),
        "samplers": samplers.collect::<Vec<Value>>(),
        "left_out": skipped.collect::<Vec<Value>>(),
    })
}

/// Formats a row per ray class, and other failures below the table.
fn table(verified: &[Verified]) -> String {
    let columns = [
        "scene",
        ":structure",
        ":verdict",
        ":class",
        "rays",
        "wrong",
        "ties",
        ":brute force",
        ":oracle",
    ];
    let mut table = Table::new("Hits against the reference tracer", &columns);
    let mut details = String::new();
    for one in verified {
        let word = match (&one.verdict, passed(one)) {
            (Err(_), _) if one.refused => "left out",
            (Err(_), _) => "not run",
            (Ok(_), true) => "passed",
            (Ok(_), false) => "FAILED",
        };
        let names = one.cell.labels(&[Axis::Accel]).join(", ");
        let head = [one.cell[Axis::Scene].label.as_str(), &names, word].map(TableCell::from);
        match &one.verdict {
            Ok(verdict) => table.rows.extend(rows(head, verdict)),
            Err(_) => table.rows.push(head.into()),
        }
        for detail in faults(&one.verdict) {
            // Writing to a string cannot fail.
            let _ = writeln!(details, "{}: {detail}", one.cell);
        }
    }
    let legend = "brute force: the reference tracer against it, wrong of rays; \
                  oracle: the reference tracer against double precision, agree / ambiguous / wrong; \
                  kept: found on disk, checked before\n";
    format!(
        "{}{}{details}",
        screen().table(&table),
        screen().lines(legend.trim_end())
    )
}

/// Formats a row per integrator, and failures below the table.
fn paths_table(judged: &[&(Cell, PathsRecord)]) -> String {
    let columns = [
        "scene",
        ":integrator",
        ":verdict",
        "paths",
        "wrong",
        "other surfaces",
        "edges",
        "decisions",
        "ill-conditioned",
        "median",
    ];
    let mut table = Table::new("Single paths against double precision", &columns);
    let mut details = String::new();
    for (cell, record) in judged {
        let word = match record.verdict() {
            Verdict::Pass => "passed",
            Verdict::Fail => "FAILED",
            Verdict::Open => "not checked",
        };
        let names = cell.labels(&[Axis::Integrator]).join(", ");
        let numbers = [
            record.paths,
            record.wrong,
            record.surfaces,
            record.edges,
            record.flips.saturating_sub(record.surfaces + record.edges),
            record.ill_conditioned,
        ];
        let mut row: Vec<TableCell> = vec![
            cell[Axis::Scene].label.as_str().into(),
            names.into(),
            word.into(),
        ];
        row.extend(numbers.map(|n| TableCell::from(count(n as u64))));
        row.push(format!("{:.1e}", record.median).into());
        table.rows.push(row);
        for detail in record.fault.iter().chain(&record.not_judged) {
            // Writing to a string cannot fail.
            let _ = writeln!(details, "{cell}: {detail}");
        }
    }
    if judged.is_empty() {
        String::new()
    } else {
        format!("{}{details}", screen().table(&table))
    }
}

/// Returns the rows of one structure; names and the reference tracer's own checks are in the first.
fn rows(head: [TableCell; 3], verdict: &GateVerdict) -> Vec<Vec<TableCell>> {
    let brute_force = &verdict.brute_force;
    let kept = brute_force.reused_unix_s.map_or("", |_| " (kept)");
    let rays = count(brute_force.rays as u64);
    let judge = [
        format!("{} of {rays}{kept}", brute_force.wrong),
        oracle(&verdict.oracle),
    ];
    let mut rows: Vec<Vec<TableCell>> = Vec::new();
    for class in &verdict.classes {
        let mut row = vec![TableCell::default(); head.len()];
        row.extend(counts(class).map(TableCell::from));
        rows.push(row);
    }
    match rows.first_mut() {
        Some(first) => {
            first.splice(..head.len(), head);
            first.extend(judge.map(TableCell::from));
        }
        None => rows.push(head.into()),
    }
    rows
}

fn counts(class: &ClassVerdict) -> [String; 4] {
    let name = class.class.name();
    let [rays, wrong, ties] = [class.rays, class.wrong, class.ties].map(|n| count(n as u64));
    [name.to_owned(), rays, wrong, ties]
}

fn oracle(check: &ReferenceCheck) -> String {
    let agree = check.rays.saturating_sub(check.wrong + check.ambiguous);
    format!(
        "{} / {} / {}",
        count(agree as u64),
        check.ambiguous,
        check.wrong
    )
}

/// Returns everything that went wrong, in words.
pub(super) fn faults(verdict: &Result<GateVerdict, String>) -> Vec<String> {
    let verdict = match verdict {
        Ok(verdict) => verdict,
        Err(reason) => return vec![reason.clone()],
    };
    let mut faults = Vec::new();
    for class in &verdict.classes {
        let first = class.first_wrong.as_ref();
        faults.extend(first.map(|ray| format!("first wrong {} ray: {ray}", counts(class)[0])));
    }
    let structural = verdict.structural.iter();
    let kernel = verdict.kernel_errors.iter();
    faults.extend(structural.map(|fault| format!("structure: {fault}")));
    faults.extend(kernel.map(|error| format!("kernel: {error}")));
    faults.extend(verdict.work.clone());
    faults.extend(verdict.elsewhere.clone());
    faults.extend(verdict.reference_fault());
    faults
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(scene: &str, accel: &str) -> Plan {
        let registries = Registries::default();
        let set = [format!("axes.scene={scene}"), format!("axes.accel={accel}")];
        let experiment = of_flags("verify", all(&registries), &set, &registries).unwrap();
        let mut plan = Plan::new(&experiment, &[], |_, _| Ok(true)).unwrap();
        assert!(spare_brute_force(&mut plan, false).is_ok());
        plan
    }

    #[test]
    fn brute_force_is_spared_large_scenes_unless_it_is_all_there_is() {
        let large = "displaced-sphere";
        let plan_of = |accel| plan(large, accel);
        let spared = plan_of("brute-force,bvh");
        assert_eq!((spared.structures.len(), spared.skipped.len()), (1, 1));
        assert!(spared.skipped[0].cell.contains(BRUTE_FORCE));
        assert_eq!(plan_of("brute-force").structures.len(), 1);
        assert_eq!(plan("cornell-box", "brute-force,bvh").structures.len(), 2);
    }

    #[test]
    fn only_the_path_tracer_is_organised_otherwise_unless_asked_for() {
        let registries = Registries::default();
        let mut plan = plan("cornell-box", "bvh");
        let others = |plan: &Plan| {
            let unusual = plan.times.iter();
            let unusual = unusual.filter(|cell| cell.is_unusual(Axis::Organisation));
            let name = |cell: &Cell| cell[Axis::Integrator].name.clone();
            unusual.map(name).collect::<Vec<_>>()
        };
        assert_eq!(others(&plan).len(), 9);
        let asked = ["axes.organisation=wavefront".to_owned()];
        spare_organisations(&mut plan, &asked, &registries);
        assert_eq!(others(&plan).len(), 9);
        spare_organisations(&mut plan, &[], &registries);
        assert_eq!(others(&plan), ["path", "path", "path"]);
    }

    #[test]
    fn without_a_file_every_structure_is_checked() {
        let registries = Registries::default();
        let catalogue = registries.catalogue();
        let experiment = of_flags("verify", all(&registries), &[], &registries).unwrap();
        assert_eq!(
            experiment.axes[Axis::Accel].len(),
            catalogue[Axis::Accel].len()
        );
        assert_eq!(experiment.axes[Axis::Scene].len(), SCENES.len());
    }
}
