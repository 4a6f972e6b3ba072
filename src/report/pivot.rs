//! Tables of figures: rows by some axes of the key, columns by figure and another part of it.

use std::collections::{HashMap, HashSet};

use super::document::{Table, TableCell};
use super::format;
use super::values::Value;
use raystone_record::Key;
use raystone_record::figure::Figure;

/// A part of a key, as a column is called; empty where the figure names it.
pub type Part<'a> = &'a dyn Fn(&Key) -> String;

/// One column per figure.
pub const FIGURES_ALONE: Part<'static> = &|_| String::new();

/// The rows of a table, and the columns before the figures.
pub struct Rows<'a> {
    by: &'a [&'a str],
    heads: Vec<&'a str>,
    rows: Vec<(Key, Vec<TableCell>)>,
}

impl<'a> Rows<'a> {
    /// Creates rows that `by` distinguishes, each with its cells under `heads` (in the notation of [`Table::new`]).
    pub fn new(
        by: &'a [&'a str],
        heads: &'a [&'a str],
        rows: impl IntoIterator<Item = (Key, Vec<TableCell>)>,
    ) -> Self {
        Self {
            by,
            heads: heads.to_vec(),
            rows: rows.into_iter().collect(),
        }
    }

    /// Creates a row for each combination of labels in the values, in their order. An axis without any label has no
    /// column.
    pub fn of_labels(by: &'a [&'a str], heads: &'a [&'a str], values: &[Value]) -> Self {
        let is_used = |axis: &str| values.iter().any(|v| !v.key.label(axis).is_empty());
        let used: Vec<bool> = by.iter().map(|axis| is_used(axis)).collect();
        let mut rows: Vec<(Key, Vec<TableCell>)> = Vec::new();
        let mut known = HashSet::new();
        for Value { key, .. } in values {
            let labels = key.labels_on(by);
            if known.insert(labels.clone()) {
                let shown = labels.into_iter().zip(&used).filter(|(_, used)| **used);
                rows.push((key.clone(), shown.map(|(label, _)| label.into()).collect()));
            }
        }
        let heads = heads.iter().zip(&used).filter(|(_, used)| **used);
        let heads = heads.map(|(head, _)| *head).collect();
        Self { by, heads, rows }
    }

    /// Returns the table of some figures, in the order of their columns. A figure or part without a value has no
    /// column, a row may have dashes alone; there is no table without any column.
    pub fn table(
        self,
        values: &[Value],
        caption: impl Into<String>,
        figures: &[&Figure],
        across: Part,
    ) -> Table {
        let shown = values
            .iter()
            .filter(|v| figures.iter().any(|f| f.id == v.figure.id));
        let shown: Vec<(&Value, String)> = shown.map(|v| (v, across(&v.key))).collect();
        let mut columns: Vec<(&Value, &str)> = Vec::new();
        let mut known = HashSet::new();
        for figure in figures {
            for (value, part) in shown
                .iter()
                .filter(|(value, _)| value.figure.id == figure.id)
            {
                if known.insert((&figure.id, part)) {
                    columns.push((value, part));
                }
            }
        }
        // The first of several values of one cell is shown.
        let mut found: HashMap<_, &Value> = HashMap::new();
        for (value, part) in &shown {
            let place = (value.key.labels_on(self.by), &*value.figure.id, &**part);
            found.entry(place).or_insert(value);
        }
        if columns.is_empty() && self.heads.len() < 2 {
            return Table::default();
        }
        let mut table = Table::new(caption, &self.heads);
        for (value, part) in &columns {
            let shared = columns.iter().filter(|(_, other)| other == part).count() > 1;
            table.add_column(match (part.is_empty(), shared) {
                (true, _) => value.figure.heading(),
                (false, false) => (*part).to_owned(),
                (false, true) => format!("{}, {part}", value.figure.title),
            });
        }
        for (key, mut cells) in self.rows {
            let labels = key.labels_on(self.by);
            cells.extend(columns.iter().map(|(first, part)| {
                let value = found.get(&(labels.clone(), &*first.figure.id, *part));
                value.map_or_else(|| format::ABSENT.into(), |value| value.cell())
            }));
            table.rows.push(cells);
        }
        table
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use raystone_record::{Interval, axis, figure};

    #[test]
    fn a_pivot_puts_each_value_where_its_key_says_and_a_dash_where_there_is_none() {
        let key = |accel: &str, rays: &str| {
            (Key::default().with(axis::ACCEL, accel)).with(axis::RAYS, rays)
        };
        let known = Interval {
            value: 2.0,
            low: 1.0,
            high: 3.0,
        };
        let values = [
            Value::new(&key("a", "x"), &figure::MRAYS_PER_S, known),
            Value::new(&key("b", "y"), &figure::MRAYS_PER_S, 4.0),
            Value::new(&key("b", "y"), &figure::NODES_PER_RAY, 9.0),
        ];
        let table = |figures: &[&Figure]| {
            let rows = Rows::of_labels(&[axis::ACCEL], &["structure"], &values);
            let rays: Part = &|key| key.label(axis::RAYS).into();
            let table = rows.table(&values, "t", figures, rays);
            let heads = table.columns.iter().map(|c| c.title.clone());
            let cells = |row: &Vec<TableCell>| row.iter().map(TableCell::flat).collect();
            let rows: Vec<Vec<String>> = table.rows.iter().map(cells).collect();
            (heads.collect::<Vec<_>>(), rows)
        };
        let (heads, rows) = table(&[&figure::MRAYS_PER_S]);
        assert_eq!(heads, ["structure", "x", "y"]);
        assert_eq!(rows, [["a", "2.00 [1.00, 3.00]", "–"], ["b", "–", "4.00"]]);
        let (heads, _) = table(&[&figure::MRAYS_PER_S, &figure::NODES_PER_RAY]);
        assert_eq!(heads, ["structure", "x", "speed, y", "nodes/ray, y"]);
        assert!(table(&[&figure::EPO]).1.is_empty());
        // No value has a label on the axis of kernels.
        let by = [axis::KERNELS, axis::ACCEL];
        let rows = Rows::of_labels(&by, &["kernels", "structure"], &values);
        let table = rows.table(&values, "t", &[&figure::NODES_PER_RAY], FIGURES_ALONE);
        let heads = table.columns.iter().map(|c| c.title.clone());
        assert_eq!(heads.collect::<Vec<_>>(), ["structure", "nodes/ray"]);
        assert_eq!(
            table.rows[1]
                .iter()
                .map(TableCell::flat)
                .collect::<Vec<_>>(),
            ["b", "9.00"]
        );
    }
}
