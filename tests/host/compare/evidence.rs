//! Each kind of evidence: samples, intervals, facts and times, and how records are classified.

use super::records::Made;
use super::{compared, said};
use raystone::compare::drift::{Drift, Place};
use raystone::compare::judge::{ChangeVerdict, Effects, Measured, Outcome, TimeRatio, compare};
use raystone::compare::side::Side;
use raystone::compare::taken::{Evidence, taken};
use raystone::measure::figure::figure;
use raystone::measure::interval::Spread;
use raystone::measure::record::{Body, Interval, Line};

const ERROR: &str = "relmse-unbiased/v1";

fn outcome(id: &str, a: &Evidence, b: &Evidence) -> Outcome {
    compare(figure(id), a, b, &Effects::default())
}

fn tested(outcome: Outcome) -> Measured {
    match outcome {
        Outcome::Tested(measured) => measured,
        Outcome::Known(verdict, why) => panic!("{verdict:?}: {why}"),
    }
}

fn verdict(outcome: Outcome) -> ChangeVerdict {
    match outcome {
        Outcome::Known(verdict, _) => verdict,
        Outcome::Tested(measured) => panic!("{measured:?}"),
    }
}

fn seeds(first: u32, values: &[f64]) -> Evidence {
    Evidence::Seeds {
        values: (first..).zip(values.iter().copied()).collect(),
        reference: String::new(),
    }
}

#[test]
fn verdicts_and_hashes_know_a_failure_from_another_text() {
    let fact = |text: &str, fails| Evidence::Fact {
        text: text.into(),
        fails,
    };
    let of = |a: (&str, bool), b: (&str, bool)| {
        verdict(outcome(ERROR, &fact(a.0, a.1), &fact(b.0, b.1)))
    };
    assert_eq!(of(("PASS", false), ("3 wrong", true)), ChangeVerdict::Worse);
    assert_eq!(
        of(("3 wrong", true), ("PASS", false)),
        ChangeVerdict::Better
    );
    assert_eq!(of(("a", false), ("b", false)), ChangeVerdict::Changed);
    assert_eq!(
        of(("3 wrong", true), ("4 wrong", true)),
        ChangeVerdict::Changed
    );
    assert_eq!(of(("a", false), ("a", false)), ChangeVerdict::Same);
}

#[test]
fn differences_of_exponents_are_absolute_and_those_of_errors_parts_of_the_base() {
    let values = [-1.0, -1.1, -0.9, -1.05, -0.95, -1.02, -0.98, -1.0].map(|x| 5.0 * x);
    let less = values.map(|x| x - 0.1);
    let slope = tested(outcome(
        "relmse-slope/v1",
        &seeds(1, &values),
        &seeds(1, &less),
    ));
    assert!(
        (slope.change.value + 0.1).abs() < 1e-12 && slope.margin == 0.02,
        "{slope:?}"
    );
    let errors = values.map(|x| -x);
    let more = errors.map(|x| x + 0.1);
    let pairs = tested(outcome(ERROR, &seeds(1, &errors), &seeds(1, &more)));
    assert!(
        (pairs.change.value - 0.02).abs() < 1e-12 && pairs.margin == 0.005,
        "{pairs:?}"
    );
    // One image each has no spread.
    let one = |value| seeds(1, &[value]);
    assert_eq!(
        verdict(outcome(ERROR, &one(1.0), &one(2.0))),
        ChangeVerdict::Undecided
    );
    // With other seeds they are two samples, whose interval is also relative to the base.
    let larger = |scale: f64| {
        let [old, new] = [1.0, 1.1].map(|by| errors.map(|x| scale * by * x));
        tested(outcome(ERROR, &seeds(1, &old), &seeds(11, &new))).change
    };
    let (small, large) = (larger(1.0), larger(10.0));
    assert!((small.value - 0.1).abs() < 1e-12 && (large.high - small.high).abs() < 1e-12);
    assert!(small.low < small.value && small.high > small.value);
}

