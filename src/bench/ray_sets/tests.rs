use super::*;
use crate::run::{Registries, RunOptions, run};
use raystone_accel::{Anatomy, BuildLog, BuiltBvh, BvhParameters};
use raystone_record::{Line, MeasuredRecord, Recorded, all_of, axis};

const SMALL: &str = r#"
[run]
name = "rays"
[axes]
accel = ["ray-hierarchy", "bvh"]
integrator = ["rays:primary", "rays:bounce", "rays:shadow"]
sequence = "sobol"
decorrelation = ["none", "cranley-patterson"]
[accel."ray-hierarchy"]
capacity = [16384, 2097152]
[integrator."rays:primary"]
squares = 4
side = 32
[[integrator."rays:bounce"]]
squares = 4
side = 32
bounce = [1, 2]
[[integrator."rays:bounce"]]
squares = 4
side = 32
spread = 30
[[integrator."rays:bounce"]]
squares = 4
side = 32
moved = 0.4
[integrator."rays:shadow"]
squares = 4
side = 32
reversed = [false, true]
[timing]
rounds = 3
min_warmup_ms = 0
max_warmup_ms = 1
"#;

#[test]
fn rays_need_no_scene_and_leave_times_counts_and_levels() {
    let registries = Registries::default();
    let parsed = |text: &str| Experiment::parse(text, "test", &[], &registries.catalogue());
    let experiment = parsed(SMALL).unwrap_or_else(|e| panic!("{e}"));
    let plan = Plan::new(&experiment, &[], |s, d| registries.is_randomised(s, d)).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let options = RunOptions {
        out: folder.path().join("run"),
        ..RunOptions::default()
    };
    let summary = run(&experiment, &plan, &registries, &options).unwrap();
    assert_eq!((summary.failed, summary.skipped), (0, 0));
    let text = std::fs::read_to_string(options.out.join("records.jsonl")).unwrap();
    let lines: Vec<Line> = text
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    let cells: Vec<Recorded<MeasuredRecord>> = all_of::<MeasuredRecord>(&lines).collect();
    // Eight sets of rays through three structures: a sampler is varied where there is a choice.
    assert_eq!(cells.len(), 24);
    for cell in &cells {
        let whole = |figure: &str| {
            let reading = cell
                .reading(figure)
                .unwrap_or_else(|| panic!("no {figure}"));
            reading.value.value
        };
        assert!(whole("rays-frame-ns/v1") > whole("rays-ns/v1"));
        assert!(whole("rays-live/v1") > 100.0);
        assert_eq!(whole("rays-triangles/v1"), 384.0);
        let is_sampled = !cell.key.label(axis::SEQUENCE).is_empty();
        assert_eq!(cell.reading("lobe-error/v1").is_some(), is_sampled);
        let is_moved = cell.key.label(axis::INTEGRATOR).contains("moved");
        let is_refitted = is_moved && cell.key.label(axis::ACCEL) == "bvh";
        for figure in ["rays-refit-ms/v1", "rays-refit-frame-ns/v1"] {
            assert_eq!(cell.reading(figure).is_some(), is_refitted, "{figure}");
        }
        let is_tree = cell.key.label(axis::ACCEL).starts_with("ray");
        assert_eq!(cell.reading("descent-tests/v1").is_some(), is_tree);
        if is_tree {
            let levels = cell.readings.iter();
            let levels = levels.filter(|r| r.figure == "level-tests/v1");
            let sum: f64 = levels.map(|r| r.value.value).sum();
            let tests = whole("descent-tests/v1");
            // Pilots test nodes of at most three levels, of 16, 4 and 1, against every 33rd triangle.
            let pilots = (tests - sum) * whole("rays-live/v1") / 12.0;
            assert!((pilots - pilots.round()).abs() < 1e-6 && (1.0..21.5).contains(&pilots));
            assert!(sum > 1.0);
        }
        let passes = cell.readings.iter().filter(|r| r.figure == "pass-ns/v1");
        let named = passes.clone().map(|r| r.at.label(axis::SUBJECT));
        let named: Vec<&str> = named.collect();
        for pass in [
            "gather",
            "leaves",
            "unions",
            "begin",
            "plan",
            "expand",
            "candidates",
            "answers",
        ] {
            assert_eq!(
                named.contains(&format!("pass {pass}").as_str()),
                is_tree,
                "{pass}"
            );
        }
        let sum: f64 = passes.map(|r| r.value.value).sum();
        assert_eq!(sum > 0.0, is_tree);
        // They are the parts of the fastest turn.
        let time = cell.reading("rays-ns/v1").unwrap();
        let raystone_record::Samples::Rounds { adapter, .. } = &time.samples else {
            panic!("no rounds");
        };
        let least = adapter.iter().copied().fold(f64::INFINITY, f64::min);
        assert!(sum <= least * (1.0 + 1e-9), "{sum} of {least}");
        assert!(!is_tree || sum > 0.1 * least, "{sum} of {least}");
    }
    for file in [
        include_str!("../../../experiments/ray-hierarchy.toml"),
        include_str!("../../../experiments/thesis/roger-ray-hierarchy.toml"),
    ] {
        parsed(file).unwrap_or_else(|e| panic!("{e}"));
    }
}

