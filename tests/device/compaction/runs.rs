//! Compactions in an ordinary run: records, figures, report.

use crate::support::{plan, run};
use raystone::measure::figure::{
    COMPACTION_KEPT, COMPACTION_LEAST_BYTES, COMPACTION_NS, COMPACTION_PASSES, Figure,
};
use raystone::measure::record::{Interval, Line, MeasuredRecord, Recorded, all_of, axis};
use raystone::run::Registries;
use std::path::Path;

const EXPERIMENT: &str = r#"
[run]
name = "compaction"
[axes]
integrator = ["compaction:roger", "compaction:horn", "compaction:subgroup"]
[[integrator."compaction:roger"]]
elements = [256, 512, 1024, 2048, 4096]
bytes = 8
[[integrator."compaction:roger"]]
elements = 4096
block = [8, 16, 32]
bytes = 8
[integrator."compaction:horn"]
elements = [256, 512, 1024, 2048, 4096]
bytes = 8
[integrator."compaction:subgroup"]
elements = 4096
bytes = 8
[timing]
rounds = 6
min_warmup_ms = 0
max_warmup_ms = 1
"#;

fn compactions(lines: &[Line]) -> Vec<Recorded<'_, MeasuredRecord>> {
    let measured = all_of::<MeasuredRecord>(lines);
    measured
        .filter(|cell| cell.measurement == "compaction")
        .collect()
}

/// A parameter such as elements or bytes, from the cell's label.
fn parameter(cell: &Recorded<MeasuredRecord>, name: &str) -> f64 {
    let variant = cell.key.get(axis::INTEGRATOR).expect("a compaction");
    match &variant.params.0[name] {
        raystone::params::ParamValue::Integer(value) => *value as f64,
        other => panic!("{name} is {other:?}"),
    }
}

#[test]
fn a_run_of_compactions_needs_no_scene_and_says_how_each_grows() {
    let registries = Registries::default();
    let (_, plan) = plan(EXPERIMENT, &registries);
    assert!(plan.structures.is_empty() && plan.times.is_empty() && plan.streams.is_empty());
    // The default block is in two tables.
    assert_eq!(plan.benches.len(), 5 + 3 + 5 + 1);
    let folder = tempfile::tempdir().expect("a folder");
    let (summary, lines) = run(EXPERIMENT, &registries, folder.path(), None);
    assert_eq!(summary.failed, 0);
    let found = compactions(&lines);
    assert_eq!(found.len() + summary.skipped, plan.benches.len());
    let exact = |cell: &Recorded<MeasuredRecord>, figure: &Figure| {
        let reading = cell.reading(&figure.id).expect("a reading");
        assert_eq!(reading.value, Interval::exact(reading.value.value));
        reading.value.value
    };
    for cell in &found {
        assert_eq!(cell.failure, None, "{}", cell.key);
        let elements = parameter(cell, "elements");
        let time = cell.reading(&COMPACTION_NS.id).expect("a time");
        assert!(time.value.value > 0.0 && time.rounds().len() == 6);
        assert_eq!(time.work, format!("{elements} elements of 8 bytes"));
        let kept = exact(cell, &COMPACTION_KEPT);
        assert!(0.0 < kept && kept < elements);
        assert_eq!(
            exact(cell, &COMPACTION_LEAST_BYTES),
            4.0 * elements + 16.0 * kept
        );
    }
    let horn = found
        .iter()
        .find(|cell| (cell.key.label(axis::INTEGRATOR)).contains("horn(elements=4096"));
    // Marks, 12 steps, the search.
    assert_eq!(exact(horn.expect("a cell"), &COMPACTION_PASSES), 14.0);
    let page = std::fs::read_to_string(folder.path().join("summary.md")).expect("a summary");
    for text in [
        "Compaction of streams",
        "fits better",
        "compaction:roger(block=16)",
    ] {
        assert!(page.contains(text), "{text} is not in\n{page}");
    }
    for plot in ["compaction-elements.svg", "compaction-block.svg"] {
        assert!(folder.path().join("plots").join(plot).exists(), "{plot}");
    }
    let figures = std::fs::read_to_string(folder.path().join("figures.csv")).expect("figures");
    for figure in [
        "compaction-ns/v1",
        "compaction-ratio/v1",
        "growth-difference/v1",
    ] {
        assert!(figures.contains(figure), "{figure}");
    }
}

/// Kernels that count one too few have no figure, while the embedded ones do.
#[test]
fn a_method_that_is_wrong_has_no_figure() {
    let folder = tempfile::tempdir().expect("a folder");
    let kernels = folder.path().join("short");
    let file = kernels.join("compaction/scatter.wesl");
    let (from, to) = (
        "= sums[BUCKETS * tiling.tiles]",
        "= sums[BUCKETS * tiling.tiles] - 1u",
    );
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("kernels/compaction/scatter.wesl");
    let text = std::fs::read_to_string(source).expect("a kernel");
    assert_eq!(text.matches(from).count(), 1);
    std::fs::create_dir_all(file.parent().expect("a folder")).expect("a folder");
    std::fs::write(&file, text.replace(from, to)).expect("a kernel");
    let text = format!(
        "[run]\nname = \"short\"\n[axes]\nintegrator = [\"compaction:reduce-scan-scatter\", \"compaction:atomic\"]\n\
         kernels = [\"\", {:?}]\n[integrator.\"compaction:reduce-scan-scatter\"]\nelements = 1000\n\
         [integrator.\"compaction:atomic\"]\nelements = 1000\n\
         [timing]\nrounds = 3\nmin_warmup_ms = 0\nmax_warmup_ms = 1\n",
        kernels.display().to_string()
    );
    let (summary, lines) = run(
        &text,
        &Registries::default(),
        &folder.path().join("out"),
        None,
    );
    assert_eq!(summary.failed, 1);
    let found = compactions(&lines);
    assert_eq!(found.len(), 4);
    for cell in found {
        let is_short = cell.key.label(axis::KERNELS) == "short"
            && cell.key.name(axis::INTEGRATOR).ends_with("scatter");
        assert_eq!(cell.failure.is_some(), is_short, "{}", cell.key);
        assert_eq!(cell.readings.is_empty(), is_short);
    }
}

#[test]
fn a_lost_device_costs_one_cell() {
    let folder = tempfile::tempdir().expect("a folder");
    let lost = "compaction:atomic(elements=1000)";
    let text = "[run]\nname = \"lost\"\n[axes]\nintegrator = [\"compaction:none\", \"compaction:atomic\", \"compaction:roger\"]\n\
                [integrator.\"compaction:none\"]\nelements = 1000\n[integrator.\"compaction:atomic\"]\nelements = 1000\n\
                [integrator.\"compaction:roger\"]\nelements = 1000\n[timing]\nrounds = 3\nmin_warmup_ms = 0\nmax_warmup_ms = 1\n";
    let (summary, lines) = run(text, &Registries::default(), folder.path(), Some(lost));
    assert_eq!(summary.failed, 1);
    let found = compactions(&lines);
    assert_eq!(found.len(), 3);
    for cell in found {
        let is_lost = cell.key.label(axis::INTEGRATOR) == lost;
        assert_eq!(cell.failure.is_some(), is_lost, "{}", cell.key);
    }
}
