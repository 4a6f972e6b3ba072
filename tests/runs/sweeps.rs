//! Runs that are resumed, divided into shards and merged: nothing is measured twice, nothing is lost, nothing outdated is
//! reused.

use crate::support::{plan, records, small_with};
use raystone::config::Shard;
use raystone::gpu::AdapterChoice;
use raystone::measure::record::{Body, CellRecord, Line, Outcome, text_of};
use raystone::run::{Existing, Inventory, Registries, RunError, RunOptions, RunSummary, merge};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// A grid that passes over the last triangle of every cell.
const FAULT: (&str, &str) = ("i < end; i++", "i + 1u < end; i++");

fn experiment(changes: &[&str]) -> String {
    let axes = [
        "axes.accel = ['bvh', 'uniform-grid']",
        "axes.sequence = ['pixel-hash', 'sobol']",
        "axes.integrator = ['primary']",
    ];
    small_with(&[&axes[..], changes].concat())
}

fn run_with(text: &str, options: RunOptions) -> Result<RunSummary, RunError> {
    let registries = Registries::default();
    let (experiment, plan) = plan(text, &registries);
    raystone::run::run(&experiment, &plan, &registries, &options)
}

fn resumed(out: &Path) -> RunOptions {
    RunOptions {
        out: out.to_owned(),
        existing: Existing::Resume,
        ..RunOptions::default()
    }
}

/// Resumes a run that ends well: its records.
fn resume(text: &str, out: &Path) -> (RunSummary, Vec<Line>) {
    let summary = run_with(text, resumed(out)).unwrap_or_else(|e| panic!("{e}"));
    (summary, records(out))
}

fn cells(lines: &[Line]) -> BTreeMap<String, CellRecord> {
    let cells = lines.iter().filter_map(|line| match &line.body {
        Body::Cell(cell) => Some((cell.unit.clone(), cell.clone())),
        _ => None,
    });
    cells.collect()
}

/// The cells that were measured after the last first line.
fn measured_again(lines: &[Line]) -> BTreeSet<String> {
    let is_run = |line: &Line| matches!(line.body, Body::Run(_));
    let start = lines.iter().rposition(is_run).expect("a first line");
    cells(&lines[start..]).into_keys().collect()
}

/// Results that do not depend on clocks: hashes of images by cell and replicate, and discrepancies.
fn evidence(lines: &[Line]) -> BTreeMap<String, String> {
    let found = lines.iter().filter_map(|line| match &line.body {
        Body::Error(r) => Some((
            format!("{} {}", line.key, r.replicate),
            format!("{} {:?}", r.image_hash, r.errors),
        )),
        Body::Stream(r) => Some((
            format!("{} {:?}", line.key, r.dimensions),
            format!("{:?}", r.star),
        )),
        Body::Time(r) => Some((format!("{} time", line.key), r.image_hash.clone())),
        _ => None,
    });
    found.collect()
}

fn units(text: &str, kind: Option<&str>) -> BTreeSet<String> {
    let registries = Registries::default();
    let (experiment, plan) = plan(text, &registries);
    let units = registries.measurements.units(&experiment, &plan);
    let units = units
        .into_iter()
        .filter(|unit| kind.is_none_or(|kind| unit.kind() == kind));
    units.map(|unit| unit.name).collect()
}

fn names(kinds: &[&str], text: &str) -> BTreeSet<String> {
    kinds
        .iter()
        .flat_map(|kind| units(text, Some(*kind)))
        .collect()
}

#[test]
fn a_finished_run_is_resumed_without_an_adapter_and_stays_to_the_byte() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = experiment(&[]);
    let (first, lines) = resume(&text, folder.path());
    assert_eq!((first.failed, first.kept), (0, 0));
    let all = cells(&lines);
    assert_eq!(
        all.keys().cloned().collect::<BTreeSet<_>>(),
        units(&text, None)
    );
    assert!(all.values().all(|cell| cell.outcome == Outcome::Done));
    let before = fs::read(folder.path().join("records.jsonl")).expect("records");
    let options = RunOptions {
        adapter: "no such adapter".parse().unwrap_or(AdapterChoice::Best),
        ..resumed(folder.path())
    };
    let summary = run_with(&text, options).expect("nothing to do");
    assert_eq!((summary.kept, summary.failed), (all.len(), 0));
    let after = fs::read(folder.path().join("records.jsonl")).expect("records");
    assert!(before == after, "the records changed");
    assert!(!folder.path().join("partial").exists());
    // A plan without some of the cells would drop what was measured there.
    let narrow = experiment(&["axes.accel = ['bvh']"]);
    let refused = run_with(&narrow, resumed(folder.path())).expect_err("cells are left out");
    let refused = refused.to_string();
    assert!(
        refused.contains("uniform-grid") && refused.contains("--out"),
        "{refused}"
    );
    let after = fs::read(folder.path().join("records.jsonl")).expect("records");
    assert!(before == after, "the records changed");
    assert!(!folder.path().join("partial").exists());
}

