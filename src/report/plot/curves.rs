//! Curves with bands over a logarithmic y axis: error against samples or seconds, discrepancy against points,
//! efficiency against bounces.

use super::axis::{Axes, Axis, without_lone_points};
use super::drawing::{DIM, Drawing, INK, Ink};
use super::legend;
use super::marker;
use crate::document::Illustration;
use crate::format;
use raystone_record::Interval;

/// One point of a curve, with the ends of its 95 % interval (equal to `y` where there is none).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurvePoint {
    /// Abscissa, positive.
    pub x: f64,
    /// Ordinate; points that are not positive have no place on a logarithmic axis and are left out.
    pub y: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl CurvePoint {
    /// Returns the point of a figure at `x`.
    pub fn new(x: f64, y: &Interval) -> Self {
        Self {
            x,
            y: y.value,
            low: y.low,
            high: y.high,
        }
    }
}

/// One curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Text of the legend.
    pub label: String,
    /// Category: the same index looks the same in every plot of a report.
    pub look: usize,
    /// `true` for an exact curve without spread, which is drawn dashed.
    pub exact: bool,
    /// Points by increasing x.
    pub points: Vec<CurvePoint>,
}

/// A thin dashed line for comparison.
#[derive(Debug, Clone, PartialEq)]
pub struct Guide {
    /// Text of the legend.
    pub label: String,
    /// `y = factor · x^exponent`.
    pub factor: f64,
    /// The exponent of `y = factor · x^exponent`.
    pub exponent: f64,
}

impl Guide {
    /// Returns the line `y = factor · x^exponent`.
    pub fn new(label: impl Into<String>, factor: f64, exponent: f64) -> Self {
        Self {
            label: label.into(),
            factor,
            exponent,
        }
    }
}

/// Spacing of the ticks of the x axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ticks {
    /// 1, 2, 4, 8, …
    PowersOfTwo,
    /// 1, 2, 5, 10, …
    PowersOfTen,
    /// 0, 1, 2, …: the x axis is linear.
    Whole,
}

/// A plot with a logarithmic y axis, and a logarithmic x axis unless its ticks are whole numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct CurvePlot {
    /// Title of the x axis, with unit.
    pub x_title: String,
    /// Ticks of the x axis.
    pub x_ticks: Ticks,
    /// Title of the y axis, with unit.
    pub y_title: String,
    /// The curves.
    pub curves: Vec<Curve>,
    /// Comparison lines.
    pub guides: Vec<Guide>,
}

const WIDTH: f64 = 580.0;
const PLOT_HEIGHT: f64 = 400.0;

impl CurvePlot {
    /// Returns the curves that have a point.
    pub fn new(
        x_title: impl Into<String>,
        x_ticks: Ticks,
        y_title: impl Into<String>,
        curves: impl IntoIterator<Item = Curve>,
    ) -> Self {
        let curves = curves.into_iter().filter(|curve| !curve.points.is_empty());
        Self {
            x_title: x_title.into(),
            x_ticks,
            y_title: y_title.into(),
            curves: curves.collect(),
            guides: Vec::new(),
        }
    }

    /// Returns the same plot with lines for comparison.
    pub fn with_guides(mut self, guides: impl IntoIterator<Item = Guide>) -> Self {
        self.guides.extend(guides);
        self
    }

    /// Returns the plot as an illustration of a document, if there is anything to draw.
    pub fn figure(&self, name: String, caption: impl Into<String>) -> Option<Illustration> {
        Some(Illustration::new(name, caption, self.draw()?))
    }

