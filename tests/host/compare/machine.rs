//! Effects of the machine: controls, places, rounds of one process, and repeated measurements.

use super::records::{Made, QUIET, SHARED};
use super::{compared, said};
use raystone::compare::judge::{ChangeVerdict, IN_TURNS, TimeRatio};
use raystone::compare::side::{Side, differences};
use raystone::compare::taken::taken;
use raystone::compare::{Comparison, Confirmed, Finding, Options, compare_sides};
use raystone::measure::record::Environment;
use raystone::measure::record::{Body, Line, Ran};

fn side(lines: Vec<Line>) -> Side {
    Side::new("made", lines, Vec::new())
}

/// Two runs; kernels differ in the second half of the structures, one slower by this factor.
fn pair(noise: super::records::Noise, slower: fn(usize) -> f64) -> [Made; 2] {
    let base = Made {
        rounds: 21,
        noise,
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

fn times<'f>(found: &'f Comparison, structure: &str) -> Vec<&'f Finding> {
    let of = |f: &&Finding| f.is_time && f.key.label("accel") == structure;
    found.findings.iter().filter(of).collect()
}

#[test]
fn every_part_of_the_place_counts() {
    let base = Environment::default();
    let text = || "another".to_owned();
    let others = [
        (
            "adapter",
            Environment {
                adapter: text(),
                ..base.clone()
            },
        ),
        (
            "backend",
            Environment {
                backend: text(),
                ..base.clone()
            },
        ),
        (
            "driver",
            Environment {
                driver: text(),
                ..base.clone()
            },
        ),
        (
            "driver version",
            Environment {
                driver_info: text(),
                ..base.clone()
            },
        ),
        (
            "type of device",
            Environment {
                device_type: text(),
                ..base.clone()
            },
        ),
        (
            "limit of loops",
            Environment {
                loop_limit: Some(1000),
                ..base.clone()
            },
        ),
        (
            "system",
            Environment {
                os: text(),
                ..base.clone()
            },
        ),
        (
            "processor",
            Environment {
                cpu: text(),
                ..base.clone()
            },
        ),
        (
            "clock",
            Environment {
                timestamps: true,
                ..base.clone()
            },
        ),
        (
            "processor threads",
            Environment {
                cpu_threads: 3,
                ..base.clone()
            },
        ),
    ];
    for (name, other) in others {
        let names: Vec<_> = differences(&base, &other)
            .into_iter()
            .map(|d| d.0)
            .collect();
        assert_eq!(names, [name]);
    }
}

#[test]
fn times_without_a_place_or_of_several_are_refused() {
    let lines = Made {
        seed: 2,
        ..Made::default()
    }
    .lines();
    let [nowhere, base] = [lines[1..].to_vec(), Made::default().lines()];
    let mut merged = lines.clone();
    let mut other = lines[0].clone();
    if let Body::Run(record) = &mut other.body {
        record.environment.driver = "another".into();
    }
    merged.push(other);
    for (a, b, said) in [
        (&base, &nowhere, "one side does not say"),
        (&nowhere, &base, "one side does not say"),
        (&nowhere, &nowhere, "no record says"),
        (&base, &merged, "driver:  against another"),
        (&merged, &base, "driver:  against another"),
    ] {
        let found = compared(&side(a.clone()), &side(b.clone()));
        assert!(
            found.notes.iter().any(|n| n.contains(said)),
            "{said}: {:?}",
            found.notes
        );
        let mut times = found.findings.iter().filter(|f| f.is_time);
        assert!(times.all(|f| f.verdict == ChangeVerdict::Undecided && !f.is_control));
    }
}

#[test]
fn another_image_is_expected_of_another_device_alone() {
    let mut lines = Made::default().lines();
    for line in &mut lines {
        match &mut line.body {
            Body::Run(record) => record.environment.driver = "another".into(),
            Body::Error(record) => record.image_hash = "another".into(),
            _ => {}
        }
    }
    let found = compared(&Made::default().side(), &side(lines));
    let images: Vec<_> = said(&found, "image/v1").collect();
    assert_eq!(images.len(), 4);
    assert!(
        images
            .iter()
            .all(|f| f.verdict == ChangeVerdict::Changed && f.why.contains("another device"))
    );
}

#[test]
fn times_of_other_work_are_open_and_no_controls() {
    let mut lines = Made {
        seed: 2,
        ..Made::default()
    }
    .lines();
    for line in &mut lines {
        if let (Body::Structure(record), "structure-3") = (&mut line.body, line.key.label("accel"))
        {
            record.timings[0].rays = 999;
        }
    }
    let found = compared(&Made::default().side(), &side(lines));
    let open: Vec<_> = times(&found, "structure-3")
        .into_iter()
        .filter(|f| f.key.label("rays") == "primary")
        .collect();
    assert_eq!(open.len(), 1);
    assert!(
        open[0].verdict == ChangeVerdict::Undecided && open[0].why.contains("999 rays"),
        "{open:?}"
    );
    assert!(open[0].measured.is_none() && !open[0].is_control && !open[0].looks_worse);
}

