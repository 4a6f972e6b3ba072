//! Ratios of figures from the same rounds: drift shared by both sides is not noise of the ratio,
//! and only figures of the same rounds are paired.

use super::verdicts::expect;
use raystone::compare::judge::TimeRatio;
use raystone::measure::figure::{COMPACTION_NS, figure};
use raystone::measure::record::{Interval, Key, Line, Ran, Reading, Samples};
use raystone::report::data::RunData;
use raystone::report::values::values;
use raystone::repro::claim::{Context, Row, judge};
use raystone::repro::judge::ClaimVerdict;
use serde_json::json;

/// The machine in each of eight rounds: three of them at half speed.
const DRIFT: [f64; 8] = [1.0, 1.02, 2.0, 1.9, 1.01, 2.1, 0.99, 1.0];
pub const A: [f64; 8] = [2.0, 2.01, 1.99, 2.02, 2.0, 1.98, 2.01, 1.99];
pub const B: [f64; 8] = [1.0, 0.99, 1.01, 1.0, 1.01, 0.99, 1.0, 1.0];

#[derive(Clone, Copy)]
pub struct Sitting {
    pub began: u64,
    pub device: &'static str,
    pub scene: &'static str,
    pub triangle: &'static str,
    pub box_test: &'static str,
}

pub const HERE: Sitting = Sitting {
    began: 1_700_000_000,
    device: "a GPU",
    scene: "box",
    triangle: "watertight",
    box_test: "padded",
};

fn median(samples: &[f64]) -> Interval {
    raystone::measure::statistics::median_interval(samples).expect("times")
}

fn interval(ms: &[f64]) -> serde_json::Value {
    let i = median(ms);
    json!({ "value": i.value, "low": i.low, "high": i.high })
}

pub fn drifted(own: [f64; 8]) -> Vec<f64> {
    own.iter()
        .zip(DRIFT)
        .map(|(own, drift)| own * drift)
        .collect()
}

/// Time of a full cell in milliseconds, and the line that completes it.
pub fn timed(accel: &str, at: Sitting, ms: &[f64]) -> [Line; 2] {
    sampled(accel, at, ms, 2)
}

fn sampled(accel: &str, at: Sitting, ms: &[f64], spp: u32) -> [Line; 2] {
    let rays = f64::from(500 * spp + 2000);
    let rates: Vec<f64> = ms.iter().map(|ms| rays / ms * 1e-3).collect();
    let body = json!({
        "kind": "time", "resolution": [8, 8], "spp": spp, "ms": ms, "wall_ms": ms,
        "ms_per_spp": interval(&ms.iter().map(|ms| ms / f64::from(spp)).collect::<Vec<_>>()),
        "rays": { "primary": 500 * spp, "shadow": 2000, "skipped": 500 }, "mrays_s": interval(&rates),
        "image_hash": "x", "image_equal": true, "failure": null,
    });
    let key = Key::default().with("scene", at.scene).with("accel", accel);
    let key = key
        .with("triangle", at.triangle)
        .with("box_test", at.box_test);
    lines(key, accel, at, body)
}

/// Rays of two classes through a structure; the second has ten times as many.
fn traced(accel: &str, at: Sitting, ms: [&[f64]; 2]) -> [Line; 2] {
    let timing = |class: &str, rays: f64, ms: &[f64]| {
        let rates: Vec<f64> = ms.iter().map(|ms| rays / ms * 1e-3).collect();
        json!({
            "class": class, "rays": rays as u64, "hit_fraction": 0.5, "ms": ms, "wall_ms": ms, "mrays_s": interval(&rates),
        })
    };
    let gate = json!({
        "passed": true, "classes": [], "brute_force": { "rays": 0, "wrong": 0, "ambiguous": 0 },
        "oracle": { "rays": 0, "wrong": 0, "ambiguous": 0 }, "kernel_errors": [], "structural": null,
    });
    let body = json!({
        "kind": "structure", "build": [], "build_ms": 1.0,
        "stats": { "nodes": 1, "leaves": 1, "references": 1, "bytes": 1, "depth": 1, "leaf_histogram": [], "sah_cost": null, "epo": null },
        "gate": gate, "timings": [timing("primary", 1e3, ms[0]), timing("bounce", 1e4, ms[1])],
        "heat_map": null, "heat_map_max": null, "failure": null,
    });
    let key = Key::default().with("scene", at.scene).with("accel", accel);
    lines(
        key.with("triangle", at.triangle)
            .with("box_test", at.box_test),
        accel,
        at,
        body,
    )
}

fn compacted(method: &str, at: Sitting, ms: &[f64], elements: f64) -> [Line; 2] {
    let per_element: Vec<f64> = ms.iter().map(|ms| 1e6 * ms / elements).collect();
    let body = json!({ "kind": "measured", "measurement": "compaction" });
    let time = Reading::new(&COMPACTION_NS, median(&per_element));
    let time = time.with_samples(Samples::Rounds {
        adapter: per_element,
        wall: Vec::new(),
        processors: Vec::new(),
    });
    let key = Key::default().with("integrator", method);
    let [measured, cell] = lines(key, method, at, body);
    [measured.with_readings(vec![time]), cell]
}

