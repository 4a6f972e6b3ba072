//! Limits of a comparison: no controls, measured once or against another reference, or below the threshold by value
//! alone.

use super::records::{Made, QUIET, SHARED};
use super::{compared, said};
use raystone::compare::Finding;
use raystone::compare::drift::{Drift, Place};
use raystone::compare::judge::{ChangeVerdict, Effects, Outcome, TimeRatio, compare};
use raystone::compare::side::Side;
use raystone::compare::taken::Evidence;
use raystone::measure::figure::figure;
use raystone::measure::record::{Body, Line, SkippedRecord};
use raystone::measure::signed_rank::SignedRank;
use raystone::params::{ParamValue, Params, Variant};

fn side(lines: Vec<Line>) -> Side {
    Side::new("made", lines, Vec::new())
}

/// Two runs of a quiet machine; kernels differ in the second half of the structures.
fn quiet(slower: fn(usize) -> f64) -> [Made; 2] {
    let base = Made {
        rounds: 21,
        noise: QUIET,
        ..Made::default()
    };
    let candidate = Made {
        seed: 2,
        machine: 2,
        candidate: true,
        slower,
        ..base.clone()
    };
    [base, candidate]
}

fn times<'f>(found: &'f [Finding], structure: &str) -> Vec<&'f Finding> {
    let of = |f: &&Finding| f.is_time && f.key.label("accel") == structure;
    found.iter().filter(of).collect()
}

#[test]
fn a_control_that_moves_alone_is_not_called_worse() {
    let [base, candidate] = quiet(|_| 1.0);
    let mut lines = candidate.lines();
    for line in &mut lines {
        // In one class of rays: two that moved alike would be drift.
        if let (Body::Structure(record), "structure-2") = (&mut line.body, line.key.label("accel"))
        {
            let timing = &mut record.timings[0];
            let all = timing.ms.iter_mut().chain(&mut timing.cpu_ms);
            all.for_each(|ms| *ms *= 1.3);
        }
    }
    let found = compared(&base.side(), &side(lines));
    let moved = times(&found.findings, "structure-2");
    assert!(moved.len() >= 2 && moved.iter().all(|f| f.is_control));
    assert!(moved.iter().all(|f| f.verdict != ChangeVerdict::Worse));
    let told = |f: &&Finding| f.why.contains("moved unlike all others");
    assert!(moved.into_iter().any(|f| told(&f)));
}

#[test]
fn equal_kernels_are_no_control_where_an_exact_figure_of_the_structure_differs() {
    let base = Made::default();
    let later = Made {
        seed: 2,
        ..Made::default()
    };
    let mut lines = later.lines();
    for line in &mut lines {
        if let (Body::Structure(record), "structure-3") = (&mut line.body, line.key.label("accel"))
        {
            record.stats.sah_cost = Some(11.0);
        }
    }
    let found = compared(&base.side(), &side(lines));
    let is_control = |name| times(&found.findings, name).iter().all(|f| f.is_control);
    assert!(!is_control("structure-3") && is_control("structure-4"));
}

#[test]
fn a_copied_measurement_is_the_same_and_tells_no_drift() {
    let base = Made::default();
    let of = |side: &Side| compared(&base.side(), side);
    let copied = of(&base.side());
    let times: Vec<_> = copied.findings.iter().filter(|f| f.is_time).collect();
    assert!(!times.is_empty() && times.iter().all(|f| f.verdict == ChangeVerdict::Same));
    assert!(times.iter().all(|f| !f.is_control && f.measured.is_none()));
    // Too few cells for a drift; copied results are the same nevertheless.
    let few = Made {
        structures: 1,
        ..Made::default()
    };
    assert_eq!(
        compared(&few.side(), &few.side()).verdict(),
        ChangeVerdict::Same
    );
    // A candidate with all but one cell copied has one control.
    let later = Made {
        seed: 2,
        ..Made::default()
    };
    let mut lines = base.lines();
    for (line, other) in lines.iter_mut().zip(later.lines()) {
        if line.key.label("accel") == "structure-4" {
            *line = other;
        }
    }
    let found = of(&side(lines));
    let controls = found.findings.iter().filter(|f| f.is_control);
    let names: Vec<&str> = controls.map(|f| f.key.label("accel")).collect();
    assert!(!names.is_empty() && names.iter().all(|name| *name == "structure-4"));
}

