//! Axes: positions of values, ticks and their labels.

use super::drawing::{Anchor, DIM, Drawing, FONT_PX, GRID, INK, Point};
use super::paint::text_width;
use crate::format;
use raystone_core::text::escape::raised;

/// A tick: a gridline with an optional label (empty for none).
#[derive(Debug, Clone, PartialEq)]
struct Tick {
    value: f64,
    label: String,
}

/// One axis, linear or logarithmic.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    is_log: bool,
    min: f64,
    max: f64,
    ticks: Vec<Tick>,
    title: String,
}

impl Axis {
    /// Returns a linear axis from 0 to a little over `max`, with ticks at 1, 2 or 5 × 10ⁿ.
    pub fn linear(max: f64, title: &str) -> Self {
        // A step of numbers below the normal ones would be 0.
        let max = if max > 0.0 && max.is_normal() {
            max
        } else {
            1.0
        };
        let rough = max / 6.0;
        let power = 10f64.powf(rough.log10().floor());
        let steps = [1.0, 2.0, 5.0, 10.0].map(|m| m * power);
        let step = steps.into_iter().find(|s| *s >= rough).unwrap_or(rough);
        let decimals = (-step.log10().floor()).max(0.0) as usize;
        let values = (0..=(max / step).ceil() as usize).map(|i| i as f64 * step);
        let shown = values.filter(|value| *value <= max * 1.001);
        let tick = |value| Tick {
            value,
            label: format!("{value:.decimals$}"),
        };
        Self {
            is_log: false,
            min: 0.0,
            max,
            ticks: shown.map(tick).collect(),
            title: title.into(),
        }
    }

    /// Returns a linear axis from 0 to `max`, with ticks at whole numbers.
    pub fn whole(max: f64, title: &str) -> Self {
        let step = (max / 10.0).ceil().max(1.0) as usize;
        let tick = |value: usize| Tick {
            value: value as f64,
            label: value.to_string(),
        };
        Self {
            ticks: (0..=max as usize).step_by(step).map(tick).collect(),
            ..Self::linear(max, title)
        }
    }

    fn logarithmic([min, max]: [f64; 2], ticks: Vec<Tick>, title: &str) -> Self {
        Self {
            is_log: true,
            min,
            max,
            ticks,
            title: title.into(),
        }
    }

    /// Returns a logarithmic axis over the values with ticks at powers of two, at most nine of them
    /// labelled; `None` without a positive value.
    pub fn log2(values: impl Iterator<Item = f64>, title: &str) -> Option<Self> {
        let (low, high) = positive_range(values)?;
        let (first, last) = (low.log2().floor() as i32, high.log2().ceil() as i32);
        let stride = ((last - first) / 9 + 1) as usize;
        let tick = |exponent| {
            let value = 2f64.powi(exponent);
            let label = plain(value);
            Tick { value, label }
        };
        let ticks: Vec<Tick> = (first..=last).step_by(stride).map(tick).collect();
        // Values that are no powers of two lie between two ticks.
        let within =
            |(low, high): (f64, f64), tick: &Tick| (low.min(tick.value), high.max(tick.value));
        let (low, high) = ticks.iter().fold((low, high), within);
        let range = [low / 1.12, high * 1.12];
        Some(Self::logarithmic(range, ticks, title))
    }

