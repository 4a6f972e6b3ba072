//! Exact figures, missing cells, other machines, broken files.

use super::records::{Made, environment};
use super::{compared, said};
use raystone::compare::judge::ChangeVerdict;
use raystone::compare::side::{Side, SideError};
use raystone::compare::{Comparison, Confirmed, Options, compare_sides};
use raystone::measure::record::{Body, Line, RecordError, text_of};

/// The comparison with a candidate whose records are changed only by `change`.
fn with(change: impl Fn(&mut Vec<Line>)) -> Comparison {
    let base = Made::default();
    let mut lines = base.lines();
    change(&mut lines);
    compared(&base.side(), &Side::new("made", lines, Vec::new()))
}

fn with_structure(change: impl Fn(&mut raystone::measure::record::StructureRecord)) -> Comparison {
    with(|lines| {
        let records = lines.iter_mut().filter_map(|line| match &mut line.body {
            Body::Structure(record) => Some(record),
            _ => None,
        });
        records.skip(3).take(1).for_each(&change);
    })
}

#[test]
fn equal_records_are_the_same() {
    let found = with(|_| ());
    assert_eq!(found.verdict(), ChangeVerdict::Same);
    assert!(found.count(ChangeVerdict::Same) > 100 && found.count(ChangeVerdict::Told) == 0);
    assert_eq!(found.findings.len(), found.count(ChangeVerdict::Same));
}

#[test]
fn a_counter_that_is_off_by_one_ray_is_worse_and_less_work_is_better() {
    for (part, verdict) in [
        (0.001, ChangeVerdict::Worse),
        (-0.001, ChangeVerdict::Better),
    ] {
        let found = with_structure(|record| {
            let counters = record.timings[1].counters.as_mut().expect("counters");
            counters.nodes += part;
        });
        let said: Vec<_> = said(&found, "nodes-per-ray/v1")
            .map(|f| f.verdict)
            .collect();
        assert_eq!(said, [verdict]);
        assert_eq!(found.count(verdict), 1);
    }
}

#[test]
fn one_wrong_hit_and_one_hit_more_are_worse() {
    let wrong = with_structure(|record| {
        let gate = record.gate.as_mut().expect("a gate");
        gate.classes[0].wrong = 1;
        gate.passed = false;
        record.timings.clear();
    });
    assert_eq!(wrong.verdict(), ChangeVerdict::Worse);
    assert!(said(&wrong, "gate/v1").any(|f| f.verdict == ChangeVerdict::Worse));
    // Figures lost with the correctness check are reported as missing, too.
    assert!(
        said(&wrong, "mrays-per-s/v1")
            .all(|f| f.verdict == ChangeVerdict::Undecided && f.why.contains("missing"))
    );
    for other in [0.749, 0.751] {
        let hits = with_structure(|record| record.timings[0].hit_fraction = other);
        assert!(said(&hits, "hit-share/v1").all(|f| f.verdict == ChangeVerdict::Worse));
        assert_eq!(hits.verdict(), ChangeVerdict::Worse);
    }
}

#[test]
fn another_image_and_another_discrepancy_are_told() {
    let image = with(|lines| {
        let error = lines.iter_mut().find_map(|line| match &mut line.body {
            Body::Error(record) => Some(record),
            _ => None,
        });
        error.expect("an error").image_hash = "another".into();
    });
    assert_eq!(
        (image.verdict(), image.count(ChangeVerdict::Worse)),
        (ChangeVerdict::Worse, 1)
    );
    let star = with(|lines| {
        let stream = lines.iter_mut().find_map(|line| match &mut line.body {
            Body::Stream(record) => Some(record),
            _ => None,
        });
        stream.expect("a stream").star[0].value =
            raystone::measure::record::Interval::exact(0.0101);
    });
    let said: Vec<_> = said(&star, "star-discrepancy/v1")
        .map(|f| f.verdict)
        .collect();
    assert_eq!(said, [ChangeVerdict::Worse]);
}

