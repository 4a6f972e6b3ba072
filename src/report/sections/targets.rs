//! An experiment's own targets, its `[[expect]]` without a thesis: each a check of the run.

use crate::data::RunData;
use crate::document::Check;
use crate::format;
use crate::repro::claim::{Context, Row, judge};
use crate::repro::judge::ClaimVerdict as Claimed;
use crate::values::{Value, values};
use raystone_config::expect::{Expect, Thesis};
use raystone_record::Verdict;
use raystone_record::figure::Spread;

/// Returns the targets of a run; none where its experiment has none.
pub(crate) fn checks(data: &RunData) -> Vec<Check> {
    let thesis = data.run.and_then(|run| {
        let thesis = Thesis::parse(&run.experiment_text, &run.experiment).ok()??;
        thesis.title.is_empty().then_some((run, thesis))
    });
    let Some((run, thesis)) = thesis else {
        return Vec::new();
    };
    let context = Context {
        software: run.environment.software,
        quick: thesis.quick.iter().all(|set| run.overrides.contains(set)),
        ..Context::default()
    };
    let is_left_out = |expect: &&Expect| {
        context.quick && !expect.at.is_empty() && expect.at.iter().all(|at| at.full_only)
    };
    let mut values = values(data);
    // A target is decided by the measured value, even if its spread is unknown.
    for value in &mut values {
        if value.figure.spread == Spread::Single {
            value.figure.to_mut().spread = Spread::Exact;
        }
    }
    let expects = thesis.expects.iter().filter(|expect| !is_left_out(expect));
    expects
        .map(|expect| check(data, expect, &values, &context))
        .collect()
}

/// Fails if one place contradicts it, and is open if none decides; shows the worst.
fn check(data: &RunData, expect: &Expect, values: &[Value], context: &Context) -> Check {
    let rows = judge(expect, values, context);
    let has = |verdict| rows.iter().any(|row| row.verdict == verdict);
    let verdict = Verdict::new(has(Claimed::Supported), has(Claimed::Contradicted));
    let known = rows.iter().filter_map(|row| Some((row, row.ours?.value)));
    // The farthest on the side of the bound.
    let is_bound_above = expect.most.is_some() || expect.at.iter().any(|at| at.most.is_some());
    let sign = if is_bound_above { 1.0 } else { -1.0 };
    let worst = known.max_by(|a, b| (sign * a.1).total_cmp(&(sign * b.1)));
    let detail = match (worst, rows.first()) {
        (Some((row, value)), _) => {
            let found = format::number(value);
            let limit = row.reason.replacen("agrees:", "limit", 1);
            format!("{found}, {limit}{}", place(data, row, value))
        }
        // Something was measured, but nothing where it looks: it may be misspelt.
        (None, Some(row)) if values.iter().any(|v| v.figure.id == expect.figure) => {
            format!("not looked at: {}.", row.reason)
        }
        _ => "not looked at.".to_owned(),
    };
    Check {
        verdict,
        title: expect.says.clone(),
        detail,
    }
}

/// Returns the place of a finding, with the ray that shows it.
fn place(data: &RunData, row: &Row, value: f64) -> String {
    if value == 0.0 || row.row.is_empty() {
        return String::new();
    }
    let notes = data.measured.iter().flat_map(|cell| {
        let of = move |at| cell.key.clone().beside(at).to_string();
        cell.notes
            .iter()
            .map(move |note| (of(&note.at), &note.text))
    });
    let note = { notes }.find(|(of, _)| *of == row.row);
    let note = note.map_or(String::new(), |(_, text)| format!(": {text}"));
    format!(" ({}{note})", row.row)
}

#[cfg(test)]
mod tests {
    use super::*;
    use raystone_record::figure::{ALARMS, Figure, MISS_SHARE, MISSES, TRAVERSAL_RATIO};
    use raystone_record::{
        Body, Environment, Key, Line, MeasuredRecord, Note, Ran, Reading, RunRecord, axis,
    };

    const SUITE: &str = include_str!("../../../experiments/stress.toml");

    fn run(overrides: &[&str]) -> Line {
        let environment = serde_json::to_value(Environment::default()).expect("JSON");
        let record = serde_json::json!({
            "name": "stress", "experiment": "stress.toml", "experiment_text": SUITE, "started_unix_s": 0,
            "environment": environment, "renders_full_product": 0, "renders_planned": 0, "overrides": overrides,
        });
        let record: RunRecord = serde_json::from_value(record).expect("a record");
        Line::about_all(Body::Run(record))
    }

    fn measured(key: Key, readings: Vec<Reading>, notes: Vec<Note>) -> Line {
        let body = MeasuredRecord {
            measurement: "stress".into(),
            notes,
            ..MeasuredRecord::default()
        };
        Line::new(key, Ran::default(), Body::Measured(body)).with_readings(readings)
    }

    fn verdicts(lines: &[Line]) -> Vec<(String, Verdict, String)> {
        let checks = checks(&RunData::new(lines)).into_iter();
        checks.map(|c| (c.title, c.verdict, c.detail)).collect()
    }

