//! The stress suite as a whole: its quick form on this adapter, planted faults that it must see, and the
//! program's commands.

use crate::support::{self, gpu, kernels_with};
use raystone::gpu::probe_arithmetic;
use raystone::measure::figure::{self, Figure};
use raystone::measure::record::{
    CellRecord, Line, MeasuredRecord, Reading, Recorded, all_of, axis,
};
use raystone::report::terminal::Screen;
use raystone::stress::EXPERIMENT;
use std::path::Path;
use std::process::Command;

/// A few families and shots through a few structures with these tests and kernels, and the targets of the whole suite.
fn run_small(out: &Path, tests: &[&str], kernels: &str) -> Vec<Line> {
    let targets = EXPERIMENT.split_once("\n[[expect]]\n").expect("targets").1;
    let text = format!(
        "[axes]\nintegrator = [\"stress:watertight\", \"stress:edges\", \"stress:coincident\", \"stress:non-finite\", \
         \"stress:shots\"]\ntriangle = {tests:?}\naccel = [\"brute-force\", \"bvh\", \"uniform-grid\"]\n\
         kernels = {kernels:?}\n[stress]\nquick = true\nrays = 64\nshots = 2048\n[[expect]]\n{targets}"
    );
    let (summary, lines) = support::run(&text, &raystone::registries(), out, None);
    assert_eq!(summary.failed, 0);
    lines
}

/// The cells of a measurement.
fn cells<'a>(lines: &'a [Line], measurement: &str) -> Vec<Recorded<'a, MeasuredRecord>> {
    let measured = all_of::<MeasuredRecord>(lines);
    measured
        .filter(|cell| cell.measurement == measurement)
        .collect()
}

fn count(cell: &Recorded<MeasuredRecord>, figure: &Figure) -> f64 {
    let reading = cell.reading(&figure.id);
    reading
        .unwrap_or_else(|| panic!("{} has no {}", cell.key, figure.id))
        .value
        .value
}

/// The series of shots, by misses.
fn misses(lines: &[Line]) -> Vec<&Reading> {
    let readings = cells(lines, "stress:shots")
        .into_iter()
        .flat_map(|cell| cell.readings);
    readings
        .filter(|reading| reading.figure == figure::MISSES.id)
        .collect()
}

#[test]
fn a_small_suite_finds_no_difference_from_brute_force_and_writes_tables_records_and_a_page() {
    let folder = tempfile::tempdir().expect("a folder");
    let records = run_small(folder.path(), &["watertight", "moeller-trumbore"], "");
    let families = cells(&records, "stress:families");
    let family = |cell: &Recorded<MeasuredRecord>| cell.key.label(axis::INTEGRATOR).to_owned();
    // Four families: the default test through three structures, the other one through two.
    assert_eq!(families.len(), 4 * (3 + 2));
    let exact = probe_arithmetic(gpu()).expect("the probe runs").is_exact();
    for cell in &families {
        assert!(count(cell, &figure::RAYS) > 0.0);
        if exact && family(cell) != "stress:non-finite" {
            assert_eq!(
                count(cell, &figure::UNEQUAL),
                0.0,
                "{}: {:?}",
                cell.key,
                cell.notes
            );
        }
        assert_eq!(count(cell, &figure::FAILED_CASES), 0.0, "{:?}", cell.notes);
    }
    let edges = families.iter().find(|cell| family(cell) == "stress:edges");
    let edges = edges.expect("a cell");
    let [median, p99, most] = [
        &figure::T_ULP_MEDIAN,
        &figure::T_ULP_P99,
        &figure::T_ULP_MOST,
    ]
    .map(|id| count(edges, id));
    assert!(median <= p99 && p99 <= most && most > 0.0);
    assert!(
        edges
            .readings
            .iter()
            .any(|reading| !reading.at.label(axis::PLACE).is_empty())
    );
    assert!(misses(&records).len() >= 12);
    let html = std::fs::read_to_string(folder.path().join("index.html")).expect("a page");
    for text in [
        "Where hits are lost",
        "cracks from inside closed meshes",
        "raystone trace",
        "uniform-grid",
        "<svg",
    ] {
        assert!(html.contains(text), "{text}");
    }
    let tables = Screen::default().tables(&records);
    assert!(
        tables.contains("brute-force") && tables.contains("PASS  cracks from inside"),
        "{tables}"
    );
    // The kernels of every cell are recorded.
    let cells: Vec<_> = all_of::<CellRecord>(&records).collect();
    assert!(cells.iter().all(|cell| !cell.inputs.kernels.is_empty()));
}

