//! Tables of coloured numbers: counts by row and column, and a number for every pair of dimensions.

use super::drawing::{Anchor, Drawing, FAILED, INK, Ink};
use super::paint::text_width;
use crate::image::viridis;
use crate::report::format;

/// Height of a cell, pixels.
const HEIGHT: f64 = 28.0;
/// Least width of a cell, pixels.
const LEAST: f64 = 54.0;
/// White between cells, pixels.
const GAP: f64 = 2.0;
/// White around all, and between names and cells, pixels.
const MARGIN: f64 = 8.0;
/// Least width of the drawing, pixels: a page stretches narrow ones.
const LEAST_WIDTH: f64 = 500.0;
/// A cell without a colour of its own.
const NOTHING: Ink = Ink::solid([0xee, 0xf1, 0xf4]);

/// A cell.
#[derive(Debug, Clone, PartialEq)]
pub struct Tile {
    /// Its number.
    pub text: String,
    /// Place on the scale of colours, 0 to 1; absent for nothing at all.
    pub share: Option<f64>,
    /// Whether it is marked.
    pub marked: bool,
}

/// Named rows and columns of cells.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatMap {
    /// Names of rows.
    pub rows: Vec<String>,
    /// Names of columns.
    pub columns: Vec<String>,
    /// Row by row; nothing where there is no value.
    pub tiles: Vec<Vec<Option<Tile>>>,
}

impl HeatMap {
    /// Counts, coloured by their logarithm; some are marked.
    pub fn of_counts(
        rows: Vec<String>,
        columns: Vec<String>,
        values: &[Vec<Option<(f64, bool)>>],
    ) -> Self {
        let greatest = values.iter().flatten().flatten().map(|v| v.0);
        let scale = (1.0 + greatest.fold(0.0, f64::max)).ln();
        let tile = |(value, marked): (f64, bool)| Tile {
            text: match value {
                0.0 => "0".to_owned(),
                // Wider than a cell otherwise.
                value if value >= 1e5 => format!("{value:.1e}"),
                value => format::significant(value, 2),
            },
            share: (value > 0.0).then(|| (1.0 + value).ln() / scale),
            marked,
        };
        let row = |row: &Vec<Option<_>>| row.iter().map(|value| value.map(tile)).collect();
        Self {
            rows,
            columns,
            tiles: values.iter().map(row).collect(),
        }
    }

    /// What is the same of a pair with its ends exchanged, so that half a table says all: `(i, j, value)`
    /// with `i < j`, coloured from the least value to the greatest.
    pub fn of_pairs(names: &[String], values: &[(usize, usize, f64)]) -> Self {
        let size = names.len().saturating_sub(1);
        let all = || values.iter().map(|(.., value)| *value);
        let low = all().fold(f64::INFINITY, f64::min);
        let range = all().fold(low, f64::max) - low;
        let mut tiles = vec![vec![None; size]; size];
        for &(i, j, value) in values {
            let share = if range > 0.0 {
                (value - low) / range
            } else {
                0.5
            };
            tiles[j - 1][i] = Some(Tile {
                text: format::number(value),
                share: Some(share),
                marked: false,
            });
        }
        Self {
            rows: names.iter().skip(1).cloned().collect(),
            columns: names.iter().take(size).cloned().collect(),
            tiles,
        }
    }