#[test]
fn cells_without_a_hash_of_their_kernels_are_no_controls() {
    let without = |made: Made| {
        let mut lines = made.lines();
        lines.iter_mut().for_each(|line| line.ran = Ran::default());
        side(lines)
    };
    let found = compared(
        &without(Made::default()),
        &without(Made {
            seed: 2,
            ..Made::default()
        }),
    );
    assert!(found.findings.iter().all(|f| !f.is_control));
    let open = found.findings.iter().filter(|f| f.is_time);
    assert!(
        open.clone().count() == 24 && open.clone().all(|f| f.verdict == ChangeVerdict::Undecided)
    );
    assert!(
        open.clone()
            .all(|f| f.measured.is_none() && f.why.contains("without enough unchanged cells"))
    );
}

#[test]
fn other_work_in_one_scene_leaves_controls_in_another() {
    let of = |made: Made, changed: bool| {
        let mut lines = made.lines();
        let others: Vec<Line> = lines
            .iter()
            .filter(|line| line.key.label("scene") == "box")
            .cloned()
            .collect();
        lines.extend(others.into_iter().map(|mut line| {
            line.key = line.key.with("scene", "hall");
            match &mut line.body {
                Body::Structure(record) if changed => record.stats.sah_cost = Some(11.0),
                _ => {}
            }
            line
        }));
        side(lines)
    };
    let found = compared(
        &of(Made::default(), false),
        &of(
            Made {
                seed: 2,
                ..Made::default()
            },
            true,
        ),
    );
    let controls: Vec<bool> = times(&found, "structure-3")
        .iter()
        .map(|f| f.is_control)
        .collect();
    let scenes: Vec<&str> = times(&found, "structure-3")
        .iter()
        .map(|f| f.key.label("scene"))
        .collect();
    assert_eq!(controls.len(), 4);
    assert!(
        scenes
            .iter()
            .zip(controls)
            .all(|(scene, control)| control == (*scene == "box"))
    );
}

#[test]
fn a_control_that_moves_alone_is_open_and_all_others_are_the_same() {
    let [base, candidate] = pair(QUIET, |_| 1.0);
    let mut lines = candidate.lines();
    for line in &mut lines {
        if let (Body::Structure(record), "structure-2") = (&mut line.body, line.key.label("accel"))
        {
            let timing = &mut record.timings[0];
            timing
                .ms
                .iter_mut()
                .chain(&mut timing.cpu_ms)
                .for_each(|ms| *ms *= 3.0);
        }
    }
    let found = compared(&base.side(), &side(lines));
    let (mut open, mut same) = (0, 0);
    for finding in found.findings.iter().filter(|f| f.is_control) {
        match finding.verdict {
            ChangeVerdict::Undecided => open += 1,
            ChangeVerdict::Same => same += 1,
            other => panic!("{other:?}"),
        }
    }
    assert_eq!((open, same), (1, 11));
}

#[test]
fn rounds_of_one_process_need_no_controls_and_nothing_is_suspect() {
    let few = |candidate| Made {
        structures: 2,
        rounds: 21,
        noise: QUIET,
        candidate,
        slower: |_| 1.0,
        ..Made::default()
    };
    let slow = Made {
        slower: |_| 1.3,
        ..few(true)
    };
    let [mut base, mut candidate] = [few(false).side(), slow.side()];
    base.notes = vec!["a note".into()];
    let apart = compared(&base, &candidate);
    let open: Vec<_> = times(&apart, "structure-1");
    assert!(
        open.iter()
            .all(|f| f.measured.is_none() && f.why.contains("without enough unchanged cells")),
        "{open:?}"
    );
    assert!(apart.notes.contains(&"base: a note".to_owned()));
    (base.in_rounds, candidate.in_rounds) = (true, true);
    let found = compared(&base, &candidate);
    let worse = times(&found, "structure-1");
    assert_eq!(worse.len(), 2);
    assert!(
        worse
            .iter()
            .all(|f| f.verdict == ChangeVerdict::Worse && f.why.ends_with("the same rounds")),
        "{worse:?}"
    );
    assert_eq!(found.suspects().count(), 0);
    // Both sides come from one run, whose notes appear once.
    let notes: Vec<_> = found
        .notes
        .iter()
        .filter(|n| n.contains("a note"))
        .collect();
    assert_eq!(notes, ["a note"]);
}

#[test]
fn only_what_looks_slower_is_suspect() {
    let suspects = |slower| {
        let [base, candidate] = pair(QUIET, slower);
        let found = compared(&base.side(), &candidate.side());
        found
            .suspects()
            .map(|f| f.key.label("accel").to_owned())
            .collect::<Vec<_>>()
    };
    assert_eq!(
        suspects(|structure| if structure == 8 { 0.7 } else { 1.0 }),
        [""; 0]
    );
    assert_eq!(
        suspects(|structure| if structure == 8 { 1.3 } else { 1.0 }),
        ["structure-8"; 2]
    );
}