fn lines(key: Key, unit: &str, at: Sitting, body: serde_json::Value) -> [Line; 2] {
    let hash = format!(
        "{unit} {} {} {} {}",
        at.began, at.scene, at.triangle, at.box_test
    );
    let cell = json!({
        "kind": "cell", "unit": unit, "outcome": "done", "device": at.device, "run_began_unix_s": at.began, "lines": [hash],
    });
    let body = serde_json::from_value(body).expect("a record");
    [
        Line::new(key, Ran::default(), body).hashed(&hash),
        Line::about_all(serde_json::from_value(cell).expect("a cell")),
    ]
}

fn found(lines: &[Line], body: &str) -> Row {
    let data = RunData::new(lines);
    let mut rows = judge(&expect(body), &values(&data), &Context::default());
    assert_eq!(rows.len(), 1, "{rows:?}");
    rows.remove(0)
}

const RATIO: &str = "figure = \"ms-per-spp/v1\"\ncompare = \"ratio\"\nof = { accel = \"slow\" }\nover = { accel = \"fast\" }\nleast = 1.9\n";

/// Low and high end relative to the value.
fn width(row: &Row) -> f64 {
    let Interval { value, low, high } = row.ours.expect("a ratio");
    (high - low) / value
}

fn pair(slow: Sitting, fast: Sitting) -> Vec<Line> {
    [
        timed("slow", slow, &drifted(A)),
        timed("fast", fast, &drifted(B)),
    ]
    .concat()
}

#[test]
fn a_drift_that_both_share_is_none_of_the_ratios_noise() {
    let row = found(&pair(HERE, HERE), RATIO);
    assert!(width(&row) < 0.03, "{row:?}");
    assert!((row.ours.expect("a ratio").value - 2.0).abs() < 0.02);
    assert_eq!(row.verdict, ClaimVerdict::Supported);
    // The interval is that of the estimator used in comparisons.
    let ratios: Vec<f64> = A.iter().zip(B).map(|(a, b)| a / b).collect();
    let paired = TimeRatio::of_rounds(&ratios, "").expect("rounds");
    let theirs = paired.measured(figure("ms-per-spp/v1"), None, 0.0).change;
    let ours = row.ours.expect("a ratio");
    for (a, b) in [
        (ours.low, 1.0 + theirs.low),
        (ours.value, 1.0 + theirs.value),
        (ours.high, 1.0 + theirs.high),
    ] {
        assert!((a / b - 1.0).abs() < 1e-9, "{ours:?} {theirs:?}");
    }
}

#[test]
fn only_what_was_timed_in_the_same_rounds_is_paired() {
    let others = [
        Sitting {
            began: HERE.began + 1,
            ..HERE
        },
        Sitting {
            device: "another GPU",
            ..HERE
        },
        Sitting {
            box_test: "plain",
            ..HERE
        },
        Sitting {
            triangle: "moeller-trumbore",
            ..HERE
        },
        Sitting {
            scene: "hall",
            ..HERE
        },
    ];
    for other in others {
        let body = RATIO.replace(
            "\"slow\" }",
            "\"slow\", scene = \"*\", triangle = \"*\", box_test = \"*\" }",
        );
        let row = found(&pair(HERE, other), &body);
        assert!(width(&row) > 0.5, "{row:?}");
        assert_eq!(row.verdict, ClaimVerdict::Undecided, "{row:?}");
    }
    // Records of older programs lack the time of measurement.
    let unsaid = Sitting { began: 0, ..HERE };
    assert!(width(&found(&pair(unsaid, unsaid), RATIO)) > 0.5);
    // A round missing on one side.
    let [slow, fast] = [drifted(A), drifted(B)];
    let fewer = [timed("slow", HERE, &slow), timed("fast", HERE, &fast[..7])].concat();
    assert!(width(&found(&fewer, RATIO)) > 0.5);
}

#[test]
fn an_order_of_times_is_paired_too() {
    let order = "figure = \"ms-per-spp/v1\"\ncompare = \"order\"\norder = [{ accel = \"fast\" }, { accel = \"slow\" }]\n";
    let near: Vec<f64> = drifted(B).iter().map(|ms| 1.1 * ms).collect();
    let of =
        |slow: Sitting| [timed("slow", slow, &near), timed("fast", HERE, &drifted(B))].concat();
    assert_eq!(found(&of(HERE), order).verdict, ClaimVerdict::Supported);
    let later = Sitting {
        began: HERE.began + 60,
        ..HERE
    };
    assert_eq!(found(&of(later), order).verdict, ClaimVerdict::Undecided);
}

