//! Run time against error: one point per cell, with the Pareto front drawn and labelled.

use super::axis::{Axes, Axis};
use super::drawing::{Anchor, DIM, Drawing, INK, Point};
use super::legend;
use super::marker;
use crate::format;
use raystone_record::Interval;
use raystone_stats::comparison::Place;
use raystone_stats::statistics::pareto_front;

/// One cell.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct CellPoint {
    /// Index into [`ParetoPlot::structures`]: the colour and the letter.
    pub structure: usize,
    /// Index into [`ParetoPlot::samplers`]: the marker.
    pub sampler: usize,
    /// Seconds per image.
    pub seconds: Interval,
    /// Error of the image, positive.
    pub error: Interval,
    /// Position relative to the Pareto front, by a test.
    pub place: Place,
}

/// The plot of one scene and integrator.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ParetoPlot {
    /// Title of the x axis.
    pub x_title: String,
    /// Title of the y axis.
    pub y_title: String,
    /// Names and looks of the structures.
    pub structures: Vec<(String, usize)>,
    /// Names and looks of the samplers.
    pub samplers: Vec<(String, usize)>,
    /// The cells.
    pub points: Vec<CellPoint>,
}

const WIDTH: f64 = 900.0;
const PLOT_HEIGHT: f64 = 480.0;

/// Returns the letter of a structure: a, b, …, z, then a number.
pub(crate) fn letter(index: usize) -> String {
    match u8::try_from(index) {
        Ok(i) if i < 26 => char::from(b'a' + i).to_string(),
        _ => (index + 1).to_string(),
    }
}

impl ParetoPlot {
    /// Returns the indices of the points of the measured front by increasing time: each is on it for certain, or undecided.
    pub(crate) fn front(&self) -> Vec<usize> {
        let points = self.points.iter();
        let points = points.map(|p| (p.seconds.value, p.error.value));
        pareto_front(&points.collect::<Vec<_>>())
    }

    /// Returns the name of a point: structure · sampler.
    pub(crate) fn name(&self, point: &CellPoint) -> String {
        format!(
            "{} · {}",
            self.structures[point.structure].0, self.samplers[point.sampler].0
        )
    }

    /// Returns the label of a point of the front.
    fn rank(&self, rank: usize, point: usize) -> String {
        let open = match self.points[point].place {
            Place::Front => "",
            Place::Open | Place::Beaten => "?",
        };
        format!("{}{open}", rank + 1)
    }

    /// Draws the plot; `None` without a point with positive time and error.
    pub(crate) fn draw(&self) -> Option<Drawing> {
        let ends = |i: Interval| [i.value, i.low, i.high];
        let times = self.points.iter().flat_map(|p| ends(p.seconds));
        let errors = self.points.iter().flat_map(|p| {
            // An interval end that happens to lie close to 0 must not stretch the axis.
            let low = p.error.low.max(p.error.value / 30.0);
            ends(Interval { low, ..p.error })
        });
        let x = Axis::log10(times, &self.x_title)?;
        let y = Axis::log10(errors, &self.y_title)?;
        let front = self.front();
        let rows = self.structures.len().max(self.samplers.len()) + front.len() + 2;
        let mut drawing = Drawing::new(WIDTH, PLOT_HEIGHT + legend::height(rows) + legend::ROW);
        let axes = Axes::new(x, y, WIDTH, PLOT_HEIGHT);
        axes.draw(&mut drawing);
        self.draw_uncertainty(&axes, &mut drawing);
        self.draw_front(&axes, &front, &mut drawing);
        for point in &self.points {
            self.draw_point(point, &axes, &mut drawing);
        }
        self.draw_labels(&axes, &front, &mut drawing);
        self.draw_legend(&front, &mut drawing);
        let named: Vec<String> = front.iter().map(|&i| self.name(&self.points[i])).collect();
        drawing.says = format!(
            "{} cells as points of time and error. On the Pareto front, from fast to exact: {}.",
            self.points.len(),
            named.join("; ")
        );
        Some(drawing)
    }

