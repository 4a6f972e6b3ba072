//! A failure in a run is reported and affects nothing else: a lost device, a missing model, a folder that cannot be
//! written. No other record is lost, none is written twice.

mod folder;

use crate::support::*;
use raystone::config::{Cell, Plan};
use raystone::gpu::{AdapterChoice, GpuError, KernelLibrary};
use raystone::integrator::SceneBuffers;
use raystone::measure::record::{Body, Line, axis};
use raystone::run::{Registries, RunError, RunOptions, RunSummary};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::OnceLock;

/// Two scenes, two structures, two samplers; `SCENES` is replaced by the scenes.
const EXPERIMENT: &str = r#"
[run]
name = "recovery"
replicates = 2
resolution = [16, 16]
spp = { pow2 = [0, 1] }
[axes]
scene = [SCENES]
accel = ["bvh", "uniform-grid"]
sequence = ["pixel-hash", "sobol"]
integrator = ["primary"]
[reference]
spp = 8
[timing]
rounds = 3
min_warmup_ms = 0
max_warmup_ms = 5
rays = 1024
[gate]
rays = 256
brute_force_tests = 1000
oracle_rays = 64
[discrepancy]
points = 16
pairs = [[0, 1], [2, 3]]
seeds = 2
"#;

fn experiment(scenes: &[&str]) -> String {
    let quoted: Vec<String> = scenes.iter().map(|s| format!("{s:?}")).collect();
    EXPERIMENT.replace("SCENES", &quoted.join(", "))
}

/// A run's records by subject. Panics if one is there twice or the last is not the end.
struct Outcome {
    summary: RunSummary,
    records: BTreeMap<String, Line>,
    /// The failed subjects.
    failed: BTreeSet<String>,
}

/// Returns the subject of a record, and `true` if it reports a failure.
fn subject(line: &Line) -> (String, bool) {
    let [scene, integrator] = [axis::SCENE, axis::INTEGRATOR].map(|axis| line.key.label(axis));
    let cell = Cell::from(&line.key);
    let sampler = cell.on(&Cell::STREAM);
    let failed = |failure: &Option<String>| failure.is_some();
    match &line.body {
        Body::Run(_) => ("run".to_owned(), false),
        Body::Scene(_) => (format!("scene {scene}"), false),
        Body::Structure(r) => (cell.to_string(), failed(&r.failure)),
        // Checked with the first sampler that gets so far.
        Body::Paths(_) => (format!("paths of {scene}, {integrator}"), false),
        Body::Reference(_) => (format!("reference {scene}, {integrator}"), false),
        Body::Error(r) => (format!("replicate {} of {cell}", r.replicate), false),
        Body::Bias(_) => (format!("bias of {cell}"), false),
        Body::Spectrum(_) => (format!("spectrum of {cell}"), false),
        Body::Time(r) => (cell.to_string(), failed(&r.failure)),
        Body::Coherence(_) => (format!("coherence of {cell}"), false),
        Body::Animation(r) => (format!("animation of {cell}"), failed(&r.failure)),
        Body::Peer(_) => (format!("peer {cell}"), false),
        Body::Measured(r) => (format!("{} {cell}", r.measurement), failed(&r.failure)),
        Body::Stream(r) => (format!("stream {sampler}, {:?}", r.dimensions), false),
        Body::Skipped(r) => (format!("skipped {}", r.cell), false),
        Body::Failed(r) => (r.cell.clone(), true),
        Body::Warning(r) => (format!("warning of {}", r.cell), false),
        Body::Kernels(r) => (format!("kernels {}", r.id), false),
        Body::Cell(r) => (format!("cell {}", r.unit), false),
        Body::Interrupted(_) => ("interrupted".to_owned(), false),
        Body::Finished(_) => ("finished".to_owned(), false),
    }
}

fn outcome(scenes: &[&str], lose_device_at: Option<&str>) -> Outcome {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let text = experiment(scenes);
    let (summary, lines) = run(&text, &Registries::default(), folder.path(), lose_device_at);
    let mut records = BTreeMap::new();
    let mut failed = BTreeSet::new();
    match lines.last().map(|line| &line.body) {
        Some(Body::Finished(end)) => assert_eq!(end.failed, summary.failed),
        other => panic!("the last record is {other:?}"),
    }
    let mut closed = BTreeSet::new();
    for line in lines {
        match &line.body {
            Body::Cell(cell) => {
                assert!(closed.insert(cell.unit.clone()), "{} twice", cell.unit);
                continue;
            }
            Body::Kernels(_) => continue,
            _ => {}
        }
        let (subject, is_failure) = subject(&line);
        if is_failure {
            failed.insert(subject.clone());
        }
        let before = records.insert(subject.clone(), line);
        assert!(before.is_none(), "{subject} is there twice");
    }
    assert_eq!(failed.len(), summary.failed, "{failed:?}");
    Outcome {
        summary,
        records,
        failed,
    }
}

