//! Ratios of predicted cycles: variation between pixel groups is noise; the shared part is not.

use super::verdicts::expect;
use raystone::measure::record::{COST, Interval, Key, Line, Ran, Tally};
use raystone::report::data::RunData;
use raystone::report::values::values;
use raystone::repro::claim::{Context, Row, judge};
use raystone::repro::judge::ClaimVerdict;
use serde_json::json;

/// Rays of six groups.
const RAYS: [u64; 6] = [64, 64, 32, 64, 48, 64];
const HARD: [f64; 6] = [1.0, 4.0, 0.5, 2.0, 1.5, 0.25];

const ISSUE: u64 = COST[0];

/// Cycles of each group: common cycles per ray times its own factor.
fn cycles(per_ray: f64, own: [f64; 6]) -> Vec<[u64; 2]> {
    let of = |i: usize| (per_ray * HARD[i] * own[i] * RAYS[i] as f64) as u64 / ISSUE * ISSUE;
    (0..6).map(|i| [RAYS[i], of(i)]).collect()
}

/// Coherence of a sampler at several sample counts.
fn followed(decorrelation: &str, at: &[(u32, Vec<[u64; 2]>)]) -> Line {
    let at_one = |(spp, groups): &(u32, Vec<[u64; 2]>)| {
        let sum = |i: usize| groups.iter().map(|g| g[i]).sum::<u64>();
        let tally = Tally {
            rays: sum(0),
            issues: sum(1) / ISSUE,
            ..Tally::default()
        };
        json!({
            "spp": spp, "organisation": "single kernel", "paths": 336, "groups": [groups],
            "classes": [["primary", tally]],
        })
    };
    let body = json!({
        "kind": "coherence",
        "settings": {
            "resolution": [16, 16], "spp": [16], "groups": 6, "warps": 2, "warp": [8, 4], "samples": 1, "rule": "loop",
            "line_bytes": 128, "l1_kib": 1, "l1_ways": 0, "l2_kib": 1, "l2_ways": 0,
        },
        "timed_spp": 1,
        "at": at.iter().map(at_one).collect::<Vec<_>>(),
    });
    let key = Key::default().with("scene", "box").with("accel", "bvh");
    let key = key.with("integrator", "ao").with("sequence", "halton");
    let key = key.with("decorrelation", decorrelation);
    let body = serde_json::from_value(body).expect("a record");
    Line::new(key, Ran::default(), body)
}

/// [`followed`] at 16 samples.
fn at_16(decorrelation: &str, groups: Vec<[u64; 2]>) -> Line {
    followed(decorrelation, &[(16, groups)])
}

fn found(lines: &[Line], body: &str) -> Row {
    let data = RunData::new(lines);
    let rows = judge(&expect(body), &values(&data), &Context::default());
    assert_eq!(rows.len(), 1, "{rows:?}");
    rows.into_iter().next().expect("a row")
}

fn ratio(bound: &str) -> String {
    format!(
        "figure = \"cycles-per-ray/v1\"\ncompare = \"ratio\"\nof = {{ decorrelation = \"shift\", rays = \"all\" }}\nover = {{ decorrelation = \"jitter\", rays = \"all\" }}\n{bound}\n"
    )
}

const SAME: [f64; 6] = [1.0; 6];
/// Some groups gain, others lose.
const MIXED: [f64; 6] = [1.3, 0.9, 1.2, 0.95, 1.1, 0.8];

fn ours(row: &Row) -> Interval {
    row.ours.expect("a ratio")
}

#[test]
fn what_all_groups_share_is_no_noise_of_a_ratio() {
    // Groups differ by a factor of sixteen; each has 1.1 times the cycles with the shift.
    let lines = [
        at_16("shift", cycles(110_000.0, SAME)),
        at_16("jitter", cycles(100_000.0, SAME)),
    ];
    let row = found(&lines, &ratio("least = 1.05"));
    let i = ours(&row);
    assert_eq!(row.verdict, ClaimVerdict::Supported, "{row:?}");
    assert!(
        (i.value - 1.1).abs() < 1e-3 && i.high - i.low < 1e-3,
        "{i:?}"
    );
}

