//! The stress suite as a whole: its quick form on this adapter, planted faults that it must see, and the
//! program's commands.

use crate::support::{gpu, kernels_with, open};
use raystone::accel::triangle::{MoellerTrumbore, TriangleTest as _};
use raystone::gpu::{Gpu, probe_arithmetic};
use raystone::measure::figure;
use raystone::measure::record::{Key, axis};
use raystone::report::terminal::Screen;
use raystone::stress::record::{Line, read, write};
use raystone::stress::report::{stress_tables, write_stress_page};
use raystone::stress::targets::{cells, shots};
use raystone::stress::{StressOptions, run};
use std::process::Command;

/// A few families through a few structures with the default test and one other.
fn small() -> StressOptions {
    let names = |names: &[&str]| names.iter().map(|n| (*n).to_owned()).collect();
    StressOptions {
        families: names(&["watertight", "edges", "coincident", "non-finite"]),
        accels: names(&["bvh", "uniform-grid"]),
        triangles: names(&["moeller-trumbore", "watertight"]),
        rays: 64,
        shots: 2048,
        ..StressOptions::new(true)
    }
}

fn run_small(gpu: &Gpu) -> Vec<Line> {
    run(std::slice::from_ref(gpu), &small(), &|_| ()).expect("the suite runs")
}

#[test]
fn a_small_suite_finds_no_difference_from_brute_force_and_writes_tables_records_and_a_page() {
    let records = run_small(gpu());
    let cells: Vec<_> = cells(&records).collect();
    let family = |key: &Key| key.label(axis::FAMILY).to_owned();
    // Four families: the default test through three structures, the other one through two.
    assert_eq!(cells.len(), 4 * (3 + 2));
    let exact = probe_arithmetic(gpu()).expect("the probe runs").is_exact();
    for cell in &cells {
        assert!(cell.count(&figure::RAYS) > 0 && !cell.rungs.is_empty());
        if exact && family(cell.key) != "non-finite" {
            assert_eq!(cell.differing(), 0, "{}: {:?}", cell.key, cell.worst);
        }
        assert!(cell.failures.is_empty(), "{:?}", cell.failures);
    }
    let edges = cells
        .iter()
        .find(|c| family(c.key) == "edges")
        .expect("a cell");
    assert!(
        edges
            .errors
            .is_some_and(|[q, ..]| q.median <= q.p99 && q.p99 <= q.max && q.max > 0.0)
    );
    assert!(shots(&records).count() >= 12);

    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), &records).expect("records");
    assert_eq!(read(folder.path()).expect("records"), records);
    let page = write_stress_page(folder.path(), &records).expect("a page");
    let html = std::fs::read_to_string(page).expect("a page");
    for text in [
        "Targets of the default configuration",
        "Where hits are lost",
        "uniform-grid",
        "<svg",
    ] {
        assert!(html.contains(text), "{text}");
    }
    let tables = stress_tables(&records, Screen::default());
    assert!(
        tables.contains("brute-force") && tables.contains("PASS"),
        "{tables}"
    );
}

#[test]
fn a_test_that_refuses_rays_through_edges_is_seen_to_leak() {
    // Zero no longer counts as inside.
    let leaky = [("u >= 0.0", "u > 1e-3 * area")];
    let gpu = open(kernels_with("accel/triangle/moeller_trumbore", &leaky));
    let settings = StressOptions {
        triangles: vec![MoellerTrumbore.name().into()],
        ..small()
    };
    let records = run(&[gpu], &settings, &|_| ()).expect("the suite runs");
    let leaks: usize = shots(&records).map(|s| s.count(&figure::MISSES)).sum();
    assert!(
        leaks > 0,
        "no crack was seen in {} series",
        shots(&records).count()
    );
    for series in shots(&records).filter(|s| s.count(&figure::MISSES) > 0) {
        assert!(
            series.count(&figure::CONFIRMED_MISSES) > 0 && series.worst.is_some(),
            "{series:?}"
        );
    }
    let edges = cells(&records)
        .find(|c| c.key.label(axis::FAMILY) == "edges" && c.key.label(axis::ACCEL) == "bvh")
        .expect("a cell");
    assert!(
        edges.count(&figure::CRACKS) > 0 && edges.differing() > 0,
        "{edges:?}"
    );
}

/// The program with the words of a line, and one more argument; its exit status and all that it says.
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