    /// The picture; `None` without a value.
    pub fn draw(&self) -> Option<Drawing> {
        let tiles = || self.tiles.iter().flatten().flatten();
        let widest = tiles().map(|t| text_width(&t.text)).reduce(f64::max)?;
        let cell = (widest + 18.0).max(LEAST);
        let length = |names: &[String]| names.iter().map(|n| text_width(n)).fold(0.0, f64::max);
        let upright = length(&self.columns) <= cell - 4.0;
        let head = if upright { 20.0 } else { length(&self.columns) };
        let (left, top) = (length(&self.rows) + 2.0 * MARGIN, head + 2.0 * MARGIN);
        let width = left + self.columns.len() as f64 * cell + MARGIN;
        let height = top + self.rows.len() as f64 * HEIGHT + MARGIN;
        let mut drawing = Drawing::new(width.max(LEAST_WIDTH), height);
        for (column, name) in self.columns.iter().enumerate() {
            let x = left + (column as f64 + 0.5) * cell;
            match upright {
                true => drawing.text((x, top - 14.0), name, INK, Anchor::Middle),
                false => drawing.upward_text((x, top - 8.0 - 0.5 * text_width(name)), name, INK),
            }
        }
        for (row, name) in self.rows.iter().enumerate() {
            let y = top + row as f64 * HEIGHT;
            drawing.text((left - MARGIN, y + HEIGHT / 2.0), name, INK, Anchor::End);
            for (column, tile) in self.tiles[row].iter().enumerate() {
                let x = left + column as f64 * cell;
                let end = (x + cell - GAP, y + HEIGHT - GAP);
                tile.iter()
                    .for_each(|tile| tile.draw(&mut drawing, (x, y), end));
            }
        }
        Some(drawing)
    }
}

impl Tile {
    fn draw(&self, drawing: &mut Drawing, (x0, y0): (f64, f64), (x1, y1): (f64, f64)) {
        let (fill, ink) = self.share.map_or((NOTHING, INK), |share| {
            let color = viridis(share as f32);
            (Ink::solid(color), legible_on(color))
        });
        drawing.bar((x0, y0), (x1, y1), fill);
        if self.marked {
            let bottom = y1 - 1.5;
            drawing.line(vec![(x0 + 1.0, bottom), (x1 - 1.0, bottom)], FAILED, 3.0);
        }
        let middle = ((x0 + x1) / 2.0, (y0 + y1) / 2.0);
        drawing.text(middle, &self.text, ink, Anchor::Middle);
    }
}

/// Black or white, whichever contrasts more with the colour (WCAG 2.1: equal at a luminance of 0.179).
fn legible_on(rgb: [u8; 3]) -> Ink {
    let linear = rgb.map(|c| (f64::from(c) / 255.0).powf(2.2));
    let luminance = 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2];
    Ink::solid(if luminance > 0.179 { [0; 3] } else { [255; 3] })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(names: &[&str]) -> Vec<String> {
        names.iter().map(ToString::to_string).collect()
    }

    fn sorted(drawing: &Drawing) -> Vec<&str> {
        let mut texts = drawing.texts();
        texts.sort_unstable();
        texts
    }

    #[test]
    fn every_cell_with_a_value_has_its_number_and_absent_ones_stay_empty() {
        let counts = [
            vec![Some((0.0, false)), Some((25.0, true))],
            vec![None, Some((3.0, false))],
        ];
        let (rows, columns) = (names(&["bvh", "octree"]), names(&["edges", "needles"]));
        let drawing = HeatMap::of_counts(rows, columns, &counts).draw().unwrap();
        let expected = ["0", "25", "3.0", "bvh", "edges", "needles", "octree"];
        assert_eq!(sorted(&drawing), expected);
        let pairs = [(0, 1, 0.125), (0, 2, 0.5), (1, 2, 0.25)];
        let matrix = HeatMap::of_pairs(&names(&["0", "3", "7"]), &pairs);
        let drawing = matrix.draw().unwrap();
        let expected = ["0", "0.125", "0.250", "0.500", "3", "3", "7"];
        assert_eq!(sorted(&drawing), expected);
        assert_eq!(matrix.tiles[1][0].as_ref().unwrap().text, "0.500");
        assert!(HeatMap::of_counts(vec![], vec![], &[]).draw().is_none());
        assert!(HeatMap::of_pairs(&names(&["4"]), &[]).draw().is_none());
    }

    #[test]
    fn numbers_are_white_on_violet_and_black_on_yellow() {
        assert_eq!(legible_on(viridis(0.0)).rgb, [255; 3]);
        assert_eq!(legible_on(viridis(1.0)).rgb, [0; 3]);
    }
}