#[test]
fn intervals_without_samples_are_tested_by_their_widths() {
    let interval = |value, low, high| Evidence::Summary(Interval { value, low, high }, 8.0);
    let base = interval(10.0, 9.0, 11.0);
    let both = tested(outcome(ERROR, &base, &interval(11.0, 9.0, 13.0)));
    // Variances are as 1 to 4; Welch's freedom, 25 / (1/8 + 16/8), is capped at either side's.
    let half = 0.1 * 5f64.sqrt();
    assert!((both.change.value - 0.1).abs() < 1e-12, "{both:?}");
    assert!(
        (both.change.high - 0.1 - half).abs() < 1e-6,
        "{both:?} {half}"
    );
    assert_eq!(verdict(outcome(ERROR, &base, &base)), ChangeVerdict::Same);
    let exact = |value| interval(value, value, value);
    assert_eq!(
        verdict(outcome(ERROR, &exact(1.0), &exact(2.0))),
        ChangeVerdict::Undecided
    );
}

#[test]
fn swapping_the_sides_turns_the_difference_and_leaves_its_p() {
    let even = [
        1.0, 1.01, 0.99, 1.02, 0.98, 1.0, 1.01, 0.99, 1.0, 1.03, 0.97, 1.0,
    ];
    let few = [1.04, 1.05];
    let again = even.map(|x| 1.01 * x + 0.001 * f64::sin(37.0 * x));
    let interval = |value, half: f64, freedom| {
        let (low, high) = (value - half, value + half);
        Evidence::Summary(Interval { value, low, high }, freedom)
    };
    let kinds = [
        (seeds(1, &even), seeds(1, &again)),
        (seeds(1, &even), seeds(50, &few)),
        (interval(10.0, 1.0, 15.0), interval(12.0, 0.2, 1.0)),
    ];
    for (a, b) in kinds {
        let [there, back] = [outcome(ERROR, &a, &b), outcome(ERROR, &b, &a)].map(tested);
        assert!((there.p - back.p).abs() < 1e-12, "{there:?} {back:?}");
        assert!(there.change.value * back.change.value < 0.0);
    }
    let times = |ms: &[f64]| Evidence::Times {
        adapter: ms.to_vec(),
        processors: Vec::new(),
    };
    let apart = (times(&even), times(&[1.1, 1.12, 1.09, 1.1]));
    for ((a, b), in_rounds) in [((times(&even), times(&again)), true), (apart, false)] {
        for compilations in [1, 3] {
            let p = |a: &Evidence, b: &Evidence| {
                let ratio = TimeRatio::new(a, b, in_rounds, compilations).expect("a ratio");
                ratio.measured(figure("ms-per-spp/v1"), None, 0.02).p
            };
            assert!((p(&a, &b) - p(&b, &a)).abs() < 1e-12, "{a:?} {b:?}");
        }
    }
}

#[test]
fn two_replicates_against_sixteen_raise_no_more_alarms_than_promised_on_either_side() {
    let mut random = super::records::Random::new(5);
    let trials = 2000;
    let mut alarms = [0; 2];
    for _ in 0..trials {
        let mut of = |first: u32, n: u32| {
            let values: Vec<f64> = (0..n).map(|_| 1.0 + 0.1 * random.normal()).collect();
            seeds(first, &values)
        };
        let (few, many) = (of(1, 2), of(10, 16));
        for (count, (a, b)) in alarms.iter_mut().zip([(&few, &many), (&many, &few)]) {
            *count += usize::from(tested(outcome(ERROR, a, b)).p <= 0.05);
        }
    }
    println!("{alarms:?} of {trials}");
    assert!(
        alarms.iter().all(|count| *count <= trials * 6 / 100),
        "{alarms:?}"
    );
}

#[test]
fn times_are_by_the_processors_where_both_sides_have_them() {
    let times = |adapter: f64, processors: &[f64]| Evidence::Times {
        adapter: vec![adapter; 4],
        processors: processors.to_vec(),
    };
    let ratio = |a: &Evidence, b: &Evidence| TimeRatio::new(a, b, false, 1).expect("a ratio");
    let calm = times(2.0, &[1.0; 4]);
    let noisy = times(3.0, &[1.9, 2.0, 2.0, 2.2]);
    let both = ratio(&calm, &noisy);
    assert!((both.log - 2f64.ln()).abs() < 0.05, "{both:?}");
    assert!(both.clock.starts_with("processor time"));
    // The noise of either side is noise of the ratio.
    assert!(both.rounds.variance > 1e-5 && ratio(&noisy, &calm).rounds.variance > 1e-5);
    for (a, b) in [(&calm, &times(3.0, &[])), (&times(2.0, &[]), &noisy)] {
        let one = ratio(a, b);
        assert!(
            (one.log - 1.5f64.ln()).abs() < 1e-12 && one.clock == "adapter time",
            "{one:?}"
        );
    }
}