    /// Returns a logarithmic axis over the values with ticks at powers of ten, and at 2 and 5 between
    /// them where there is room; `None` without a positive value.
    pub fn log10(values: impl Iterator<Item = f64>, title: &str) -> Option<Self> {
        let (low, high) = positive_range(values)?;
        // A margin, and at least a factor of three so that there are ticks.
        let air = (high / low).powf(0.05).max(1.1);
        let air = air.max((3.0 * low / high).sqrt());
        let (min, max) = (low / air, high * air);
        let decades = (max / min).log10();
        // Tenths of a power of ten.
        let labelled: &[u32] = match decades {
            _ if decades < 0.7 => &[10, 12, 15, 20, 25, 30, 40, 50, 60, 80],
            _ if decades < 1.2 => &[10, 20, 30, 40, 50, 60, 80],
            _ if decades < 3.0 => &[10, 20, 50],
            _ => &[10],
        };
        let mut ticks = Vec::new();
        let stride = (decades / 8.0).ceil().max(1.0) as i32;
        for exponent in min.log10().floor() as i32..=max.log10().ceil() as i32 {
            for tenths in 10..100 {
                let value = f64::from(tenths) * 10f64.powi(exponent - 1);
                let shown = labelled.contains(&tenths) && exponent.rem_euclid(stride) == 0;
                let label = shown.then(|| decimal_or_power(tenths, exponent));
                let between = tenths % 10 == 0 && decades < 4.0;
                if (min..=max).contains(&value) && (shown || between) {
                    let label = label.unwrap_or_default();
                    ticks.push(Tick { value, label });
                }
            }
        }
        Some(Self::logarithmic([min, max], ticks, title))
    }

    /// Returns the largest value shown.
    pub fn max(&self) -> f64 {
        self.max
    }

    /// Returns the smallest value shown.
    pub fn min(&self) -> f64 {
        self.min
    }

    /// Returns the position of a value along the axis, clamped to [0, 1].
    pub fn share(&self, value: f64) -> f64 {
        let share = if self.is_log {
            (value / self.min).ln() / (self.max / self.min).ln()
        } else {
            (value - self.min) / (self.max - self.min)
        };
        if share.is_nan() {
            0.0
        } else {
            share.clamp(0.0, 1.0)
        }
    }

    fn labelled(&self) -> impl Iterator<Item = &Tick> {
        self.ticks.iter().filter(|tick| !tick.label.is_empty())
    }

    /// Draws a horizontal axis: gridlines from `top` to `bottom`, labels and title below.
    pub(crate) fn draw_across(
        &self,
        drawing: &mut Drawing,
        (left, right): (f64, f64),
        (top, bottom): (f64, f64),
    ) {
        let at = |tick: &Tick| left + self.share(tick.value) * (right - left);
        for tick in &self.ticks {
            drawing.line(
                vec![(at(tick), top), (at(tick), bottom)],
                GRID,
                tick.width(),
            );
        }
        drawing.line(vec![(left, top), (left, bottom), (right, bottom)], DIM, 1.0);
        let mut free_from = 0.0;
        for tick in self.labelled() {
            let half = text_width(&tick.label) / 2.0;
            if at(tick) - half >= free_from {
                drawing.text((at(tick), bottom + 14.0), &tick.label, INK, Anchor::Middle);
                free_from = at(tick) + half + 8.0;
            }
        }
        let middle = ((left + right) / 2.0, bottom + 38.0);
        drawing.text(middle, &self.title, INK, Anchor::Middle);
    }

    /// Draws a vertical axis: gridlines from `left` to `right`, labels and title on the left.
    fn draw_up(&self, drawing: &mut Drawing, (left, right): (f64, f64), (top, bottom): (f64, f64)) {
        let at = |tick: &Tick| bottom - self.share(tick.value) * (bottom - top);
        for tick in &self.ticks {
            drawing.line(
                vec![(left, at(tick)), (right, at(tick))],
                GRID,
                tick.width(),
            );
        }
        let mut free_to = f64::INFINITY;
        for tick in self.labelled() {
            if at(tick) + FONT_PX / 2.0 <= free_to {
                drawing.text((left - 7.0, at(tick)), &tick.label, INK, Anchor::End);
                free_to = at(tick) - FONT_PX / 2.0 - 3.0;
            }
        }
        drawing.upward_text((14.0, (top + bottom) / 2.0), &self.title, INK);
    }

    /// Returns the width of the widest tick label in pixels.
    fn label_width(&self) -> f64 {
        let widths = self.ticks.iter().map(|tick| text_width(&tick.label));
        widths.fold(0.0, f64::max)
    }
}

