//! A drawing as a list of shapes.
//!
//! Plots are laid out once, in pixels at display size; `paint` paints them.

use super::raster::Raster;

/// A colour with opacity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ink {
    /// sRGB.
    pub rgb: [u8; 3],
    /// Opacity in [0, 1].
    pub alpha: f64,
}

impl Ink {
    /// Returns the opaque colour.
    pub const fn solid(rgb: [u8; 3]) -> Self {
        Self { rgb, alpha: 1.0 }
    }

    /// Returns the same colour with this opacity.
    pub(crate) const fn with_alpha(self, alpha: f64) -> Self {
        Self {
            rgb: self.rgb,
            alpha,
        }
    }
}

/// Colour of text and axes.
pub(crate) const INK: Ink = Ink::solid([0x1f, 0x29, 0x33]);
/// Colour of secondary text.
pub(crate) const DIM: Ink = Ink::solid([0x5b, 0x67, 0x73]);
/// Colour of gridlines.
pub(crate) const GRID: Ink = Ink::solid([0xe3, 0xe7, 0xeb]);
/// Colour of failures.
pub const FAILED: Ink = Ink::solid([0xb4, 0x23, 0x18]);
/// Font size of plots, pixels per em.
pub(crate) const FONT_PX: f64 = 14.0;

/// A point in pixels from the top left.
pub type Point = (f64, f64);

/// The point of a text that its position refers to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    /// Left end.
    Start,
    /// Middle.
    Middle,
    /// Right end.
    End,
}

/// One shape; lengths in pixels.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A polyline.
    Line {
        /// Corners.
        points: Vec<Point>,
        /// Colour.
        ink: Ink,
        /// Stroke width.
        width: f64,
    },
    /// A filled polygon.
    Area {
        /// Corners.
        points: Vec<Point>,
        /// Colour.
        ink: Ink,
    },
    /// One line of text, centred vertically on its position.
    Text {
        /// Position of the anchor.
        at: Point,
        /// The text.
        text: String,
        /// Colour.
        ink: Ink,
        /// The point of the text at `at`.
        anchor: Anchor,
        /// `true` if the text reads upwards.
        upwards: bool,
    },
}

/// A picture of a fixed size on white.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawing {
    /// Width in pixels.
    pub width: f64,
    /// Height in pixels.
    pub height: f64,
    /// Rasters behind all shapes.
    pub rasters: Vec<Raster>,
    /// Shapes from back to front.
    pub shapes: Vec<Shape>,
    /// Tooltips.
    pub spots: Vec<Spot>,
    /// Text alternative of the picture.
    pub says: String,
}

/// A tooltip: a place of a drawing and its text.
#[derive(Debug, Clone, PartialEq)]
pub struct Spot {
    /// Centre of the place.
    pub at: Point,
    /// Name and values.
    pub text: String,
}

impl Drawing {
    /// Returns an empty picture.
    pub fn new(width: f64, height: f64) -> Self {
        Self {
            width,
            height,
            rasters: Vec::new(),
            shapes: Vec::new(),
            spots: Vec::new(),
            says: String::new(),
        }
    }

    /// Adds a tooltip.
    pub fn spot(&mut self, at: Point, text: impl Into<String>) {
        let text = text.into();
        self.spots.push(Spot { at, text });
    }

    /// Adds a polyline.
    pub fn line(&mut self, points: Vec<Point>, ink: Ink, width: f64) {
        self.shapes.push(Shape::Line { points, ink, width });
    }

    /// Adds a dashed polyline; both lengths in pixels.
    pub(crate) fn dashed_line(
        &mut self,
        points: &[Point],
        ink: Ink,
        width: f64,
        dash: f64,
        gap: f64,
    ) {
        for piece in dashes(points, dash, gap) {
            self.line(piece, ink, width);
        }
    }

    /// Adds a filled polygon.
    pub fn area(&mut self, points: Vec<Point>, ink: Ink) {
        self.shapes.push(Shape::Area { points, ink });
    }

    /// Adds a filled rectangle.
    pub fn bar(&mut self, (x0, y0): Point, (x1, y1): Point, ink: Ink) {
        self.area(vec![(x0, y0), (x1, y0), (x1, y1), (x0, y1)], ink);
    }

    /// Adds a line of text.
    pub fn text(&mut self, at: Point, text: impl Into<String>, ink: Ink, anchor: Anchor) {
        self.add_text(at, text.into(), ink, anchor, false);
    }

    /// Adds a line of text that reads upwards.
    pub(crate) fn upward_text(&mut self, at: Point, text: impl Into<String>, ink: Ink) {
        self.add_text(at, text.into(), ink, Anchor::Middle, true);
    }

    fn add_text(&mut self, at: Point, text: String, ink: Ink, anchor: Anchor, upwards: bool) {
        self.shapes.push(Shape::Text {
            at,
            text,
            ink,
            anchor,
            upwards,
        });
    }

    /// Returns all texts of the drawing, for tests.
    #[cfg(test)]
    pub fn texts(&self) -> Vec<&str> {
        let texts = self.shapes.iter().filter_map(|shape| match shape {
            Shape::Text { text, .. } => Some(text.as_str()),
            _ => None,
        });
        texts.collect()
    }
}

/// Cuts a polyline into dashes.
fn dashes(points: &[Point], dash: f64, gap: f64) -> Vec<Vec<Point>> {
    let mut pieces = Vec::new();
    let mut current: Vec<Point> = points.first().copied().into_iter().collect();
    let (mut drawing, mut left) = (true, dash);
    for pair in points.windows(2) {
        let ((mut x, mut y), (x1, y1)) = (pair[0], pair[1]);
        let mut length = (x1 - x).hypot(y1 - y);
        while length > left {
            let share = left / length;
            (x, y) = (x + (x1 - x) * share, y + (y1 - y) * share);
            length -= left;
            current.push((x, y));
            if drawing {
                pieces.push(std::mem::take(&mut current));
            }
            current = vec![(x, y)];
            drawing = !drawing;
            left = if drawing { dash } else { gap };
        }
        left -= length;
        current.push((x1, y1));
    }
    if drawing && current.len() > 1 {
        pieces.push(current);
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dashes_cover_their_share_of_the_line() {
        let pieces = dashes(&[(0.0, 0.0), (50.0, 0.0), (100.0, 0.0)], 6.0, 4.0);
        let drawn: f64 = pieces
            .iter()
            .flat_map(|p| p.windows(2))
            .map(|w| w[1].0 - w[0].0)
            .sum();
        assert_eq!(pieces.len(), 10);
        assert!((drawn - 60.0).abs() < 1e-9);
    }
}
