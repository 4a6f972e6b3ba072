//! A tiny experiment from its file to its report, through the program.

use raystone::measure::record::{Body, Line, SCHEMA, axis};
use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

const EXPERIMENT: &str = "tests/data/tiny.toml";
const STRUCTURES: [&str; 2] = ["bvh", "uniform-grid"];
const REPLICATES: u32 = 2;

/// Runs the experiment: exit code and standard error.
fn program(out: &Path, more: &[&str]) -> (Option<i32>, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_raystone"))
        .args(["run", EXPERIMENT, "--quiet", "--out"])
        .arg(out)
        .args(more)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("the program starts");
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    (output.status.code(), words)
}

/// Options for a run of integrands alone.
const INTEGRANDS: [&str; 6] = [
    "--set",
    "axes.integrator=integrand:disk",
    "--set",
    "axes.accel=bvh",
    "--set",
    "run.replicates=8",
];

#[test]
fn a_reference_too_noisy_for_the_errors_fails_the_run() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (code, words) = program(folder.path(), &["--set", "reference.spp=8"]);
    assert_eq!(code, Some(1), "{words}");
    assert!(words.contains("failed: Reference noise below"), "{words}");
    assert!(
        words.contains("0 gates or cells, 1 check failed"),
        "{words}"
    );
    let summary = std::fs::read_to_string(folder.path().join("summary.md")).expect("a summary");
    assert!(summary.contains("no winner: "), "{summary}");
}

#[test]
fn a_biased_sampler_fails_the_run_unless_it_is_so_by_design() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let design = [
        "--set",
        "axes.sequence=halton",
        "--set",
        "axes.decorrelation=disc-rotation",
    ];
    let (code, words) = program(folder.path(), &[&INTEGRANDS[..], &design[..]].concat());
    assert_eq!(code, Some(0), "{words}");
    let records = std::fs::read_to_string(folder.path().join("records.jsonl")).expect("records");
    assert!(records.contains(r#""by_design":true,"verdict":"biased""#));
    // The program's own kernel, twenty percent brighter.
    let kernel = "kernels/integrator/integrand.wesl";
    let text = std::fs::read_to_string(kernel).expect("a kernel");
    let faulty = text.replace("vec3<f32>(", "vec3<f32>(1.2 * ");
    assert_ne!(text, faulty);
    let kernels = folder.path().join("mine/integrator");
    std::fs::create_dir_all(&kernels).expect("a folder");
    std::fs::write(kernels.join("integrand.wesl"), faulty).expect("a kernel file");
    let mine = folder.path().join("mine");
    let fault = ["--kernels", mine.to_str().expect("a name in UTF-8")];
    let out = folder.path().join("faulty");
    let (code, words) = program(&out, &[&INTEGRANDS[..], &fault[..]].concat());
    assert_eq!(code, Some(1), "{words}");
    assert!(words.contains("failed: Samplers without bias: "), "{words}");
}

fn run(out: &Path) -> Vec<Line> {
    let (code, words) = program(out, &[]);
    assert_eq!(code, Some(0), "{words}");
    assert!(!words.contains("panicked"), "{words}");
    let records = std::fs::read_to_string(out.join("records.jsonl")).expect("records");
    let parse = |(i, line): (usize, &str)| {
        serde_json::from_str(line).unwrap_or_else(|e| panic!("line {}: {e}: {line}", i + 1))
    };
    records.lines().enumerate().map(parse).collect()
}

#[test]
fn a_tiny_experiment_runs_to_its_end_and_leaves_whole_records_and_a_report() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("run");
    let lines = run(&out);
    assert!(lines.iter().all(|line| line.schema == SCHEMA));
    assert!(matches!(
        lines.first().map(|line| &line.body),
        Some(Body::Run(_))
    ));
    match lines.last().map(|line| &line.body) {
        Some(Body::Finished(finished)) => assert_eq!(finished.failed, 0),
        other => panic!("the last line is no end of a run: {other:?}"),
    }
    check_structures(&lines);
    check_errors(&lines);
    check_times(&lines);
    let streams = lines
        .iter()
        .filter(|line| matches!(line.body, Body::Stream(_)));
    assert!(streams.count() > 0, "no stream was measured");
    check_report(&out);
}

fn check_structures(lines: &[Line]) {
    let mut passed = BTreeSet::new();
    for line in lines {
        let Body::Structure(structure) = &line.body else {
            continue;
        };
        let gate = structure.gate.as_ref().expect("a verdict of the gate");
        assert!(gate.passed && structure.failure.is_none(), "{structure:?}");
        let rays = gate.classes.iter().map(|class| class.rays);
        assert!(rays.sum::<usize>() >= 1024, "{gate:?}");
        assert!(
            gate.brute_force.rays >= 1 && gate.brute_force.wrong == 0,
            "{gate:?}"
        );
        assert!(!structure.timings.is_empty(), "{structure:?}");
        passed.insert(line.key.name(axis::ACCEL));
    }
    assert_eq!(passed, BTreeSet::from(STRUCTURES));
}

fn check_errors(lines: &[Line]) {
    let mut replicates = BTreeSet::new();
    let mut images = BTreeSet::new();
    for line in lines {
        let Body::Error(error) = &line.body else {
            continue;
        };
        let spp: Vec<_> = error.errors.iter().map(|at| at.spp).collect();
        assert_eq!(spp, [1, 2, 4]);
        let finite = |at: &raystone::measure::record::ErrorAtSpp| {
            !at.metrics.is_empty() && at.metrics.values().all(|value| value.is_finite())
        };
        assert!(error.errors.iter().all(finite), "{error:?}");
        assert_eq!(error.non_finite_pixels, 0);
        replicates.insert(error.replicate);
        images.insert(error.image_hash.as_str());
    }
    assert_eq!(replicates, (0..REPLICATES).collect());
    assert_eq!(
        images.len(),
        REPLICATES as usize,
        "seeds give different images"
    );
}

fn check_times(lines: &[Line]) {
    let mut timed = BTreeSet::new();
    for line in lines {
        let Body::Time(time) = &line.body else {
            continue;
        };
        assert!(time.failure.is_none() && time.image_equal, "{time:?}");
        assert!(time.mrays_s.is_some_and(|m| m.value > 0.0), "{time:?}");
        timed.insert(line.key.name(axis::ACCEL));
    }
    assert_eq!(timed, BTreeSet::from(STRUCTURES));
}

/// The page is there, and the records alone make it again.
fn check_report(out: &Path) {
    let page = std::fs::read_to_string(out.join("index.html")).expect("a report");
    assert!(
        page.contains("uniform-grid"),
        "the page does not name a structure"
    );
    assert!(out.join("summary.md").is_file());
    let before = page.len();
    std::fs::remove_file(out.join("index.html")).expect("a writable folder");
    let rewritten = Command::new(env!("CARGO_BIN_EXE_raystone"))
        .arg("report")
        .arg(out)
        .status()
        .expect("the program starts");
    assert_eq!(rewritten.code(), Some(0));
    let page = std::fs::read_to_string(out.join("index.html")).expect("the report again");
    assert_eq!(page.len(), before, "the records alone make the same page");
}
