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

fn experiment(tables: &str) -> String {
    format!(
        "[run]\nname = \"t\"\n[axes]\nintegrator = [\"specular:search\"]\n{tables}\n\
        [timing]\nrounds = 3\nmin_warmup_ms = 0\nmax_warmup_ms = 1\n"
    )
}

#[test]
fn an_experiment_needs_no_scene_and_leaves_figures_and_maps() {
    let folder = tempfile::tempdir().unwrap();
    let tables = r#"
[[integrator."specular:search"]]
reflector = ["plane", "sphere", "ellipsoid", "torus", "bumpy", "concave"]
precision = "device"
vertices = 64
[[integrator."specular:search"]]
step = ["newton-differences", "newton"]
vertices = 64
[[integrator."specular:search"]]
step = "newton-differences"
merit = "gradient"
starts = 16
reflector = "concave"
vertices = 64
"#;
    let (lines, failed, skipped) = ran(&experiment(tables), folder.path());
    assert_eq!((failed, skipped), (0, 0));
    let cells: Vec<_> = all_of::<MeasuredRecord>(&lines).collect();
    assert_eq!(cells.len(), 9);
    for cell in &cells {
        let picture = cell.picture.as_deref().unwrap();
        assert!(
            folder.path().join("run").join(picture).is_file(),
            "{picture}"
        );
        let mean = cell.reading("specular-iterations/v1").unwrap().value.value;
        assert!(mean >= 0.5, "{mean}");
    }
    let timed = cells
        .iter()
        .filter(|cell| cell.reading("specular-ns/v1").is_some());
    assert_eq!(timed.count(), 6);
    let several: Vec<f64> = cells
        .iter()
        .filter_map(|cell| Some(cell.reading("specular-points/v1")?.value.value))
        .collect();
    assert_eq!(several.len(), 1);
    assert!(
        (0.97..=1.0).contains(&several[0]),
        "of the bowl's points: {several:?}"
    );
}

#[test]
fn parameters_that_contradict_each_other_are_left_out_with_a_reason() {
    let cases = [
        ("amplitude = 0.1", "bumps"),
        ("stop = \"moved\"", "Newton's method"),
        ("step = \"newton\"\nstop = \"edge\"", "no triangle"),
        ("merit = \"gradient\"", "secants lower nothing"),
        ("starts = 4", "one triangle"),
        (
            "step = \"newton\"\nstarts = 4\nbegin = \"random\"",
            "contradicts",
        ),
        (
            "step = \"newton\"\ngradient = \"sign-mended\"",
            "exact gradient",
        ),
        ("step = \"newton\"\nsingular = 4", "threshold of secants"),
    ];
    for (keys, reason) in cases {
        let folder = tempfile::tempdir().unwrap();
        let table = format!("[[integrator.\"specular:search\"]]\n{keys}\n");
        let (lines, failed, skipped) = ran(&experiment(&table), folder.path());
        assert_eq!((failed, skipped), (0, 1), "{keys}");
        let text = serde_json::to_string(&lines.last()).unwrap()
            + &lines
                .iter()
                .map(|line| serde_json::to_string(line).unwrap())
                .collect::<String>();
        assert!(text.contains(reason), "{keys}: {text}");
    }
}
