//! Tables of coloured numbers: counts by row and column, and a number for every pair of dimensions.

use super::drawing::{Anchor, DIM, Drawing, FAILED, INK, Ink};
use super::paint::text_width;
use crate::format;
use raystone_image::viridis;

/// Height of a cell, pixels.
const HEIGHT: f64 = 28.0;
/// Least width of a cell, pixels.
const LEAST: f64 = 54.0;
/// Gap between cells, pixels.
const GAP: f64 = 2.0;
/// Margin around the drawing, and between names and cells, pixels.
const MARGIN: f64 = 8.0;
/// Least width of the drawing, pixels: a page stretches narrow ones.
const LEAST_WIDTH: f64 = 500.0;
/// Colour of a cell without a value on the scale.
const NOTHING: Ink = Ink::solid([0xee, 0xf1, 0xf4]);

/// A cell of the table.
#[derive(Debug, Clone, PartialEq)]
pub struct Tile {
    /// Its number as text.
    pub text: String,
    /// Place on the colour scale, 0 to 1; `None` for an empty count.
    pub share: Option<f64>,
    /// `true` if the cell is marked.
    pub marked: bool,
}

/// Named rows and columns of cells.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatMap {
    /// Names of rows.
    pub rows: Vec<String>,
    /// Names of columns.
    pub columns: Vec<String>,
    /// Cells row by row; `None` where there is no value.
    pub tiles: Vec<Vec<Option<Tile>>>,
    /// Labels of the ends of the colour scale.
    ends: [String; 2],
    /// Label of the scale: quantity, unit and mapping.
    between: String,
}

/// Width and height of the colour scale below the cells, and total height of the scale with its labels, pixels.
const SCALE: [f64; 3] = [180.0, 12.0, 44.0];
/// Number of steps of the scale.
const STEPS: usize = 60;

impl HeatMap {
    /// Returns a table of counts in a unit, coloured by their logarithm up to `greatest`, which adjacent maps share;
    /// some are marked.
    pub fn of_counts(
        what: &str,
        rows: Vec<String>,
        columns: Vec<String>,
        values: &[Vec<Option<(f64, bool)>>],
        greatest: f64,
    ) -> Self {
        let scale = (1.0 + greatest).ln();
        let tile = |(value, marked): (f64, bool)| Tile {
            text: match value {
                0.0 => "0".to_owned(),
                // Other formats are wider than a cell.
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
            ends: ["few".into(), format::significant(greatest, 2)],
            between: format!("{what}; logarithm of 1 + value, one scale for all maps; grey: 0"),
        }
    }

    /// Returns half a table of values that are symmetric in their pair: `(i, j, value)` with `i < j`, coloured from the
    /// least value to the greatest.
    pub(crate) fn of_pairs(names: &[String], values: &[(usize, usize, f64)]) -> Self {
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
            ends: [low, low + range].map(format::number),
            between: "least to greatest, linear, no unit".into(),
        }
    }