#[test]
fn a_missing_cell_is_named_and_a_new_one_is_no_fault() {
    let gone = with(|lines| lines.retain(|line| line.key.label("accel") != "structure-3"));
    assert_eq!(gone.verdict(), ChangeVerdict::Undecided);
    let missing = gone
        .findings
        .iter()
        .filter(|f| f.verdict == ChangeVerdict::Undecided);
    assert!(missing.clone().count() > 10);
    assert!(
        missing
            .clone()
            .all(|f| f.why == "missing in the candidate" && f.key.label("accel") == "structure-3")
    );
    let base = Made::default();
    let more = Made {
        structures: 13,
        ..base.clone()
    };
    let found = compared(&base.side(), &more.side());
    assert!(found.count(ChangeVerdict::New) > 10 && found.count(ChangeVerdict::Undecided) == 0);
}

#[test]
fn times_of_another_machine_are_refused_and_all_else_is_compared() {
    let found = with(|lines| {
        for line in lines.iter_mut() {
            if let Body::Run(record) = &mut line.body {
                record.environment.cpu = "Another Processor".into();
            }
            if let Body::Structure(record) = &mut line.body {
                record.stats.sah_cost = Some(13.0);
            }
        }
    });
    assert!(
        found
            .notes
            .iter()
            .any(|n| n.contains("processor: Some Processor against Another Processor")),
        "{:?}",
        found.notes
    );
    assert!(
        found
            .findings
            .iter()
            .filter(|f| f.is_time)
            .all(|f| f.verdict == ChangeVerdict::Undecided && f.measured.is_none())
    );
    assert!(said(&found, "sah-cost/v1").all(|f| f.verdict == ChangeVerdict::Worse));
    // If times do not decide, a refusal leaves nothing open.
    let base = Made::default();
    let mut other = base.side();
    if let Body::Run(record) = &mut other.lines[0].body {
        record.environment = raystone::measure::record::Environment {
            driver: "another".into(),
            ..environment()
        };
    }
    let options = Options {
        times_decide: false,
        ..Options::default()
    };
    assert_eq!(
        compare_sides(&base.side(), &other, &options, &Confirmed::new()).verdict(),
        ChangeVerdict::Same
    );
}

#[test]
fn other_scenes_rays_and_parameters_are_not_compared_as_if_they_were_the_same() {
    let scene = with(|lines| {
        if let Body::Scene(record) = &mut lines[1].body {
            record.scene_hash = "other".into();
        }
    });
    assert!(
        said(&scene, "nodes-per-ray/v1")
            .all(|f| f.verdict == ChangeVerdict::Undecided && f.why.contains("scene abc"))
    );
    assert_eq!(said(&scene, "nodes-per-ray/v1").count(), 24);
    let rays = with_structure(|record| record.timings[0].rays = 999);
    assert_eq!(said(&rays, "nodes-per-ray/v1").count(), 1);
    assert!(said(&rays, "nodes-per-ray/v1").all(|f| f.why.contains("999 rays")));
}

#[test]
fn records_that_contradict_themselves_are_named() {
    let found = with(|lines| {
        let is_third = |line: &&Line| line.key.label("accel") == "structure-3";
        let mut again = lines.iter().find(is_third).expect("a structure").clone();
        if let Body::Structure(record) = &mut again.body {
            record.stats.sah_cost = Some(11.0);
        }
        lines.push(again);
    });
    let said: Vec<_> = said(&found, "sah-cost/v1").collect();
    assert_eq!(said.len(), 1);
    assert!(
        said[0].verdict == ChangeVerdict::Undecided && said[0].why.contains("contradict"),
        "{said:?}"
    );
    // A repeated line is no contradiction.
    let twice = with(|lines| lines.extend(lines.clone()));
    assert_eq!(twice.verdict(), ChangeVerdict::Same);
}