#[test]
fn a_changed_setting_runs_the_cells_that_depend_on_it_and_no_others() {
    let folder = tempfile::tempdir().expect("a folder");
    let (_, lines) = resume(&experiment(&[]), folder.path());
    let first = evidence(&lines);
    for (change, kinds) in [
        ("discrepancy.points = 32", &["stream"][..]),
        ("reference.spp = 16", &["sampler"]),
        ("gate.rays = 2048", &["structure"]),
        ("timing.rounds = 4", &["structure", "time"]),
        ("run.replicates = 3", &["sampler"]),
    ] {
        let copy = tempfile::tempdir().expect("a folder");
        copy_folder(folder.path(), copy.path());
        let text = experiment(&[change]);
        let (summary, lines) = resume(&text, copy.path());
        assert_eq!(summary.failed, 0, "{change}");
        assert_eq!(measured_again(&lines), names(kinds, &text), "{change}");
        assert_eq!(cells(&lines).len(), units(&text, None).len(), "{change}");
        for (what, value) in evidence(&lines) {
            let before = first.get(&what);
            let is_other = before.is_some_and(|before| *before != value);
            let of_kind = kinds.contains(&"sampler") || kinds.contains(&"stream");
            assert!(!is_other || of_kind, "{change}: {what}");
        }
        // A second time there is nothing left to do.
        let (again, _) = resume(&text, copy.path());
        assert_eq!(again.kept, units(&text, None).len(), "{change}");
    }
}

fn copy_folder(from: &Path, to: &Path) {
    for entry in fs::read_dir(from).expect("a folder") {
        let entry = entry.expect("an entry");
        let target = to.join(entry.file_name());
        if entry.path().is_dir() {
            fs::create_dir_all(&target).expect("a folder");
            copy_folder(&entry.path(), &target);
        } else {
            fs::copy(entry.path(), &target).expect("a copy");
        }
    }
}

#[test]
fn a_changed_kernel_runs_the_cells_that_were_made_of_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let mine = folder.path().join("mine");
    let write = |module: &str, more: &str| {
        let library = raystone::gpu::KernelLibrary::default();
        let text = library.text(module).expect("a kernel").to_owned() + more;
        let file = mine.join(module).with_extension("wesl");
        fs::create_dir_all(file.parent().expect("a folder")).expect("a folder");
        fs::write(file, text).expect("a kernel");
    };
    write("accel/uniform_grid", "");
    let kernels = format!("axes.kernels = [{:?}]", mine.display().to_string());
    let text = experiment(&[&kernels, "axes.integrator = ['primary']"]);
    let out = folder.path().join("out");
    let (_, lines) = resume(&text, &out);
    assert!(cells(&lines).values().all(|c| c.outcome == Outcome::Done));
    write("accel/uniform_grid", "\n// Another word.\n");
    let (_, lines) = resume(&text, &out);
    let again = measured_again(&lines);
    let grid: BTreeSet<String> = names(&["structure", "time"], &text)
        .into_iter()
        .filter(|name| name.contains("uniform-grid"))
        .collect();
    assert!(grid.is_subset(&again), "{again:?}");
    // Samplers were rendered through one of the structures, by luck this one.
    let others: BTreeSet<&String> = again.difference(&grid).collect();
    let samplers = units(&text, Some("sampler"));
    assert!(
        others.iter().all(|name| samplers.contains(*name)),
        "{others:?}"
    );
}

