//! Power spectra of point sets.

use super::drawing::{Anchor, DIM, Drawing, GRID, INK};
use super::marker;
use super::panels::{Area, Content};
use super::raster::Raster;
use raystone_discrepancy::Periodogram;
use raystone_image::viridis;

/// Ends of the power scale, as powers of ten.
const DECADES: [f64; 2] = [-2.0, 2.0];

/// Width of the labels of a curve, pixels.
const LABELS: f64 = 42.0;

/// Returns the highest frequency shown for this many points: twice their mean number per unit of length, within limits.
pub(crate) fn highest_frequency(points: usize) -> usize {
    (2.0 * (points as f64).sqrt()).round().clamp(16.0, 96.0) as usize
}

/// Returns the place of a power on the scale, clamped to [0, 1].
fn share(power: f64) -> f64 {
    let [low, high] = DECADES;
    // Rounding leaves 10⁻³⁰ where a power is 0; the floor makes the logarithm finite.
    ((power.max(1e-30).log10() - low) / (high - low)).clamp(0.0, 1.0)
}

/// Mean power against the length of the frequency, element 0 for frequency 1; logarithmic from 0.01 to 100, clamped
/// to the edges.
#[derive(Debug, Clone)]
pub(crate) struct RadialCurve(pub Vec<f64>);

impl Content for RadialCurve {
    fn draw(&self, drawing: &mut Drawing, area: Area) {
        // Labels are inside the frame, so that panels may be close together.
        let left = LABELS / area.size.0;
        let across = |power| [[left, share(power)], [1.0, share(power)]].map(|end| area.at(end));
        for power in [0.1, 1.0, 10.0] {
            drawing.line(across(power).into(), GRID, 1.0);
        }
        drawing.dashed_line(&across(1.0), DIM, 1.2, 5.0, 4.0);
        area.outline(drawing);
        for power in [0.01, 0.1, 1.0, 10.0, 100.0] {
            let (x, y) = area.at([left, share(power)]);
            let y = y.clamp(area.top + 10.0, area.top + area.size.1 - 10.0);
            drawing.text((x - 6.0, y), power.to_string(), DIM, Anchor::End);
        }
        let last = self.0.len().max(2) as f64;
        let at = |(i, power): (usize, &f64)| {
            area.at([left + (1.0 - left) * (i + 1) as f64 / last, share(*power)])
        };
        let line = self.0.iter().enumerate().map(at).collect();
        drawing.line(line, marker::ink(0), 1.6);
    }
}

/// Power at every frequency, frequency 0 in the middle (left white), on a logarithmic colour scale from 0.01 to 100.
pub(crate) struct PeriodogramMap(pub Periodogram);

impl Content for PeriodogramMap {
    fn draw(&self, drawing: &mut Drawing, area: Area) {
        let highest = self.0.highest as i32;
        let color = |x: i32, y: i32| match [x, y] {
            [0, 0] => [255; 3],
            frequency => viridis(share(self.0.power(frequency)) as f32),
        };
        let rows = (-highest..=highest).rev();
        let rgb = rows.flat_map(|y| (-highest..=highest).map(move |x| (x, y)));
        drawing.rasters.push(Raster {
            at: (area.left, area.top),
            size: area.size,
            columns: 2 * self.0.highest + 1,
            rgb: rgb.map(|(x, y)| color(x, y)).collect(),
        });
        area.outline(drawing);
    }
}

/// The colour scale of [`PeriodogramMap`], upright in the middle of the square.
pub(crate) struct ColorBar;

impl Content for ColorBar {
    fn draw(&self, drawing: &mut Drawing, area: Area) {
        const STEPS: usize = 64;
        let (left, width) = (area.left + 6.0, 18.0);
        let rgb = (0..STEPS)
            .rev()
            .map(|i| viridis(i as f32 / (STEPS - 1) as f32));
        drawing.rasters.push(Raster {
            at: (left, area.top),
            size: (width, area.size.1),
            columns: 1,
            rgb: rgb.collect(),
        });
        for (power, label) in [
            (0.01, "≤ 0.01"),
            (0.1, "0.1"),
            (1.0, "1, white noise"),
            (10.0, "10"),
            (100.0, "≥ 100"),
        ] {
            let (_, y) = area.at([0.0, share(power)]);
            let y = y.clamp(area.top + 7.0, area.top + area.size.1 - 7.0);
            drawing.text((left + width + 8.0, y), label, INK, Anchor::Start);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::drawing::Shape;
    use super::super::panels::{self, Panel};
    use super::*;
    use raystone_discrepancy::{Budget, PointSet, periodogram};

    #[test]
    fn powers_beyond_the_scale_lie_on_its_ends() {
        assert_eq!(share(1.0), 0.5);
        assert_eq!((share(0.0), share(1e9)), (0.0, 1.0));
        assert_eq!(highest_frequency(1), 16);
        assert_eq!(highest_frequency(1024), 64);
        assert_eq!(highest_frequency(1 << 20), 96);
    }

    #[test]
    fn one_point_is_as_white_as_noise_everywhere_but_in_the_middle() {
        let point = PointSet::from_points(&[[0.3, 0.7]]).unwrap();
        let found = periodogram(&point, 4, &Budget::seconds(60.0)).unwrap();
        let curve = RadialCurve(found.radial());
        let map = PeriodogramMap(found);
        let panels = [Panel::new("", "", map), Panel::new("", "", curve)];
        let drawing = panels::draw(&panels, 2, (100.0, 100.0));
        let pixels = &drawing.rasters[0].rgb;
        assert_eq!((pixels.len(), pixels[40]), (81, [255; 3]));
        let mut others = pixels.iter().enumerate().filter(|(i, _)| *i != 40);
        assert!(others.all(|(_, pixel)| *pixel == viridis(0.5)));
        let curve = drawing.shapes.iter().find_map(|shape| match shape {
            Shape::Line { points, width, .. } if *width == 1.6 => Some(points),
            _ => None,
        });
        let ys: Vec<f64> = curve.unwrap().iter().map(|p| p.1).collect();
        assert_eq!(ys.len(), 4);
        assert!(ys.iter().all(|y| (y - 76.0).abs() < 1e-9), "{ys:?}");
    }
}
