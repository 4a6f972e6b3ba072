//! Bars of Mrays/s, grouped by ray class.

use super::axis::Axis;
use super::drawing::{Anchor, DIM, Drawing, FAILED, FONT_PX, GRID, INK};
use super::marker;
use super::paint::{fit_text, text_width};
use crate::format;
use raystone_record::Interval;

/// One bar, or the text in its place.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Bar {
    /// Name of the structure.
    pub label: String,
    /// Category: the same structure looks the same in every plot.
    pub look: usize,
    /// Mrays/s; `None` for a structure without a valid figure.
    pub rate: Option<Interval>,
    /// Text in place of the bar, for instance `FAILED`.
    pub instead: String,
}

/// Horizontal bars in groups.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RatePlot {
    /// The clock of the times.
    pub clock: &'static str,
    /// `(ray class, one bar per structure)`.
    pub groups: Vec<(String, Vec<Bar>)>,
}

const WIDTH: f64 = 900.0;
const ROW: f64 = 24.0;
const HEADER: f64 = 30.0;

impl RatePlot {
    /// Draws the bars; `None` without a bar.
    pub(crate) fn draw(&self) -> Option<Drawing> {
        let bars = || self.groups.iter().flat_map(|(_, bars)| bars);
        let widest = bars().map(|bar| text_width(&bar.label)).reduce(f64::max)?;
        let rates = bars().filter_map(|bar| bar.rate);
        let max = rates
            .map(|rate| rate.high.max(rate.value))
            .fold(0.0, f64::max);
        let (left, right) = (widest.min(330.0) + 40.0, WIDTH - 170.0);
        let rows = bars().count() as f64 * ROW;
        let bottom = rows + self.groups.len() as f64 * HEADER + 12.0;
        let mut drawing = Drawing::new(WIDTH, bottom + 56.0);
        let title = format!("million rays per second ({}; median)", self.clock);
        let axis = Axis::linear(max, &title);
        if max > 0.0 {
            axis.draw_across(&mut drawing, (left, right), (8.0, bottom));
        }
        let mut y = 4.0;
        for (class, bars) in &self.groups {
            let rule = y + HEADER / 2.0;
            drawing.text((14.0, rule), class, INK, Anchor::Start);
            let end = 22.0 + text_width(class);
            drawing.line(vec![(end.max(left), rule), (right, rule)], GRID, 1.0);
            y += HEADER;
            for bar in bars {
                let x_at = |rate: f64| left + axis.share(rate) * (right - left);
                bar.draw(&mut drawing, left, y + ROW / 2.0, x_at);
                if let Some(rate) = bar.rate {
                    let (name, speed) = (&bar.label, format::interval(&rate));
                    let text = format!("{name}, {class} rays\n{speed} Mrays/s");
                    drawing.spot((x_at(rate.value), y + ROW / 2.0), text);
                }
                y += ROW;
            }
        }
        drawing.says = self.says();
        Some(drawing)
    }

    /// Describes the bars in words: the longest of each group, and structures without a bar.
    fn says(&self) -> String {
        let group = |(class, bars): &(String, Vec<Bar>)| {
            let rated = bars.iter().filter_map(|bar| Some((bar, bar.rate?.value)));
            let best = rated.max_by(|a, b| a.1.total_cmp(&b.1));
            let best = best.map(|(bar, rate)| {
                format!("{} is the longest with {}", bar.label, format::number(rate))
            });
            let without: Vec<&str> = (bars.iter().filter(|bar| bar.rate.is_none()))
                .map(|bar| bar.label.as_str())
                .collect();
            let without = if without.is_empty() {
                String::new()
            } else {
                format!(", without a bar: {}", without.join(", "))
            };
            format!("{class}: {}{without}", best.unwrap_or("no bar".into()))
        };
        let groups: Vec<String> = self.groups.iter().map(group).collect();
        format!(
            "Bars of Mrays/s by class of rays and structure. {}.",
            groups.join("; ")
        )
    }
}

impl Bar {
    fn draw(&self, drawing: &mut Drawing, left: f64, y: f64, x_at: impl Fn(f64) -> f64) {
        let label = fit_text(&self.label, left - 30.0);
        drawing.text((left - 24.0, y), label, INK, Anchor::End);
        let ink = marker::ink(self.look);
        marker::draw(drawing, self.look, (left - 12.0, y), 4.5, ink);
        let Some(rate) = self.rate else {
            let instead = fit_text(&self.instead, WIDTH - left - 14.0);
            drawing.text((left + 8.0, y), instead, FAILED, Anchor::Start);
            return;
        };
        let [value, low, high] = [rate.value, rate.low, rate.high].map(x_at);
        let half = FONT_PX * 0.5;
        drawing.bar((left, y - half), (value, y + half), ink.with_alpha(0.85));
        drawing.line(vec![(low, y), (high, y)], INK, 1.4);
        for end in [low, high] {
            drawing.line(vec![(end, y - 4.0), (end, y + 4.0)], INK, 1.4);
        }
        let x = high.max(value) + 8.0;
        let text = format::number(rate.value);
        let behind = x + text_width(&text) + 7.0;
        drawing.text((x, y), text, INK, Anchor::Start);
        drawing.text((behind, y), format::bounds(&rate), DIM, Anchor::Start);
    }
}

#[cfg(test)]
mod tests {
    use super::super::drawing::Shape;
    use super::*;

    #[test]
    fn a_failed_structure_has_a_word_and_no_bar() {
        let drawn = |rates: &[Option<f64>]| {
            let bar = |rate: &Option<f64>| Bar {
                label: "bvh".into(),
                look: 0,
                rate: rate.map(Interval::exact),
                instead: "FAILED".into(),
            };
            let bars = rates.iter().map(bar).collect();
            let plot = RatePlot {
                clock: "GPU clock",
                groups: vec![("primary".into(), bars)],
            };
            let drawing = plot.draw()?;
            let is_bar = |s: &&Shape| matches!(s, Shape::Area { ink, .. } if ink.alpha == 0.85);
            let bars = drawing.shapes.iter().filter(is_bar).count();
            Some((bars, drawing.texts().contains(&"FAILED")))
        };
        assert_eq!(drawn(&[Some(5.0), None]), Some((1, true)));
        assert_eq!(drawn(&[Some(5.0), Some(4.0)]), Some((2, false)));
        assert_eq!(drawn(&[None]), Some((0, true)));
        assert_eq!(drawn(&[]), None);
    }
}
