//! Records of the words that samplers draw.

use super::{Interval, Key, Reading, axis};
use crate::figure::{self, Figure};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use raystone_sampling::to_unit;
use serde::{Deserialize, Serialize};

/// Star discrepancy of a dumped stream.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct StreamRecord {
    /// The two dimensions of the path's table.
    pub dimensions: [u32; 2],
    /// Their use in the path, for instance `bounce 0: direction`.
    pub purpose: String,
    /// True if the experiment names the pair.
    #[serde(default = "yes")]
    pub named: bool,
    /// Number of pairs drawn by the integrators among which this one has the sampler's greatest D*; absent where it
    /// is not the worst.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub worst_of: Option<usize>,
    /// True if each seed gives another point set.
    pub randomised: bool,
    /// Seeds measured (one for a deterministic stream).
    pub seeds: usize,
    /// Linear index of the pixel whose words were read for each seed.
    #[serde(default)]
    pub pixels: Vec<u32>,
    /// `(N, D*)` for the first N points: mean over seeds with interval.
    pub star: Vec<FigureAtCount>,
    /// Everything else, see `stream`.
    #[serde(default)]
    pub figures: StreamFigures,
    /// Points for pictures, of one pair of each sampler.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub points: Option<RecordedPoints>,
}

impl StreamRecord {
    /// Returns the use of the dimensions, with their numbers.
    pub fn pair(&self) -> String {
        let [a, b] = self.dimensions;
        format!("{} (dimensions {a} and {b})", self.purpose)
    }

    /// Returns its figures.
    pub fn readings(&self) -> Vec<Reading> {
        let key = Key::default().with(axis::DIMENSIONS, self.pair());
        let figures = &self.figures;
        let at = |key: &Key, figure: &Figure, counts: &[FigureAtCount]| -> Vec<Reading> {
            let at = |at: &FigureAtCount| {
                Reading::new(figure, at.value).at(key.clone().with(axis::POINTS, at.n))
            };
            counts.iter().map(at).collect()
        };
        let exponents = |key: &Key, figures: &[(&Figure, Option<Interval>)]| -> Vec<Reading> {
            let known = Reading::known(figures.iter().copied()).into_iter();
            known.map(|reading| reading.at(key.clone())).collect()
        };
        let mut readings = at(&key, &figure::STAR_DISCREPANCY, &self.star);
        readings.extend(at(&key, &figure::L2_STAR, &figures.l2_star));
        readings.extend(at(&key, &figure::CENTERED, &figures.centered));
        let of_points = [
            (&figure::STAR_EXPONENT, figures.star_slope),
            (&figure::L2_STAR_EXPONENT, figures.l2_star_slope),
        ];
        readings.extend(exponents(&key, &of_points));
        for integrand in &figures.integrands {
            let key = key.clone().with(axis::SUBJECT, &integrand.function);
            readings.extend(at(&key, &figure::INTEGRAL_RMSE, &integrand.rmse));
            let exponent = [(&figure::INTEGRAL_EXPONENT, integrand.slope)];
            readings.extend(exponents(&key, &exponent));
        }
        for pixels in &figures.pixels {
            let key = key.clone().with(axis::POINTS, pixels.n);
            let angle = pixels.neighbour_angle.to_degrees();
            let angle = Reading::exact(&figure::NEIGHBOUR_ANGLE, angle);
            let coverage = Reading::exact(&figure::COVERAGE, pixels.coverage);
            readings.extend([angle, coverage].map(|reading| reading.at(key.clone())));
        }
        readings
    }
}

fn yes() -> bool {
    true
}

/// The words of a stream, for pictures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct RecordedPoints {
    /// Samples of each pixel; the sampler was made for so many.
    pub samples: u32,
    /// Pixels 0, 1, … to this, excluded.
    pub pixels: u32,
    /// Seed.
    pub seed: u32,
    /// The kernel's words in Base64, low byte first: pixel by pixel, sample by sample, dimension by
    /// dimension.
    pub words: String,
    /// Mean power of 1024 points of pixel 0 by length of the frequency, 1 first, white noise being 1; empty
    /// if it was not computed.
    pub spectrum: Vec<f64>,
}

impl RecordedPoints {
    /// Records `words` of so many samples of so many pixels.
    pub fn new([samples, pixels]: [u32; 2], seed: u32, words: &[u32], spectrum: Vec<f64>) -> Self {
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        Self {
            samples,
            pixels,
            seed,
            words: STANDARD.encode(bytes),
            spectrum,
        }
    }

    /// Returns the points of each pixel as the renderer's floats; `None` if the text does not hold them.
    pub fn points(&self) -> Option<Vec<Vec<[f64; 2]>>> {
        let bytes = STANDARD.decode(&self.words).ok()?;
        let number = |b: &[u8]| f64::from(to_unit(u32::from_le_bytes([b[0], b[1], b[2], b[3]])));
        let points = bytes.chunks_exact(8).map(|b| [number(b), number(&b[4..])]);
        let points: Vec<[f64; 2]> = points.collect();
        let [samples, pixels] = [self.samples, self.pixels].map(|n| n as usize);
        let whole = samples > 0 && points.len() == samples * pixels;
        whole.then(|| points.chunks_exact(samples).map(<[_]>::to_vec).collect())
    }
}

/// Figures of a dumped stream beside its star discrepancy.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default)]
pub struct StreamFigures {
    /// Exponent of D* in N: slope of the mean over seeds.
    pub star_slope: Option<Interval>,
    /// L2-star discrepancy (the root).
    pub l2_star: Vec<FigureAtCount>,
    /// Its exponent.
    pub l2_star_slope: Option<Interval>,
    /// Centered discrepancy (the square).
    pub centered: Vec<FigureAtCount>,
    /// Errors of integrals that are known.
    pub integrands: Vec<IntegrandFigures>,
    /// Figures of neighbouring and superposed pixels; only of pairs that are a direction.
    pub pixels: Vec<PixelsAtCount>,
}

/// A figure at one number of points: mean over seeds with interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct FigureAtCount {
    /// Number of points.
    pub n: usize,
    /// The figure.
    pub value: Interval,
}

/// Errors of one function on the unit square.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct IntegrandFigures {
    /// Its name, as in `integrand:NAME`.
    pub function: String,
    /// The exact value.
    pub integral: f64,
    /// RMSE over seeds; of a deterministic stream the absolute error.
    pub rmse: Vec<FigureAtCount>,
    /// Exponent of the RMSE in N.
    pub slope: Option<Interval>,
}

/// Figures of several pixels of N samples each, one seed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct PixelsAtCount {
    /// Samples of a pixel.
    pub n: usize,
    /// Mean angle between the directions of neighbouring pixels at the same sample, radians.
    pub neighbour_angle: f64,
    /// Share of the cells of a grid of 4√N × 4√N that the points of 150 pixels fall into.
    pub coverage: f64,
}