    /// Shots that miss so often: at random and at edges where the mesh is modelled, and far from there.
    fn shots(misses: [f64; 3]) -> Line {
        let series = [
            ("ordinary", "random"),
            ("ordinary", "edges"),
            ("far (223423)", "random"),
        ];
        let readings = series
            .iter()
            .zip(misses)
            .flat_map(|((place, aim), misses)| {
                let at = Key::default().with(axis::PLACE, place).with(axis::AIM, aim);
                let figures: [(&Figure, f64); 2] =
                    [(&MISSES, misses), (&MISS_SHARE, misses / 1000.0)];
                figures.map(|(figure, value)| Reading::exact(figure, value).at(at.clone()))
            });
        measured(
            Key::default().with(axis::TRIANGLE, "watertight"),
            readings.collect(),
            Vec::new(),
        )
    }

    #[test]
    fn one_miss_fails_its_target_and_no_other() {
        let of = |misses| -> Vec<Verdict> {
            let found = verdicts(&[run(&[]), shots(misses)]);
            found[..3].iter().map(|(_, verdict, _)| *verdict).collect()
        };
        assert_eq!(of([0.0; 3]), [Verdict::Pass; 3]);
        for bad in 0..3 {
            let (mut misses, mut expected) = ([0.0; 3], [Verdict::Pass; 3]);
            misses[bad] = 1.0;
            expected[bad] = Verdict::Fail;
            assert_eq!(of(misses), expected);
        }
        let nothing = verdicts(&[run(&[])]);
        assert!(
            nothing
                .iter()
                .all(|(_, verdict, _)| *verdict == Verdict::Open)
        );
        assert!(
            nothing
                .iter()
                .all(|(.., detail)| detail.contains("not looked at"))
        );
    }

    #[test]
    fn a_target_that_is_missed_says_by_how_much_and_where() {
        let readings = |alarms| vec![Reading::exact(&ALARMS, alarms)];
        let key = Key::default().with(axis::INTEGRATOR, "stress:numerics");
        let note = Note {
            at: Key::default(),
            what: "ALARM".into(),
            text: "acos".into(),
        };
        let of = |alarms| {
            let lines = [
                run(&[]),
                measured(key.clone(), readings(alarms), vec![note.clone()]),
            ];
            let mut found = verdicts(&lines).into_iter();
            let found = found.find(|(title, ..)| title.contains("alarm level"));
            found.map(|(_, verdict, detail)| (verdict, detail))
        };
        assert_eq!(of(0.0).map(|found| found.0), Some(Verdict::Pass));
        let (verdict, detail) = of(2.0).expect("a target");
        assert_eq!(verdict, Verdict::Fail);
        assert!(
            detail.starts_with("2.00") && detail.contains("acos"),
            "{detail}"
        );
    }

    #[test]
    fn a_ratio_measured_once_is_held_by_its_value_and_a_short_run_leaves_it_out() {
        let of = |ratio, overrides: &[&str]| {
            let key = Key::default().with(axis::TRIANGLE, "watertight");
            let ratio = vec![Reading::exact(&TRAVERSAL_RATIO, ratio)];
            let mut found =
                verdicts(&[run(overrides), measured(key, ratio, Vec::new())]).into_iter();
            let found = found.find(|(title, ..)| title.contains("moeller-trumbore"));
            found.map(|(_, verdict, _)| verdict)
        };
        assert_eq!(of(1.1, &[]), Some(Verdict::Pass));
        assert_eq!(of(1.2, &[]), Some(Verdict::Fail));
        assert_eq!(of(1.2, &["stress.quick=true"]), None);
    }

    #[test]
    fn the_value_told_of_a_target_is_the_one_closest_to_missing_it() {
        let told = |bound: &str| {
            let text = format!(
                "[[expect]]\nid = \"ratio\"\nsays = \"a ratio\"\nfigure = \"{}\"\ncompare = \"bound\"\n{bound}\n",
                TRAVERSAL_RATIO.id
            );
            let mut lines = vec![run(&[])];
            if let Body::Run(run) = &mut lines[0].body {
                run.experiment_text = text;
            }
            for (test, ratio) in [("watertight", 3.0), ("pluecker", 1.0), ("bare", 2.0)] {
                let key = Key::default().with(axis::TRIANGLE, test);
                let ratio = vec![Reading::exact(&TRAVERSAL_RATIO, ratio)];
                lines.push(measured(key, ratio, Vec::new()));
            }
            let [(_, verdict, detail)] = &verdicts(&lines)[..] else {
                panic!("one target")
            };
            (*verdict, detail[..4].to_owned())
        };
        for (bound, verdict, value) in [
            ("least = 0.5", Verdict::Pass, "1.00"),
            ("least = 1.5", Verdict::Fail, "1.00"),
            ("most = 3.5", Verdict::Pass, "3.00"),
            ("most = 2.5", Verdict::Fail, "3.00"),
        ] {
            assert_eq!(told(bound), (verdict, value.to_owned()), "{bound}");
        }
    }
}
