//! JUnit XML (as Jenkins, GitLab and `junitparser` read it): gates, judged paths, checks and cells as test cases.

use super::{Exported, Source};
use crate::data::{Measured, SceneGroup};
use crate::sections::belief::checks;
use raystone_core::text::escape::xml as escape;
use raystone_record::{PathsRecord, Recorded, StructureRecord, Verdict, axis};
use std::fmt::Write as _;

/// How a case ended.
enum Outcome {
    Passed,
    Failed(String),
    Skipped(String),
}

struct Case {
    name: String,
    outcome: Outcome,
}

struct Suite {
    name: String,
    cases: Vec<Case>,
}

pub(super) fn write(source: &Source) -> Exported {
    let mut suites: Vec<Suite> = source.data.scenes.iter().map(gates).collect();
    suites.push(suite("paths", source.data.paths.iter().map(paths)));
    let all_checks = checks(&source.data).into_iter();
    suites.push(suite(
        "checks",
        all_checks.map(|check| case(check.title, check.verdict, check.detail)),
    ));
    suites.push(cells(source));
    suites.retain(|suite| !suite.cases.is_empty());
    let name = source.run().map_or("raystone", |run| &run.name);
    let time = source.data.finished.map(|finished| finished.wall_s);
    Exported::whole(xml(name, time, &suites))
}

fn suite(name: &str, cases: impl Iterator<Item = Case>) -> Suite {
    Suite {
        name: name.to_owned(),
        cases: cases.collect(),
    }
}

fn case(name: impl Into<String>, verdict: Verdict, detail: String) -> Case {
    Case {
        name: name.into(),
        outcome: match verdict {
            Verdict::Pass => Outcome::Passed,
            Verdict::Fail => Outcome::Failed(detail),
            Verdict::Open => Outcome::Skipped(detail),
        },
    }
}

/// A case for each structure and class of rays of a scene, and one for each structure as a whole.
fn gates(scene: &SceneGroup) -> Suite {
    let of_structure = |s: &Measured<StructureRecord>| {
        let (Some(gate), true) = (&s.gate, s.failure.is_none()) else {
            let why = s.fault().unwrap_or_default();
            let outcome = match s.refused {
                true => Outcome::Skipped(why),
                false => Outcome::Failed(why),
            };
            let name = s.key.to_string();
            return vec![Case { name, outcome }];
        };
        let of_class = gate.classes.iter().map(|class| {
            let rays = class.class.name();
            let first = class.first_wrong.clone().unwrap_or_default();
            let detail = format!(
                "{} of {} rays differ; first: {first}",
                class.wrong, class.rays
            );
            let verdict = Verdict::new(class.rays > 0, class.wrong > 0);
            case(
                s.key.clone().with(axis::RAYS, rays).to_string(),
                verdict,
                detail,
            )
        });
        let whole = Verdict::new(true, !gate.passed);
        let whole = case(s.key.to_string(), whole, s.fault().unwrap_or_default());
        of_class.chain([whole]).collect()
    };
    let cases = scene.structures.iter().flat_map(of_structure);
    suite(&format!("gate: {}", scene.name), cases)
}

fn paths(paths: &Recorded<PathsRecord>) -> Case {
    let detail = paths.fault.clone().or_else(|| paths.not_judged.clone());
    case(
        paths.key.to_string(),
        paths.verdict(),
        detail.unwrap_or_default(),
    )
}

/// Cells without figures, and whether the run came to its end.
fn cells(source: &Source) -> Suite {
    let data = &source.data;
    let failed = data.failures().into_iter().map(|(name, why)| Case {
        name: name.to_owned(),
        outcome: Outcome::Failed(why.to_owned()),
    });
    let skipped = data.skipped.iter().map(|cell| Case {
        name: cell.cell.clone(),
        outcome: Outcome::Skipped(cell.reason.clone()),
    });
    let end = match (data.finished, data.interrupted) {
        (Some(_), _) => Outcome::Passed,
        (None, Some(early)) => Outcome::Failed(format!("ended early: {}", early.reason)),
        (None, None) => Outcome::Failed("the records have no last line".into()),
    };
    let name = "the run came to its end".to_owned();
    let end = Case { name, outcome: end };
    suite("cells", failed.chain(skipped).chain([end]))
}

fn xml(name: &str, time: Option<f64>, suites: &[Suite]) -> String {
    let time = time.map_or(String::new(), |seconds| format!(" time=\"{seconds}\""));
    let all = suites.iter().flat_map(|suite| &suite.cases);
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"{}\"{}{time}>\n",
        escape(name),
        counts(all)
    );
    for suite in suites {
        let suite_name = escape(&suite.name);
        let counts = counts(suite.cases.iter());
        let _ = writeln!(text, "  <testsuite name=\"{suite_name}\"{counts}>");
        for case in &suite.cases {
            let name = escape(&case.name);
            let _ = write!(
                text,
                "    <testcase classname=\"{suite_name}\" name=\"{name}\""
            );
            let _ = match &case.outcome {
                Outcome::Passed => writeln!(text, "/>"),
                Outcome::Failed(why) => writeln!(
                    text,
                    ">\n      <failure message=\"{0}\">{0}</failure>\n    </testcase>",
                    escape(why)
                ),
                Outcome::Skipped(why) => writeln!(
                    text,
                    ">\n      <skipped message=\"{}\"/>\n    </testcase>",
                    escape(why)
                ),
            };
        }
        text += "  </testsuite>\n";
    }
    text + "</testsuites>\n"
}

fn counts<'a>(cases: impl Iterator<Item = &'a Case>) -> String {
    let (mut tests, mut failures, mut skipped) = (0, 0, 0);
    for case in cases {
        tests += 1;
        match case.outcome {
            Outcome::Passed => {}
            Outcome::Failed(_) => failures += 1,
            Outcome::Skipped(_) => skipped += 1,
        }
    }
    format!(" tests=\"{tests}\" failures=\"{failures}\" errors=\"0\" skipped=\"{skipped}\"")
}
