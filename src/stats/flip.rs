//! ꟻLIP, the perceived difference between two alternating pictures.
//!
//! Source: P. Andersson, J. Nilsson, T. Akenine-Möller, M. Oskarsson, K. Åström, M. D. Fairchild,
//! "ꟻLIP: A Difference Evaluator for Alternating Images", Proc. ACM Comput. Graph. Interact. Tech.
//! 3(2), 2020; with the constants and matrices of the authors' program. Equation numbers refer to
//! the paper. The existing crate binds the C++ code and supports bytes only.

use rayon::prelude::*;
use std::f64::consts::PI;

/// Pixels per degree of the observer: a display 0.7 m wide with 3840 pixels, 0.7 m away.
const PIXELS_PER_DEGREE: f64 = 3840.0 * PI / 180.0;
/// Exponent of colour differences, and end of the compressed part of their scale (section 4.1.3).
const COLOUR_EXPONENT: f64 = 0.7;
const KNEE_AT: f64 = 0.4;
const KNEE_TO: f64 = 0.95;
/// Width of an edge or point, degrees, and the exponent of their differences (section 4.2).
const FEATURE_WIDTH: f64 = 0.082;
const FEATURE_EXPONENT: f64 = 0.5;
/// Gaussians of contrast sensitivity in luminance, red–green and blue–yellow: pairs of a weight a
/// and a width b of a √(π / b) exp(−π² x² / b) (table 1).
const SENSITIVITY: [&[[f64; 2]]; 3] = [
    &[[1.0, 0.0047]],
    &[[1.0, 0.0053]],
    &[[34.1, 0.04], [13.5, 0.025]],
];
/// XYZ of white, mapped to 1.
const WHITE: [f64; 3] = [0.950428545, 1.0, 1.088900371];

struct Plane {
    width: usize,
    values: Vec<f64>,
}

/// The compared features of a picture.
pub struct Seen {
    /// Hunt-adjusted L*a*b* after contrast sensitivity.
    colours: Vec<[f64; 3]>,
    features: Vec<[f64; 2]>,
}