#[test]
fn a_changed_scene_runs_its_cells_and_those_of_no_other() {
    let folder = tempfile::tempdir().expect("a folder");
    let model = folder.path().join("one.obj");
    let write = |x: &str| {
        let text = format!("v 0 0 0\nv {x} 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n");
        fs::write(&model, text).expect("a model");
    };
    write("1.0");
    let scenes = format!(
        "axes.scene = ['furnace-box', {:?}]",
        model.display().to_string()
    );
    let text = experiment(&[&scenes]);
    let out = folder.path().join("out");
    resume(&text, &out);
    write("1.5");
    let (_, lines) = resume(&text, &out);
    let of_model = |name: &String| name.starts_with("one.obj");
    let expected = units(&text, None).into_iter().filter(of_model).collect();
    assert_eq!(measured_again(&lines), expected);
}

/// A run that is killed leaves whole lines in `partial/`, and perhaps the beginning of one.
#[test]
fn a_run_that_was_killed_anywhere_loses_no_cell_that_was_closed() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = experiment(&[]);
    let (_, lines) = resume(&text, folder.path());
    let whole = evidence(&lines);
    let bytes = text_of(&lines).expect("lines").into_bytes();
    for part in 0..6 {
        let cut = bytes.len() * (2 * part + 1) / 12;
        let killed = tempfile::tempdir().expect("a folder");
        let partial = killed.path().join("partial");
        fs::create_dir_all(partial.join("images")).expect("a folder");
        fs::write(partial.join("records.jsonl"), &bytes[..cut]).expect("records");
        let kept = String::from_utf8_lossy(&bytes[..cut]);
        let closed = kept.matches(r#""kind":"cell""#).count();
        let (summary, lines) = resume(&text, killed.path());
        // The line that was cut may be the last of a cell.
        assert!(closed - summary.kept <= 1, "{closed} {}", summary.kept);
        assert_eq!(evidence(&lines), whole, "cut at {cut}");
        assert_eq!(cells(&lines).len(), units(&text, None).len());
        let ends = lines.iter().filter(|l| matches!(l.body, Body::Finished(_)));
        assert_eq!(ends.count(), 1);
    }
}

/// Three shards of an experiment, each in a folder of its own.
fn shards_of(text: &str, folder: &Path) -> Vec<PathBuf> {
    (1..=3)
        .map(|number| {
            let out = folder.join(format!("{number}"));
            let options = RunOptions {
                shard: Some(Shard { number, of: 3 }),
                ..resumed(&out)
            };
            let summary = run_with(text, options).unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(summary.failed, 0);
            out
        })
        .collect()
}

fn joined(dirs: &[PathBuf], out: &Path) -> Result<raystone::run::Merged, RunError> {
    merge(dirs, out, None, &Registries::default())
}

#[test]
fn shards_together_are_the_whole_run() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = experiment(&["axes.scene = ['cornell-box', 'furnace-box']"]);
    let (_, lines) = resume(&text, &folder.path().join("whole"));
    let whole = evidence(&lines);
    let dirs = shards_of(&text, folder.path());
    for dir in &dirs {
        let own = cells(&records(dir)).len();
        assert!(0 < own && own < units(&text, None).len());
        let inventory = Inventory::read(dir, &Registries::default()).expect("records");
        assert_eq!(inventory.missing().count(), 0, "{}", dir.display());
    }
    let out = folder.path().join("joined");
    let merged = joined(&dirs, &out).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(
        (merged.cells, merged.incomplete),
        (units(&text, None).len(), false)
    );
    let lines = records(&out);
    assert_eq!(evidence(&lines), whole);
    raystone::report::write_report(&out).expect("a report");
    let inventory = Inventory::read(&out, &Registries::default()).expect("records");
    assert!(inventory.states.iter().all(|state| state.is_settled()));
    // Every picture that a record names is there.
    let pictures = lines.iter().filter_map(|line| match &line.body {
        Body::Error(record) => record.image.as_ref(),
        _ => None,
    });
    let (there, missing): (Vec<_>, Vec<_>) = pictures.partition(|image| out.join(image).exists());
    assert!(!there.is_empty() && missing.is_empty(), "{missing:?}");
    // A shard that is missing is missed; one that is there twice is not counted twice.
    let without = folder.path().join("without");
    let merged = joined(&dirs[1..], &without).expect("two shards");
    assert!(merged.incomplete && merged.notes.iter().any(|n| n.contains("missing")));
    let inventory = Inventory::read(&without, &Registries::default()).expect("records");
    assert!(inventory.missing().count() > 0);
    let twice = folder.path().join("twice");
    let merged = joined(&[&dirs[..], &dirs[..1]].concat(), &twice).expect("shards");
    assert_eq!(
        (merged.cells, merged.incomplete),
        (units(&text, None).len(), false)
    );
    assert!(joined(&dirs, &out).is_err(), "results were overwritten");
}