#[test]
fn what_looks_slower_in_two_runs_is_to_be_measured_again() {
    let [base, candidate] = quiet(|structure| if structure == 8 { 1.3 } else { 1.0 });
    let found = compared(&base.side(), &candidate.side());
    let suspects: Vec<&str> = found.suspects().map(|f| f.key.label("accel")).collect();
    assert!(suspects.len() >= 2 && suspects.iter().all(|name| *name == "structure-8"));
}

#[test]
fn the_same_is_said_only_where_the_whole_interval_is_within_the_effect() {
    let pair = |seed| {
        let base = Made {
            seed,
            noise: SHARED,
            ..Made::default()
        };
        let candidate = Made {
            seed: seed + 100,
            machine: seed + 100,
            candidate: true,
            ..base.clone()
        };
        compared(&base.side(), &candidate.side()).findings
    };
    let mut open = 0;
    for finding in (1..20).flat_map(pair).filter(|f| !f.is_control) {
        let Some(measured) = finding.measured else {
            continue;
        };
        let (change, margin) = (measured.change, measured.margin);
        let within = change.low > -margin && change.high < margin;
        open += usize::from(!within && change.value.abs() < margin);
        assert!(
            within || finding.verdict != ChangeVerdict::Same,
            "{finding:?}"
        );
    }
    assert!(open > 10, "only {open} of small value and wide interval");
}

#[test]
fn times_of_another_machine_are_refused_even_where_controls_tell_its_drift() {
    let [base, candidate] = quiet(|structure| if structure == 8 { 1.3 } else { 1.0 });
    let mut lines = candidate.lines();
    if let Body::Run(record) = &mut lines[0].body {
        record.environment.cpu = "Another Processor".into();
    }
    let found = compared(&base.side(), &side(lines));
    let mut of_time = found.findings.iter().filter(|f| f.is_time);
    assert!(of_time.all(|f| f.verdict == ChangeVerdict::Undecided && f.measured.is_none()));
}

#[test]
fn another_default_under_the_same_label_is_other_work() {
    let with_leaves = |size: i64| {
        let value = ("leaf_size".to_owned(), ParamValue::Integer(size));
        let variant = Variant {
            name: "structure-3".into(),
            params: Params([value].into()),
            label: "structure-3".into(),
        };
        let mut lines = Made::default().lines();
        for line in &mut lines {
            if line.key.label("accel") == "structure-3" {
                line.key = line.key.clone().with_variant("accel", &variant);
            }
        }
        side(lines)
    };
    let found = compared(&with_leaves(4), &with_leaves(8));
    let told: Vec<_> = found
        .findings
        .iter()
        .filter(|f| f.verdict != ChangeVerdict::Same)
        .collect();
    assert!(told.len() > 5);
    for finding in told {
        assert_eq!(finding.verdict, ChangeVerdict::Undecided, "{finding:?}");
        assert!(
            finding.why.contains("leaf_size was 4 and is 8"),
            "{}",
            finding.why
        );
    }
}

#[test]
fn a_cell_that_fails_now_is_worse_and_one_that_failed_before_is_better() {
    let sound = Made::default().lines();
    let mut failing = sound.clone();
    let failed = SkippedRecord {
        cell: "box, structure-3".into(),
        reason: "out of memory".into(),
    };
    failing.insert(2, Line::about_all(Body::Failed(failed)));
    for (base, candidate, verdict) in [
        (&sound, &failing, ChangeVerdict::Worse),
        (&failing, &sound, ChangeVerdict::Better),
    ] {
        let found = compared(&side(base.clone()), &side(candidate.clone()));
        let said: Vec<_> = said(&found, "cell/v1").map(|f| f.verdict).collect();
        assert_eq!((said, found.verdict()), (vec![verdict], verdict));
    }
}