/// All times of these records measured again, with these ratios.
fn again(of: &Made, clock: &'static str, ratio: impl Fn(&str) -> f64) -> Confirmed {
    let all = taken(&of.side())
        .into_iter()
        .filter(|t| t.figure.id == "mrays-per-s/v1");
    let ratios = |by: f64| -> Vec<f64> {
        let noise = [1.0, 1.004, 0.997, 1.002, 0.999, 1.003, 0.996, 1.001, 0.998];
        noise.map(|x| by * x).into()
    };
    let pairs = all.map(|t| {
        let ratio = TimeRatio::of_rounds(&ratios(ratio(t.key.label("accel"))), clock);
        (t.identity(), ratio.expect("a ratio"))
    });
    pairs.collect()
}

#[test]
fn what_was_measured_again_replaces_the_two_runs() {
    let [base, candidate] = pair(SHARED, |structure| if structure == 8 { 1.5 } else { 1.0 });
    let found = |confirmed: &Confirmed| {
        compare_sides(
            &base.side(),
            &candidate.side(),
            &Options::default(),
            confirmed,
        )
    };
    let before = found(&Confirmed::new());
    assert!(before.suspects().count() > 0);
    // It was noise.
    let calm = found(&again(&base, "processor time", |_| 1.0));
    assert_eq!(calm.suspects().count(), 0);
    let again_the_same = times(&calm, "structure-8");
    assert!(!again_the_same.is_empty());
    for finding in again_the_same {
        assert_eq!(finding.verdict, ChangeVerdict::Same, "{finding:?}");
        assert!(
            finding.why.contains("the same rounds, widened")
                && finding.why.ends_with("side by side"),
            "{}",
            finding.why
        );
    }
    // It was not.
    let slow = found(&again(&base, "processor time", |name| {
        if name == "structure-8" { 1.5 } else { 1.0 }
    }));
    let slower = times(&slow, "structure-8");
    assert!(!slower.is_empty());
    assert!(
        slower
            .iter()
            .all(|f| f.verdict == ChangeVerdict::Worse && !f.looks_worse)
    );
    // Alternating programs have no controls: all may be slower.
    let turns = found(&again(&base, IN_TURNS, |_| 1.2));
    assert!(
        turns
            .findings
            .iter()
            .filter(|f| f.is_time)
            .all(|f| f.verdict == ChangeVerdict::Worse),
        "{:?}",
        turns.notes
    );
}

#[test]
fn a_base_that_was_cut_leaves_what_it_lacks_open() {
    let mut lines = Made::default().lines();
    lines.retain(|line| {
        line.key.label("accel") != "structure-3" && !matches!(line.body, Body::Finished(_))
    });
    let found = compared(&side(lines), &Made::default().side());
    assert_eq!(found.count(ChangeVerdict::New), 0);
    assert_eq!(found.verdict(), ChangeVerdict::Undecided);
    let open = found
        .findings
        .iter()
        .filter(|f| f.verdict == ChangeVerdict::Undecided);
    assert!(
        open.clone().count() > 10
            && open
                .clone()
                .all(|f| f.why.contains("the base did not reach its end"))
    );
}

#[test]
fn two_lines_on_one_thing_contradict_each_other_by_what_they_count() {
    type Change = fn(&mut Line);
    let contradicting: [(Change, &str, usize); 4] = [
        (
            |line| {
                if let Body::Structure(r) = &mut line.body {
                    r.stats.sah_cost = Some(12.51)
                }
            },
            "sah-cost/v1",
            12,
        ),
        (
            |line| {
                if let Body::Error(r) = &mut line.body {
                    r.image_hash = "another".into()
                }
            },
            "image/v1",
            4,
        ),
        (
            |line| {
                if let Body::Error(r) = &mut line.body {
                    r.errors[0].metrics.values_mut().for_each(|x| *x *= 1.01);
                }
            },
            "relmse-unbiased/v1",
            4,
        ),
        (
            |line| {
                if let Body::Stream(r) = &mut line.body {
                    r.star[0].value.value += 0.01
                }
            },
            "star-discrepancy/v1",
            4,
        ),
    ];
    let twice = |change: Change| {
        let mut lines = Made::default().lines();
        let mut others = lines.clone();
        others.iter_mut().for_each(change);
        others.retain(|line| !line.key.is_empty());
        lines.extend(others);
        compared(&Made::default().side(), &side(lines))
    };
    for (change, id, count) in contradicting {
        let found = twice(change);
        let open: Vec<_> = said(&found, id).collect();
        assert_eq!(open.len(), count, "{id}");
        assert!(
            open.iter().all(|f| f.why.contains("contradict themselves")),
            "{id}: {open:?}"
        );
    }
    // Times never repeat exactly.
    let found = twice(|line| {
        if let Body::Structure(record) = &mut line.body {
            record.build_ms *= 2.0;
            record
                .timings
                .iter_mut()
                .for_each(|t| t.cpu_ms.iter_mut().for_each(|ms| *ms *= 1.5));
        }
    });
    assert!(found.findings.iter().all(|f| !f.why.contains("contradict")));
}
