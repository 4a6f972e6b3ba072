//! Small multiples: square panels of one size in rows.

use super::drawing::{Anchor, DIM, Drawing, INK, Point};
use super::paint::fit_text;

/// Height of the title above a panel, pixels.
const TITLE: f64 = 26.0;
/// Height of the note below a panel, pixels.
const NOTE: f64 = 24.0;
/// Distance between panels, pixels.
const GAP: f64 = 20.0;
/// White around all panels, pixels.
const MARGIN: f64 = 10.0;

/// The square that a panel is drawn in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Area {
    /// Left edge, pixels.
    pub left: f64,
    /// Upper edge, pixels.
    pub top: f64,
    /// Side, pixels.
    pub side: f64,
}

impl Area {
    /// Pixel of a point of the unit square, whose origin is the lower left corner.
    pub fn at(&self, [x, y]: [f64; 2]) -> Point {
        (self.left + x * self.side, self.top + (1.0 - y) * self.side)
    }

    /// Draws the edges.
    pub fn frame(&self, drawing: &mut Drawing) {
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]];
        drawing.line(corners.map(|c| self.at(c)).into(), DIM, 1.0);
    }
}

/// What a panel shows.
pub trait Content {
    /// Draws it into the square.
    fn draw(&self, drawing: &mut Drawing, area: Area);
}

/// One of the small multiples.
pub struct Panel {
    /// Line above.
    pub title: String,
    /// Line below.
    pub note: String,
    /// What it shows.
    pub content: Box<dyn Content>,
}

impl Panel {
    /// A panel with a line above and a line below.
    pub fn new(
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

/// Side of panels of which `columns` fill a drawing of `width` pixels.
pub fn side(width: f64, columns: usize) -> f64 {
    let columns = columns.max(1) as f64;
    ((width - 2.0 * MARGIN - (columns - 1.0) * GAP) / columns).floor()
}

/// The panels row by row, `columns` in a row; without panels an empty drawing of the height of one
/// margin.
pub fn draw(panels: &[Panel], columns: usize, side: f64) -> Drawing {
    let columns = columns.clamp(1, panels.len().max(1));
    let rows = panels.len().div_ceil(columns) as f64;
    let step = (side + GAP, TITLE + side + NOTE);
    let width = 2.0 * MARGIN + columns as f64 * step.0 - GAP;
    let mut drawing = Drawing::new(width, MARGIN + rows * step.1);
    for (i, panel) in panels.iter().enumerate() {
        let area = Area {
            left: MARGIN + (i % columns) as f64 * step.0,
            top: TITLE + (i / columns) as f64 * step.1,
            side,
        };
        let middle = area.left + side / 2.0;
        let room = side + GAP - 6.0;
        let title = fit_text(&panel.title, room);
        drawing.text((middle, area.top - 13.0), title, INK, Anchor::Middle);
        panel.content.draw(&mut drawing, area);
        let note = fit_text(&panel.note, room);
        drawing.text((middle, area.top + side + 12.0), note, DIM, Anchor::Middle);
    }
    drawing
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Nothing;

    impl Content for Nothing {
        fn draw(&self, drawing: &mut Drawing, area: Area) {
            area.frame(drawing);
        }
    }

    #[test]
    fn panels_fill_rows_of_the_width_asked_for() {
        let panels: Vec<Panel> = (0..5)
            .map(|i| Panel::new(i.to_string(), "", Nothing))
            .collect();
        let drawing = draw(&panels, 4, side(900.0, 4));
        assert!((drawing.width - 900.0).abs() < 4.0, "{}", drawing.width);
        assert_eq!(drawing.shapes.len(), 15);
        let one_row = draw(&panels[..4], 4, side(900.0, 4));
        assert!(drawing.height > 1.8 * one_row.height - 20.0);
        assert!(draw(&[], 4, 100.0).shapes.is_empty());
    }

    #[test]
    fn the_origin_lies_below_on_the_left() {
        let area = Area {
            left: 10.0,
            top: 20.0,
            side: 100.0,
        };
        assert_eq!(area.at([0.0, 0.0]), (10.0, 120.0));
        assert_eq!(area.at([1.0, 1.0]), (110.0, 20.0));
    }
}