#[test]
fn rates_are_paired_as_rates_with_the_number_of_rays_of_each_side() {
    let rate = RATIO
        .replace("ms-per-spp", "cell-mrays-per-s")
        .replace("least = 1.9", "most = 0.55");
    let row = found(&pair(HERE, HERE), &rate);
    assert!(
        (row.ours.expect("a ratio").value - 0.5).abs() < 0.01 && width(&row) < 0.03,
        "{row:?}"
    );
    let rays = [
        traced("a", HERE, [&drifted(A), &drifted(B)]),
        timed("a", HERE, &drifted(A)),
    ]
    .concat();
    let classes = "figure = \"mrays-per-s/v1\"\ncompare = \"ratio\"\nof = { rays = \"bounce\" }\nover = { rays = \"primary\" }\nleast = 19\n";
    let row = found(&rays, classes);
    assert!(
        (row.ours.expect("a ratio").value - 20.0).abs() < 0.2 && width(&row) < 0.03,
        "{row:?}"
    );
    let methods = ["compaction:a", "compaction:b"];
    let compactions = [
        compacted(methods[0], HERE, &drifted(A), 1000.0),
        compacted(methods[1], HERE, &drifted(B), 2000.0),
    ]
    .concat();
    let body = "figure = \"compaction-ns/v1\"\ncompare = \"ratio\"\nof = { integrator = \"compaction:a\" }\nover = { integrator = \"compaction:b\" }\nleast = 3.9\n";
    let row = found(&compactions, body);
    assert!(
        (row.ours.expect("a ratio").value - 4.0).abs() < 0.02 && width(&row) < 0.03,
        "{row:?}"
    );
}

#[test]
fn of_a_cell_that_was_measured_again_the_later_rounds_count() {
    let earlier = Sitting {
        began: HERE.began - 60,
        ..HERE
    };
    let lines = [
        timed("slow", earlier, &DRIFT),
        timed("slow", HERE, &drifted(A)),
        timed("fast", HERE, &drifted(B)),
    ];
    assert!(width(&found(&lines.concat(), RATIO)) < 0.03);
}

#[test]
fn a_time_per_sample_is_paired_as_such() {
    let lines = [
        sampled("slow", HERE, &drifted(A), 4),
        sampled("fast", HERE, &drifted(B), 1),
    ];
    let body = RATIO.replace("least = 1.9", "most = 0.51");
    let row = found(&lines.concat(), &body);
    assert_eq!(row.verdict, ClaimVerdict::Supported, "{row:?}");
    // 4,000 rays in twice the time of 2,500.
    let rate = RATIO.replace("ms-per-spp", "cell-mrays-per-s");
    let row = found(&lines.concat(), &rate);
    assert!(
        (row.ours.expect("a ratio").value - 0.8).abs() < 0.01,
        "{row:?}"
    );
}

fn answer(lines: &[Line], question: &str) -> String {
    let tables = raystone::report::terminal_tables(lines);
    let row = tables.lines().find(|line| line.starts_with(question));
    row.unwrap_or_else(|| panic!("{tables}")).to_owned()
}

#[test]
fn winners_of_a_report_are_found_by_the_rounds_that_both_were_timed_in() {
    let near: Vec<f64> = drifted(B).iter().map(|ms| 1.1 * ms).collect();
    let of = |slow: Sitting| {
        let cells = [
            traced("slow", slow, [&near, &near]),
            traced("fast", HERE, [&drifted(B), &drifted(B)]),
            timed("slow", slow, &near),
            timed("fast", HERE, &drifted(B)),
        ];
        cells.concat()
    };
    for question in ["fastest, primary rays", "fastest for rendering"] {
        let row = answer(&of(HERE), question);
        assert!(
            row.contains(" fast ") && !row.contains("undecided"),
            "{row}"
        );
        assert!(row.contains("(1.10×)"), "{row}");
        // Another run has another drift.
        let later = Sitting {
            began: HERE.began + 60,
            ..HERE
        };
        let unsaid = Sitting { began: 0, ..HERE };
        for apart in [later, unsaid] {
            let row = answer(&of(apart), question);
            assert!(row.contains("undecided: "), "{row}");
        }
    }
}

#[test]
fn the_best_of_a_report_is_the_one_that_is_best_in_the_rounds_of_both() {
    // The machine is slow in eight of fifteen rounds. The second was lucky in one of these, and has
    // a median of 1 against 2.7: in fourteen rounds the first is faster by a tenth.
    let machine = [[1.0; 7].to_vec(), [3.0; 8].to_vec()].concat();
    let first: Vec<f64> = machine.iter().map(|m| 0.9 * m).collect();
    let mut second = machine.clone();
    second[9] = 0.8;
    let cells = [timed("first", HERE, &first), timed("second", HERE, &second)];
    let row = answer(&cells.concat(), "fastest for rendering");
    assert!(
        row.contains(" first ") && !row.contains("undecided"),
        "{row}"
    );
}