#[test]
fn what_was_measured_once_is_told_and_decides_nothing() {
    let base = Made::default();
    let mut lines = base.lines();
    for line in &mut lines {
        if let Body::Structure(record) = &mut line.body {
            record.build_ms *= 10.0;
            record.build.iter_mut().for_each(|step| step.ms *= 10.0);
        }
    }
    let found = compared(&base.side(), &side(lines));
    assert!(said(&found, "build-ms/v1").count() == 12);
    assert!(said(&found, "build-ms/v1").all(|f| f.verdict == ChangeVerdict::Told));
    assert_eq!(found.verdict(), ChangeVerdict::Same);
}

fn seeds(first: u32, values: [f64; 8]) -> Evidence {
    Evidence::Seeds {
        values: (first..).zip(values).collect(),
        reference: String::new(),
    }
}

#[test]
fn errors_against_other_references_are_paired_by_nothing() {
    let error = figure("relmse-unbiased/v1");
    let values = [1.0, 1.1, 0.9, 1.05, 0.95, 1.02, 0.98, 1.0];
    let base = seeds(1, values);
    let slightly = |first| seeds(first, values.map(|x| 1.01 * x));
    let outcome = |other: &Evidence| compare(error, &base, other, &Effects::default());
    let Outcome::Tested(pairs) = outcome(&slightly(1)) else {
        panic!("equal seeds are pairs");
    };
    // The interval is that of the signed ranks at the stated level.
    let gaps = values.map(|x| 0.01 * x / (values.iter().sum::<f64>() / 8.0));
    let [low, high] = SignedRank::new(&gaps).expect("a test").interval(0.05);
    assert!((pairs.change.low - low).abs() < 1e-9 && (pairs.change.high - high).abs() < 1e-9);
    let Outcome::Tested(samples) = outcome(&slightly(9)) else {
        panic!("other seeds are two samples");
    };
    assert!(samples.p > 0.5 && pairs.p < 0.01, "{samples:?} {pairs:?}");
    for first in [1, 9] {
        let Evidence::Seeds { values, .. } = slightly(first) else {
            unreachable!("seeds");
        };
        let reference = "another".to_owned();
        let other = outcome(&Evidence::Seeds { values, reference });
        assert!(
            matches!(other, Outcome::Known(ChangeVerdict::Undecided, _)),
            "{other:?}"
        );
    }
}

#[test]
fn rounds_of_one_process_are_compared_round_by_round() {
    let times = |factor: f64| Evidence::Times {
        adapter: [1.0, 2.0, 1.5, 3.0, 1.2, 2.5, 1.1, 1.9]
            .map(|ms| factor * ms)
            .into(),
        processors: Vec::new(),
    };
    let ratio =
        |in_rounds| TimeRatio::new(&times(1.0), &times(1.05), in_rounds, 1).expect("a ratio");
    let (together, apart) = (ratio(true).rounds.variance, ratio(false).rounds.variance);
    assert!(together < 1e-20 && apart > 1e-3, "{together} {apart}");
}

