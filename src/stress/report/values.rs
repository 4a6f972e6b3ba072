//! What the suite's records say, figure by figure.

use crate::record::{Line, Record};
use raystone_record::axis;
use raystone_record::figure::{self, FIGURES};
use raystone_report::values::Value;

/// Everything that the suite found.
pub(super) fn values(lines: &[Line]) -> Vec<Value<'static>> {
    lines.iter().flat_map(of_line).collect()
}

/// What one line says, in the order of the table of figures.
pub(super) fn of_line(line: &Line) -> Vec<Value<'static>> {
    if let Record::Gauge(gauge) = &line.body {
        let key = line.key.clone().with(axis::SUBJECT, &gauge.name);
        let figures = [
            (&figure::NUMERICS, Some(gauge.value)),
            (&figure::ALARM, gauge.alarm),
        ];
        let mut values = Value::known(&key, figures);
        values[0].figure.to_mut().unit = gauge.unit.clone().into();
        return values;
    }
    let Some(found) = line.body.findings() else {
        return Vec::new();
    };
    // Shots that a kernel's error ended tell nothing of the mesh.
    let ended = matches!(line.body, Record::Shots(_)) && !found.failures.is_empty();
    let told = FIGURES.iter().filter(|f| !ended || f.id == figure::RAYS.id);
    let figures = told.map(|f| (*f, found.figures.get(&*f.id).copied()));
    Value::known(&line.key, figures)
}