fn of(found: &Comparison, figure: &str) -> usize {
    let is_it = |f: &&raystone::compare::Finding| f.figure.id == figure;
    found.findings.iter().filter(is_it).count()
}

#[test]
fn a_run_of_many_cells_whose_checks_failed_is_the_same_as_itself() {
    let mut lines = Made::default().lines();
    // Checks refer to it by order of appearance.
    for line in &mut lines {
        if let Body::Structure(record) = &mut line.body
            && ["structure-2", "structure-5"].contains(&line.key.label("accel"))
        {
            record.gate.as_mut().expect("a gate").passed = false;
            record.timings.clear();
        }
    }
    let done = lines.iter().find(|line| matches!(line.body, Body::Cell(_)));
    lines.push(done.expect("a finished cell").clone());
    let side = Side::new("made", lines, Vec::new());
    let found = compared(&side, &side.clone());
    assert!(of(&found, "check/v1") > 0);
    assert_eq!(found.verdict(), ChangeVerdict::Same, "{:?}", found.findings);
}

#[test]
fn cells_that_share_a_reference_say_its_error_once() {
    let mut lines = Made::default().lines();
    let of_samplers = lines
        .iter()
        .filter(|line| matches!(line.body, Body::Error(_)));
    let others = of_samplers.map(|line| {
        let mut other = line.clone();
        other.key = other.key.with("organisation", "multi-kernel");
        other
    });
    let others: Vec<Line> = others.collect();
    lines.extend(others);
    let side = Side::new("made", lines, Vec::new());
    let found = compared(&side, &side.clone());
    assert_eq!(of(&found, "reference-mse/v1"), 1);
    assert_eq!(found.verdict(), ChangeVerdict::Same, "{:?}", found.findings);
}

fn read(text: &str) -> Result<Side, SideError> {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("records.jsonl"), text).expect("written");
    Side::read(folder.path())
}

#[test]
fn cut_and_mixed_files_are_named() {
    let base = Made::default();
    let text = text_of(&base.lines()).expect("text");
    let cut = read(&text[..text.len() - 30]).expect("whole lines before");
    assert!(cut.notes[0].contains("cut off"), "{:?}", cut.notes);
    assert!(
        cut.notes[1].contains("did not reach its end"),
        "{:?}",
        cut.notes
    );
    let found = compared(&base.side(), &cut);
    assert!(
        found
            .notes
            .iter()
            .any(|note| note.starts_with("candidate: line")),
        "{:?}",
        found.notes
    );
    // Truncated in the middle, from a future version, and with an invalid number.
    let (first, rest) = text.split_at(400);
    let newer = text.replacen("raystone/3", "raystone/4", 1);
    let nan = text.replacen("\"sah_cost\":12.5", "\"sah_cost\":NaN", 1);
    let null = text.replacen("\"nodes\":20.0", "\"nodes\":null", 1);
    for (text, said) in [
        (format!("{first}\n{rest}"), "not a record"),
        (newer, "raystone/4"),
        (nan, "not a record"),
        (null, "not a record"),
    ] {
        let error = read(&text).expect_err("no side").to_string();
        assert!(error.contains(said), "{error}");
    }
    assert!(matches!(
        read(""),
        Err(SideError::Records(RecordError::NoRecords { .. }))
    ));
    let old =
        r#"{"schema":"raystone/1","hash":"","record":{"kind":"skipped","cell":"a","reason":"b"}}"#;
    let mixed = read(&format!("{old}\n{text}")).expect("both are read");
    assert!(
        mixed
            .notes
            .iter()
            .any(|n| n.starts_with("1 of ") && n.contains("older schema")),
        "{:?}",
        mixed.notes
    );
}