/// Three compilations per side, each with equal rounds, give three observations, not 21.
#[test]
fn rounds_of_one_compilation_are_one_observation() {
    let times = |of: [f64; 3]| Evidence::Times {
        adapter: (0..21).map(|r| of[r % 3]).collect(),
        processors: Vec::new(),
    };
    let (base, candidate) = (times([1.0; 3]), times([1.1f64, 1.0, 1.0 / 1.1]));
    let ratio = TimeRatio::new(&base, &candidate, true, 3).expect("a ratio");
    // Logarithms x, 0 and -x have variance x², their mean a third of it.
    let wanted = 1.1f64.ln().powi(2) / 3.0;
    assert!((ratio.rounds.variance - wanted).abs() < 1e-12, "{ratio:?}");
    assert_eq!(ratio.rounds.freedom, 2.0);
    let alone = TimeRatio::new(&base, &candidate, true, 1).expect("a ratio");
    assert!(alone.rounds.variance < 0.5 * wanted, "{alone:?}");
    // No run writes this many.
    let many = TimeRatio::new(&base, &candidate, true, usize::MAX).expect("a ratio");
    assert_eq!(many.rounds, alone.rounds);
}

#[test]
fn drift_is_that_of_the_scene_or_of_all_whichever_moved_more_and_leaves_the_cell_itself_out() {
    let place = |scene: &str| Place {
        figure: "speed".into(),
        scene: scene.into(),
        clock: "adapter time",
    };
    let with = |controls: &[(&str, f64)]| {
        let mut drift = Drift::default();
        for (scene, log) in controls {
            drift.add(place(scene), *log, 1e-6);
        }
        drift
    };
    let variance = |drift: &Drift, scene: &str, rounds: f64, itself: Option<f64>| {
        Some(drift.of(&place(scene), rounds, itself)?.variance)
    };
    let calm_here = [
        ("a", 0.01),
        ("a", -0.01),
        ("a", 0.01),
        ("b", 0.1),
        ("b", -0.1),
        ("b", 0.1),
    ];
    let drift = with(&calm_here);
    // The scene itself is calm and the whole is not; and vice versa.
    let all = (3.0 * 1e-4 + 3.0 * 1e-2) / 6.0;
    assert!((variance(&drift, "a", 1e-6, None).expect("known") - all).abs() < 1e-12);
    assert!((variance(&drift, "b", 1e-6, None).expect("known") - 1e-2).abs() < 1e-12);
    // Rounds noisier than the controls' count by the excess.
    let noisy = variance(&drift, "b", 1e-3, None).expect("known");
    assert!((noisy - (1e-2 + 1e-3 - 1e-6)).abs() < 1e-12);
    // Fewer than three controls are inconclusive, and nothing is its own control.
    assert_eq!(variance(&with(&calm_here[..2]), "a", 1e-6, None), None);
    assert_eq!(
        variance(&with(&calm_here[..3]), "a", 1e-6, Some(0.01)),
        None
    );
}

#[test]
fn what_is_no_number_any_more_is_open_and_a_base_of_zero_hides_nothing() {
    let cost = figure("sah-cost/v1");
    let allowed = Effects {
        exact: 0.5,
        ..Effects::default()
    };
    let verdict =
        |a: f64, b: f64| match compare(cost, &Evidence::Exact(a), &Evidence::Exact(b), &allowed) {
            Outcome::Known(verdict, _) => verdict,
            Outcome::Tested(_) => panic!("nothing is tested"),
        };
    for (a, b, wanted) in [
        (1.0, f64::NAN, ChangeVerdict::Undecided),
        (1.0, f64::INFINITY, ChangeVerdict::Undecided),
        (f64::NAN, 1.0, ChangeVerdict::Undecided),
        (f64::INFINITY, f64::INFINITY, ChangeVerdict::Same),
        (0.0, 1e-9, ChangeVerdict::Worse),
        (0.0, -1e-9, ChangeVerdict::Better),
        (-2.0, -1.0, ChangeVerdict::Same),
        (-1.0, -2.0, ChangeVerdict::Better),
        // Half of the base, not of the candidate.
        (2.0, 3.0, ChangeVerdict::Same),
        (2.0, 3.1, ChangeVerdict::Worse),
        (3.0, 1.4, ChangeVerdict::Better),
    ] {
        assert_eq!(verdict(a, b), wanted, "{a} {b}");
    }
}