    /// Draws the plot; `None` for fewer than two points with positive coordinates, since the tables show a single one.
    pub fn draw(&self) -> Option<Drawing> {
        let points = || {
            let points = self.curves.iter().flat_map(|curve| &curve.points);
            points.filter(|p| drawable(p, self.x_ticks))
        };
        points().nth(1)?;
        let xs = points().map(|p| p.x);
        let x = match self.x_ticks {
            Ticks::PowersOfTwo => Axis::log2(xs, &self.x_title)?,
            Ticks::PowersOfTen => Axis::log10(xs, &self.x_title)?,
            Ticks::Whole => Axis::whole(xs.reduce(f64::max)?, &self.x_title),
        };
        let ends = [x.min() * 1.05, x.max() / 1.05];
        let guides = self.guides.iter();
        let guide_ys = guides.flat_map(|guide| ends.map(|x| guide.at(x)));
        let (low, high) = without_lone_points(points().map(|p| p.y))?;
        let is_within = |p: &&CurvePoint| p.y >= low * 0.999 && p.y <= high * 1.001;
        let ys = points().filter(is_within);
        let ys = ys.flat_map(|p| [p.y, shown_low(p), p.high.min(p.y * 30.0)]);
        let y = Axis::log10(ys.chain(guide_ys), &self.y_title)?;
        let beyond = points().count() - points().filter(is_within).count();
        let rows = self.curves.len() + self.guides.len() + usize::from(beyond > 0);
        let mut drawing = Drawing::new(WIDTH, PLOT_HEIGHT + legend::height(rows));
        let axes = Axes::new(x, y, WIDTH, PLOT_HEIGHT);
        axes.draw(&mut drawing);
        let mut rows = legend::Rows::new(PLOT_HEIGHT, (16.0, WIDTH));
        for curve in &self.curves {
            curve.draw(&axes, self.x_ticks, &mut drawing);
            self.tell(curve, &axes, &mut drawing);
            let (ink, exact) = (marker::ink(curve.look), curve.exact);
            rows.add(&mut drawing, &curve.label, INK, |drawing, y| {
                curve_line(drawing, &[(16.0, y), (50.0, y)], ink, exact);
                marker::draw(drawing, curve.look, (33.0, y), 4.5, ink);
            });
        }
        for (i, guide) in self.guides.iter().enumerate() {
            let line = ends.map(|x| axes.at(x, guide.at(x)));
            guide_line(&mut drawing, &line, i);
            rows.add(&mut drawing, &guide.label, DIM, |drawing, y| {
                guide_line(drawing, &[(16.0, y), (50.0, y)], i);
            });
        }
        if beyond > 0 {
            let points = format::plural(beyond, "point");
            let text = format!("{points} far beyond the axis, drawn at its edge");
            rows.title(&mut drawing, &text, DIM);
        }
        drawing.says = self.says();
        Some(drawing)
    }

    /// Adds the values of a curve as tooltips.
    fn tell(&self, curve: &Curve, axes: &Axes, drawing: &mut Drawing) {
        for p in curve.points.iter().filter(|p| drawable(p, self.x_ticks)) {
            let of = Interval {
                value: p.y,
                low: p.low,
                high: p.high,
            };
            let (x, y) = (format::significant(p.x, 4), format::interval(&of));
            let (x, y) = (
                format!("{}: {x}", self.x_title),
                format!("{}: {y}", self.y_title),
            );
            drawing.spot(axes.at(p.x, p.y), format!("{}\n{x}\n{y}", curve.label));
        }
    }

    /// Describes the plot in words: where each curve begins and ends.
    fn says(&self) -> String {
        let curve = |curve: &Curve| {
            let mut points = curve.points.iter().filter(|p| drawable(p, self.x_ticks));
            let first = points.next()?;
            let at = |p: &CurvePoint| {
                format!("{} at {}", format::number(p.y), format::significant(p.x, 4))
            };
            let to = points
                .next_back()
                .map_or(String::new(), |last| format!(" to {}", at(last)));
            Some(format!("{}: {}{to}", curve.label, at(first)))
        };
        let curves: Vec<String> = self.curves.iter().filter_map(curve).collect();
        let (x, y) = (&self.x_title, &self.y_title);
        format!("Curves of {y} against {x}. {}.", curves.join("; "))
    }
}

impl Guide {
    fn at(&self, x: f64) -> f64 {
        self.factor * x.powf(self.exponent)
    }
}