#[test]
fn a_test_that_refuses_rays_through_edges_is_seen_to_leak() {
    // Zero no longer counts as inside.
    let leaky = [("u >= 0.0", "u > 1e-3 * area")];
    let module = "accel/triangle/moeller_trumbore";
    let folder = tempfile::tempdir().expect("a folder");
    let kernels = folder.path().join("kernels");
    let file = kernels.join(module).with_extension("wesl");
    std::fs::create_dir_all(file.parent().expect("a parent")).expect("a folder");
    let text = kernels_with(module, &leaky)
        .text(module)
        .expect("a kernel")
        .to_owned();
    std::fs::write(&file, text).expect("a kernel");
    let out = folder.path().join("run");
    let kernels = kernels.to_str().expect("UTF-8");
    let records = run_small(&out, &["moeller-trumbore"], kernels);
    let misses = misses(&records);
    let leaks: f64 = misses.iter().map(|misses| misses.value.value).sum();
    assert!(leaks > 0.0, "no crack was seen in {} series", misses.len());
    for cell in cells(&records, "stress:shots") {
        for series in cell
            .readings
            .iter()
            .filter(|r| r.figure == figure::MISSES.id && r.value.value > 0.0)
        {
            let is_its =
                |r: &&Reading| r.figure == figure::CONFIRMED_MISSES.id && r.at == series.at;
            let confirmed = cell.readings.iter().find(is_its);
            assert!(confirmed.is_some_and(|r| r.value.value > 0.0), "{series:?}");
            assert!(
                cell.notes.iter().any(|note| note.at == series.at),
                "{series:?}"
            );
        }
    }
    let families = cells(&records, "stress:families");
    let is_edges = |cell: &&Recorded<MeasuredRecord>| {
        [axis::INTEGRATOR, axis::ACCEL].map(|axis| cell.key.label(axis)) == ["stress:edges", "bvh"]
    };
    let edges = families.iter().find(is_edges).expect("a cell");
    assert!(count(edges, &figure::CRACKS) > 0.0 && count(edges, &figure::UNEQUAL) > 0.0);
}

/// Runs the program with the words of a line, and one more argument; returns its exit status and all its output.
fn program(line: &str, last: Option<&str>) -> (Option<i32>, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_raystone"))
        .args(line.split_whitespace().chain(last))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("the program starts");
    let text = [output.stdout, output.stderr].concat();
    (
        output.status.code(),
        String::from_utf8_lossy(&text).into_owned(),
    )
}

#[test]
fn trace_shows_every_node_and_the_answers_of_structure_brute_force_and_oracle() {
    let ray = Some("1 1 3 0 0 -1 0 1e30");
    let (status, text) = program("trace --scene single-triangle --accel bvh --ray", ray);
    assert_eq!(status, Some(0), "{text}");
    for part in [
        "node 0",
        "triangle tests",
        "brute force",
        "oracle",
        "equal to the bit",
    ] {
        assert!(text.contains(part), "{part} in {text}");
    }
    let case = "--scene=stress:needles:scattered, ordinary:1";
    let (status, text) = program("trace --accel kd-tree --ray=0,0,9,0,0,-1", Some(case));
    assert_eq!(status, Some(0), "{text}");
}

#[test]
fn unknown_names_and_broken_rays_are_answered_with_two_and_what_there_is() {
    for (line, part) in [
        ("stress --family nails", "needles"),
        ("stress --triangle wet", "watertight"),
        ("stress --accel bhv", "bvh"),
        ("trace --scene cornell-box --ray 1,2,3", "3 numbers"),
        ("trace --scene stress:nails:a:1 --ray 0,0,0,0,0,1", "nails"),
        (
            "trace --scene cornell-box --triangle x --ray 0,0,0,0,0,1",
            "watertight",
        ),
    ] {
        let (status, text) = program(line, None);
        assert_eq!(status, Some(2), "{line}: {text}");
        assert!(text.contains(part), "{line}: {text}");
    }
}

#[test]
fn a_folder_that_another_run_writes_is_left_to_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().to_str().expect("a path in UTF-8");
    let lock = raystone::run::lock_folder(folder.path()).expect("nobody writes it");
    let (status, text) = program("stress --family seams --out", Some(out));
    assert_eq!(status, Some(2), "{text}");
    assert!(text.contains("another run is writing"), "{text}");
    drop(lock);
    raystone::run::lock_folder(folder.path()).expect("nobody writes it any more");
}
