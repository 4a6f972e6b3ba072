//! Axes: where a value lies, which ticks are drawn, how they read.

use super::drawing::{Anchor, DIM, Drawing, FONT_PX, GRID, INK, Point};
use super::paint::text_width;
use crate::report::format;

/// How values map to a length.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Scale {
    Linear,
    Log,
}

/// A tick: a gridline, with a label unless that is empty.
#[derive(Debug, Clone, PartialEq)]
struct Tick {
    value: f64,
    label: String,
}

/// One axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    scale: Scale,
    min: f64,
    max: f64,
    ticks: Vec<Tick>,
    title: String,
}

impl Axis {
    /// From 0 to a little over `max`, ticks at 1, 2 or 5 × 10ⁿ.
    pub fn linear(max: f64, title: &str) -> Self {
        let max = if max > 0.0 { max } else { 1.0 };
        let rough = max / 6.0;
        let power = 10f64.powf(rough.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0]
            .iter()
            .map(|m| m * power)
            .find(|s| *s >= rough)
            .unwrap_or(rough);
        let decimals = (-step.log10().floor()).max(0.0) as usize;
        let ticks = (0..=(max / step).ceil() as usize)
            .map(|i| Tick {
                value: i as f64 * step,
                label: format!("{:.decimals$}", i as f64 * step),
            })
            .filter(|tick| tick.value <= max * 1.001)
            .collect();
        Self {
            scale: Scale::Linear,
            min: 0.0,
            max,
            ticks,
            title: title.into(),
        }
    }

    /// Logarithmic over the values, ticks at powers of two, at most nine of them labelled; `None`
    /// without a positive value.
    pub fn log2(values: impl Iterator<Item = f64>, title: &str) -> Option<Self> {
        let (low, high) = positive_range(values)?;
        let (first, last) = (low.log2().floor() as i32, high.log2().ceil() as i32);
        let stride = ((last - first) / 9 + 1) as usize;
        let ticks = (first..=last)
            .step_by(stride)
            .map(|e| 2f64.powi(e))
            .map(|value| Tick {
                value,
                label: plain(value),
            })
            .collect();
        let (min, max) = (low / 1.12, high * 1.12);
        Some(Self {
            scale: Scale::Log,
            min,
            max,
            ticks,
            title: title.into(),
        })
    }

    /// Logarithmic over the values, ticks at powers of ten, with 2 and 5 between them where there is
    /// room; `None` without a positive value.
    pub fn log10(values: impl Iterator<Item = f64>, title: &str) -> Option<Self> {
        let (low, high) = positive_range(values)?;
        // Some air, and at least a factor of three so that there are ticks.
        let air = ((high / low).powf(0.05))
            .max(1.1)
            .max((3.0 * low / high).sqrt());
        let (min, max) = (low / air, high * air);
        let decades = (max / min).log10();
        let labelled: &[u32] = if decades < 1.2 {
            &[1, 2, 3, 4, 5, 6, 8]
        } else if decades < 3.0 {
            &[1, 2, 5]
        } else {
            &[1]
        };
        let mut ticks = Vec::new();
        let stride = (decades / 8.0).ceil().max(1.0) as i32;
        for exponent in min.log10().floor() as i32..=max.log10().ceil() as i32 {
            for mantissa in 1..10 {
                let value = f64::from(mantissa) * 10f64.powi(exponent);
                let shown = labelled.contains(&mantissa) && exponent.rem_euclid(stride) == 0;
                let label = if shown {
                    decimal_or_power(mantissa, exponent)
                } else {
                    String::new()
                };
                if (min..=max).contains(&value) && (shown || decades < 4.0) {
                    ticks.push(Tick { value, label });
                }
            }
        }
        Some(Self {
            scale: Scale::Log,
            min,
            max,
            ticks,
            title: title.into(),
        })
    }

    /// Largest value shown.
    pub fn max(&self) -> f64 {
        self.max
    }

    /// Smallest value shown.
    pub fn min(&self) -> f64 {
        self.min
    }

    /// Position of a value as a share of the axis, 0 to 1; clamped.
    pub fn share(&self, value: f64) -> f64 {
        let share = match self.scale {
            Scale::Linear => (value - self.min) / (self.max - self.min),
            Scale::Log => (value / self.min).ln() / (self.max / self.min).ln(),
        };
        if share.is_nan() {
            0.0
        } else {
            share.clamp(0.0, 1.0)
        }
    }

    /// Draws it as the only axis of a plot: gridlines from `top` to `bottom`, labels below.
    pub fn draw_below(&self, drawing: &mut Drawing, left: f64, right: f64, top: f64, bottom: f64) {
        for tick in &self.ticks {
            let x = left + self.share(tick.value) * (right - left);
            drawing.line(vec![(x, top), (x, bottom)], GRID, grid_width(tick));
            drawing.text((x, bottom + 14.0), &tick.label, INK, Anchor::Middle);
        }
        drawing.line(vec![(left, top), (left, bottom), (right, bottom)], DIM, 1.0);
        drawing.text(
            ((left + right) / 2.0, bottom + 38.0),
            &self.title,
            INK,
            Anchor::Middle,
        );
    }

    /// Width of the widest tick label in pixels.
    fn label_width(&self) -> f64 {
        self.ticks
            .iter()
            .map(|tick| text_width(&tick.label))
            .fold(0.0, f64::max)
    }
}

fn positive_range(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values
        .filter(|v| v.is_finite() && *v > 0.0)
        .fold(None, |range, v| {
            range.map_or(Some((v, v)), |(a, b): (f64, f64)| {
                Some((a.min(v), b.max(v)))
            })
        })
}