impl Tick {
    /// Returns the width of the gridline in pixels.
    fn width(&self) -> f64 {
        if self.label.is_empty() { 0.5 } else { 1.0 }
    }
}

fn positive_range(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let positive = values.filter(|v| v.is_finite() && *v > 0.0);
    let ends = positive.map(|v| (v, v));
    ends.reduce(|(low, high), (v, _)| (low.min(v), high.max(v)))
}

/// Number of decades that a plot may span before lone points at its ends are cut off.
const MOST_DECADES: f64 = 6.0;
/// Number of empty decades that separate lone points from the others.
const LONE: f64 = 2.0;

/// Returns the least and the greatest positive value, without lone ones that would flatten all others: at most a
/// tenth of the values at either end, two empty decades from the rest. `None` without a positive value.
pub(crate) fn without_lone_points(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let positive = values.filter(|v| v.is_finite() && *v > 0.0);
    let mut logs: Vec<f64> = positive.map(f64::log10).collect();
    logs.sort_unstable_by(f64::total_cmp);
    let (&first, &last) = (logs.first()?, logs.last()?);
    let (mut low, mut high) = (0, logs.len() - 1);
    if last - first > MOST_DECADES {
        let few = (logs.len() / 10).max(1);
        let gap = |i: usize| logs[i + 1] - logs[i] > LONE;
        let from_below = (0..few.min(high)).rev().find(|i| gap(*i));
        low = from_below.map_or(0, |i| i + 1);
        let from_above = (high.saturating_sub(few)..high).find(|i| gap(*i));
        high = from_above.unwrap_or(high).max(low);
    }
    Some((10f64.powf(logs[low]), 10f64.powf(logs[high])))
}

fn plain(value: f64) -> String {
    if value >= 1.0 {
        format!("{value}")
    } else {
        format::significant(value, 2)
    }
}

/// Formats `tenths` tenths of a power of ten: `0.02`, `1.5`, `1000`, or `2·10⁻⁵` where that is shorter.
fn decimal_or_power(tenths: u32, exponent: i32) -> String {
    let mantissa = f64::from(tenths) / 10.0;
    if (-3..=4).contains(&exponent) {
        let last = if tenths.is_multiple_of(10) {
            exponent
        } else {
            exponent - 1
        };
        let decimals = (-last).max(0) as usize;
        return format!("{:.decimals$}", mantissa * 10f64.powi(exponent));
    }
    let power = raised(&exponent.to_string());
    match tenths {
        10 => format!("10{power}"),
        _ => format!("{mantissa}·10{power}"),
    }
}

/// Two axes and the rectangle that they span.
#[derive(Debug, Clone)]
pub struct Axes {
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Left and right edge.
    across: (f64, f64),
    /// Upper and lower edge.
    up: (f64, f64),
}

impl Axes {
    /// Places axes, with room for labels, in the upper `height` pixels of a drawing `width` pixels wide.
    pub fn new(x: Axis, y: Axis, width: f64, height: f64) -> Self {
        let left = (y.label_width() + 44.0).max(60.0);
        Self {
            x,
            y,
            across: (left, width - 18.0),
            up: (14.0, height - 52.0),
        }
    }

    /// Returns the pixel of a point.
    pub fn at(&self, x: f64, y: f64) -> Point {
        let ((left, right), (top, bottom)) = (self.across, self.up);
        let x = left + self.x.share(x) * (right - left);
        (x, bottom - self.y.share(y) * (bottom - top))
    }

    /// Draws gridlines, ticks, labels and titles.
    pub fn draw(&self, drawing: &mut Drawing) {
        self.y.draw_up(drawing, self.across, self.up);
        self.x.draw_across(drawing, self.across, self.up);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: Option<Axis>) -> Vec<String> {
        let axis = axis.expect("an axis");
        axis.labelled().map(|tick| tick.label.clone()).collect()
    }

