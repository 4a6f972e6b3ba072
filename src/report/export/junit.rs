//! JUnit XML (as Jenkins, GitLab and `junitparser` read it): gates, checked paths, checks and cells as test cases.

use super::{Exported, Source};
use crate::data::{Measured, RunData, SceneGroup};
use crate::document::Check;
use crate::sections::belief::checks;
use raystone_core::text::escape::xml as escape;
use raystone_record::{PathsRecord, Recorded, StructureRecord, Verdict, axis};

/// A name and cases: an open one is skipped.
type Suite = (String, Vec<Check>);

pub(super) fn write(source: &Source) -> Exported {
    let data = &source.data;
    let mut suites: Vec<Suite> = data.scenes.iter().map(gates).collect();
    suites.push(("paths".into(), data.paths.iter().map(paths).collect()));
    suites.push(("checks".into(), checks(data)));
    suites.push(("cells".into(), cells(data)));
    suites.retain(|(_, cases)| !cases.is_empty());
    let name = source.run().map_or("raystone", |run| &run.name);
    let time = data.finished.map(|finished| finished.wall_s);
    Exported::whole(xml(name, time, &suites))
}

fn case(title: impl Into<String>, verdict: Verdict, detail: impl Into<String>) -> Check {
    let (title, detail) = (title.into(), detail.into());
    Check {
        verdict,
        title,
        detail,
    }
}

/// Returns a case for each structure and class of rays of a scene, and one for each structure as a whole.
fn gates(scene: &SceneGroup) -> Suite {
    let of_structure = |s: &Measured<StructureRecord>| {
        let why = s.fault().unwrap_or_default();
        let (Some(gate), true) = (&s.gate, s.failure.is_none()) else {
            let verdict = Verdict::new(!s.refused, !s.refused);
            return vec![case(s.key.to_string(), verdict, why)];
        };
        let of_class = gate.classes.iter().map(|class| {
            let key = s.key.clone().with(axis::RAYS, class.class.name());
            let first = class.first_wrong.as_deref().unwrap_or_default();
            let (wrong, rays) = (class.wrong, class.rays);
            let detail = format!("{wrong} of {rays} rays differ; first: {first}");
            case(key.to_string(), Verdict::new(rays > 0, wrong > 0), detail)
        });
        let whole = case(s.key.to_string(), Verdict::new(true, !gate.passed), why);
        of_class.chain([whole]).collect()
    };
    let cases = scene.structures.iter().flat_map(of_structure);
    (format!("gate: {}", scene.name), cases.collect())
}

fn paths(paths: &Recorded<PathsRecord>) -> Check {
    let detail = paths.fault.clone().or_else(|| paths.not_judged.clone());
    case(
        paths.key.to_string(),
        paths.verdict(),
        detail.unwrap_or_default(),
    )
}

/// Returns cells without figures, and the end of the run as a case.
fn cells(data: &RunData) -> Vec<Check> {
    let failed = data.failures().into_iter();
    let failed = failed.map(|(name, why)| case(name, Verdict::Fail, why));
    let skipped = data.skipped.iter();
    let skipped = skipped.map(|cell| case(&*cell.cell, Verdict::Open, &*cell.reason));
    let (end, why) = match (data.finished, data.interrupted) {
        (Some(_), _) => (Verdict::Pass, String::new()),
        (None, Some(early)) => (Verdict::Fail, format!("ended early: {}", early.reason)),
        (None, None) => (Verdict::Fail, "the records have no last line".into()),
    };
    let end = case("the run came to its end", end, why);
    failed.chain(skipped).chain([end]).collect()
}

fn xml(name: &str, time: Option<f64>, suites: &[Suite]) -> String {
    let time = time.map_or(String::new(), |seconds| format!(" time=\"{seconds}\""));
    let all = counts(suites.iter().flat_map(|(_, cases)| cases));
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"{}\"{all}{time}>\n",
        escape(name)
    );
    for (name, cases) in suites {
        let (suite, counts) = (escape(name), counts(cases.iter()));
        text += &format!("  <testsuite name=\"{suite}\"{counts}>\n");
        for case in cases {
            let (name, why) = (escape(&case.title), escape(&case.detail));
            text += &format!("    <testcase classname=\"{suite}\" name=\"{name}\"");
            text += &match case.verdict {
                Verdict::Pass => "/>\n".to_owned(),
                Verdict::Fail => format!(
                    ">\n      <failure message=\"{why}\">{why}</failure>\n    </testcase>\n"
                ),
                Verdict::Open => {
                    format!(">\n      <skipped message=\"{why}\"/>\n    </testcase>\n")
                }
            };
        }
        text += "  </testsuite>\n";
    }
    text + "</testsuites>\n"
}

fn counts<'a>(cases: impl Iterator<Item = &'a Check> + Clone) -> String {
    let of = |verdict| cases.clone().filter(|case| case.verdict == verdict).count();
    let (tests, failures, skipped) = (cases.clone().count(), of(Verdict::Fail), of(Verdict::Open));
    format!(" tests=\"{tests}\" failures=\"{failures}\" errors=\"0\" skipped=\"{skipped}\"")
}
