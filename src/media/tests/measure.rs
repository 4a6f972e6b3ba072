//! The measurements in a run: planned, prepared, timed, written.

use crate::register;
use raystone_bench::run::{Registries, RunOptions, run};
use raystone_config::{Experiment, Plan};
use raystone_record::{Line, MeasuredRecord, Recorded, all_of};

/// The least of the experiment in `experiments/media.toml`.
const SMALL: &str = r#"
[run]
name = "media"
[axes]
integrator = [
    "media:dda", "media:level-map", "media:min-max", "media:bricks", "media:sparse-tree", "media:chebyshev",
    "media:cube-bvh", "media:paths", "media:photons", "media:pipeline",
]
[[integrator."media:dda"]]
content = ["cloud", "glass-ball", "noisy-cube", "gyroid"]
side = 16
rays = 256
[[integrator."media:level-map"]]
content = "glass-ball"
key = "n"
epsilon = 0.1
side = 16
rays = 256
[[integrator."media:paths"]]
side = 32
scheme = ["normalised", "printed"]
[[integrator."media:paths"]]
side = 32
rule = "region"
step = 0.0
[[integrator."media:paths"]]
target = "lens"
[[integrator."media:paths"]]
step = 0.0
[[integrator."media:paths"]]
target = "lens"
rule = "region"
step = 0.0
[[integrator."media:photons"]]
points = ["grid", "hammersley"]
side = 64
cells = 16
warp = ["none", "alias"]
[[integrator."media:pipeline"]]
strategy = ["swap", "fixed-64", "sort"]
photons = 32
side = 8
[timing]
rounds = 3
min_warmup_ms = 0
max_warmup_ms = 1
"#;

#[test]
fn an_experiment_of_media_needs_no_scene_and_leaves_its_figures() {
    let mut registries = Registries::default();
    register(&mut registries).unwrap();
    let parsed = |text: &str| Experiment::parse(text, "test", &[], &registries.catalogue());
    let experiment = parsed(SMALL).unwrap_or_else(|e| panic!("{e}"));
    let plan = Plan::new(&experiment, &[], |s, d| registries.is_randomised(s, d)).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let options = RunOptions {
        out: folder.path().join("run"),
        ..RunOptions::default()
    };
    let summary = run(&experiment, &plan, &registries, &options).unwrap();
    // A fixed step of 0 is refused, and a lens has no other.
    let text = std::fs::read_to_string(options.out.join("records.jsonl")).unwrap();
    assert_eq!((summary.failed, summary.skipped), (0, 2), "{text}");
    let lines: Vec<Line> = text
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    let of = |measurement: &str| {
        let all = all_of::<MeasuredRecord>(&lines);
        all.filter(|cell| cell.measurement == measurement)
            .collect::<Vec<_>>()
    };
    let value = |cell: &Recorded<MeasuredRecord>, figure: &str| {
        cell.reading(figure)
            .unwrap_or_else(|| panic!("no {figure}"))
            .value
            .value
    };
    let structures = of("media:structures");
    // Four of `dda`, one of the level map, and the others by default.
    assert_eq!(structures.len(), 4 + 1 + 5);
    for cell in &structures {
        assert!(value(cell, "media-steps/v1") >= 1.0 && value(cell, "media-bytes/v1") > 0.0);
        assert_eq!(cell.reading("media-step-ns/v1").unwrap().rounds().len(), 3);
    }
    let paths = of("media:paths");
    assert_eq!(paths.len(), 4);
    assert!(
        paths
            .iter()
            .all(|cell| value(cell, "media-capped/v1") == 0.0)
    );
    let photons = of("media:photons");
    let deviations: Vec<f64> = photons
        .iter()
        .map(|c| value(c, "photon-deviation/v1"))
        .collect();
    assert_eq!(photons.len(), 4);
    // A grid has few first coordinates, and an alias table takes its cells from the first one alone.
    let [grid, grid_by_alias, even, even_by_alias] = deviations[..] else {
        panic!("{deviations:?}")
    };
    assert!(grid < 0.1 && even < 0.1, "{deviations:?}");
    assert!(
        even_by_alias > 0.1 && grid_by_alias > 2.0 * even_by_alias,
        "{deviations:?}"
    );
    let pipelines = of("media:pipeline");
    assert_eq!(pipelines.len(), 3);
    for cell in &pipelines {
        assert!((0.0..0.1).contains(&value(cell, "scatter-rmse/v1")));
        assert!(
            value(cell, "scatter-deposit-ns/v1") > 0.0 && value(cell, "scatter-view-ns/v1") > 0.0
        );
    }
    let whole = include_str!("../../../experiments/media.toml");
    assert!(parsed(whole).is_ok());
}
