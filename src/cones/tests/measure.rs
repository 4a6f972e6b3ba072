//! The measurement in a run: planned, prepared, timed, written; parameters that contradict each other.

use crate::register;
use raystone_bench::run::{Registries, RunOptions, run};
use raystone_config::{Experiment, Plan};
use raystone_record::{Line, MeasuredRecord, all_of};

/// Runs an experiment; returns its lines and how many cells failed and were left out.
fn ran(text: &str, folder: &std::path::Path) -> (Vec<Line>, usize, usize) {
    let mut registries = Registries::default();
    register(&mut registries).unwrap();
    let experiment = Experiment::parse(text, "test", &[], &registries.catalogue());
    let experiment = experiment.unwrap_or_else(|e| panic!("{e}"));
    let plan = Plan::new(&experiment, &[], |s, d| registries.is_randomised(s, d)).unwrap();
    let options = RunOptions {
        out: folder.join("run"),
        ..RunOptions::default()
    };
    let summary = run(&experiment, &plan, &registries, &options).unwrap();
    let text = std::fs::read_to_string(options.out.join("records.jsonl")).unwrap();
    let lines = text.lines().map(|line| serde_json::from_str(line).unwrap());
    (lines.collect(), summary.failed, summary.skipped)
}

fn experiment(axes: &str, tables: &str) -> String {
    format!(
        "[run]\nname = \"t\"\n[axes]\nintegrator = [\"cones:reflected\"]\n{axes}\n{tables}\n\
        [timing]\nrounds = 3\nmin_warmup_ms = 0\nmax_warmup_ms = 1\n"
    )
}

#[test]
fn an_experiment_needs_no_scene_and_leaves_figures_and_pictures() {
    let folder = tempfile::tempdir().unwrap();
    let axes = "sequence = [\"sobol\", \"hammersley\"]\ndecorrelation = [\"cranley-patterson\"]";
    let tables = r#"
[[integrator."cones:reflected"]]
side = 8
samples = 256
place = "thin"
frames = 2
sampled = [true, false]
"#;
    let (lines, failed, skipped) = ran(&experiment(axes, tables), folder.path());
    assert_eq!((failed, skipped), (0, 0));
    let cells: Vec<_> = all_of::<MeasuredRecord>(&lines).collect();
    assert_eq!(cells.len(), 3);
    let has = |id: &str| {
        cells
            .iter()
            .filter(|cell| cell.reading(id).is_some())
            .count()
    };
    assert_eq!(has("cones-ns/v1"), 1);
    assert_eq!(has("cones-bias/v1"), 3);
    assert_eq!(has("cones-edge-bias/v1"), 3);
    assert_eq!(has("cones-shimmer/v1"), 3);
    assert_eq!(has("cones-edges/v1"), 1);
    assert_eq!(has("cones-error-1/v1"), 2);
    assert_eq!(
        has("cones-adaptive/v1"),
        1,
        "Hammersley's points depend on their number"
    );
    for cell in &cells {
        let picture = cell.picture.as_deref().unwrap();
        assert!(
            folder.path().join("run").join(picture).is_file(),
            "{picture}"
        );
    }
}

#[test]
fn parameters_that_contradict_each_other_are_left_out_with_a_reason() {
    let cases = [
        ("resolution = 16", "at least `side`"),
        (
            "mirror = \"plane\"\nfootprint = \"mean\"",
            "leave `footprint` out",
        ),
        ("blend = \"level\"\ncut = 0.1", "leave `cut` out"),
    ];
    for (keys, reason) in cases {
        let folder = tempfile::tempdir().unwrap();
        let table = format!("[[integrator.\"cones:reflected\"]]\n{keys}\n");
        let (lines, failed, skipped) = ran(&experiment("", &table), folder.path());
        assert_eq!((failed, skipped), (0, 1), "{keys}");
        let text: String = lines
            .iter()
            .map(|line| serde_json::to_string(line).unwrap())
            .collect();
        assert!(text.contains(reason), "{keys}: {text}");
    }
}