    /// Fills the area between the front of all lower ends of the intervals and that of all upper ends.
    fn draw_uncertainty(&self, axes: &Axes, drawing: &mut Drawing) {
        let stairs = |end: fn(&Interval) -> f64| {
            let corners = self.points.iter().map(|p| (end(&p.seconds), end(&p.error)));
            let corners: Vec<Point> = corners.collect();
            let front = pareto_front(&corners);
            staircase(axes, front.into_iter().map(|i| corners[i]))
        };
        let (best, worst) = (stairs(|i| i.low), stairs(|i| i.high));
        let band: Vec<Point> = best.into_iter().chain(worst.into_iter().rev()).collect();
        drawing.area(band, DIM.with_alpha(0.16));
    }

    /// Draws the front: points above and to the right of it are beaten.
    fn draw_front(&self, axes: &Axes, front: &[usize], drawing: &mut Drawing) {
        let corners = front.iter().map(|&i| &self.points[i]);
        let stairs = staircase(axes, corners.map(|p| (p.seconds.value, p.error.value)));
        drawing.dashed_line(&stairs, DIM, 1.4, 6.0, 4.0);
    }

    fn draw_point(&self, point: &CellPoint, axes: &Axes, drawing: &mut Drawing) {
        let ink = marker::ink(self.structures[point.structure].1);
        let (seconds, error) = (point.seconds, point.error);
        let low = error.low.max(axes.y.min());
        let across = [seconds.low, seconds.high].map(|x| axes.at(x, error.value));
        let up = [low, error.high].map(|y| axes.at(seconds.value, y));
        for ends in [across, up] {
            drawing.line(ends.to_vec(), ink.with_alpha(0.5), 1.2);
        }
        let at = axes.at(seconds.value, error.value);
        let (time, off) = (format::interval(&seconds), format::interval(&error));
        let (x, y) = (&self.x_title, &self.y_title);
        drawing.spot(at, format!("{}\n{x}: {time}\n{y}: {off}", self.name(point)));
        marker::draw(drawing, self.samplers[point.sampler].1, at, 5.5, ink);
    }

    /// Draws ranks of the front and letters of the structures where they cover no marker and no other label; where
    /// there is no room a letter is left out.
    fn draw_labels(&self, axes: &Axes, front: &[usize], drawing: &mut Drawing) {
        const CLEAR: f64 = 12.0;
        let at = |i: usize| {
            let point: &CellPoint = &self.points[i];
            axes.at(point.seconds.value, point.error.value)
        };
        let mut taken: Vec<Point> = (0..self.points.len()).map(at).collect();
        let ranks = front.iter().enumerate();
        let ranks = ranks.map(|(rank, &i)| (i, self.rank(rank, i), INK));
        let letters = (0..self.points.len()).map(|i| (i, letter(self.points[i].structure), DIM));
        for (i, text, ink) in ranks.chain(letters) {
            let (x, y) = at(i);
            let is_rank = ink == INK;
            let side = if is_rank { -1.0 } else { 1.0 };
            let places = [(1.0, -1.0), (1.0, 1.0), (-1.0, -1.0), (-1.0, 1.0)]
                .map(|(dx, dy)| (x + 12.0 * dx * side, y - 9.0 * dy * side));
            let is_free = |place: &&Point| {
                let far = |other: &Point| (other.0 - place.0).hypot(other.1 - place.1) >= CLEAR;
                taken.iter().all(far)
            };
            let free = places.iter().find(is_free).copied();
            // The front is labelled even where there is no room.
            if let Some(place) = free.or(is_rank.then_some(places[0])) {
                drawing.text(place, text, ink, Anchor::Middle);
                taken.push(place);
            }
        }
    }