fn rewrite(dir: &Path, change: impl Fn(&mut Line)) {
    let mut lines = records(dir);
    lines.iter_mut().for_each(change);
    let text = text_of(&lines).expect("lines");
    fs::write(dir.join("records.jsonl"), text).expect("records");
}

fn refused(dirs: &[PathBuf], out: &Path) -> String {
    joined(dirs, out).expect_err("a contradiction").to_string()
}

#[test]
fn what_does_not_belong_together_is_not_joined() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = experiment(&[]);
    let (one, other) = (folder.path().join("one"), folder.path().join("other"));
    resume(&text, &one);
    let fresh = || {
        let _ = fs::remove_dir_all(&other);
        fs::create_dir_all(&other).expect("a folder");
        copy_folder(&one, &other);
    };
    let dirs = [one.clone(), other.clone()];
    let out = folder.path().join("out");
    fresh();
    rewrite(&other, |line| {
        if let Body::Error(record) = &mut line.body {
            record
                .errors
                .iter_mut()
                .flat_map(|e| e.metrics.values_mut())
                .for_each(|m| *m *= 1.01);
        }
    });
    let told = refused(&dirs, &out);
    assert!(
        told.contains("contradict") && told.contains("figures"),
        "{told}"
    );
    fresh();
    rewrite(&other, |line| {
        if let Body::Cell(cell) = &mut line.body {
            cell.inputs.settings = "0123456789abcdef".to_owned();
        }
    });
    assert!(refused(&dirs, &out).contains("the settings"));
    fresh();
    rewrite(&other, |line| {
        if let Body::Run(run) = &mut line.body {
            run.experiment_text += "# another\n";
        }
    });
    assert!(refused(&dirs, &out).contains("different experiments"));
    assert!(!out.join("records.jsonl").exists());
    // Halves of two devices: their times do not meet, unless one is chosen.
    let shards = shards_of(&text, &folder.path().join("shards"));
    rewrite(&shards[2], |line| match &mut line.body {
        Body::Cell(cell) if !cell.inputs.device.is_empty() => {
            cell.inputs.device = "another machine".to_owned();
        }
        _ => {}
    });
    let told = refused(&shards, &out);
    assert!(
        told.contains("another machine") && told.contains("--device"),
        "{told}"
    );
    let devices = cells(&records(&shards[0])).into_values();
    let device = devices
        .map(|cell| cell.inputs.device)
        .find(|d| !d.is_empty());
    let device = device.expect("a cell that is timed");
    let merged = merge(&shards, &out, Some(&device), &Registries::default());
    let merged = merged.unwrap_or_else(|e| panic!("{e}"));
    assert!(
        merged.notes.iter().any(|note| note.contains("left behind")),
        "{merged:?}"
    );
}

/// The fastest structure depends on clocks: of two machines that measured one cell, each may have rendered through another.
#[test]
fn images_through_different_structures_agree_if_they_are_equal() {
    let folder = tempfile::tempdir().expect("a folder");
    let (one, other) = (folder.path().join("one"), folder.path().join("other"));
    let text = experiment(&[]);
    resume(&text, &one);
    copy_folder(&one, &other);
    // Lines that name another kernel have another hash, and the cells other modules.
    let through_another = |module: &str| {
        rewrite(&other, |line| match &mut line.body {
            Body::Error(_) | Body::Bias(_) => line.hash = format!("0{}", &line.hash[1..]),
            Body::Kernels(set) => {
                set.id = format!("0{}", &set.id[1..]);
                let hash = "0123456789abcdef".to_owned();
                set.modules.insert(module.to_owned(), hash);
            }
            Body::Cell(cell) => {
                let kernels = &mut cell.inputs.kernels;
                *kernels = kernels.get(1..).map_or(String::new(), |k| format!("0{k}"));
                for hash in &mut cell.lines {
                    *hash = format!("0{}", &hash[1..]);
                }
            }
            // So that all lines of a cell are found.
            _ if line.hash.len() > 1 => line.hash = format!("0{}", &line.hash[1..]),
            _ => {}
        });
    };
    through_another("accel/another");
    let dirs = [one.clone(), other.clone()];
    let merged = joined(&dirs, &folder.path().join("joined")).unwrap_or_else(|e| panic!("{e}"));
    assert!(!merged.incomplete);
    assert!(
        merged.notes.iter().any(|note| note.contains("agree with")),
        "{merged:?}"
    );
    // Differences are found all the same.
    rewrite(&other, |line| {
        if let Body::Error(record) = &mut line.body {
            record.image_hash.insert(0, '0');
        }
    });
    let out = folder.path().join("out");
    assert!(refused(&dirs, &out).contains("figures"));
    // And a module that both used has to be the same.
    through_another("common/errors");
    let told = refused(&dirs, &out);
    assert!(told.contains("the kernels"), "{told}");
}

