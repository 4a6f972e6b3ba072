//! A number for every row and column, coloured by its logarithm.

use super::drawing::{Anchor, Drawing, FAILED, INK, Ink};
use super::matrix::legible_on;
use super::paint::text_width;
use crate::image::viridis;
use crate::report::format;

/// Width and height of a cell, pixels.
const CELL: (f64, f64) = (54.0, 26.0);
/// White between cells, pixels.
const GAP: f64 = 2.0;
/// A cell whose value is 0.
const NOTHING: Ink = Ink::solid([0xee, 0xf1, 0xf4]);

/// A table of counts.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatMap {
    /// Names of rows.
    pub rows: Vec<String>,
    /// Names of columns.
    pub columns: Vec<String>,
    /// Row by row: the value and whether the cell is marked; nothing where there is no value.
    pub values: Vec<Vec<Option<(f64, bool)>>>,
}

impl HeatMap {
    /// The picture; `None` without a value.
    pub fn draw(&self) -> Option<Drawing> {
        let values = || self.values.iter().flatten().flatten().map(|v| v.0);
        let greatest = values().reduce(f64::max)?;
        let widest = |names: &[String]| names.iter().map(|n| text_width(n)).fold(0.0, f64::max);
        let (left, top) = (widest(&self.rows) + 16.0, widest(&self.columns) + 16.0);
        let width = left + self.columns.len() as f64 * CELL.0 + 12.0;
        let height = top + self.rows.len() as f64 * CELL.1 + 12.0;
        let mut drawing = Drawing::new(width, height);
        for (column, name) in self.columns.iter().enumerate() {
            let x = left + (column as f64 + 0.5) * CELL.0;
            drawing.upward_text((x, top - 8.0 - 0.5 * text_width(name)), name.clone(), INK);
        }
        for (row, name) in self.rows.iter().enumerate() {
            let y = top + row as f64 * CELL.1;
            drawing.text(
                (left - 8.0, y + CELL.1 / 2.0),
                name.clone(),
                INK,
                Anchor::End,
            );
            for (column, value) in self.values[row].iter().enumerate() {
                let corner = (left + column as f64 * CELL.0, y);
                if let Some((value, marked)) = value {
                    draw_cell(&mut drawing, corner, *value, *marked, greatest);
                }
            }
        }
        Some(drawing)
    }
}

fn draw_cell(drawing: &mut Drawing, corner: (f64, f64), value: f64, marked: bool, greatest: f64) {
    let end = (corner.0 + CELL.0 - GAP, corner.1 + CELL.1 - GAP);
    let share = (1.0 + value).ln() / (1.0 + greatest).ln().max(f64::MIN_POSITIVE);
    let color = viridis(share as f32);
    let (fill, ink) = match value > 0.0 {
        true => (Ink::solid(color), legible_on(color)),
        false => (NOTHING, INK),
    };
    drawing.bar(corner, end, fill);
    if marked {
        let (left, right, bottom) = (corner.0 + 1.0, end.0 - 1.0, end.1 - 1.5);
        drawing.line(vec![(left, bottom), (right, bottom)], FAILED, 3.0);
    }
    let middle = ((corner.0 + end.0) / 2.0, (corner.1 + end.1) / 2.0);
    let text = match value {
        0.0 => "0".to_owned(),
        // Wider than a cell otherwise.
        value if value >= 1e5 => format!("{value:.1e}"),
        value => format::significant(value, 2),
    };
    drawing.text(middle, text, ink, Anchor::Middle);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cell_with_a_value_has_its_number_and_absent_ones_stay_empty() {
        let map = HeatMap {
            rows: vec!["bvh".into(), "octree".into()],
            columns: vec!["edges".into(), "needles".into()],
            values: vec![
                vec![Some((0.0, false)), Some((25.0, true))],
                vec![None, Some((3.0, false))],
            ],
        };
        let drawing = map.draw().unwrap();
        for text in ["bvh", "octree", "edges", "needles", "0", "25", "3.0"] {
            assert!(
                drawing.texts().contains(&text),
                "{text} in {:?}",
                drawing.texts()
            );
        }
        assert_eq!(drawing.texts().len(), 7);
        let empty = HeatMap {
            rows: vec![],
            columns: vec![],
            values: vec![],
        };
        assert!(empty.draw().is_none());
    }
}
