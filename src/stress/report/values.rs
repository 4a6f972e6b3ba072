//! What the suite's records say, figure by figure.

use crate::measure::record::axis;
use crate::report::values::Value;
use crate::stress::record::{CellRecord, Line, Quantiles, Record};

/// Everything that the suite found.
pub fn values(lines: &[Line]) -> Vec<Value<'static>> {
    let mut values = Vec::new();
    for line in lines {
        let key = &line.key;
        let mut add = |id: &str, value: f64| values.push(Value::exact(key, id, value));
        match &line.body {
            Record::Cell(cell) => of_cell(cell, add),
            Record::Shots(r) => {
                add("rays/v1", r.rays as f64);
                if r.failure.is_none() {
                    add("misses/v1", r.misses as f64);
                    add("confirmed-misses/v1", r.confirmed as f64);
                }
            }
            Record::BoxTest(r) => {
                add("pad-ulps/v1", f64::from(r.pad_ulps));
                add("rays/v1", r.rays as f64);
                add("lost-hits/v1", r.lost as f64);
            }
            Record::Offset(r) => {
                add("rays/v1", r.rays as f64);
                add("self-intersections/v1", r.self_intersections as f64);
                add("leaks/v1", r.leaks as f64);
                add("farthest-begin/v1", r.farthest);
            }
            Record::Cost(r) => {
                add("test-bytes/v1", f64::from(r.bytes));
                add("ns-per-test/v1", r.ns_per_test);
                add("traversal-ratio/v1", r.traversal_ratio);
                add("tests-per-ray/v1", r.tests_per_ray);
            }
            Record::Figure(r) => {
                let key = key.clone().with(axis::SUBJECT, &r.name);
                let mut value = Value::exact(&key, "numerics/v1", r.value);
                value.figure.to_mut().unit = r.unit.clone().into();
                values.push(value);
                values.extend(r.alarm.map(|alarm| Value::exact(&key, "alarm/v1", alarm)));
            }
            Record::Suite(_) | Record::Target(_) | Record::Skipped(_) | Record::Finished { .. } => {
            }
        }
    }
    values
}

fn of_cell(cell: &CellRecord, mut add: impl FnMut(&str, f64)) {
    for (id, count) in [
        ("rays/v1", Some(cell.rays)),
        ("false-misses/v1", Some(cell.false_misses)),
        ("unexplained-misses/v1", Some(cell.unexplained_misses)),
        ("cracks/v1", Some(cell.cracks)),
        ("false-hits/v1", Some(cell.false_hits)),
        ("unexplained-hits/v1", Some(cell.unexplained_hits)),
        ("wrong-triangle/v1", Some(cell.wrong_triangle)),
        ("not-nearest/v1", Some(cell.not_nearest)),
        ("borderline/v1", Some(cell.borderline)),
        ("differing/v1", Some(cell.differing)),
        ("any-differing/v1", cell.any_differing),
        ("ties/v1", Some(cell.ties)),
    ] {
        count.into_iter().for_each(|count| add(id, count as f64));
    }
    let p99 = |quantiles: Option<Quantiles>| quantiles.map(|q| q.p99);
    for (id, value) in [
        ("slowdown/v1", cell.slowdown),
        ("t-ulp-p99/v1", p99(cell.t_ulp)),
        ("point-ulp-p99/v1", p99(cell.point_ulp)),
    ] {
        value.into_iter().for_each(|value| add(id, value));
    }
}
