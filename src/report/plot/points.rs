//! Point sets in the square, on the disc and on the hemisphere.

use super::drawing::{DIM, Drawing, GRID, Ink, Point};
use super::marker;
use super::panels::{Area, Content};
use super::raster::Canvas;
use raystone_sampling::hash::pcg_hash;
use std::f64::consts::{FRAC_PI_4, PI, TAU};

/// Greatest number of points drawn.
pub const MOST_DRAWN: usize = 1 << 16;
/// Greatest number of points drawn as shapes; more are painted as pixels.
const MOST_SHAPES: usize = 1024;
/// Number of corners of a dot.
const CORNERS: usize = 10;
/// Elevation of the viewer of the hemisphere.
const TILT: f64 = PI / 5.0;
/// Colour of intervals without a point, and of the first pixel's points among others.
const ACCENT: usize = 1;

/// A point of the unit square.
pub type Pair = [f64; 2];

/// The domain that the points of the square are mapped to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Domain {
    /// The square itself.
    Square,
    /// `radius = √x`, `angle = 2π y`: the path tracer's mapping of directions
    /// (`kernels/shading/hemisphere.wesl`), seen from above.
    PolarDisc,
    /// Squares to rings (Shirley and Chiu 1997), for comparison: no kernel uses it.
    ConcentricDisc,
    /// Like [`Domain::PolarDisc`], lifted to `z = √(1 − x)` and seen from the side.
    Hemisphere,
}

impl Domain {
    /// Returns the place of a point in a square of side 1 that contains the domain.
    pub(crate) fn place(self, [x, y]: Pair) -> Pair {
        let on_disc = |radius: f64, angle: f64| [radius * angle.cos(), radius * angle.sin()];
        let [a, b] = match self {
            Self::Square => return [x, y],
            Self::PolarDisc => on_disc(x.sqrt(), TAU * y),
            Self::ConcentricDisc => {
                let (radius, angle) = concentric([x, y]);
                on_disc(radius, angle)
            }
            Self::Hemisphere => {
                let [a, b] = on_disc(x.sqrt(), TAU * y);
                return seen_from_the_side([a, b, (1.0 - x).max(0.0).sqrt()]);
            }
        };
        [0.5 + 0.5 * a, 0.5 + 0.5 * b]
    }

    /// Returns `true` if the point lies behind the dome, as seen from the side.
    fn is_behind(self, [x, y]: Pair) -> bool {
        // Seen along the direction (0, cos, −sin) of the tilt.
        let normal =
            x.sqrt() * (TAU * y).sin() * TILT.cos() - (1.0 - x).max(0.0).sqrt() * TILT.sin();
        self == Self::Hemisphere && normal > 0.0
    }

    /// Draws the border.
    fn outline(self, drawing: &mut Drawing, area: Area) {
        let curve = |drawing: &mut Drawing, ink, of: &dyn Fn(f64) -> Pair| {
            let corners = (0..=96).map(|i| area.at(of(f64::from(i) / 96.0)));
            drawing.line(corners.collect(), ink, 1.0);
        };
        match self {
            Self::Square => area.outline(drawing),
            Self::PolarDisc | Self::ConcentricDisc => {
                curve(drawing, DIM, &|t| Self::PolarDisc.place([1.0, t]));
            }
            Self::Hemisphere => {
                for height in [0.25, 0.5, 0.75] {
                    curve(drawing, GRID, &|t| self.place([height, t]));
                }
                for angle in [0.0, 0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875] {
                    curve(drawing, GRID, &|t| self.place([t, angle]));
                }
                curve(drawing, DIM, &|t| self.place([1.0, t]));
                let rim = |t: f64| {
                    let (sin, cos) = (PI * t).sin_cos();
                    seen_from_the_side([cos, sin * TILT.sin(), sin * TILT.cos()])
                };
                curve(drawing, DIM, &rim);
            }
        }
    }
}

