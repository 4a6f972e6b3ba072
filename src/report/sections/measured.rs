//! Measurements that have no section of their own: a table of all their figures.

use super::{compactions, streams, stress};
use crate::data::{RunData, grouped, without_repeats};
use crate::document::*;
use crate::pictures;
use crate::pivot::{FIGURES_ALONE, Rows};
use crate::values::{Value, of_readings};
use raystone_record::axis;
use raystone_record::figure::Figure;
use std::path::Path;

/// Returns a table of each measurement.
pub(crate) fn tables(data: &RunData) -> Vec<Table> {
    both(data).map(|[wholes, _]| wholes).collect()
}

/// Returns the figures of each measurement, and apart from them those of parts that its cells tell of.
fn both(data: &RunData) -> impl Iterator<Item = [Table; 2]> {
    let names = data.measured.iter().map(|cell| cell.measurement.clone());
    let names = without_repeats(names.collect()).into_iter();
    let own = [compactions::NAME, streams::COST];
    let others = names.filter(move |name| !own.contains(&name.as_str()) && !stress::is_shown(name));
    others.map(|name| of_measurement(data, &name))
}

fn of_measurement(data: &RunData, name: &str) -> [Table; 2] {
    let cells = data.measured_by(name);
    let values = cells.iter().flat_map(|cell| of_readings(data, *cell));
    let (mut wholes, mut parts): (Vec<Value>, Vec<Value>) =
        values.partition(|value| value.key.label(axis::SUBJECT).is_empty());
    if wholes.is_empty() {
        std::mem::swap(&mut wholes, &mut parts);
    }
    let failed = cells.iter().filter(|cell| cell.failure.is_some()).count();
    let mut caption = format!("Measured: {name}");
    if failed > 0 {
        caption += &format!("; failed: {failed} of {}", cells.len());
    }
    [
        table(&wholes, caption),
        table(&parts, format!("Measured: {name}, part by part")),
    ]
}

/// Returns a table with a column for each axis on which rows differ; the caption has what all of them share. A single row has
/// its labels as columns.
fn table(values: &[Value], mut caption: String) -> Table {
    let Some(first) = values.first() else {
        return Table::default();
    };
    let is_row = values.iter().all(|value| value.key == first.key);
    let differs = |axis: &str| is_row || values.iter().any(|v| !v.key.agrees(&first.key, &[axis]));
    let (varied, shared): (Vec<&str>, Vec<&str>) = axis::ALL.into_iter().partition(|a| differs(a));
    for axis in shared {
        let label = first.key.label(axis);
        if !label.is_empty() {
            caption += &format!("; {axis} {label}");
        }
    }
    let figures = grouped(values.iter(), |value| &value.figure.id).into_iter();
    let figures: Vec<&Figure> = figures.map(|(_, values)| &*values[0].figure).collect();
    let heads: Vec<String> = varied.iter().map(|axis| format!(":{axis}")).collect();
    let heads: Vec<&str> = heads.iter().map(String::as_str).collect();
    Rows::of_labels(&varied, &heads, values).table(values, caption, &figures, FIGURES_ALONE)
}

/// Returns the pictures of all cells that have one.
fn pictures_of(data: &RunData, dir: &Path) -> Option<Block> {
    let items = data.measured.iter().filter_map(|cell| {
        let path = cell.picture.as_deref()?;
        let labels = axis::ALL.map(|axis| cell.key.label(axis).to_owned());
        let caption: Vec<String> = labels
            .into_iter()
            .filter(|label| !label.is_empty())
            .collect();
        let alt = format!("Map of {}", caption.join(", "));
        Some(pictures::load(dir, path, caption.join(", ")).described(alt))
    });
    Block::gallery("Maps", items.collect(), None)
}

/// Returns the section; `None` where there is no such measurement.
pub(crate) fn section(data: &RunData, dir: &Path) -> Option<Section> {
    let mut section = Section::new("measured", "Further measurements");
    for [wholes, parts] in both(data) {
        section.blocks.extend(wholes.into_block());
        let parts = parts.into_block().into_iter().collect();
        section.blocks.extend(Block::fold("Part by part", parts));
    }
    let maps = pictures_of(data, dir).into_iter().collect();
    section.blocks.extend(Block::fold("Where: maps", maps));
    (!section.blocks.is_empty()).then_some(section)
}