#[test]
fn the_error_of_a_lobe_falls_with_samples_at_the_rate_of_independent_ones_and_faster_for_a_net() {
    let soup = room(8);
    let judge = BuiltBvh::build(&soup, &BvhParameters::default(), &mut BuildLog::default());
    let twin = judge.as_ref().unwrap().cpu_twin(&soup).unwrap();
    let lobes = Lobes {
        from: &on_mirror(64, 0.0),
        spread: 0.6,
        host: (&soup, &*twin),
    };
    let truth = lobes.truth();
    let registry = raystone_sampling::SamplerRegistry::default();
    let error = |sequence: &str, decorrelation: &str, samples: u32| {
        let [sequence, decorrelation] = [sequence, decorrelation].map(Variant::plain);
        let demand = Demand {
            samples: Some(samples),
            dimensions: 2,
            width: Some(64),
        };
        let sampler = registry
            .sampler(&sequence, &decorrelation, &demand)
            .unwrap();
        let draw = Draw { sampler, seed: 1 };
        let found = lobes.means(samples, &|pixel, sample| draw.at(pixel, sample, 0));
        let squares = found
            .iter()
            .zip(&truth)
            .map(|(x, truth)| (x - truth).powi(2));
        (squares.sum::<f64>() / truth.len() as f64).sqrt()
    };
    let [few, many] = [4, 64].map(|samples| error("pixel-hash", "none", samples));
    // 1/√16 of it, and an error of 16 pixels in a thousand.
    assert!((few / many / 4.0 - 1.0).abs() < 0.1, "{few} {many}");
    let net = error("sobol", "owen-hash", 64);
    assert!(net < 0.5 * many, "{net} {many}");
}

#[test]
fn balls_move_by_so_much_and_walls_do_not() {
    let still = room(8);
    let moved = room::moved(&still, 0.4);
    let mut farthest: f32 = 0.0;
    for (a, b) in still.records.iter().zip(&moved.records) {
        for (a, b) in a.vertices().into_iter().zip(b.vertices()) {
            let (a, b) = (glam::Vec3::from(a), glam::Vec3::from(b));
            assert!(a.abs().max_element() < 5.0 || a == b, "{a} {b}");
            farthest = farthest.max(a.distance(b));
        }
    }
    assert!((0.1..=0.4).contains(&farthest), "{farthest}");
}

#[test]
fn lobes_are_on_the_side_of_the_normal_and_widen_a_tree() {
    let soup = room(8);
    let judge = BuiltBvh::build(&soup, &BvhParameters::default(), &mut BuildLog::default());
    let judge = judge.unwrap();
    let twin = judge.cpu_twin(&soup).unwrap();
    let host = (&soup, &*twin);
    let seen = on_mirror(32, 0.0);
    let draw = |pixel: u32, number: u32| {
        [0, 1]
            .map(|k| (pixel.wrapping_mul(0x9e37_79b9) >> (4 * (k + number))) as f32 / 2f32.powi(32))
    };
    let params = Default::default();
    let mean_angle = |spread: f32| {
        let rays = room::bounced(seen.clone(), (1, spread), &draw, host);
        for (ray, vertex) in rays.iter().zip(&seen) {
            assert_eq!(ray.is_ray(), vertex.is_some());
            let outward = glam::Vec3::from(ray.direction).dot(glam::Vec3::from(ray.origin));
            assert!(outward > -1e-5, "{ray:?}");
        }
        Anatomy::new(&soup, &params, &rays).unwrap().levels[2].angle[0]
    };
    let angles = [0.0, 0.2, 1.0].map(mean_angle);
    assert!(angles.is_sorted_by(|a, b| a < b), "{angles:?}");
    // A closed room lets no path out.
    let third = room::bounced(seen.clone(), (3, 0.0), &draw, host);
    let live = |rays: &[Ray]| rays.iter().filter(|ray| ray.is_ray()).count();
    assert_eq!(live(&third), live(&mirrored(&seen)));
}