#[test]
fn records_that_name_pictures_elsewhere_bring_none_along() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = experiment(&[]);
    let one = folder.path().join("one");
    resume(&text, &one);
    fs::write(folder.path().join("secret"), "secret").expect("a file");
    rewrite(&one, |line| {
        if let Body::Error(record) = &mut line.body {
            record.image = Some("../secret".to_owned());
            record.error_map = Some("images/../../secret".to_owned());
        }
    });
    let out = folder.path().join("out");
    joined(&[one], &out).expect("a folder");
    let all = fs::read_dir(&out).expect("a folder").flatten();
    assert!(all.map(|e| e.file_name()).all(|name| name != "secret"));
    assert!(!out.join("images/../../secret").ends_with("out/secret"));
}

#[test]
fn the_first_failure_ends_the_run_where_that_was_asked_for_and_it_can_be_resumed() {
    let folder = tempfile::tempdir().expect("a folder");
    let mine = folder.path().join("mine");
    fs::create_dir_all(mine.join("accel")).expect("a folder");
    let library = raystone::gpu::KernelLibrary::default();
    let good = library.text("accel/uniform_grid").expect("a kernel");
    let (before, after) = FAULT;
    assert_eq!(good.matches(before).count(), 1);
    let write = |text: &str| fs::write(mine.join("accel/uniform_grid.wesl"), text);
    write(&good.replace(before, after)).expect("a kernel");
    let kernels = format!("axes.kernels = [{:?}]", mine.display().to_string());
    let text = experiment(&[&kernels, "axes.accel = ['uniform-grid', 'bvh']"]);
    let out = folder.path().join("out");
    let fails_fast = RunOptions {
        fail_fast: true,
        ..resumed(&out)
    };
    let ended = run_with(&text, fails_fast).expect_err("a structure fails");
    assert_eq!(ended.exit_code(), 1, "{ended}");
    assert!(ended.to_string().contains("uniform-grid"), "{ended}");
    assert_eq!(cells(&records(&out)).len(), 1);
    // Failed cells are tried again, and fail again; the rest is measured once.
    let (summary, lines) = resume(&text, &out);
    assert!(summary.failed > 0 && summary.kept == 0);
    let failed = |cell: &&CellRecord| cell.outcome == Outcome::Failed;
    let count = cells(&lines).values().filter(failed).count();
    let (again, _) = resume(&text, &out);
    assert_eq!(again.kept, units(&text, None).len() - count);
    write(good).expect("a kernel");
    let (healed, lines) = resume(&text, &out);
    assert_eq!(healed.failed, 0);
    assert!(
        cells(&lines)
            .values()
            .all(|cell| cell.outcome == Outcome::Done)
    );
}