    fn draw_legend(&self, front: &[usize], drawing: &mut Drawing) {
        let mut left = legend::Rows::new(PLOT_HEIGHT, (16.0, WIDTH / 2.0));
        left.title(drawing, "structure (colour, letter)", DIM);
        for (i, (name, look)) in self.structures.iter().enumerate() {
            left.add(drawing, name, INK, |drawing, y| {
                drawing.bar((18.0, y - 5.0), (34.0, y + 5.0), marker::ink(*look));
                drawing.text((42.0, y), letter(i), INK, Anchor::Start);
            });
        }
        let mut right = legend::Rows::new(PLOT_HEIGHT, (WIDTH / 2.0, WIDTH));
        right.title(drawing, "sampler (marker)", DIM);
        for (name, look) in &self.samplers {
            right.add(drawing, name, INK, |drawing, y| {
                marker::draw(drawing, *look, (WIDTH / 2.0 + 20.0, y), 5.0, DIM);
            });
        }
        left.y = left.y.max(right.y) + legend::ROW / 2.0;
        left.title(
            drawing,
            "Pareto front: no cell is both faster and better (?: the noise leaves it open); grey: where it may lie",
            DIM,
        );
        let mut fronts = legend::Rows::new(left.y - legend::ROW / 2.0, (16.0, WIDTH));
        for (rank, &i) in front.iter().enumerate() {
            fronts.add(drawing, &self.name(&self.points[i]), INK, |drawing, y| {
                drawing.text((34.0, y), self.rank(rank, i), INK, Anchor::End);
            });
        }
    }
}

/// Returns the steps through some corners by increasing time, from the upper edge to the right one.
fn staircase(axes: &Axes, corners: impl Iterator<Item = Point>) -> Vec<Point> {
    let mut stairs: Vec<Point> = Vec::new();
    for (seconds, error) in corners {
        let (x, y) = axes.at(seconds, error);
        let top = || axes.at(axes.x.min(), axes.y.max()).1;
        let from = stairs.last().map_or_else(top, |last| last.1);
        stairs.extend([(x, from), (x, y)]);
    }
    if let Some(&(_, y)) = stairs.last() {
        stairs.push((axes.at(axes.x.max(), axes.y.min()).0, y));
    }
    stairs
}

#[cfg(test)]
mod tests {
    use super::super::drawing::Shape;
    use super::*;

    #[test]
    fn the_picture_names_the_front() {
        let point = |structure, seconds, error| CellPoint {
            structure,
            sampler: 0,
            seconds: Interval::exact(seconds),
            error: Interval::exact(error),
            place: if structure == 0 {
                Place::Front
            } else {
                Place::Open
            },
        };
        let plot = ParetoPlot {
            x_title: "seconds".into(),
            y_title: "relMSE".into(),
            structures: vec![("bvh".into(), 0), ("brute-force".into(), 1)],
            samplers: vec![("sobol × none".into(), 0)],
            points: vec![point(0, 1.0, 0.1), point(1, 9.0, 0.1)],
        };
        let drawing = plot.draw().unwrap();
        assert!(drawing.texts().contains(&"1") && !drawing.texts().contains(&"1?"));
        let mut open = plot.clone();
        open.points[0].place = Place::Open;
        assert!(open.draw().unwrap().texts().contains(&"1?"));
        assert!(drawing.texts().contains(&"bvh · sobol × none"));
        assert!(!drawing.texts().contains(&"brute-force · sobol × none"));
    }

    #[test]
    fn the_grey_band_reaches_as_far_as_the_intervals_of_a_lone_point() {
        let plot = ParetoPlot {
            x_title: "seconds".into(),
            y_title: "relMSE".into(),
            structures: vec![("bvh".into(), 0)],
            samplers: vec![("sobol × none".into(), 0)],
            points: vec![CellPoint {
                structure: 0,
                sampler: 0,
                seconds: Interval {
                    value: 3.0,
                    low: 2.0,
                    high: 5.0,
                },
                error: Interval {
                    value: 0.2,
                    low: 0.1,
                    high: 0.3,
                },
                place: Place::Front,
            }],
        };
        let shapes = plot.draw().unwrap().shapes;
        let grey = DIM.with_alpha(0.16);
        let band = shapes.iter().find_map(|shape| match shape {
            Shape::Area { points, ink } if *ink == grey => Some(points.clone()),
            _ => None,
        });
        // The whiskers of the point: across and up.
        let whiskers = shapes.iter().filter_map(|shape| match shape {
            Shape::Line { points, ink, .. } if ink.alpha == 0.5 => Some(points.clone()),
            _ => None,
        });
        let whiskers: Vec<Vec<Point>> = whiskers.collect();
        let [across, up] = &whiskers[..] else {
            panic!("{whiskers:?}")
        };
        let band = band.expect("a band");
        for end in [0, 1] {
            let corner = (across[end].0, up[end].1);
            assert!(band.contains(&corner), "{corner:?} in {band:?}");
        }
    }
}
