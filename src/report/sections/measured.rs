//! Measurements that have no section of their own: a table of all their figures.

use super::{compactions, streams, stress};
use crate::data::{RunData, grouped, without_repeats};
use crate::document::*;
use crate::pivot::{FIGURES_ALONE, Rows};
use crate::values::{Value, of_readings};
use raystone_record::axis;
use raystone_record::figure::Figure;

/// Returns one table for each measurement.
pub(crate) fn tables(data: &RunData) -> Vec<Table> {
    let names = data.measured.iter().map(|cell| cell.measurement.clone());
    let names = without_repeats(names.collect()).into_iter();
    let own = [compactions::NAME, streams::COST];
    let others = names.filter(|name| !own.contains(&name.as_str()) && !stress::is_shown(name));
    others.map(|name| table(data, &name)).collect()
}

fn table(data: &RunData, name: &str) -> Table {
    let cells = data.measured_by(name);
    let values: Vec<Value> = cells
        .iter()
        .flat_map(|cell| of_readings(data, *cell))
        .collect();
    let figures = grouped(values.iter(), |value| &value.figure.id).into_iter();
    let figures: Vec<&Figure> = figures.map(|(_, values)| &*values[0].figure).collect();
    let failed = cells.iter().filter(|cell| cell.failure.is_some()).count();
    let mut caption = format!("Measured: {name}");
    if failed > 0 {
        caption += &format!("; failed: {failed} of {}", cells.len());
    }
    Rows::of_labels(&axis::ALL, &axis::ALL, &values).table(
        &values,
        caption,
        &figures,
        FIGURES_ALONE,
    )
}

/// Returns the section; `None` where there is no such measurement.
pub(crate) fn section(data: &RunData) -> Option<Section> {
    let mut section = Section::new("measured", "Further measurements");
    let tables = tables(data).into_iter().filter_map(Table::into_block);
    section.blocks.extend(tables);
    (!section.blocks.is_empty()).then_some(section)
}
