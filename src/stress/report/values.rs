//! What the suite's records say, figure by figure.

use crate::measure::figure::FIGURES;
use crate::measure::record::axis;
use crate::report::values::Value;
use crate::stress::record::{Line, Record};

/// Everything that the suite found, in the order of the table of figures.
pub fn values(lines: &[Line]) -> Vec<Value<'static>> {
    let mut values = Vec::new();
    for line in lines {
        let key = &line.key;
        if let Record::Gauge(gauge) = &line.body {
            let key = key.clone().with(axis::SUBJECT, &gauge.name);
            let mut value = Value::exact(&key, "numerics/v1", gauge.value);
            value.figure.to_mut().unit = gauge.unit.clone().into();
            values.push(value);
            let alarm = gauge.alarm.iter();
            values.extend(alarm.map(|alarm| Value::exact(&key, "alarm/v1", *alarm)));
        }
        let Some(found) = line.body.findings() else {
            continue;
        };
        // Shots that a kernel's error ended tell nothing of the mesh.
        let ended = matches!(line.body, Record::Shots(_)) && !found.failures.is_empty();
        for figure in FIGURES.iter().filter(|f| !ended || f.id == "rays/v1") {
            let value = found.figures.get(&*figure.id);
            values.extend(value.map(|value| Value::exact(key, &figure.id, *value)));
        }
    }
    values
}