#[test]
fn rounds_that_contradict_each_other_are_no_difference() {
    let ratio = TimeRatio {
        log: 0.1,
        rounds: Spread {
            variance: 1e-8,
            freedom: 7.0,
        },
        by_round: vec![0.1, -0.1, 0.11, -0.11, 0.12, -0.12, 0.1, -0.09],
        clock: "",
    };
    let noise = Spread {
        variance: 1e-8,
        freedom: 8.0,
    };
    let time = ratio.measured(figure("ms-per-spp/v1"), Some(noise), 0.02);
    assert!(time.p > 0.3, "{}", time.p);
}

#[test]
fn drift_is_of_the_figure_and_its_own_cell_alone_is_left_out() {
    let place = |figure: &str, scene: &str| Place {
        figure: figure.into(),
        scene: scene.into(),
        clock: "adapter time",
    };
    let mut drift = Drift::default();
    let small = [0.01, 0.01, 0.01].map(|log| ("a", log)).into_iter();
    let all = [("b", 0.05), ("a", 0.05)].into_iter().chain(small);
    for (scene, log) in all.chain([("b", 0.001), ("b", 0.001), ("b", 0.001)]) {
        drift.add(place("speed", scene), log, 1e-4);
    }
    let found = |figure, rounds| drift.of(&place(figure, "a"), rounds, Some(0.05));
    // Of the other scene the same logarithm stays: (0.05² + 3 · 0.01² + 3 · 0.001²) / 7.
    let spread = found("speed", 1e-4).expect("enough");
    assert!(
        (spread.variance - 2.803e-3 / 7.0).abs() < 1e-9,
        "{spread:?}"
    );
    // Rounds calmer than the controls' subtract nothing.
    assert_eq!(found("speed", 0.0), found("speed", 1e-4));
    assert_eq!(found("time", 1e-4), None);
    let mut many = Drift::default();
    (0..20).for_each(|i| many.add(place("speed", "a"), -0.05 - 0.002 * f64::from(i), 1e-4));
    assert_eq!(
        many.of(&place("speed", "a"), 1e-4, None).map(|s| s.freedom),
        Some(8.0)
    );
    let words = many.words();
    assert!(
        words.len() == 1 && words[0].contains("of 20 cells") && words[0].contains("−8.4 to −4.9 %"),
        "{words:?}"
    );
}

fn with(change: impl Fn(&mut Line)) -> raystone::compare::Comparison {
    let base = Made::default();
    let mut lines = base.lines();
    lines.iter_mut().for_each(change);
    compared(&base.side(), &Side::new("made", lines, Vec::new()))
}

#[test]
fn an_error_is_that_of_its_count_of_samples_and_its_root_half_of_it() {
    let found = with(|line| {
        if let (Body::Error(record), "sequence-2") = (&mut line.body, line.key.label("sequence")) {
            let last = record.errors.last_mut().expect("errors");
            last.metrics.values_mut().for_each(|value| *value *= 1.05);
        }
    });
    for (id, change) in [(ERROR, 0.05), ("rmse-unbiased/v1", 1.05f64.sqrt() - 1.0)] {
        let worse: Vec<_> = said(&found, id).collect();
        assert_eq!(worse.len(), 1, "{worse:?}");
        assert_eq!(
            (worse[0].verdict, worse[0].key.label("spp")),
            (ChangeVerdict::Worse, "8")
        );
        let measured = worse[0].measured.expect("a difference");
        assert!(
            (measured.change.value - change).abs() < 0.003,
            "{id}: {measured:?}"
        );
    }
    // Errors fall with the square root of the samples, their squares with the samples.
    let all = taken(&Made::default().side());
    for (id, slope) in [("relmse-slope/v1", -1.0), ("rmse-slope/v1", -0.5)] {
        let of_it: Vec<_> = all.iter().filter(|t| t.figure.id == id).collect();
        assert_eq!(of_it.len(), 4);
        for taken in of_it {
            let Evidence::Seeds { values, .. } = &taken.evidence else {
                panic!("{:?}", taken.evidence);
            };
            let mean = values.iter().map(|(_, x)| x).sum::<f64>() / values.len() as f64;
            assert!((mean - slope).abs() < 0.1, "{id}: {mean}");
        }
    }
}

