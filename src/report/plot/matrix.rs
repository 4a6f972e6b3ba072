//! A number for every pair of dimensions.

use super::drawing::{Anchor, Drawing, INK, Ink};
use super::paint::text_width;
use crate::image::viridis;
use crate::report::format;

/// Width and height of a cell, pixels.
const CELL: (f64, f64) = (74.0, 40.0);
/// White between cells, pixels.
const GAP: f64 = 2.0;
/// Least width of the drawing, pixels: a page stretches narrow ones.
const LEAST_WIDTH: f64 = 500.0;

/// Star discrepancies of pairs of dimensions; D* is the same with the dimensions exchanged, so that half a
/// matrix says all.
#[derive(Debug, Clone, PartialEq)]
pub struct PairMatrix {
    /// The dimensions.
    pub dims: Vec<u32>,
    /// `(i, j, value)` with positions `i < j` in `dims`.
    pub values: Vec<(usize, usize, f64)>,
}

impl PairMatrix {
    /// Half a table, coloured from the least value to the greatest; `None` without a pair.
    pub fn draw(&self) -> Option<Drawing> {
        let values = || self.values.iter().map(|(_, _, value)| *value);
        let (low, high) = (values().reduce(f64::min)?, values().reduce(f64::max)?);
        let widest = self.dims.iter().map(|d| text_width(&d.to_string()));
        let left = widest.fold(0.0, f64::max) + 24.0;
        let size = self.dims.len().saturating_sub(1) as f64;
        let bottom = 8.0 + size * CELL.1;
        let width = (left + size * CELL.0 + 12.0).max(LEAST_WIDTH);
        let mut drawing = Drawing::new(width, bottom + 26.0);
        for &(i, j, value) in &self.values {
            let corner = (left + i as f64 * CELL.0, 8.0 + (j - 1) as f64 * CELL.1);
            let share = if high > low {
                (value - low) / (high - low)
            } else {
                0.5
            };
            let color = viridis(share as f32);
            let end = (corner.0 + CELL.0 - GAP, corner.1 + CELL.1 - GAP);
            drawing.bar(corner, end, Ink::solid(color));
            let middle = ((corner.0 + end.0) / 2.0, (corner.1 + end.1) / 2.0);
            drawing.text(
                middle,
                format::number(value),
                legible_on(color),
                Anchor::Middle,
            );
        }
        for (position, dim) in self.dims.iter().enumerate() {
            let (x, y) = (position as f64 + 0.5, position as f64 - 0.5);
            if position > 0 {
                let at = (left - 10.0, 8.0 + y * CELL.1);
                drawing.text(at, dim.to_string(), INK, Anchor::End);
            }
            if position + 1 < self.dims.len() {
                let at = (left + x * CELL.0, bottom + 12.0);
                drawing.text(at, dim.to_string(), INK, Anchor::Middle);
            }
        }
        Some(drawing)
    }

    /// The pair with the greatest value, as dimensions.
    pub fn worst(&self) -> Option<(u32, u32, f64)> {
        let worst = self.values.iter().max_by(|a, b| a.2.total_cmp(&b.2))?;
        Some((self.dims[worst.0], self.dims[worst.1], worst.2))
    }
}

/// Black or white, whichever contrasts more with the colour (WCAG 2.1: equal at a luminance of 0.179).
pub(super) fn legible_on(rgb: [u8; 3]) -> Ink {
    let linear = rgb.map(|c| (f64::from(c) / 255.0).powf(2.2));
    let luminance = 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2];
    Ink::solid(if luminance > 0.179 { [0; 3] } else { [255; 3] })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pair_has_its_number_and_the_worst_is_named() {
        let matrix = PairMatrix {
            dims: vec![0, 3, 7],
            values: vec![(0, 1, 0.125), (0, 2, 0.5), (1, 2, 0.25)],
        };
        let drawing = matrix.draw().unwrap();
        let texts = drawing.texts();
        assert_eq!(texts, ["0.125", "0.500", "0.250", "0", "3", "3", "7"]);
        assert_eq!(matrix.worst(), Some((0, 7, 0.5)));
        let empty = PairMatrix {
            dims: vec![4],
            values: Vec::new(),
        };
        assert!(empty.draw().is_none() && empty.worst().is_none());
    }

    #[test]
    fn numbers_are_white_on_violet_and_black_on_yellow() {
        assert_eq!(legible_on(viridis(0.0)).rgb, [255; 3]);
        assert_eq!(legible_on(viridis(1.0)).rgb, [0; 3]);
    }
}
