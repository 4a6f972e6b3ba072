//! Rows of a legend below a plot.

use super::drawing::{Anchor, Drawing, Ink};
use super::paint::fit_text;

/// Height of a row, pixels.
pub(crate) const ROW: f64 = 21.0;

/// Returns the height of `rows` rows, with the margin below.
pub(crate) fn height(rows: usize) -> f64 {
    rows as f64 * ROW + 8.0
}

/// Rows from top to bottom in one column of a drawing.
pub(crate) struct Rows {
    /// Middle of the next row.
    pub y: f64,
    /// Left edge, where samples begin; texts end at `right`.
    left: f64,
    right: f64,
}

impl Rows {
    /// Starts rows at `top`, between `left` and `right`.
    pub(crate) fn new(top: f64, (left, right): (f64, f64)) -> Self {
        let y = top + ROW / 2.0;
        Self { y, left, right }
    }

    /// Adds a row: the drawing of `sample` at its height, and the text after it, shortened to fit.
    pub(crate) fn add(
        &mut self,
        drawing: &mut Drawing,
        text: &str,
        ink: Ink,
        sample: impl FnOnce(&mut Drawing, f64),
    ) {
        sample(drawing, self.y);
        let left = self.left + 44.0;
        let text = fit_text(text, self.right - left - 6.0);
        drawing.text((left, self.y), text, ink, Anchor::Start);
        self.y += ROW;
    }

    /// Adds a row of text alone.
    pub(crate) fn title(&mut self, drawing: &mut Drawing, text: &str, ink: Ink) {
        drawing.text((self.left, self.y), text, ink, Anchor::Start);
        self.y += ROW;
    }
}