fn plain(value: f64) -> String {
    if value >= 1.0 {
        format!("{value}")
    } else {
        format::significant(value, 2)
    }
}

/// `0.02`, `1000`, or `2·10⁻⁵` where that is shorter.
fn decimal_or_power(mantissa: u32, exponent: i32) -> String {
    if (-2..=4).contains(&exponent) {
        let decimals = (-exponent).max(0) as usize;
        return format!("{:.decimals$}", f64::from(mantissa) * 10f64.powi(exponent));
    }
    let power: String = exponent
        .to_string()
        .chars()
        .map(|c| match c {
            '-' => '⁻',
            digit => {
                ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][digit as usize - '0' as usize]
            }
        })
        .collect();
    if mantissa == 1 {
        format!("10{power}")
    } else {
        format!("{mantissa}·10{power}")
    }
}

/// The rectangle that two axes span.
#[derive(Debug, Clone)]
pub struct Frame {
    /// Axis from left to right.
    pub x: Axis,
    /// Axis from bottom to top.
    pub y: Axis,
    left: f64,
    top: f64,
    right: f64,
    bottom: f64,
}

impl Frame {
    /// Axes in the upper `height` pixels of a drawing `width` pixels wide; room is left for labels.
    pub fn new(x: Axis, y: Axis, width: f64, height: f64) -> Self {
        let left = (y.label_width() + 44.0).max(60.0);
        Self {
            x,
            y,
            left,
            top: 14.0,
            right: width - 18.0,
            bottom: height - 52.0,
        }
    }

    /// Pixel of a point.
    pub fn at(&self, x: f64, y: f64) -> Point {
        (
            self.left + self.x.share(x) * (self.right - self.left),
            self.bottom - self.y.share(y) * (self.bottom - self.top),
        )
    }

    /// Draws gridlines, ticks, labels and titles.
    pub fn draw(&self, drawing: &mut Drawing) {
        for tick in &self.x.ticks {
            let x = self.at(tick.value, self.y.min).0;
            drawing.line(
                vec![(x, self.top), (x, self.bottom)],
                GRID,
                grid_width(tick),
            );
        }
        for tick in &self.y.ticks {
            let y = self.at(self.x.min, tick.value).1;
            drawing.line(
                vec![(self.left, y), (self.right, y)],
                GRID,
                grid_width(tick),
            );
        }
        let corners = vec![
            (self.left, self.top),
            (self.left, self.bottom),
            (self.right, self.bottom),
        ];
        drawing.line(corners, DIM, 1.0);
        let mut free_from = 0.0;
        for tick in self.x.ticks.iter().filter(|tick| !tick.label.is_empty()) {
            let x = self.at(tick.value, self.y.min).0;
            let half = text_width(&tick.label) / 2.0;
            if x - half >= free_from {
                drawing.text((x, self.bottom + 14.0), &tick.label, INK, Anchor::Middle);
                free_from = x + half + 8.0;
            }
        }
        let mut free_to = f64::INFINITY;
        for tick in self.y.ticks.iter().filter(|tick| !tick.label.is_empty()) {
            let y = self.at(self.x.min, tick.value).1;
            if y + FONT_PX / 2.0 <= free_to {
                drawing.text((self.left - 7.0, y), &tick.label, INK, Anchor::End);
                free_to = y - FONT_PX / 2.0 - 3.0;
            }
        }
        let middle = (self.left + self.right) / 2.0;
        drawing.text(
            (middle, self.bottom + 38.0),
            &self.x.title,
            INK,
            Anchor::Middle,
        );
        drawing.upward_text((14.0, (self.top + self.bottom) / 2.0), &self.y.title, INK);
    }
}

fn grid_width(tick: &Tick) -> f64 {
    if tick.label.is_empty() { 0.5 } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis) -> Vec<&str> {
        axis.ticks
            .iter()
            .map(|t| t.label.as_str())
            .filter(|l| !l.is_empty())
            .collect()
    }

    #[test]
    fn log2_ticks_are_powers_of_two_and_few() {
        let axis = Axis::log2([1.0, 2.0, 4.0, 32.0].into_iter(), "spp").unwrap();
        assert_eq!(labels(&axis), ["1", "2", "4", "8", "16", "32"]);
        let long = Axis::log2([1.0, 65536.0].into_iter(), "N").unwrap();
        assert!(labels(&long).len() <= 9, "{:?}", labels(&long));
    }

    #[test]
    fn log10_ticks_read_well_over_short_and_long_ranges() {
        let short = Axis::log10([0.02, 0.05].into_iter(), "error").unwrap();
        assert!(labels(&short).contains(&"0.03"), "{:?}", labels(&short));
        let long = Axis::log10([2e-6, 3.0].into_iter(), "error").unwrap();
        assert!(
            labels(&long).contains(&"10⁻⁵") && labels(&long).contains(&"1"),
            "{:?}",
            labels(&long)
        );
        let single = Axis::log10([0.5].into_iter(), "error").unwrap();
        assert!(labels(&single).len() >= 2, "{:?}", labels(&single));
    }

    #[test]
    fn values_without_a_logarithm_make_no_axis() {
        assert!(Axis::log10([0.0, -1.0, f64::NAN].into_iter(), "").is_none());
        assert!(Axis::log2(std::iter::empty(), "").is_none());
    }

    #[test]
    fn shares_run_from_zero_to_one() {
        let axis = Axis::linear(7.0, "rate");
        assert_eq!(axis.share(0.0), 0.0);
        assert_eq!(axis.share(7.0), 1.0);
        assert_eq!(labels(&axis), ["0", "2", "4", "6"]);
        let log = Axis::log10([1.0, 100.0].into_iter(), "").unwrap();
        assert!((log.share(10.0) - 0.5).abs() < 1e-12);
    }
}
