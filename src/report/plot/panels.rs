//! Small multiples: panels of one size in rows.

use super::drawing::{Anchor, DIM, Drawing, INK, Point};
use super::paint::fit_text;
use crate::document::Illustration;

/// Height of the title above a panel, pixels.
const TITLE: f64 = 26.0;
/// Height of the note below a panel, pixels.
const NOTE: f64 = 24.0;
/// Distance between panels, pixels.
const GAP: f64 = 20.0;
/// Margin around all panels, pixels.
const MARGIN: f64 = 10.0;

/// The rectangle that a panel is drawn in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Area {
    /// Left edge, pixels.
    pub left: f64,
    /// Upper edge, pixels.
    pub top: f64,
    /// Width and height, pixels.
    pub size: (f64, f64),
}

impl Area {
    /// Returns the pixel of a point of the unit square, whose origin is the lower left corner.
    pub(crate) fn at(&self, [x, y]: [f64; 2]) -> Point {
        let (width, height) = self.size;
        (self.left + x * width, self.top + (1.0 - y) * height)
    }

    /// Draws the edges.
    pub(crate) fn outline(&self, drawing: &mut Drawing) {
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]];
        drawing.line(corners.map(|c| self.at(c)).into(), DIM, 1.0);
    }
}

/// The content of a panel.
pub(crate) trait Content {
    /// Draws the content into the rectangle.
    fn draw(&self, drawing: &mut Drawing, area: Area);
}

/// One of the small multiples.
pub(crate) struct Panel {
    /// Line above.
    pub title: String,
    /// Line below.
    pub note: String,
    /// The content.
    pub content: Box<dyn Content>,
}

impl Panel {
    /// Returns a panel with a line above and a line below.
    pub(crate) fn new(
        title: impl Into<String>,
        note: impl Into<String>,
        content: impl Content + 'static,
    ) -> Self {
        Self {
            title: title.into(),
            note: note.into(),
            content: Box::new(content),
        }
    }
}

/// Width of a drawing that fills the page, pixels.
const WIDTH: f64 = 900.0;

/// Returns square panels, `columns` in a row that fills the page.
pub(crate) fn figure(
    name: impl Into<String>,
    caption: impl Into<String>,
    panels: &[Panel],
    columns: usize,
) -> Illustration {
    Illustration::new(name, caption, draw(panels, columns, square(WIDTH, columns)))
}

/// Returns the size of square panels of which `columns` fill a drawing of `width` pixels.
fn square(width: f64, columns: usize) -> (f64, f64) {
    let columns = columns.max(1) as f64;
    let side = ((width - 2.0 * MARGIN - (columns - 1.0) * GAP) / columns).floor();
    (side, side)
}

/// Draws the panels row by row, `columns` in a row; without panels an empty drawing one margin high.
pub(crate) fn draw(panels: &[Panel], columns: usize, (width, height): (f64, f64)) -> Drawing {
    let columns = columns.clamp(1, panels.len().max(1));
    let rows = panels.len().div_ceil(columns) as f64;
    let step = (width + GAP, TITLE + height + NOTE);
    let all = 2.0 * MARGIN + columns as f64 * step.0 - GAP;
    let mut drawing = Drawing::new(all, MARGIN + rows * step.1);
    for (i, panel) in panels.iter().enumerate() {
        let area = Area {
            left: MARGIN + (i % columns) as f64 * step.0,
            top: TITLE + (i / columns) as f64 * step.1,
            size: (width, height),
        };
        let middle = area.left + width / 2.0;
        let mut text = |text: &str, y, ink| {
            let text = fit_text(text, width + GAP - 6.0);
            drawing.text((middle, y), text, ink, Anchor::Middle);
        };
        text(&panel.title, area.top - 13.0, INK);
        text(&panel.note, area.top + height + 12.0, DIM);
        panel.content.draw(&mut drawing, area);
    }
    drawing
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Nothing;

    impl Content for Nothing {
        fn draw(&self, drawing: &mut Drawing, area: Area) {
            area.outline(drawing);
        }
    }

    #[test]
    fn panels_fill_rows_of_the_width_asked_for_with_the_origin_below_on_the_left() {
        let panels = [(); 5].map(|()| Panel::new("title", "", Nothing));
        let drawing = draw(&panels, 4, square(900.0, 4));
        assert!((drawing.width - 900.0).abs() < 4.0, "{}", drawing.width);
        assert_eq!(drawing.shapes.len(), 15);
        let one_row = draw(&panels[..4], 4, square(900.0, 4));
        assert!(drawing.height > 1.8 * one_row.height - 20.0);
        assert!(draw(&[], 4, (100.0, 100.0)).shapes.is_empty());
        let area = Area {
            left: 10.0,
            top: 20.0,
            size: (100.0, 50.0),
        };
        assert_eq!(area.at([0.0, 0.0]), (10.0, 70.0));
        assert_eq!(area.at([1.0, 1.0]), (110.0, 20.0));
    }
}
