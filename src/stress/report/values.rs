//! What the suite's records say, figure by figure.

use crate::measure::record::axis;
use crate::report::values::Value;
use crate::stress::record::{CellRecord, Line, Quantiles, Record};

/// Everything that the suite found.
pub fn values(lines: &[Line]) -> Vec<Value<'static>> {
    lines.iter().flat_map(of_line).collect()
}

/// What one line says.
pub(super) fn of_line(line: &Line) -> Vec<Value<'static>> {
    let known = |figures: &[(&str, Option<f64>)]| Value::known(&line.key, figures.iter().copied());
    let count = |n: usize| Some(n as f64);
    match &line.body {
        Record::Cell(cell) => known(&of_cell(cell)),
        Record::Shots(r) => {
            let sound = |n: usize| count(n).filter(|_| r.failure.is_none());
            known(&[
                ("rays/v1", count(r.rays)),
                ("misses/v1", sound(r.misses)),
                ("confirmed-misses/v1", sound(r.confirmed)),
            ])
        }
        Record::BoxTest(r) => known(&[
            ("pad-ulps/v1", Some(f64::from(r.pad_ulps))),
            ("rays/v1", count(r.rays)),
            ("lost-hits/v1", count(r.lost)),
        ]),
        Record::Offset(r) => known(&[
            ("rays/v1", count(r.rays)),
            ("self-intersections/v1", count(r.self_intersections)),
            ("leaks/v1", count(r.leaks)),
            ("farthest-begin/v1", Some(r.farthest)),
        ]),
        Record::Cost(r) => known(&[
            ("test-bytes/v1", Some(f64::from(r.bytes))),
            ("ns-per-test/v1", Some(r.ns_per_test)),
            ("traversal-ratio/v1", Some(r.traversal_ratio)),
            ("tests-per-ray/v1", Some(r.tests_per_ray)),
        ]),
        Record::Figure(r) => {
            let key = line.key.clone().with(axis::SUBJECT, &r.name);
            let figures = [("numerics/v1", Some(r.value)), ("alarm/v1", r.alarm)];
            let mut values = Value::known(&key, figures);
            values[0].figure.to_mut().unit = r.unit.clone().into();
            values
        }
        Record::Suite(_) | Record::Target(_) | Record::Skipped(_) | Record::Finished { .. } => {
            Vec::new()
        }
    }
}

fn of_cell(cell: &CellRecord) -> [(&'static str, Option<f64>); 15] {
    let count = |n: usize| Some(n as f64);
    let p99 = |quantiles: Option<Quantiles>| quantiles.map(|q| q.p99);
    [
        ("rays/v1", count(cell.rays)),
        ("false-misses/v1", count(cell.false_misses)),
        ("unexplained-misses/v1", count(cell.unexplained_misses)),
        ("cracks/v1", count(cell.cracks)),
        ("false-hits/v1", count(cell.false_hits)),
        ("unexplained-hits/v1", count(cell.unexplained_hits)),
        ("wrong-triangle/v1", count(cell.wrong_triangle)),
        ("not-nearest/v1", count(cell.not_nearest)),
        ("borderline/v1", count(cell.borderline)),
        ("differing/v1", count(cell.differing)),
        ("any-differing/v1", cell.any_differing.and_then(count)),
        ("ties/v1", count(cell.ties)),
        ("slowdown/v1", cell.slowdown),
        ("t-ulp-p99/v1", p99(cell.t_ulp)),
        ("point-ulp-p99/v1", p99(cell.point_ulp)),
    ]
}