    #[test]
    fn ticks_read_well_over_short_and_long_ranges() {
        let log2 = |values: &[f64]| Axis::log2(values.iter().copied(), "");
        let log10 = |values: &[f64]| Axis::log10(values.iter().copied(), "");
        let powers = ["1", "2", "4", "8", "16", "32"];
        assert_eq!(labels(log2(&[1.0, 2.0, 4.0, 32.0])), powers);
        assert!(labels(log2(&[1.0, 65536.0])).len() <= 9);
        assert!(labels(log10(&[0.02, 0.05])).contains(&"0.03".into()));
        let long = labels(log10(&[2e-6, 3.0]));
        let has = |label: &str| long.iter().any(|known| known == label);
        assert!(has("10⁻⁵") && has("1"), "{long:?}");
        assert!(labels(log10(&[0.5])).len() >= 2);
        assert_eq!(labels(log10(&[1.1, 2.2])), ["1", "1.2", "1.5", "2", "2.5"]);
        assert_eq!(labels(log10(&[1.1e-6, 1.4e-6])).len(), 5);
        assert!(labels(log10(&[120.0, 180.0])).contains(&"150".into()));
        assert!(log10(&[0.0, -1.0, f64::NAN]).is_none() && log2(&[]).is_none());
    }

    #[test]
    fn a_tick_stands_at_its_own_value() {
        for values in [
            [3.0, 24.0],
            [6.0, 10.0],
            [1.0, 32.0],
            [5.0, 5.0],
            [0.3, 70_000.0],
        ] {
            let [log2, log10] = [
                Axis::log2(values.into_iter(), ""),
                Axis::log10(values.into_iter(), ""),
            ];
            for axis in [log2.unwrap(), log10.unwrap()] {
                assert!(!axis.ticks.is_empty());
                for tick in &axis.ticks {
                    let at = axis.min * (axis.max / axis.min).powf(axis.share(tick.value));
                    assert!(
                        (at / tick.value - 1.0).abs() < 1e-9,
                        "{values:?}: {tick:?} at {at}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_lone_point_far_away_is_cut_off_and_a_long_range_that_is_filled_is_not() {
        let mut values: Vec<f64> = (1..=10).map(|i| 0.01 * f64::from(i)).collect();
        let ends = |values: &[f64]| without_lone_points(values.iter().copied()).unwrap();
        let near = |(a, b): (f64, f64), (c, d): (f64, f64)| {
            assert!(
                (a / c - 1.0).abs() < 1e-9 && (b / d - 1.0).abs() < 1e-9,
                "{a} {b}"
            )
        };
        values.push(1e-10);
        near(ends(&values), (0.01, 0.1));
        values.push(1e9);
        near(ends(&values), (0.01, 0.1));
        let filled: Vec<f64> = (0..20).map(|i| 10f64.powi(-i)).collect();
        near(ends(&filled), (1e-19, 1.0));
        near(ends(&[3.0]), (3.0, 3.0));
    }

    #[test]
    fn shares_run_from_zero_to_one() {
        // Neither nothing nor the least number has a scale of its own.
        for max in [0.0, 5e-324, f64::NAN] {
            assert_eq!(Axis::linear(max, "").max, 1.0);
        }
        let axis = Axis::linear(7.0, "rate");
        assert_eq!([axis.share(0.0), axis.share(7.0)], [0.0, 1.0]);
        assert_eq!(labels(Some(axis)), ["0", "2", "4", "6"]);
        assert_eq!(labels(Some(Axis::whole(3.0, ""))), ["0", "1", "2", "3"]);
        assert_eq!(labels(Some(Axis::whole(20.0, ""))).len(), 11);
        assert!(labels(Some(Axis::whole(29.0, ""))).len() <= 11);
        let log = Axis::log10([1.0, 100.0].into_iter(), "").unwrap();
        assert!((log.share(10.0) - 0.5).abs() < 1e-12);
    }
}