const SCENES: [&str; 2] = ["cornell-box", "furnace-box"];

fn undisturbed() -> &'static Outcome {
    static OUTCOME: OnceLock<Outcome> = OnceLock::new();
    OUTCOME.get_or_init(|| {
        let outcome = outcome(&SCENES, None);
        assert_eq!((outcome.summary.failed, outcome.summary.skipped), (0, 0));
        outcome
    })
}

fn cells() -> Plan {
    plan(&experiment(&SCENES), &Registries::default()).1
}

fn subjects(outcome: &Outcome) -> BTreeSet<&str> {
    outcome.records.keys().map(String::as_str).collect()
}

/// Everything but failures is as if nothing had happened: the same records, and in them the same
/// images.
fn check_the_rest(disturbed: &Outcome, missing: &BTreeSet<&str>, added: &BTreeSet<&str>) {
    let (before, after) = (subjects(undisturbed()), subjects(disturbed));
    let lost: BTreeSet<&str> = before.difference(&after).copied().collect();
    assert_eq!(lost, *missing);
    let new: BTreeSet<&str> = after.difference(&before).copied().collect();
    assert_eq!(new, *added);
    let mut images = 0;
    for (subject, record) in &disturbed.records {
        let before = undisturbed().records.get(subject).map(|line| &line.body);
        if let (Body::Error(after), Some(Body::Error(before))) = (&record.body, before) {
            assert_eq!(after.image_hash, before.image_hash, "{subject}");
            images += 1;
        }
    }
    assert!(images > 0);
}

fn set<'a>(texts: impl IntoIterator<Item = &'a String>) -> BTreeSet<&'a str> {
    texts.into_iter().map(String::as_str).collect()
}

#[test]
fn a_device_lost_at_a_structure_fails_that_structure_alone() {
    let plan = cells();
    let cell = &plan.structures[1];
    let disturbed = outcome(&SCENES, Some(&cell.to_string()));
    // Without the structure there is nothing to time its full cells with.
    let times = plan.times.iter().filter(|time| time.is_on(cell));
    let mut expected: BTreeSet<String> = times.map(ToString::to_string).collect();
    assert_eq!(expected.len(), 2);
    expected.insert(cell.to_string());
    assert_eq!(disturbed.failed, expected);
    check_the_rest(&disturbed, &BTreeSet::new(), &BTreeSet::new());
}

#[test]
fn a_device_lost_at_a_sampler_fails_that_sampler_alone() {
    let cell = cells().samplers[0].to_string();
    let disturbed = outcome(&SCENES, Some(&cell));
    assert_eq!(disturbed.failed, BTreeSet::from([cell.clone()]));
    let missing = [
        format!("replicate 0 of {cell}"),
        format!("replicate 1 of {cell}"),
        format!("bias of {cell}"),
        format!("spectrum of {cell}"),
    ];
    check_the_rest(&disturbed, &set(&missing), &set([&cell]));
}

#[test]
fn a_device_lost_at_a_full_cell_fails_that_cell_alone() {
    let times = cells().times;
    for cell in [&times[1], &times[times.len() - 1]] {
        let cell = cell.to_string();
        let disturbed = outcome(&SCENES, Some(&cell));
        assert_eq!(disturbed.failed, BTreeSet::from([cell]));
        check_the_rest(&disturbed, &BTreeSet::new(), &BTreeSet::new());
    }
}

#[test]
fn a_device_lost_at_a_stream_fails_that_stream_alone() {
    let cell = cells().streams[0].to_string();
    let disturbed = outcome(&SCENES, Some(&cell));
    let streams = [[0, 1], [2, 3]].map(|pair| format!("stream {cell}, {pair:?}"));
    assert_eq!(disturbed.failed, BTreeSet::from(streams));
    let cost = format!("sampler-cost {cell}");
    check_the_rest(&disturbed, &set([&cost]), &BTreeSet::new());
}

#[test]
fn a_missing_model_fails_its_scene_and_the_others_go_on() {
    let missing = "no-such-folder/no-such-model.obj";
    let disturbed = outcome(&["cornell-box", missing, "furnace-box"], None);
    assert!(disturbed.summary.bad_input);
    assert_eq!(disturbed.failed.len(), 1);
    let failed = disturbed.failed.first().expect("a failure");
    let Body::Failed(told) = &disturbed.records[failed].body else {
        panic!("{failed}");
    };
    assert!(told.reason.contains(missing), "{told:?}");
    check_the_rest(&disturbed, &BTreeSet::new(), &set([failed]));
}