#[test]
fn errors_of_another_reference_or_resolution_are_open_and_their_order_is_nothing() {
    type Change = fn(&mut raystone::measure::record::ReferenceRecord);
    let changes: [Change; 4] = [
        |r| r.spp = 1024,
        |r| r.mean = 0.25,
        |r| r.mse = Some(2e-9),
        |r| r.file = Some("other.exr".into()),
    ];
    // Another draw of the noise, as from another reference.
    let other = Made {
        other_images: true,
        seed: 2,
        ..Made::default()
    };
    for change in changes {
        let mut lines = other.lines();
        lines.iter_mut().for_each(|line| {
            if let Body::Reference(record) = &mut line.body {
                change(record);
            }
        });
        let found = compared(
            &Made::default().side(),
            &Side::new("made", lines, Vec::new()),
        );
        let open: Vec<_> = said(&found, ERROR).collect();
        assert_eq!(open.len(), 16);
        assert!(
            open.iter()
                .all(|f| f.verdict == ChangeVerdict::Undecided
                    && f.why.contains("references differ"))
        );
    }
    let wide = with(|line| {
        if let Body::Error(record) = &mut line.body {
            record.resolution = [16, 8];
        }
    });
    assert!(
        said(&wide, ERROR).count() == 16
            && said(&wide, ERROR).all(|f| f.why.starts_with("other work"))
    );
    // All but the ends, which mark the beginning and end of a run.
    let mut turned = Made::default().lines();
    let last = turned.len() - 1;
    turned[1..last].reverse();
    let found = compared(
        &Made::default().side(),
        &Side::new("made", turned, Vec::new()),
    );
    assert_eq!(
        found.verdict(),
        ChangeVerdict::Same,
        "{:?}",
        found.findings[0]
    );
}

#[test]
fn random_point_sets_are_intervals_and_others_exact() {
    let lines = |shift: f64| {
        let mut lines = Made::default().lines();
        for line in &mut lines {
            if let Body::Stream(record) = &mut line.body {
                let value = record.star[0].value.value + shift;
                let random = line.key.label("sequence") == "sequence-0";
                let half = if random { 0.004 } else { 0.0 };
                record.star[0].value = Interval {
                    value,
                    low: value - half,
                    high: value + half,
                };
                (record.randomised, record.seeds) = (random, if random { 5 } else { 1 });
            }
        }
        Side::new("made", lines, Vec::new())
    };
    let star = |t: &&raystone::compare::taken::Taken| t.figure.id == "star-discrepancy/v1";
    let all = taken(&lines(0.0));
    let kinds: Vec<_> = all.iter().filter(star).map(|t| &t.evidence).collect();
    assert_eq!(kinds.len(), 4);
    let intervals = kinds
        .iter()
        .filter(|e| matches!(e, Evidence::Summary(_, freedom) if *freedom == 4.0));
    assert_eq!(intervals.count(), 1);
    let found = compared(&lines(0.0), &lines(0.0005));
    let verdicts: Vec<_> = said(&found, "star-discrepancy/v1")
        .map(|f| f.verdict)
        .collect();
    assert_eq!(
        verdicts,
        [
            ChangeVerdict::Worse,
            ChangeVerdict::Worse,
            ChangeVerdict::Worse,
            ChangeVerdict::Undecided
        ]
    );
}

#[test]
fn figures_that_follow_from_others_are_not_compared() {
    let side = Made::default().side();
    let data = raystone::report::data::RunData::new(&side.lines);
    let known: Vec<String> = raystone::report::values::values(&data)
        .iter()
        .map(|v| v.figure.id.to_string())
        .collect();
    let found = compared(&side, &side);
    for id in [
        "build-rate/v1",
        "bytes-per-triangle/v1",
        "references-per-triangle/v1",
    ] {
        assert!(known.iter().any(|known| known == id), "{known:?}");
        assert!(found.findings.iter().all(|f| f.figure.id != id), "{id}");
    }
}

#[test]
fn one_pixel_that_is_no_number_makes_a_run_worse() {
    let found = with(|line| {
        if let (Body::Error(record), "sequence-2") = (&mut line.body, line.key.label("sequence")) {
            record.non_finite_pixels = usize::from(record.replicate == 0);
        }
    });
    let worse: Vec<_> = said(&found, "finite/v1").collect();
    assert_eq!(worse.len(), 1, "{worse:?}");
    assert_eq!(worse[0].verdict, ChangeVerdict::Worse);
}