/// Returns radius and angle of the concentric map (P. Shirley and K. Chiu, "A low distortion map between disk and
/// square", JGT 2(3), 1997).
fn concentric(point: Pair) -> (f64, f64) {
    let [a, b] = point.map(|c| 2.0 * c - 1.0);
    if a == 0.0 && b == 0.0 {
        (0.0, 0.0)
    } else if a.abs() > b.abs() {
        (a, FRAC_PI_4 * (b / a))
    } else {
        (b, 2.0 * FRAC_PI_4 - FRAC_PI_4 * (a / b))
    }
}

/// Projects the unit hemisphere along a direction that falls by [`TILT`].
fn seen_from_the_side([x, y, z]: [f64; 3]) -> Pair {
    [0.5 + 0.5 * x, 0.4 + 0.5 * (y * TILT.sin() + z * TILT.cos())]
}

/// Returns the indices of at most `most` of `n` points, in order: all of them, or a choice that does not depend on
/// their places (the least hashes), since every prefix or stride of a sequence has its own structure.
pub fn thinned(n: usize, most: usize) -> Vec<usize> {
    let mut chosen: Vec<usize> = (0..n).collect();
    if n > most {
        chosen.sort_by_cached_key(|&i| pcg_hash(i as u32));
        chosen.truncate(most);
        chosen.sort_unstable();
    }
    chosen
}

/// Returns in words how many of `n` points are drawn.
pub(crate) fn drawn_in_words(n: usize) -> String {
    match n {
        1 => "1 point".into(),
        _ if n <= MOST_DRAWN => format!("{n} points"),
        _ => format!("{MOST_DRAWN} of {n} points"),
    }
}

/// Counts the points in each of the `2^a × 2^b` elementary intervals, row by row from below; points on the upper
/// border count for the last cell.
pub(crate) fn interval_counts(points: &[Pair], [a, b]: [u32; 2]) -> Vec<u32> {
    let cell = |c: f64, bits: u32| {
        let cells = 1usize << bits;
        ((c * cells as f64) as usize).min(cells - 1)
    };
    let mut counts = vec![0; 1 << (a + b)];
    for [x, y] in points {
        counts[(cell(*y, b) << a) + cell(*x, a)] += 1;
    }
    counts
}

/// Points in a domain.
#[derive(Debug, Clone)]
pub(crate) struct Cloud {
    /// The domain.
    pub domain: Domain,
    /// Points of the unit square, [thinned](MOST_DRAWN) when drawn.
    pub points: Vec<Pair>,
    /// Points on top, in another colour.
    pub highlighted: Vec<Pair>,
    /// Exponents of the `2^a × 2^b` elementary intervals drawn below the points; those without a point are tinted.
    pub intervals: Option<[u32; 2]>,
}

impl Cloud {
    /// Returns a plot of points alone.
    pub(crate) fn new(domain: Domain, points: Vec<Pair>) -> Self {
        Self {
            domain,
            points,
            highlighted: Vec::new(),
            intervals: None,
        }
    }

    /// Returns the radius of a dot in pixels: a fraction of the mean distance between points, within limits.
    fn radius(&self, drawn: usize, area: Area) -> f64 {
        (0.16 * area.size.0 / (drawn.max(1) as f64).sqrt()).clamp(0.5, 3.2)
    }

    fn draw_intervals(&self, [a, b]: [u32; 2], drawing: &mut Drawing, area: Area) {
        let (columns, rows) = (1usize << a, 1usize << b);
        let corner =
            |x: usize, y: usize| area.at([x as f64 / columns as f64, y as f64 / rows as f64]);
        let tint = marker::ink(ACCENT).with_alpha(0.25);
        for (cell, count) in interval_counts(&self.points, [a, b]).iter().enumerate() {
            let (x, y) = (cell % columns, cell / columns);
            if *count == 0 {
                drawing.bar(corner(x, y), corner(x + 1, y + 1), tint);
            }
        }
        for x in 1..columns {
            drawing.line(vec![corner(x, 0), corner(x, rows)], GRID, 1.0);
        }
        for y in 1..rows {
            drawing.line(vec![corner(0, y), corner(columns, y)], GRID, 1.0);
        }
    }
}

