//! Bars of Mrays/s, grouped by ray class.

use super::axis::Axis;
use super::drawing::{Anchor, DIM, Drawing, FAILED, FONT_PX, GRID, INK};
use super::marker;
use super::paint::{fit_text, text_width};
use crate::measure::record::Interval;
use crate::report::format;

/// One bar, or what stands in its place.
#[derive(Debug, Clone, PartialEq)]
pub struct Bar {
    /// Name of the structure.
    pub label: String,
    /// Category: the same structure looks the same in every plot.
    pub look: usize,
    /// Mrays/s; absent when the structure has no right to a figure.
    pub rate: Option<Interval>,
    /// Text in place of the bar, for instance `FAILED`.
    pub instead: String,
}

/// Horizontal bars in groups.
#[derive(Debug, Clone, PartialEq)]
pub struct RatePlot {
    /// Which clock the times come from.
    pub clock: &'static str,
    /// `(ray class, one bar per structure)`.
    pub groups: Vec<(String, Vec<Bar>)>,
}

const WIDTH: f64 = 900.0;
const ROW: f64 = 24.0;
const HEADER: f64 = 30.0;

impl RatePlot {
    /// The picture; `None` without a bar.
    pub fn draw(&self) -> Option<Drawing> {
        let bars = || self.groups.iter().flat_map(|(_, bars)| bars);
        let widest = bars().map(|bar| text_width(&bar.label)).reduce(f64::max)?;
        let max = bars()
            .filter_map(|bar| bar.rate)
            .map(|rate| rate.high.max(rate.value))
            .fold(0.0, f64::max);
        let left = widest.min(330.0) + 40.0;
        let right = WIDTH - 170.0;
        let height: f64 = self
            .groups
            .iter()
            .map(|(_, bars)| HEADER + bars.len() as f64 * ROW)
            .sum();
        let bottom = height + 12.0;
        let mut drawing = Drawing::new(WIDTH, bottom + 56.0);
        let title = format!("million rays per second ({}; median)", self.clock);
        let axis = Axis::linear(max, &title);
        if max > 0.0 {
            axis.draw_below(&mut drawing, left, right, 8.0, bottom);
        }
        let mut y = 4.0;
        for (class, bars) in &self.groups {
            drawing.text((14.0, y + HEADER / 2.0), class, INK, Anchor::Start);
            let end = 22.0 + text_width(class);
            let rule = y + HEADER / 2.0;
            drawing.line(vec![(end.max(left), rule), (right, rule)], GRID, 1.0);
            y += HEADER;
            for bar in bars {
                let x_at = |rate: f64| left + axis.share(rate) * (right - left);
                bar.draw(&mut drawing, left, y + ROW / 2.0, x_at);
                y += ROW;
            }
        }
        Some(drawing)
    }
}

impl Bar {
    fn draw(&self, drawing: &mut Drawing, left: f64, y: f64, x_at: impl Fn(f64) -> f64) {
        let label = fit_text(&self.label, left - 30.0);
        drawing.text((left - 24.0, y), label, INK, Anchor::End);
        let ink = marker::ink(self.look);
        marker::draw(drawing, self.look, (left - 12.0, y), 4.5, ink);
        let Some(rate) = self.rate else {
            drawing.text((left + 8.0, y), &self.instead, FAILED, Anchor::Start);
            return;
        };
        let half = FONT_PX * 0.5;
        drawing.bar(
            (left, y - half),
            (x_at(rate.value), y + half),
            ink.with_alpha(0.85),
        );
        let (low, high) = (x_at(rate.low), x_at(rate.high));
        drawing.line(vec![(low, y), (high, y)], INK, 1.4);
        for end in [low, high] {
            drawing.line(vec![(end, y - 4.0), (end, y + 4.0)], INK, 1.4);
        }
        let text_left = high.max(x_at(rate.value)) + 8.0;
        let value = format::number(rate.value);
        let value_width = text_width(&value) + 7.0;
        drawing.text((text_left, y), value, INK, Anchor::Start);
        drawing.text(
            (text_left + value_width, y),
            format::bounds(&rate),
            DIM,
            Anchor::Start,
        );
    }
}

#[cfg(test)]
mod tests {
    use super::super::drawing::Shape;
    use super::*;

    fn bar(rate: Option<f64>) -> Bar {
        let rate = rate.map(|value| Interval {
            value,
            low: value * 0.9,
            high: value * 1.1,
        });
        Bar {
            label: "bvh".into(),
            look: 0,
            rate,
            instead: "FAILED".into(),
        }
    }

    fn filled(drawing: &Drawing) -> usize {
        let is_bar = |s: &&Shape| matches!(s, Shape::Area { ink, .. } if ink.alpha == 0.85);
        drawing.shapes.iter().filter(is_bar).count()
    }

    #[test]
    fn a_failed_structure_has_a_word_and_no_bar() {
        let plot = RatePlot {
            clock: "GPU clock",
            groups: vec![("primary".into(), vec![bar(Some(5.0)), bar(None)])],
        };
        let drawing = plot.draw().unwrap();
        assert_eq!(filled(&drawing), 1);
        assert!(drawing.texts().contains(&"FAILED"));
        let all_good = RatePlot {
            clock: "GPU clock",
            groups: vec![("primary".into(), vec![bar(Some(5.0)); 2])],
        }
        .draw()
        .unwrap();
        assert_eq!(filled(&all_good), 2);
        assert!(!all_good.texts().contains(&"FAILED"));
    }

    #[test]
    fn all_failed_still_draws_and_nothing_does_not() {
        let failed = RatePlot {
            clock: "GPU clock",
            groups: vec![("primary".into(), vec![bar(None)])],
        };
        assert_eq!(filled(&failed.draw().unwrap()), 0);
        assert!(
            RatePlot {
                clock: "GPU clock",
                groups: vec![]
            }
            .draw()
            .is_none()
        );
    }
}