#[test]
fn an_include_brings_back_what_an_exclude_takes_and_a_condition_ties_a_variant_to_cells() {
    let plan_of = |changes: &[&str], more: &str| {
        let text = experiment(changes) + more;
        plan(&text, &Registries::default()).1
    };
    let scenes = "axes.scene = ['cornell-box', 'furnace-box']";
    let all = plan_of(&[scenes], "");
    assert_eq!((all.structures.len(), all.times.len()), (4, 8));
    let exclude = "\n[[exclude]]\naccel = 'uniform-grid'\n";
    let without = plan_of(&[scenes], exclude);
    assert_eq!((without.structures.len(), without.times.len()), (2, 4));
    let include =
        "[[include]]\naccel = 'uniform-grid'\nscene = 'furnace-box'\nsequence = 'sobol'\n";
    let with = plan_of(&[scenes], &format!("{exclude}{include}"));
    // The structure comes back for the one cell that is timed with it.
    assert_eq!((with.structures.len(), with.times.len()), (3, 5));
    let out: usize = with.skipped.iter().map(|s| s.cells).sum();
    assert_eq!(out, 3);
    let when = "\n[accel.uniform-grid]\nlambda = [3, 8]\nwhen = { scene = 'furnace-box' }\n";
    let tied = plan_of(&[scenes], when);
    assert_eq!((tied.structures.len(), tied.times.len()), (4, 8));
    assert!(
        tied.skipped
            .iter()
            .any(|s| s.reason.contains("furnace-box"))
    );
    for (wrong, told) in [
        ("\n[[include]]\naccel = 'octree'\n", "octree"),
        ("\n[accel.bvh]\nwhen = { scnee = 'furnace-box' }\n", "scene"),
        ("\n[accel.bvh]\nwhen = 'furnace-box'\n", "when"),
        ("\n[[include]]\nacel = 'bvh'\n", "accel"),
    ] {
        let text = experiment(&[]) + wrong;
        let catalogue = Registries::default().catalogue();
        let refused = raystone::config::Experiment::parse(&text, "test", &[], &catalogue);
        let refused = refused.expect_err(wrong).to_string();
        assert!(refused.contains(told), "{refused}");
    }
}

#[test]
fn times_of_another_device_and_cells_of_another_program_are_measured_again() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = experiment(&[]);
    resume(&text, folder.path());
    // Something is missing, so that an adapter is opened and looked at.
    let take_out = |line: &mut Line| {
        if let Body::Cell(cell) = &mut line.body {
            if cell.inputs.device.is_empty() {
                cell.inputs.program = "another".to_owned()
            } else {
                cell.inputs.device = "another machine".to_owned()
            }
        }
    };
    rewrite(folder.path(), take_out);
    let (_, lines) = resume(&text, folder.path());
    let all = names(&["sampler", "stream", "structure", "time"], &text);
    assert_eq!(measured_again(&lines), all);
    assert!(!text_of(&lines).expect("lines").contains("another machine"));
}

/// The cell ends before its figures are written, and the check of the run is made from records.
#[test]
fn an_image_that_is_not_finite_fails_the_check_of_the_run_and_of_joined_ones() {
    let folder = tempfile::tempdir().expect("a folder");
    let mine = folder.path().join("mine");
    fs::create_dir_all(mine.join("integrator")).expect("a folder");
    let library = raystone::gpu::KernelLibrary::default();
    let good = library.text("integrator/primary").expect("a kernel");
    // Single paths would show the column before: they are not checked with a biased offset.
    let nan = "* bitcast<f32>(select(0x3f800000u, 0x7fc00000u, pixel.x == 27u)) * abs(";
    let before = "* abs(";
    assert_eq!(good.matches(before).count(), 1);
    let file = mine.join("integrator/primary.wesl");
    fs::write(file, good.replace(before, nan)).expect("a kernel");
    let kernels = format!("axes.kernels = [{:?}]", mine.display().to_string());
    let text = experiment(&[
        &kernels,
        "axes.accel = ['bvh']",
        "axes.sequence = ['sobol']",
        "axes.offset = ['fixed']",
        "run.resolution = [32, 32]",
    ]);
    let out = folder.path().join("out");
    let (summary, lines) = resume(&text, &out);
    assert!(summary.failed > 0);
    let is_told = |lines: &[Line]| {
        let failed = raystone::report::failed_checks(lines);
        let mut finite = failed
            .iter()
            .filter(|c| c.starts_with("Every pixel finite: "));
        assert!(finite.any(|check| check.contains("sobol")), "{failed:?}");
    };
    is_told(&lines);
    let page = raystone::report::write_report(&out).expect("a report").html;
    let page = fs::read_to_string(page).expect("a page");
    assert!(page.contains("NaN or infinite pixels"));
    let together = folder.path().join("joined");
    let merged = joined(&[out], &together).expect("a folder");
    assert!(merged.incomplete, "{merged:?}");
    is_told(&records(&together));
}