    /// Draws the table; `None` without a value.
    pub fn draw(&self) -> Option<Drawing> {
        let tiles = || self.tiles.iter().flatten().flatten();
        let widest = tiles().map(|t| text_width(&t.text)).reduce(f64::max)?;
        let cell = (widest + 18.0).max(LEAST);
        let length = |names: &[String]| names.iter().map(|n| text_width(n)).fold(0.0, f64::max);
        let upright = length(&self.columns) <= cell - 4.0;
        let head = if upright { 20.0 } else { length(&self.columns) };
        let (left, top) = (length(&self.rows) + 2.0 * MARGIN, head + 2.0 * MARGIN);
        let width = left + self.columns.len() as f64 * cell + MARGIN;
        let cells = top + self.rows.len() as f64 * HEIGHT + MARGIN;
        let height = cells + SCALE[2];
        let mut drawing = Drawing::new(width.max(LEAST_WIDTH), height);
        for (column, name) in self.columns.iter().enumerate() {
            let x = left + (column as f64 + 0.5) * cell;
            if upright {
                drawing.text((x, top - 14.0), name, INK, Anchor::Middle);
            } else {
                drawing.upward_text((x, top - 8.0 - 0.5 * text_width(name)), name, INK);
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
        if tiles().any(|tile| tile.share.is_some()) {
            self.draw_scale(&mut drawing, cells);
        }
        drawing.says = self.says();
        Some(drawing)
    }

    fn draw_scale(&self, drawing: &mut Drawing, top: f64) {
        let [width, height, _] = SCALE;
        let [low, high] = &self.ends;
        let left = 2.0 * MARGIN + text_width(low);
        let middle = top + 0.5 * height;
        drawing.text((MARGIN, middle), low, INK, Anchor::Start);
        let step = width / STEPS as f64;
        for i in 0..STEPS {
            let color = viridis(i as f32 / (STEPS - 1) as f32);
            let x = left + i as f64 * step;
            drawing.bar((x, top), (x + step + 0.3, top + height), Ink::solid(color));
        }
        drawing.text((left + width + MARGIN, middle), high, INK, Anchor::Start);
        drawing.text(
            (MARGIN, top + height + 14.0),
            &self.between,
            DIM,
            Anchor::Start,
        );
    }

    /// Describes the table in words: the cells with the greatest numbers.
    fn says(&self) -> String {
        let mut shares: Vec<(f64, String)> = Vec::new();
        for (name, row) in self.rows.iter().zip(&self.tiles) {
            for (column, tile) in self.columns.iter().zip(row) {
                let Some((share, tile)) = tile.as_ref().and_then(|t| Some((t.share?, t))) else {
                    continue;
                };
                shares.push((share, format!("{name}, {column}: {}", tile.text)));
            }
        }
        shares.sort_by(|a, b| b.0.total_cmp(&a.0));
        let greatest: Vec<String> = shares.into_iter().take(5).map(|(_, text)| text).collect();
        let (rows, columns) = (self.rows.len(), self.columns.len());
        if greatest.is_empty() {
            format!("Table of {rows} by {columns} cells, all 0.")
        } else {
            format!(
                "Table of {rows} by {columns} coloured numbers; the greatest: {}.",
                greatest.join("; ")
            )
        }
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

/// Colour of text on bright cells; not the ink of pages, which is bright in dark mode.
const NEAR_BLACK: [u8; 3] = [1; 3];

/// Returns black or white, whichever contrasts more with the colour (WCAG 2.1: equal at a luminance of 0.179).
fn legible_on(rgb: [u8; 3]) -> Ink {
    let linear = rgb.map(|c| (f64::from(c) / 255.0).powf(2.2));
    let luminance = 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2];
    Ink::solid(if luminance > 0.179 {
        NEAR_BLACK
    } else {
        [255; 3]
    })
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
        let drawing = HeatMap::of_counts("rays", rows, columns, &counts, 40.0)
            .draw()
            .unwrap();
        let found = sorted(&drawing);
        for text in [
            "0", "25", "40", "3.0", "bvh", "edges", "needles", "octree", "few",
        ] {
            assert!(found.contains(&text), "{text} in {found:?}");
        }
        let unit = "rays; logarithm of 1 + value, one scale for all maps; grey: 0";
        assert!(found.contains(&unit) && drawing.says.contains("bvh, needles: 25"));
        let pairs = [(0, 1, 0.125), (0, 2, 0.5), (1, 2, 0.25)];
        let matrix = HeatMap::of_pairs(&names(&["0", "3", "7"]), &pairs);
        let drawing = matrix.draw().unwrap();
        let found = sorted(&drawing);
        for (text, count) in [
            ("0", 1),
            ("0.125", 2),
            ("0.250", 1),
            ("0.500", 2),
            ("3", 2),
            ("7", 1),
        ] {
            assert_eq!(
                found.iter().filter(|t| **t == text).count(),
                count,
                "{text}"
            );
        }
        assert_eq!(matrix.tiles[1][0].as_ref().unwrap().text, "0.500");
        let none = HeatMap::of_counts("", vec![], vec![], &[], 0.0);
        assert!(none.draw().is_none());
        assert!(HeatMap::of_pairs(&names(&["4"]), &[]).draw().is_none());
    }

    #[test]
    fn numbers_are_white_on_violet_and_black_on_yellow() {
        assert_eq!(legible_on(viridis(0.0)).rgb, [255; 3]);
        assert_eq!(legible_on(viridis(1.0)).rgb, NEAR_BLACK);
    }
}