fn times(matrix: [[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    matrix.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

fn decode_srgb(v: f64) -> f64 {
    if v <= 0.04045 {
        v / 12.92
    } else {
        ((v + 0.055) / 1.055).powf(2.4)
    }
}

/// Linear sRGB to XYZ relative to white.
fn to_xyz(linear: [f64; 3]) -> [f64; 3] {
    const D: f64 = 73_733_382.0;
    let xyz = times(
        [
            [30_406_656.0 / D, 26_366_430.0 / D, 13_305_225.0 / D],
            [15_678_432.0 / D, 52_732_860.0 / D, 5_322_090.0 / D],
            [1_425_312.0 / D, 8_788_810.0 / D, 70_074_185.0 / D],
        ],
        linear,
    );
    [0, 1, 2].map(|i| xyz[i] / WHITE[i])
}

fn from_xyz(relative: [f64; 3]) -> [f64; 3] {
    times(
        [
            [3.241003275, -1.537398934, -0.498615861],
            [-0.969224334, 1.875930071, 0.041554224],
            [0.055639423, -0.204011202, 1.057148933],
        ],
        [0, 1, 2].map(|i| relative[i] * WHITE[i]),
    )
}

/// YCxCz, the linear opponents of L*a*b*.
fn to_opponents(linear: [f64; 3]) -> [f64; 3] {
    let [x, y, z] = to_xyz(linear);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn from_opponents([y, cx, cz]: [f64; 3]) -> [f64; 3] {
    let y = (y + 16.0) / 116.0;
    from_xyz([y + cx / 500.0, y, y - cz / 200.0])
}

/// L*a*b* with colours attenuated in the dark (Hunt effect, equation 7).
fn hunt_adjusted(linear: [f64; 3]) -> [f64; 3] {
    const DELTA: f64 = 6.0 / 29.0;
    let curve = |t: f64| {
        if t > DELTA.powi(3) {
            t.cbrt()
        } else {
            t / (3.0 * DELTA * DELTA) + 4.0 / 29.0
        }
    };
    let [x, y, z] = to_xyz(linear).map(curve);
    let lightness = 116.0 * y - 16.0;
    let [a, b] = [500.0 * (x - y), 200.0 * (y - z)];
    [lightness, 0.01 * lightness * a, 0.01 * lightness * b]
}

/// City-block distance in lightness plus Euclidean distance in colour (equation 6).
fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])
}

impl Plane {
    /// Separable convolution, `across` in x and `down` in y, of odd lengths; repeats border pixels.
    fn filtered(&self, across: &[f64], down: &[f64]) -> Self {
        let (width, height) = (self.width, self.values.len() / self.width);
        let clamped = |at: usize, k: usize, taps: usize, size: usize| {
            (at + k).saturating_sub(taps / 2).min(size - 1)
        };
        let along = |i: usize| {
            let (row, x) = (i / width * width, i % width);
            let terms = across.iter().enumerate();
            terms
                .map(|(k, w)| w * self.values[row + clamped(x, k, across.len(), width)])
                .sum()
        };
        let rows: Vec<f64> = (0..self.values.len()).into_par_iter().map(along).collect();
        let upright = |i: usize| {
            let (y, x) = (i / width, i % width);
            let terms = down.iter().enumerate();
            terms
                .map(|(k, w)| w * rows[clamped(y, k, down.len(), height) * width + x])
                .sum()
        };
        let values = (0..rows.len()).into_par_iter().map(upright).collect();
        Self { width, values }
    }
}

/// A function at integer distances up to `radius`.
fn taps(radius: f64, function: impl Fn(f64) -> f64) -> Vec<f64> {
    let radius = radius as i32;
    (-radius..=radius).map(|x| function(f64::from(x))).collect()
}

/// One channel filtered by the eye's contrast sensitivity (equation 4).
fn sensed(plane: &Plane, gaussians: &[[f64; 2]]) -> Plane {
    let radius = (3.0 * (0.04 / (2.0 * PI * PI)).sqrt() * PIXELS_PER_DEGREE).ceil();
    let shape = |b: f64| {
        taps(radius, |x| {
            (-(PI * x / PIXELS_PER_DEGREE).powi(2) / b).exp()
        })
    };
    // Each Gaussian is separable; together they sum to 1.
    let weight = |[a, b]: [f64; 2]| a * (PI / b).sqrt();
    let total: f64 = gaussians
        .iter()
        .map(|g| weight(*g) * shape(g[1]).iter().sum::<f64>().powi(2))
        .sum();
    let mut out = vec![0.0; plane.values.len()];
    for gaussian in gaussians {
        let taps = shape(gaussian[1]);
        let part = plane.filtered(&taps, &taps);
        let weight = weight(*gaussian) / total;
        for (sum, value) in out.iter_mut().zip(part.values) {
            *sum += weight * value;
        }
    }
    Plane {
        width: plane.width,
        values: out,
    }
}

/// Strength of edges and points in luminance from 0 to 1: magnitudes of the first and second
/// derivatives (equations 11 and 12).
fn features(luminance: &Plane) -> Vec<[f64; 2]> {
    let deviation = 0.5 * FEATURE_WIDTH * PIXELS_PER_DEGREE;
    let radius = (3.0 * deviation).ceil();
    let gaussian = |x: f64| (-x * x / (2.0 * deviation * deviation)).exp();
    let mut smooth = taps(radius, gaussian);
    let sum: f64 = smooth.iter().sum();
    smooth.iter_mut().for_each(|w| *w /= sum);
    let strengths = |weight: &dyn Fn(f64) -> f64| -> Vec<f64> {
        let mut taps = taps(radius, |x| weight(x) * gaussian(x));
        // Positive weights sum to 1, negative ones to −1.
        let of_sign = |sign: f64| taps.iter().map(|w| (sign * w).max(0.0)).sum::<f64>();
        let [positive, negative] = [of_sign(1.0), of_sign(-1.0)];
        for w in &mut taps {
            *w /= if *w > 0.0 { positive } else { negative };
        }
        let in_x = luminance.filtered(&taps, &smooth).values;
        let in_y = luminance.filtered(&smooth, &taps).values;
        in_x.iter().zip(in_y).map(|(x, y)| x.hypot(y)).collect()
    };
    let edges = strengths(&|x| -x);
    let points = strengths(&|x| (x / deviation).powi(2) - 1.0);
    edges.into_iter().zip(points).map(|(e, p)| [e, p]).collect()
}

impl Seen {
    /// Analyses a picture of sRGB values in [0, 1], row by row.
    ///
    /// # Panics
    /// If the number of pixels is not a multiple of the width.
    pub fn new(srgb: &[[f64; 3]], width: usize) -> Self {
        assert!(width > 0 && srgb.len().is_multiple_of(width));
        let opponents: Vec<[f64; 3]> = srgb
            .par_iter()
            .map(|pixel| to_opponents(pixel.map(decode_srgb)))
            .collect();
        let plane = |value: &dyn Fn(&[f64; 3]) -> f64| Plane {
            width,
            values: opponents.iter().map(value).collect(),
        };
        let channels = [0, 1, 2].map(|c| sensed(&plane(&|p| p[c]), SENSITIVITY[c]).values);
        let colour = |i: usize| {
            let linear = from_opponents([0, 1, 2].map(|c| channels[c][i]));
            hunt_adjusted(linear.map(|v| v.clamp(0.0, 1.0)))
        };
        Self {
            colours: (0..srgb.len()).into_par_iter().map(colour).collect(),
            features: features(&plane(&|p| (p[0] + 16.0) / 116.0)),
        }
    }

    /// Difference of every pixel, 0 to 1.
    ///
    /// # Panics
    /// If the pictures differ in size.
    pub fn difference(&self, other: &Self) -> Vec<f64> {
        assert_eq!(self.colours.len(), other.colours.len());
        let [green, blue] = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(hunt_adjusted);
        let most = distance(green, blue).powf(COLOUR_EXPONENT);
        let knee = KNEE_AT * most;
        let pixel = |i: usize| {
            let error = distance(self.colours[i], other.colours[i]).powf(COLOUR_EXPONENT);
            let of_colour = if error < knee {
                error * KNEE_TO / knee
            } else {
                KNEE_TO + (error - knee) / (most - knee) * (1.0 - KNEE_TO)
            };
            let [edges, points] =
                [0, 1].map(|k| (self.features[i][k] - other.features[i][k]).abs());
            let of_features = (edges.max(points) / 2.0_f64.sqrt()).powf(FEATURE_EXPONENT);
            of_colour.powf(1.0 - of_features)
        };
        (0..self.colours.len()).map(pixel).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(colour: [f64; 3]) -> Vec<[f64; 3]> {
        vec![colour; 32 * 32]
    }

    fn step(at: usize) -> Vec<[f64; 3]> {
        let value = |i: usize| f64::from(u8::from(i % 32 >= at));
        (0..32 * 32).map(|i| [value(i); 3]).collect()
    }

    fn difference(a: &[[f64; 3]], b: &[[f64; 3]]) -> Vec<f64> {
        Seen::new(a, 32).difference(&Seen::new(b, 32))
    }

    fn mean(values: &[f64]) -> f64 {
        values.iter().sum::<f64>() / values.len() as f64
    }

    /// Values of the PyPI package `flip-evaluator` 1.7, the authors' program in single precision:
    /// features of a flat picture are not quite 0, which raises the difference by 2·10⁻⁵.
    #[test]
    fn known_pictures_differ_as_the_authors_program_says() {
        let black_and_white = difference(&flat([0.0; 3]), &flat([1.0; 3]));
        assert!((mean(&black_and_white) - 0.967_395_13).abs() < 3e-5);
        let extremes = difference(&flat([0.0, 1.0, 0.0]), &flat([0.0, 0.0, 1.0]));
        assert!((mean(&extremes) - 1.0).abs() < 3e-5);
        let edges = difference(&step(16), &step(17));
        assert!(
            (mean(&edges) - 0.103_463_35).abs() < 3e-5,
            "{}",
            mean(&edges)
        );
        for (x, expected) in [
            (12, 0.078_480_70),
            (15, 0.772_916_56),
            (16, 0.538_264_75),
            (17, 0.497_552_93),
            (20, 0.019_276_08),
        ] {
            let found = edges[16 * 32 + x];
            // Pixel 16 is equidistant from both edges: the root of a rounded zero.
            let tolerance = if x == 16 { 2e-4 } else { 5e-5 };
            assert!(
                (found - expected).abs() < tolerance,
                "{x}: {found} {expected}"
            );
        }
    }

    #[test]
    fn equal_pictures_do_not_differ_and_the_order_does_not_count() {
        let (a, b) = (step(12), step(20));
        assert!(difference(&a, &a).iter().all(|d| *d == 0.0));
        let there = difference(&a, &b);
        assert!(there.iter().all(|d| (0.0..=1.0).contains(d)));
        let back = difference(&b, &a);
        assert!(there.iter().zip(&back).all(|(x, y)| (x - y).abs() < 1e-12));
    }
}