impl Content for Cloud {
    fn draw(&self, drawing: &mut Drawing, area: Area) {
        if let Some(shape) = self.intervals {
            self.draw_intervals(shape, drawing, area);
        }
        self.domain.outline(drawing, area);
        let chosen = thinned(self.points.len(), MOST_DRAWN);
        let radius = self.radius(chosen.len(), area);
        // Overlapping dots add up to a full colour.
        let alpha = if chosen.len() > MOST_SHAPES { 0.6 } else { 0.9 };
        let ink = marker::ink(0);
        let dots = chosen.iter().map(|&i| {
            let point = self.points[i];
            let pale = if self.domain.is_behind(point) {
                0.3
            } else {
                1.0
            };
            (area.at(self.domain.place(point)), pale * alpha)
        });
        if chosen.len() > MOST_SHAPES {
            let mut canvas = Canvas::new((area.left, area.top), area.size.0, ink);
            dots.for_each(|(at, alpha)| canvas.dot(at, radius, alpha));
            drawing.rasters.push(canvas.into_raster());
        } else {
            dots.for_each(|(at, alpha)| dot(drawing, at, radius, ink.with_alpha(alpha)));
        }
        for point in &self.highlighted {
            let at = area.at(self.domain.place(*point));
            dot(drawing, at, 2.4, marker::ink(ACCENT));
        }
    }
}

/// Draws a disc as a polygon of few corners.
fn dot(drawing: &mut Drawing, (x, y): Point, radius: f64, ink: Ink) {
    let corner = |i: usize| {
        let (sin, cos) = (TAU * i as f64 / CORNERS as f64).sin_cos();
        (x + radius * cos, y + radius * sin)
    };
    drawing.area((0..CORNERS).map(corner).collect(), ink);
}

#[cfg(test)]
mod tests {
    use super::super::drawing::Shape;
    use super::super::panels::{self, Panel};
    use super::*;

    fn drawn(cloud: Cloud) -> Drawing {
        panels::draw(&[Panel::new("", "", cloud)], 1, (200.0, 200.0))
    }

    fn dots(drawing: &Drawing) -> Vec<Point> {
        let middle = |points: &[Point]| {
            let sum = points
                .iter()
                .fold((0.0, 0.0), |s, p| (s.0 + p.0, s.1 + p.1));
            (sum.0 / points.len() as f64, sum.1 / points.len() as f64)
        };
        let dots = drawing.shapes.iter().filter_map(|shape| match shape {
            Shape::Area { points, .. } if points.len() == CORNERS => Some(middle(points)),
            _ => None,
        });
        dots.collect()
    }

    #[test]
    fn no_point_draws_the_frame_one_point_one_dot_and_the_border_lies_on_the_frame() {
        for domain in [
            Domain::Square,
            Domain::PolarDisc,
            Domain::ConcentricDisc,
            Domain::Hemisphere,
        ] {
            let empty = drawn(Cloud::new(domain, Vec::new()));
            assert!(dots(&empty).is_empty() && !empty.shapes.is_empty());
            let one = drawn(Cloud::new(domain, vec![[0.25, 0.75]]));
            assert_eq!(dots(&one).len(), 1, "{domain:?}");
        }
        let corners = [[0.0, 0.0], [1.0, 1.0], [1.0, 0.0]];
        let expected = [(10.0, 226.0), (210.0, 26.0), (210.0, 226.0)];
        let drawing = drawn(Cloud::new(Domain::Square, corners.into()));
        for (found, expected) in dots(&drawing).iter().zip(expected) {
            let distance = (found.0 - expected.0).hypot(found.1 - expected.1);
            assert!(distance < 1e-9, "{found:?}");
        }
        assert_eq!(interval_counts(&corners, [1, 1]), [1, 1, 0, 1]);
    }

