//! Records of the errors of samplers and of their references.

use super::{Interval, Key, Reading, axis};
use crate::figure;
use raystone_config::StopRule;
use raystone_stats::bias::BiasVerdict;
pub(crate) use raystone_stats::heavy_tails::Tail;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A reference image.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ReferenceRecord {
    /// Samples per pixel of both halves together; 0 if nothing had to be rendered.
    pub spp: u32,
    /// The value of every pixel, if it is known: then this is the reference.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exact: Option<f64>,
    /// True if an earlier run rendered it; then `seconds` are those of reading it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub cached: bool,
    /// The file it was read from, if it was not rendered.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Sampler, as `sequence × decorrelation`; `exact` or `file` if there was none.
    pub sampler: String,
    /// Seconds it took.
    pub seconds: f64,
    /// Estimated mean squared error of the reference itself, from its two halves; absent for a single image of
    /// unknown parts.
    pub mse: Option<f64>,
    /// The same of the relative error, which samplers are ranked by.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relmse: Option<f64>,
    /// Tone-mapped PNG relative to the run's folder; empty if it could not be written.
    pub image: String,
    /// Mean radiance over pixels and channels.
    pub mean: f64,
}

/// Error at one number of samples.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ErrorAtSpp {
    /// Samples per pixel.
    pub spp: u32,
    /// Metric id with version → value, for instance `rmse/v1`, `relmse/eps=1e-2/v1`.
    pub metrics: BTreeMap<String, f64>,
    /// Id of an unbiased metric → its values with each part of the reference left out, those of its
    /// first half first: the reference's share in the metric's uncertainty.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub without_part: BTreeMap<String, Vec<f64>>,
    /// Influence of single pixels on the mean relMSE of the replicates up to this one. Unknown in old records, and for
    /// references without parts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tail: Option<Tail>,
    /// True if the points are an incomplete net in base 2 at this number of samples.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub partial_net: bool,
}

/// Error of one replicate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ErrorRecord {
    /// True if the pair is randomised by its seed; a deterministic pair has one replicate.
    pub randomised: bool,
    /// Number of this replicate, from 0.
    pub replicate: u32,
    /// Its seed.
    pub seed: u32,
    /// Image size in pixels.
    pub resolution: [u32; 2],
    /// Error at 1, 2, 4, … samples per pixel.
    pub errors: Vec<ErrorAtSpp>,
    /// The rule that may have ended the sampler before the most samples of the experiment.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stop: Option<StopRule>,
    /// Pixels that were NaN or infinite (any is a failure).
    pub non_finite_pixels: usize,
    /// BLAKE3 of the f32 image at the highest spp.
    pub image_hash: String,
    /// Tone-mapped image at the highest spp (first replicate only).
    pub image: Option<String>,
    /// Error map at the highest spp (first replicate only).
    pub error_map: Option<String>,
}

/// Bias check of one sampler: t-tests of the replicates against the reference, for the whole image, for a mean in
/// which noisy places count less, and per tile.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct BiasRecord {
    /// Tiles tested.
    pub tiles: usize,
    /// Tiles rejected after Benjamini–Hochberg at `alpha`.
    pub rejected: usize,
    /// Bound on the probability of calling a sampler without bias biased: a third of it is for the whole
    /// image, a third for the weighted mean, a third is the false-discovery rate among tiles. (Half for the
    /// image and half for tiles in records without `weighted_p`.)
    pub alpha: f64,
    /// The same bound for the whole run: `alpha` is its share. Absent in records that know of no sharing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub alpha_of_run: Option<f64>,
    /// Smallest p-value of a tile.
    pub min_p: f64,
    /// p-value of all the tests of this sampler together, to be compared with `alpha`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub p_of_all: Option<f64>,
    /// Histogram of the p-values in ten equal bins, without tiles whose difference rounding explains: flat when
    /// there is no bias.
    pub p_histogram: Vec<usize>,
    /// Difference of the mean luminance of all replicates from the reference's beyond rounding, in standard errors;
    /// absent where it is not testable or has no spread.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub z: Option<f64>,
    /// p-value of `z`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub p: Option<f64>,
    /// Degrees of freedom of `z`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub degrees_of_freedom: Option<f64>,
    /// Like `p`, of the mean in which noisy places count less; absent where there is no such test.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub weighted_p: Option<f64>,
    /// Degrees of freedom of that test.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub weighted_degrees_of_freedom: Option<f64>,
    /// The least bias, as a part of the radiance that all pixels share, that one of these two tests would have
    /// found in 90 % of all cases.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub detectable: Option<f64>,
    /// True if the sampler's mean over seeds is not the integral by design, so that a bias is no fault.
    #[serde(default)]
    pub by_design: bool,
    /// The verdict on this sampler alone. A report tests the samplers of a run together: those found biased leave a
    /// larger share of `alpha_of_run` to the others.
    pub verdict: BiasVerdict,
}

