//! A table for each figure: rows by the axes in which its keys differ, columns by the last suitable one of these.

use super::{Exported, Source};
use crate::data::{grouped, without_repeats};
use crate::document::Table;
use crate::markdown;
use crate::pivot::Rows;
use crate::values::{Estimate, Value};
use raystone_record::{Key, axis};
use std::borrow::Cow;

/// Axes suitable as columns, the best first.
const ACROSS: [&str; 4] = [axis::RAYS, axis::SPP, axis::POINTS, axis::SUBJECT];
/// Greatest number of columns that fit on a page.
const MOST_COLUMNS: usize = 9;

pub(super) fn markdown(source: &Source) -> Exported {
    let tables = tables(&source.values);
    let texts: Vec<String> = tables.iter().map(markdown::table).collect();
    Exported::whole(texts.join("\n"))
}

/// Returns a table for each figure, in the given order.
pub(super) fn tables(values: &[Value]) -> Vec<Table> {
    let figures = grouped(values.iter().cloned(), |value| value.figure.id.to_string());
    figures.iter().map(|(_, values)| table(values)).collect()
}

/// Returns the table of one figure; labels that all its keys share are in the caption.
fn table(values: &[Value]) -> Table {
    let labels = |axis: &str| {
        let mut labels: Vec<&str> = values.iter().map(|v| v.key.label(axis)).collect();
        labels.sort_unstable();
        labels.dedup();
        labels
    };
    let all = values.iter().flat_map(|value| value.key.labels());
    let axes = without_repeats(all.map(|(axis, _)| axis).collect());
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
    let has_width = |v: &&Value| matches!(v.estimate, Estimate::Known(i) | Estimate::HeavyTailed(i) if i.low < i.high);
    // The caption holds for all, also for those of few rounds.
    let spreads = values.iter().filter(has_width).map(Value::spread_words);
    let weakest = |spread: &Cow<str>| *spread == figure.spread.words();
    let spread = spreads.min_by_key(weakest).unwrap_or_default();
    let shared = values[0].key.only(&shared).to_string();
    let parts = [figure.heading(), shared, spread.into_owned()];
    let parts: Vec<String> = parts.into_iter().filter(|part| !part.is_empty()).collect();
    let part = |key: &Key| across.map_or(String::new(), |axis| key.label(axis).to_owned());
    Rows::of_labels(&by, &heads, values).table(values, parts.join("; "), &[figure], &part)
}
