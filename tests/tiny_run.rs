//! A tiny experiment from its file to its report, through the program.

use raystone::measure::record::{Line, Record, SCHEMA};
use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

const EXPERIMENT: &str = "tests/data/tiny.toml";
const STRUCTURES: [&str; 2] = ["bvh", "uniform-grid"];
const REPLICATES: u32 = 2;

fn run(out: &Path) -> Vec<Line> {
    let output = Command::new(env!("CARGO_BIN_EXE_raystone"))
        .args(["run", EXPERIMENT, "--quiet", "--out"])
        .arg(out)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("the program starts");
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(0), "{words}");
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
        lines.first().map(|line| &line.record),
        Some(Record::Run(_))
    ));
    match lines.last().map(|line| &line.record) {
        Some(Record::Finished(finished)) => assert_eq!(finished.failed, 0),
        other => panic!("the last line is no end of a run: {other:?}"),
    }
    check_structures(&lines);
    check_errors(&lines);
    check_times(&lines);
    let streams = lines
        .iter()
        .filter(|line| matches!(line.record, Record::Stream(_)));
    assert!(streams.count() > 0, "no stream was measured");
    check_report(&out);
}

fn check_structures(lines: &[Line]) {
    let mut passed = BTreeSet::new();
    for line in lines {
        let Record::Structure(structure) = &line.record else {
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
        passed.insert(structure.accel.name.as_str());
    }
    assert_eq!(passed, BTreeSet::from(STRUCTURES));
}

fn check_errors(lines: &[Line]) {
    let mut replicates = BTreeSet::new();
    let mut images = BTreeSet::new();
    for line in lines {
        let Record::Error(error) = &line.record else {
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
        let Record::Time(time) = &line.record else {
            continue;
        };
        assert!(time.failure.is_none() && time.image_equal, "{time:?}");
        assert!(time.mrays_s.is_some_and(|m| m.value > 0.0), "{time:?}");
        timed.insert(time.accel.name.as_str());
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