#[test]
fn two_sets_of_kernels_of_one_run_are_its_two_sides() {
    let base = Made::default();
    let idea = Made {
        candidate: true,
        ..base.clone()
    };
    let mut lines = base.lines();
    let of_idea = idea
        .lines()
        .into_iter()
        .filter(|line| matches!(line.body, Body::Structure(_) | Body::Error(_)));
    lines.extend(of_idea.map(|mut line| {
        line.key = line.key.with("kernels", "idea");
        line
    }));
    let run = Side::new("run", lines, Vec::new());
    assert_eq!(run.kernels(), ["embedded", "idea"]);
    let [a, b] = run.of_kernels(None).expect("two sides");
    assert!(a.in_rounds && b.lines.iter().all(|line| line.key.get("kernels").is_none()));
    let found = compared(&a, &b);
    assert_eq!(
        found.count(ChangeVerdict::Worse) + found.count(ChangeVerdict::Better),
        0,
        "{:?}",
        found.findings[0]
    );
    // Records of the idea come first where its gate failed: it is the candidate all the same.
    let mut turned = run.clone();
    turned.lines.reverse();
    assert_eq!(turned.kernels(), ["idea", "embedded"]);
    let names = |run: &Side| {
        let sides = run.of_kernels(None).expect("two sides");
        sides.map(|side| side.name.clone())
    };
    assert_eq!(names(&turned), names(&run));
    assert!(run.of_kernels(Some(["embedded", "other"])).is_err());
    assert!(
        base.side()
            .of_kernels(None)
            .expect_err("one set")
            .to_string()
            .contains("second run")
    );
}

#[test]
fn cells_that_failed_belong_to_their_kernels_alone() {
    let mut lines = Made::default().lines();
    for kernels in ["idea", "idea-2"] {
        let other = Made::default().lines().into_iter();
        let of_cells = other.filter(|line| {
            matches!(
                line.body,
                Body::Structure(_) | Body::Error(_) | Body::Stream(_)
            )
        });
        lines.extend(of_cells.map(|mut line| {
            line.key = line.key.with("kernels", kernels);
            line
        }));
    }
    let failed = |cell: &str| {
        let record = raystone::measure::record::SkippedRecord {
            cell: cell.into(),
            reason: "out of memory".into(),
        };
        Line::about_all(Body::Failed(record))
    };
    // One fails only with the new kernels, one with all.
    lines.extend(
        [
            "box, grid, @idea-2",
            "box, bvh",
            "box, bvh, @idea",
            "box, bvh, @idea-2",
        ]
        .map(failed),
    );
    let run = Side::new("run", lines, Vec::new());
    for (kernels, worse) in [("idea", 0), ("idea-2", 1)] {
        let [a, b] = run
            .of_kernels(Some(["embedded", kernels]))
            .expect("two sides");
        let found = compared(&a, &b);
        let names: Vec<_> = said(&found, "cell/v1")
            .map(|f| f.key.label("subject"))
            .collect();
        assert_eq!(names, ["box, grid"; 1][..worse], "{:?}", found.findings[0]);
        assert_eq!(found.count(ChangeVerdict::Worse), worse);
    }
}

#[test]
fn a_run_of_other_kernels_alone_is_compared_cell_by_cell() {
    let base = Made::default();
    let mut lines = base.lines();
    let of_cells = |line: &&mut Line| {
        matches!(
            line.body,
            Body::Structure(_) | Body::Error(_) | Body::Stream(_)
        )
    };
    for line in lines.iter_mut().filter(of_cells) {
        line.key = line.key.clone().with("kernels", "idea");
    }
    let idea = Side::new("idea", lines, Vec::new()).alone();
    let named = |line: &Line| !line.key.label("kernels").is_empty();
    assert!(!idea.lines.iter().any(named) && !idea.in_rounds);
    let found = compared(&base.side().alone(), &idea);
    assert!(
        found.findings.len() > 20,
        "{} findings",
        found.findings.len()
    );
    assert_eq!(found.findings.len(), found.count(ChangeVerdict::Same));
}