#[test]
fn groups_that_disagree_leave_it_open() {
    let lines = [
        at_16("shift", cycles(100_000.0, MIXED)),
        at_16("jitter", cycles(100_000.0, SAME)),
    ];
    let row = found(&lines, &ratio("least = 1.0"));
    let i = ours(&row);
    assert_eq!(row.verdict, ClaimVerdict::Undecided, "{row:?}");
    // The quotient of sums, as in reports, and the delete-one jackknife by hand.
    let sums = |own: [f64; 6], without: usize| {
        let kept = (0..6).filter(|i| *i != without);
        kept.map(|i| HARD[i] * own[i] * RAYS[i] as f64).sum::<f64>()
    };
    let log = |without: usize| (sums(MIXED, without) / sums(SAME, without)).ln();
    assert!((i.value.ln() - log(6)).abs() < 1e-3, "{i:?}");
    let logs: Vec<f64> = (0..6).map(log).collect();
    let mean = logs.iter().sum::<f64>() / 6.0;
    let variance = 5.0 / 6.0 * logs.iter().map(|x| (x - mean).powi(2)).sum::<f64>();
    // Student's 97.5 % quantile for five degrees of freedom.
    let half = 2.570_581_835_636 * variance.sqrt();
    assert!(
        ((i.high / i.value).ln() - half).abs() < 1e-3,
        "{i:?} {half}"
    );
    assert!(((i.value / i.low).ln() - half).abs() < 1e-3, "{i:?} {half}");
}

#[test]
fn a_gain_that_grows_is_judged_by_what_groups_say_of_all_four_figures() {
    let order = "figure = \"cycles-per-ray/v1\"\ncompare = \"order\"\nof = { decorrelation = \"shift\", rays = \"all\" }\nover = { decorrelation = \"jitter\", rays = \"all\" }\norder = [{ spp = \"16\" }, { spp = \"256\" }]\n";
    let lines = |late: [f64; 6]| {
        let shift = [(16, cycles(1e5, MIXED)), (256, cycles(1.3e5, late))];
        let jitter = [16, 256].map(|spp| (spp, cycles(1e5, SAME)));
        [followed("shift", &shift), followed("jitter", &jitter)]
    };
    // The same groups gain and lose: the growth is known although no gain is.
    let row = found(&lines(MIXED), order);
    assert_eq!(row.verdict, ClaimVerdict::Supported, "{row:?}");
    assert!((ours(&row).value - 1.3).abs() < 1e-3, "{row:?}");
    let mut turned = MIXED;
    turned.reverse();
    assert_eq!(
        found(&lines(turned), order).verdict,
        ClaimVerdict::Undecided
    );
}

#[test]
fn cycles_of_a_path_and_of_recorded_rays_have_the_noise_of_groups_too() {
    let lines = [
        at_16("shift", cycles(1e5, MIXED)),
        at_16("jitter", cycles(1e5, SAME)),
    ];
    let of_ray = ours(&found(&lines, &ratio("least = 1.0")));
    let of_path = ratio("least = 1.0").replace("cycles-per-ray", "cycles-per-path");
    let of_path = ours(&found(&lines, &of_path));
    // Here each path is one ray.
    assert!(
        (of_path.low / of_ray.low - 1.0).abs() < 1e-9,
        "{of_path:?} {of_ray:?}"
    );
    assert!(of_ray.low < 0.95 * of_ray.value);
}

#[test]
fn one_group_says_nothing_of_others_and_older_records_have_none() {
    let one = |name: &str, per_ray: f64| at_16(name, cycles(per_ray, SAME)[..1].to_vec());
    let row = found(
        &[one("shift", 2e5), one("jitter", 1e5)],
        &ratio("least = 1.0"),
    );
    assert_eq!(row.verdict, ClaimVerdict::Undecided, "{row:?}");
    // A ratio of sides with different numbers of groups is not certain either.
    let fewer = [
        at_16("shift", cycles(2e5, SAME)),
        at_16("jitter", cycles(1e5, SAME)[..5].to_vec()),
    ];
    let row = found(&fewer, &ratio("least = 1.0"));
    assert_eq!(row.verdict, ClaimVerdict::Undecided, "{row:?}");
    // Without groups in the records it is a counted figure like others.
    let strip = |line: Line| {
        let mut json = serde_json::to_value(&line).expect("JSON");
        json["body"]["at"][0]
            .as_object_mut()
            .expect("a record")
            .remove("groups");
        serde_json::from_value::<Line>(json).expect("an older record")
    };
    let lines = [
        strip(at_16("shift", cycles(100_000.0, MIXED))),
        strip(at_16("jitter", cycles(100_000.0, SAME))),
    ];
    let i = ours(&found(&lines, &ratio("least = 1.0")));
    assert_eq!(i.low, i.high);
}