#[test]
fn vertices_that_are_not_numbers_are_dropped_and_counted() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let model = folder.path().join("holes.obj");
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv NaN 1 1\nv 0 0 inf\nf 1 2 3\nf 1 2 4\nf 1 2 5\n";
    std::fs::write(&model, text).expect("a model");
    let outcome = outcome(&[&model.display().to_string()], None);
    assert_eq!(
        (outcome.summary.failed, outcome.summary.bad_input),
        (0, false)
    );
    let scenes = outcome
        .records
        .values()
        .filter_map(|line| match &line.body {
            Body::Scene(scene) => Some(scene),
            _ => None,
        });
    let scenes: Vec<_> = scenes.collect();
    let [scene] = &scenes[..] else {
        panic!("{} scenes", scenes.len());
    };
    assert_eq!((scene.triangles, scene.report.dropped_non_finite), (1, 2));
}

/// Runs into a folder that cannot be used.
fn refused(out: &Path, adapter: AdapterChoice) -> RunError {
    let registries = Registries::default();
    let (experiment, plan) = plan(&experiment(&["furnace-box"]), &registries);
    let options = RunOptions {
        out: out.to_owned(),
        adapter,
        ..RunOptions::default()
    };
    let ended = raystone::run::run(&experiment, &plan, &registries, &options);
    ended.expect_err("the run ends early")
}

fn assert_names(error: &RunError, path: &Path) {
    let text = error.to_string();
    assert!(matches!(error, RunError::Input(_)), "{text}");
    assert_eq!(error.exit_code(), 2);
    assert!(text.contains(&path.display().to_string()), "{text}");
}

#[test]
fn a_folder_that_cannot_be_written_is_told_before_anything_is_run() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("file");
    std::fs::write(&file, "kept").expect("a file");
    let error = refused(&file.join("run"), AdapterChoice::Best);
    assert_names(&error, &file.join("run"));
    assert!(error.to_string().contains("--out"), "{error}");
    assert_eq!(std::fs::read_to_string(&file).expect("the file"), "kept");

    let taken = folder.path().join("taken");
    std::fs::create_dir_all(taken.join("records.jsonl")).expect("a folder");
    let error = refused(&taken, AdapterChoice::Best);
    assert_names(&error, &taken.join("records.jsonl"));
    assert!(!taken.join("partial").exists(), "something was run");
}

#[test]
fn a_report_that_cannot_be_written_costs_no_record() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let registries = Registries::default();
    let experiment = experiment(&["furnace-box"]);
    let (_, measured) = run(&experiment, &registries, folder.path(), None);
    let page = folder.path().join("index.html");
    std::fs::remove_file(&page).expect("the page");
    std::fs::create_dir_all(page.join("taken")).expect("a folder");
    let error = raystone::report::write_report(folder.path()).expect_err("a taken name");
    let text = error.to_string();
    assert!(text.contains(&page.display().to_string()), "{text}");
    let lines = records(folder.path());
    assert_eq!(lines.len(), measured.len());
    let last = lines.last().map(|line| &line.body);
    assert!(matches!(last, Some(Body::Finished(_))));
}

#[test]
fn without_the_adapter_the_records_of_an_earlier_run_are_kept() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let records = folder.path().join("records.jsonl");
    std::fs::write(&records, "kept").expect("a file");
    let error = refused(
        folder.path(),
        AdapterChoice::Name("no such adapter".to_owned()),
    );
    assert!(
        matches!(error, RunError::Gpu(GpuError::UnknownAdapter { .. })),
        "{error}"
    );
    assert_eq!(error.exit_code(), 3);
    assert_eq!(std::fs::read_to_string(&records).expect("the file"), "kept");
}

#[test]
fn a_scene_beyond_the_limit_of_a_binding_is_refused_with_both_numbers() {
    let mut small = alone(KernelLibrary::default());
    let scene = builtin("cornell-box", &[]);
    let soup = raystone::accel::TriangleSoup::new(&scene);
    let needed = soup.records.len() as u64 * 48;
    // Triangles come in up to four parts of whole triangles.
    small.limits.max_storage_buffer_binding_size = needed / 2;
    assert!(SceneBuffers::upload(&small, &scene, &soup).is_ok());
    let part = (needed / 5).next_multiple_of(192) - 192;
    small.limits.max_storage_buffer_binding_size = part;
    let error = SceneBuffers::upload(&small, &scene, &soup)
        .err()
        .expect("an error");
    let text = error.to_string();
    assert!(matches!(error, GpuError::TooLarge { .. }), "{text}");
    for number in [needed, 4 * part] {
        assert!(text.contains(&number.to_string()), "{text}");
    }
}