impl Curve {
    fn draw(&self, axes: &Axes, ticks: Ticks, drawing: &mut Drawing) {
        let ink = marker::ink(self.look);
        let points = self.points.iter().filter(|p| drawable(p, ticks));
        let points: Vec<&CurvePoint> = points.collect();
        // An interval that reaches 0 ends at the bottom of the axis.
        let upper = points.iter().map(|p| axes.at(p.x, p.high));
        let lower = points.iter().rev();
        let lower = lower.map(|p| axes.at(p.x, p.low.max(axes.y.min())));
        if points.iter().any(|p| p.low < p.high) {
            drawing.area(upper.chain(lower).collect(), ink.with_alpha(0.22));
        }
        let line: Vec<_> = points.iter().map(|p| axes.at(p.x, p.y)).collect();
        if line.len() > 1 {
            curve_line(drawing, &line, ink, self.exact);
        }
        for at in line {
            marker::draw(drawing, self.look, at, 4.5, ink);
        }
    }
}

fn curve_line(drawing: &mut Drawing, points: &[(f64, f64)], ink: Ink, exact: bool) {
    if exact {
        drawing.dashed_line(points, ink, 1.8, 7.0, 4.0);
    } else {
        drawing.line(points.to_vec(), ink, 1.8);
    }
}

/// Draws a thin line, with a dash length that depends on the guide.
fn guide_line(drawing: &mut Drawing, points: &[(f64, f64)], index: usize) {
    let dash = 2.0 + 6.0 * index as f64;
    drawing.dashed_line(points, DIM, 1.1, dash, 3.0);
}

/// Returns the least value that an axis has to reach for a point: not an end that happens to lie close to 0.
fn shown_low(point: &CurvePoint) -> f64 {
    point.low.max(point.y / 30.0)
}

fn drawable(point: &CurvePoint, ticks: Ticks) -> bool {
    let has_place = point.x > 0.0 || (ticks == Ticks::Whole && point.x == 0.0);
    has_place && point.y > 0.0 && point.x.is_finite() && point.y.is_finite()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(points: Vec<CurvePoint>) -> CurvePlot {
        CurvePlot {
            x_title: "samples per pixel".into(),
            x_ticks: Ticks::PowersOfTwo,
            y_title: "relMSE".into(),
            curves: vec![Curve {
                label: "sobol".into(),
                look: 0,
                exact: false,
                points,
            }],
            guides: vec![Guide::new("2.5/√N", 2.5, -0.5)],
        }
    }

    #[test]
    fn a_plot_names_axes_curves_and_guides_and_leaves_out_zero_errors() {
        let at = |x, y| CurvePoint::new(x, &Interval::exact(y));
        let drawing = plot(vec![at(1.0, 0.5), at(2.0, 0.25)]).draw().unwrap();
        for text in ["samples per pixel", "relMSE", "sobol", "2.5/√N", "1", "2"] {
            assert!(drawing.texts().contains(&text), "{text}");
        }
        // One point is not a plot; two points of different curves are.
        assert!(plot(vec![at(4.0, 0.5), at(8.0, 0.0)]).draw().is_none());
        let mut two = plot(vec![at(4.0, 0.5)]);
        assert!(two.draw().is_none());
        two.curves.push(two.curves[0].clone());
        assert!(two.draw().is_some());
        assert!(plot(vec![]).draw().is_none());
    }

    #[test]
    fn an_interval_that_reaches_far_down_leaves_the_curve_its_room() {
        let at = |x, y, low| CurvePoint { x, y, low, high: y };
        let between = |low| {
            let mut plot = plot(vec![at(1.0, 1.0, 1.0), at(2.0, 0.1, low)]);
            plot.guides.clear();
            let spots = plot.draw().unwrap().spots;
            spots[1].at.1 - spots[0].at.1
        };
        // A decade of the three that a thirtieth of the lower point leaves on the axis.
        for low in [0.1, 1e-5, 1e-12] {
            assert!(between(low) > 0.25 * PLOT_HEIGHT, "{low}: {}", between(low));
        }
    }
}