    #[test]
    fn a_hundred_thousand_points_are_thinned_to_the_number_said() {
        let points: Vec<Pair> = (0..100_000)
            .map(|i| [f64::from(i) / 1e5, f64::from(i * 7919 % 100_000) / 1e5])
            .collect();
        let chosen = thinned(points.len(), MOST_DRAWN);
        assert_eq!(chosen.len(), MOST_DRAWN);
        assert!(chosen.windows(2).all(|pair| pair[0] < pair[1]));
        // A fair choice: each tenth of the set keeps its share.
        let first = chosen.iter().filter(|&&i| i < 10_000).count();
        assert!((6_300..6_800).contains(&first), "{first}");
        assert_eq!(drawn_in_words(100_000), "65536 of 100000 points");
        assert_eq!(drawn_in_words(1), "1 point");
        assert_eq!(thinned(5, 9), [0, 1, 2, 3, 4]);
        let drawing = drawn(Cloud::new(Domain::Square, points));
        assert!(drawing.rasters.len() == 1 && dots(&drawing).is_empty());
    }

    #[test]
    fn the_disc_is_the_hemisphere_of_the_kernel_seen_from_above() {
        for (point, expected) in [
            ([1.0, 0.0], [1.0, 0.5]),
            ([0.25, 0.25], [0.5, 0.75]),
            ([0.0, 0.7], [0.5, 0.5]),
        ] {
            let [x, y] = Domain::PolarDisc.place(point);
            let distance = (x - expected[0]).hypot(y - expected[1]);
            assert!(distance < 1e-12, "{point:?}: {x} {y}");
        }
        // The concentric map sends the border to the border and the middle to the middle.
        let [x, y] = Domain::ConcentricDisc.place([1.0, 0.3]);
        assert!(((x - 0.5).hypot(y - 0.5) - 0.5).abs() < 1e-12);
        assert_eq!(Domain::ConcentricDisc.place([0.5, 0.5]), [0.5, 0.5]);
        // The pole is the highest point of the dome and in front.
        assert!(!Domain::Hemisphere.is_behind([0.0, 0.0]));
        assert!(Domain::Hemisphere.is_behind([1.0, 0.25]));
        assert!(!Domain::Hemisphere.is_behind([1.0, 0.75]));
    }

    #[test]
    fn intervals_without_a_point_are_tinted() {
        let tinted = |points: Vec<Pair>| {
            let cloud = Cloud {
                intervals: Some([1, 1]),
                ..Cloud::new(Domain::Square, points)
            };
            let is_tint =
                |shape: &&Shape| matches!(shape, Shape::Area { ink, .. } if ink.alpha == 0.25);
            drawn(cloud).shapes.iter().filter(is_tint).count()
        };
        let net = vec![[0.0, 0.0], [0.5, 0.5], [0.25, 0.75], [0.75, 0.25]];
        assert_eq!(tinted(net), 0);
        assert_eq!(tinted(vec![[0.1, 0.1], [0.2, 0.2]]), 3);
    }

    #[test]
    fn the_concentric_map_takes_equal_steps_along_a_side_to_equal_angles() {
        // Shirley and Chiu 1997: half a side of the square is an eighth of the circle, on the side where it lies.
        for (point, degrees) in [
            ([1.0, 0.75], 22.5),
            ([0.75, 1.0], 67.5),
            ([0.25, 1.0], 112.5),
            ([0.0, 0.75], 157.5),
            ([0.0, 0.25], 202.5),
            ([0.25, 0.0], 247.5),
            ([0.75, 0.0], 292.5),
            ([1.0, 0.25], 337.5),
        ] {
            let (sin, cos) = f64::to_radians(degrees).sin_cos();
            let [x, y] = Domain::ConcentricDisc.place(point);
            let off = (2.0 * x - 1.0 - cos).hypot(2.0 * y - 1.0 - sin);
            assert!(off < 1e-12, "{point:?}: {x} {y}");
        }
    }
}
