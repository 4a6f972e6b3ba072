//! A table for each figure: rows by the axes in which its keys differ, columns by the last suitable one of these.

use super::{Exported, Source};
use crate::document::Table;
use crate::markdown;
use crate::pivot::Rows;
use crate::values::{Reading, Value};
use raystone_record::{Key, axis};

/// Axes suitable as columns, the best first.
const ACROSS: [&str; 4] = [axis::RAYS, axis::SPP, axis::POINTS, axis::SUBJECT];
/// Greatest number of columns that fit on a page.
const MOST_COLUMNS: usize = 9;

pub(super) fn markdown(source: &Source) -> Exported {
    let tables = tables(&source.values);
    let texts: Vec<String> = tables.iter().map(markdown::table).collect();
    Exported {
        text: texts.join("\n"),
        left_out: Vec::new(),
    }
}

/// Returns a table for each figure, in the given order.
pub(super) fn tables(values: &[Value]) -> Vec<Table> {
    let mut figures: Vec<Vec<Value>> = Vec::new();
    for value in values {
        let known = figures
            .iter_mut()
            .find(|f| f[0].figure.id == value.figure.id);
        match known {
            Some(known) => known.push(value.clone()),
            None => figures.push(vec![value.clone()]),
        }
    }
    figures.iter().map(|values| table(values)).collect()
}

/// Returns the table of one figure; labels that all its keys share are in the caption.
fn table(values: &[Value]) -> Table {
    let labels = |axis: &str| {
        let mut labels: Vec<&str> = values.iter().map(|v| v.key.label(axis)).collect();
        labels.sort_unstable();
        labels.dedup();
        labels
    };
    let mut axes: Vec<&str> = Vec::new();
    for (axis, _) in values.iter().flat_map(|value| value.key.labels()) {
        if !axes.contains(&axis) {
            axes.push(axis);
        }
    }
    let (shared, varying): (Vec<&str>, Vec<&str>) =
        axes.into_iter().partition(|axis| labels(axis).len() == 1);
    let fits = |axis: &&str| varying.contains(axis) && labels(axis).len() <= MOST_COLUMNS;
    let across = ACROSS.into_iter().find(fits).filter(|_| varying.len() > 1);
    let by: Vec<&str> = varying
        .into_iter()
        .filter(|axis| Some(*axis) != across)
        .collect();
    let heads: Vec<String> = by.iter().map(|axis| format!(":{axis}")).collect();
    let heads: Vec<&str> = heads.iter().map(String::as_str).collect();
    let figure = &values[0].figure;
    let known = values.iter().any(
        |v| matches!(v.reading, Reading::Known(i) | Reading::HeavyTailed(i) if i.low < i.high),
    );
    let spread = if known { figure.spread.words() } else { "" };
    let shared = values[0].key.only(&shared).to_string();
    let parts = [figure.heading(), shared, spread.to_owned()];
    let parts: Vec<String> = parts.into_iter().filter(|part| !part.is_empty()).collect();
    let part = |key: &Key| across.map_or(String::new(), |axis| key.label(axis).to_owned());
    Rows::of_labels(&by, &heads, values).table(values, parts.join("; "), &[figure], &part)
}