/// The signed luminance error of the image at the highest spp, see `spectrum`: means
/// over replicates with intervals.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct SpectrumRecord {
    /// Samples per pixel.
    pub spp: u32,
    /// Replicates.
    pub replicates: usize,
    /// Power by frequency, white noise being 1; empty if the error is the same in all pixels.
    pub power: Vec<PowerAt>,
    /// Mean power up to 1/8 cycle per pixel, white noise being 1.
    pub low_frequency: Option<Interval>,
    /// Power of the loudest wave, white noise having about ln(n/2) + 0.58 for n pixels.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub loudest: Option<Interval>,
    /// Correlation of the errors of neighbouring pixels.
    pub autocorrelation: Option<Interval>,
    /// Errors left by Gaussian filters.
    pub filtered: Vec<FilteredError>,
}

impl ReferenceRecord {
    /// Returns its own error.
    pub fn readings(&self) -> Vec<Reading> {
        Reading::known([(&figure::REFERENCE_MSE, self.mse)])
    }
}

impl BiasRecord {
    /// Returns its figures; none where it was not testable.
    pub fn readings(&self) -> Vec<Reading> {
        let Some(p) = self.p else {
            return Vec::new();
        };
        Reading::known([
            (&figure::BIAS_TILES, Some(self.tiles as f64)),
            (&figure::BIAS_REJECTED, Some(self.rejected as f64)),
            (&figure::BIAS_LEAST_P, Some(self.min_p)),
            (&figure::BIAS_Z, self.z),
            (&figure::BIAS_P, Some(p)),
            (&figure::BIAS_FREEDOM, self.degrees_of_freedom),
            (&figure::BIAS_WEIGHTED_P, self.weighted_p),
            (
                &figure::BIAS_WEIGHTED_FREEDOM,
                self.weighted_degrees_of_freedom,
            ),
            (
                &figure::BIAS_DETECTABLE,
                self.detectable.map(|part| 100.0 * part),
            ),
        ])
    }
}

impl SpectrumRecord {
    /// Returns the error before any filter, the divisor of filtered shares; `None` if there is none.
    pub fn unfiltered(&self) -> Option<f64> {
        let at = self.filtered.iter().find(|at| at.sigma == 0.0)?;
        (at.rmse.value > 0.0).then_some(at.rmse.value)
    }

    /// Returns its figures.
    pub fn readings(&self) -> Vec<Reading> {
        let key = Key::default().with(axis::SPP, self.spp);
        let before = self.unfiltered();
        let whole = self.filtered.iter().find(|at| at.sigma == 0.0);
        let readings = Reading::known([
            (&figure::LOW_FREQUENCY_POWER, self.low_frequency),
            (&figure::LOUDEST_WAVE, self.loudest),
            (&figure::NEIGHBOUR_CORRELATION, self.autocorrelation),
            (
                &figure::LUMINANCE_RMSE,
                whole.map(|at| at.rmse).filter(|_| before.is_some()),
            ),
        ]);
        let mut readings: Vec<Reading> = readings
            .into_iter()
            .map(|reading| reading.at(key.clone()))
            .collect();
        for at in self.filtered.iter().filter(|at| at.sigma > 0.0) {
            let key = (key.clone()).with(axis::SUBJECT, format!("σ = {} px", at.sigma));
            let share = before.map(|before| at.rmse.value / before);
            let share = share.map(|share| Reading::exact(&figure::FILTERED_SHARE, share));
            readings.extend(share.map(|share| share.at(key)));
        }
        readings
    }
}

/// Quantiles of the spectra of single images: the middle, and outliers.
pub const OUTLIER_QUANTILES: [f64; 4] = [0.5, 0.75, 0.95, 1.0];

/// A point of a radial spectrum.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct PowerAt {
    /// Cycles per pixel.
    pub frequency: f64,
    /// Mean power around that frequency, white noise being 1.
    pub power: Interval,
    /// Quantiles over replicates, [`OUTLIER_QUANTILES`], of the power in units of the mean variance of all
    /// replicates: the range of single images.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quantiles: Option<[f64; 4]>,
}

/// Error after a Gaussian filter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct FilteredError {
    /// Standard deviation of the filter, pixels; 0 is no filter.
    pub sigma: f64,
    /// Root mean square of the luminance error after the filter.
    pub rmse: Interval,
}
