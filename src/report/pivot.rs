//! Tables of figures: rows by one part of the key, columns by figure and another part.

use super::document::{Cell, Table};
use super::format;
use super::values::Value;
use crate::measure::record::Key;

/// A part of a key, as a row or column is called.
pub type Part<'a> = &'a dyn Fn(&Key) -> String;

/// How values are laid out.
pub struct Pivot<'a> {
    /// What it shows.
    pub caption: String,
    /// Heads of the columns before the figures, as [`Table::new`] takes them.
    pub heads: &'a [&'a str],
    /// What tells rows apart, and the cells before their figures.
    pub rows: Vec<(String, Vec<Cell>)>,
    /// Which part of a key chooses the row.
    pub row: Part<'a>,
    /// Ids of the figures, in the order of their columns.
    pub figures: &'a [&'a str],
    /// Which part of a key makes columns of its own; none: one column per figure.
    pub across: Option<Part<'a>>,
}

impl Pivot<'_> {
    /// The table; a figure or part without a value has no column, a row may have dashes alone.
    pub fn table(self, values: &[Value]) -> Table {
        let part = |value: &Value| self.across.map_or(String::new(), |part| part(&value.key));
        let mut columns: Vec<(&Value, String)> = Vec::new();
        for id in self.figures {
            for value in values.iter().filter(|value| value.figure.id == *id) {
                let column = (value, part(value));
                if (columns.iter()).all(|c| c.0.figure.id != *id || c.1 != column.1) {
                    columns.push(column);
                }
            }
        }
        let mut table = Table::new(self.caption, self.heads);
        for (value, part) in &columns {
            let shared = columns.iter().filter(|(_, other)| other == part).count() > 1;
            table.add_column(match (part.is_empty(), shared) {
                (true, _) => value.figure.heading(),
                (false, false) => part.clone(),
                (false, true) => format!("{}, {part}", value.figure.title),
            });
        }
        for (name, mut cells) in self.rows {
            let of_row: Vec<&Value> = values
                .iter()
                .filter(|v| (self.row)(&v.key) == name)
                .collect();
            cells.extend(columns.iter().map(|(first, column)| {
                let is_it =
                    |value: &&&Value| value.figure.id == first.figure.id && part(value) == *column;
                let found = of_row.iter().find(is_it);
                found.map_or_else(|| format::ABSENT.into(), |value| value.cell())
            }));
            table.rows.push(cells);
        }
        match columns.is_empty() && self.heads.len() < 2 {
            true => Table::default(),
            false => table,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::record::{Interval, axis};

    #[test]
    fn a_pivot_puts_each_value_where_its_key_says_and_a_dash_where_there_is_none() {
        let key = |accel: &str, rays: &str| {
            Key::default()
                .with(axis::ACCEL, accel)
                .with(axis::RAYS, rays)
        };
        let values = [
            Value::new(
                &key("a", "x"),
                "mrays-per-s/v1",
                Interval {
                    value: 2.0,
                    low: 1.0,
                    high: 3.0,
                },
            ),
            Value::exact(&key("b", "y"), "mrays-per-s/v1", 4.0),
            Value::exact(&key("b", "y"), "nodes-per-ray/v1", 9.0),
        ];
        let pivot = |figures: &[&str]| {
            Pivot {
                caption: "t".into(),
                heads: &["structure"],
                rows: ["a", "b"]
                    .map(|name| (name.into(), vec![name.into()]))
                    .to_vec(),
                row: &|key| key.label(axis::ACCEL).into(),
                figures,
                across: Some(&|key| key.label(axis::RAYS).into()),
            }
            .table(&values)
        };
        let texts = |table: &Table| -> Vec<Vec<String>> {
            table
                .rows
                .iter()
                .map(|row| row.iter().map(Cell::flat).collect())
                .collect()
        };
        let heads = |table: &Table| -> Vec<String> {
            table.columns.iter().map(|c| c.title.clone()).collect()
        };
        let one = pivot(&["mrays-per-s/v1"]);
        assert_eq!(heads(&one), ["structure", "x", "y"]);
        assert_eq!(
            texts(&one),
            [["a", "2.00 [1.00, 3.00]", "–"], ["b", "–", "4.00"]]
        );
        let two = pivot(&["mrays-per-s/v1", "nodes-per-ray/v1"]);
        assert_eq!(heads(&two), ["structure", "x", "speed, y", "nodes/ray, y"]);
        assert!(pivot(&["epo/v1"]).rows.is_empty());
    }
}
