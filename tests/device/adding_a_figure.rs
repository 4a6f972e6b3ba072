//! A figure from outside the crate: one row and the code that measures it, and it appears in
//! records and everywhere figures are shown.

use crate::support;
use raystone::accel::{BuiltAccel, TriangleSoup};
use raystone::measure::figure::{Better, Figure, Shown, Spread};
use raystone::measure::record::{Line, StructureRecord, all_of, axis};
use raystone::report::terminal_tables;
use raystone::run::Registries;
use std::path::Path;
use std::process::Command;

const LARGEST_LEAF: Figure = Figure::new(
    "largest-leaf/v1",
    "largest leaf",
    "references",
    Better::Lower,
    Shown::Count,
    Spread::Exact,
);

/// Measures trees only, since grid cells are not leaves.
fn largest_leaf(built: &dyn BuiltAccel, _: &TriangleSoup) -> Option<f64> {
    let stats = built.stats();
    stats.depth?;
    let largest = stats
        .leaf_histogram
        .iter()
        .rposition(|&leaves| leaves > 0)?;
    Some(largest as f64)
}

fn run(registries: &Registries, out: &Path) -> Vec<Line> {
    let text = std::fs::read_to_string("tests/data/tiny.toml").expect("the experiment");
    support::run(&text, registries, out, None).1
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// Every text that must contain the figure: the page, the summary, the export and the terminal.
fn shown(out: &Path, lines: &[Line]) -> [String; 4] {
    let [page, summary, export] =
        ["index.html", "summary.md", "figures.csv"].map(|name| read(&out.join(name)));
    [page, summary, export, terminal_tables(lines)]
}

#[test]
fn a_figure_from_outside_stands_in_records_page_summary_export_and_terminal() {
    let mut registries = Registries::default();
    let added = registries.figures.add(LARGEST_LEAF, largest_leaf);
    added.expect("a new id");
    let folder = tempfile::tempdir().expect("a folder");
    let lines = run(&registries, folder.path());
    let of = |accel: &str| {
        let mut structures = all_of::<StructureRecord>(&lines);
        let is_it = |s: &raystone::measure::record::Recorded<StructureRecord>| {
            s.key.name(axis::ACCEL) == accel
        };
        let structure = structures.find(is_it).expect(accel);
        structure.figures.get("largest-leaf/v1").copied()
    };
    let found = of("bvh").expect("the figure of a tree");
    assert!(found.value >= 1.0 && found.low == found.high, "{found:?}");
    assert_eq!(of("uniform-grid"), None, "a grid has none");
    let row = format!(
        "largest-leaf/v1,largest leaf,references,{0},{0},{0},exact",
        found.value
    );
    let texts = shown(folder.path(), &lines);
    for (place, text) in texts.iter().enumerate() {
        assert!(text.contains("largest leaf"), "{place}: {text}");
    }
    let export: Vec<&str> = texts[2]
        .lines()
        .filter(|line| line.contains(&row))
        .collect();
    assert_eq!(export.len(), 1, "{}", texts[2]);
    assert!(export[0].starts_with("cornell-box,bvh,"), "{export:?}");
    // The program, which does not know it, shows it from the records alone.
    std::fs::remove_file(folder.path().join("index.html")).expect("a page");
    let again = Command::new(env!("CARGO_BIN_EXE_raystone"))
        .arg("report")
        .arg(folder.path())
        .status();
    assert!(again.expect("the program starts").success());
    assert_eq!(shown(folder.path(), &lines), texts);
}

#[test]
fn without_it_nothing_speaks_of_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let lines = run(&Registries::default(), folder.path());
    assert!(!read(&folder.path().join("records.jsonl")).contains("largest-leaf"));
    for text in shown(folder.path(), &lines) {
        assert!(
            !text.contains("largest leaf") && !text.contains("Further figures"),
            "{text}"
        );
    }
}
