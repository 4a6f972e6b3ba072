//! The bias check: tests whether a sampler's replicates have the same mean as the reference.
//!
//! A t-test ([`capped_t_test`]) compares luminance means of the replicates with those of the
//! independent parts of the reference (the idea of Jung, Hanika and Dachsbacher, JCGT 9(2), 2020,
//! with the replicate image as the unit of inference, since samples within an image may be
//! dependent). There are three tests, each at a third of the level:
//!
//! * the mean of the whole image, which detects any bias that accumulates;
//! * a mean that weights noisy places less (`weights`), which detects a small bias shared by all
//!   pixels: on the Cornell box, where most noise comes from the edges of the lamp, its standard
//!   error is a fifth of the plain mean's;
//! * per tile, for local bias: the Benjamini–Hochberg procedure bounds the share of false alarms.
//!
//! An unbiased sampler is thus called biased with at most the total probability.
//!
//! Rare events show no noise where no replicate caught them, yet differ from the reference. If
//! replicates show less than `LEAST_NOISE` of the noise predicted by the reference, the prediction
//! is used (`careful_test`). Below `replicates_needed` there is no verdict.
//!
//! The t-test assumes nearly normal means. Many samples per pixel provide that; at very few,
//! fireflies skew them and very small p-values are too frequent.

mod weights;

use crate::hypothesis::{
    WelchTest, benjamini_hochberg, capped_t_test, least_rate, student_t_two_sided, t_test_effect,
    t_test_power,
};
use crate::statistics::{mean, median, variance};
use raystone_image::{Image, ImageError, luminance};
use serde::{Deserialize, Serialize};
use std::fmt;

/// "No bias found" requires that a bias of this many standard errors of the whole image's mean
/// luminance would have been found with probability `POWER`.
pub(crate) const EFFECT: f64 = 10.0;
/// Probability of finding a bias of `EFFECT`.
pub(crate) const POWER: f64 = 0.9;
/// Share of the level for each of the three tests.
const SHARE: f64 = 1.0 / 3.0;
/// Fraction of the variance predicted by the reference below which the replicates' variance is not
/// trusted: of eight even replicates, one tile in twenty has so little by chance.
pub(crate) const LEAST_NOISE: f64 = 0.25;
/// Limit on an experiment's replicates.
const MOST_REPLICATES: u32 = 1024;

/// Test options.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BiasOptions {
    /// Edge of a tile in pixels, at least 1.
    pub tile: u32,
    /// Maximum probability of a false alarm, in (0, 1): a third for each of the three tests.
    pub alpha: f64,
    /// Relative differences below this are rounding, not bias; see `rounding_bound`.
    pub rounding: f64,
}

impl Default for BiasOptions {
    /// 8 × 8 pixels, 1 %, and 2⁻¹⁵: 256 additions in f32 on both sides.
    fn default() -> Self {
        Self {
            tile: 8,
            alpha: 0.01,
            rounding: 1.0 / 32768.0,
        }
    }
}

/// The verdict of the test.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum BiasVerdict {
    /// Neither the whole image nor a tile was rejected. This is not a proof: a bias far below the noise
    /// stays unseen.
    NoBiasFound,
    /// The whole image or at least one tile was rejected.
    Biased,
    /// There is nothing to test, or too little to find a bias in, for this reason.
    NotTestable(String),
}

impl fmt::Display for BiasVerdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoBiasFound => f.write_str("no bias found"),
            Self::Biased => f.write_str("biased"),
            Self::NotTestable(reason) => write!(f, "not testable: {reason}"),
        }
    }
}

/// Outcome of the check.
#[derive(Debug, Clone, PartialEq)]
pub struct BiasCheck {
    /// Number of tiles tested; 0 if not testable.
    pub tiles: usize,
    /// Top left pixels `[x, y]` of rejected tiles.
    pub rejected: Vec<[u32; 2]>,
    /// Probability of a false alarm requested.
    pub alpha: f64,
    /// Smallest p-value of a tile; 1 if not testable.
    pub min_p: f64,
    /// Combined p-value: the smallest `alpha` at which a test rejects; 1 if not testable.
    pub p: f64,
    /// Histogram of tile p-values in ten equal bins of `[0, 1]`, without those whose difference is
    /// explained by rounding (p = 1 by definition): flat if there is no bias.
    pub p_histogram: [usize; 10],
    /// Test of the image's mean luminance, reduced by the rounding; absent if not testable.
    pub whole: Option<WelchTest>,
    /// Test of the mean that weights noisy places less, relative to that mean; absent if not
    /// testable, below four parts of the reference, or without noise.
    pub weighted: Option<WelchTest>,
    /// The smallest relative bias, shared by all pixels, that one of these two tests would have
    /// found with probability `POWER`; absent if not testable or black.
    pub detectable: Option<f64>,
    /// The verdict.
    pub verdict: BiasVerdict,
}

/// Tests `replicates` (independent seeds of one sampler and spp) against independent
/// `reference_parts` (other seeds, preferably another sampler family).
///
/// The result is [`BiasVerdict::NotTestable`] for fewer than two images on a side, for NaN or
/// infinite pixels, and for fewer than `replicates_needed`, unless no pixel has noise on either
/// side. Only in that case, a tile has p = 1 if the means agree up to rounding, else p = 0.
///
/// # Errors
/// [`ImageError::SizeMismatch`] if the images differ in size.
pub fn check_bias(
    replicates: &[Image],
    reference_parts: &[Image],
    options: BiasOptions,
) -> Result<BiasCheck, ImageError> {
    for image in replicates.iter().chain(reference_parts) {
        reference_parts
            .first()
            .unwrap_or(image)
            .check_size(image, "an image of the bias check")?;
    }
    let mut check = BiasCheck {
        tiles: 0,
        rejected: Vec::new(),
        alpha: options.alpha,
        min_p: 1.0,
        p: 1.0,
        p_histogram: [0; 10],
        whole: None,
        weighted: None,
        detectable: None,
        verdict: BiasVerdict::NoBiasFound,
    };
    if let Some(reason) = why_not_testable(replicates, reference_parts) {
        check.verdict = BiasVerdict::NotTestable(reason);
        return Ok(check);
    }
    let noisy = has_noise(replicates) || has_noise(reference_parts);
    let tiles = [replicates, reference_parts].map(|images| tile_means(images, options.tile));
    let noisier = noisy.then(|| noise_ratio(&tiles));
    let test = |a: &[f64], b: &[f64]| careful_test(a, b, options.rounding, noisier);
    let (width, height) = (replicates[0].width, replicates[0].height);
    let level = SHARE * options.alpha;
    let whole = |images| tile_means(images, width.max(height)).concat();
    check.whole = test(&whole(replicates), &whole(reference_parts));
    let [ours, theirs] = weights::weighted_means(replicates, reference_parts).unwrap_or_default();
    check.weighted = test(&ours, &theirs);
    let brightness = mean_size(&whole(reference_parts));
    let relative = [
        (check.whole, brightness),
        (check.weighted, mean_size(&theirs)),
    ];
    let least = relative
        .into_iter()
        .filter_map(|(test, size)| detectable(test?, size, level));
    check.detectable = least.reduce(f64::min).map(|least| least + options.rounding);
    // Both sides have at least two finite samples, so the tests exist.
    let p_value = |test: Option<WelchTest>| test.map_or(1.0, |test| test.p);
    let [ours, theirs] = &tiles;
    let pairs = ours.iter().zip(theirs);
    let p_values: Vec<f64> = pairs.map(|(a, b)| p_value(test(a, b))).collect();
    count_tiles(&mut check, &p_values, width, options);
    let of_image = [check.whole, check.weighted].map(p_value);
    let biased = of_image.iter().any(|p| *p <= level) || !check.rejected.is_empty();
    let least = of_image.into_iter().fold(least_rate(&p_values), f64::min);
    check.p = (least / SHARE).min(1.0);
    let too_few = too_few(replicates.len(), options.alpha).filter(|_| noisy);
    if let Some(reason) = too_few {
        (check.rejected, check.p) = (Vec::new(), 1.0);
        check.verdict = BiasVerdict::NotTestable(reason);
    } else if biased {
        check.verdict = BiasVerdict::Biased;
    }
    Ok(check)
}

/// Returns the reason why this number of noisy replicates is inconclusive at this level; `None` if it suffices.
fn too_few(replicates: usize, alpha: f64) -> Option<String> {
    let needed = replicates_needed(alpha);
    ((replicates as u64) < u64::from(needed)).then(|| {
        format!(
            "{replicates} replicates, {needed} are needed to find a bias of {EFFECT} standard errors in {:.0} % of all \
             cases at this level ({alpha:.1e})",
            100.0 * POWER
        )
    })
}

/// The smallest bias relative to `size` that this test finds with probability [`POWER`].
fn detectable(test: WelchTest, size: f64, level: f64) -> Option<f64> {
    let effect = t_test_effect(POWER, level, test.degrees_of_freedom);
    let part = effect * test.standard_error / size;
    part.is_finite().then_some(part)
}

/// Number of replicates from which a bias of [`EFFECT`] standard errors in the whole image is found
/// with probability [`POWER`] at level `alpha`, if the reference has far less noise.
pub(crate) fn replicates_needed(alpha: f64) -> u32 {
    let finds = |&n: &u32| t_test_power(EFFECT, SHARE * alpha, f64::from(n - 1)) >= POWER;
    (2..MOST_REPLICATES).find(finds).unwrap_or(MOST_REPLICATES)
}

fn why_not_testable(replicates: &[Image], parts: &[Image]) -> Option<String> {
    for (images, name) in [
        (replicates, "replicates"),
        (parts, "parts of the reference"),
    ] {
        if images.len() < 2 {
            return Some(format!("{} {name}, two are needed", images.len()));
        }
        let bad: usize = images.iter().map(Image::non_finite_pixels).sum();
        if bad > 0 {
            return Some(format!("{bad} pixels of the {name} are NaN or infinite"));
        }
    }
    None
}

/// Luminance means by tile (row by row), then by image.
fn tile_means(images: &[Image], tile: u32) -> Vec<Vec<f64>> {
    let (width, height) = (images[0].width, images[0].height);
    let tile = tile.max(1);
    let mut means = Vec::new();
    for y in (0..height).step_by(tile as usize) {
        for x in (0..width).step_by(tile as usize) {
            let (right, bottom) = ((x + tile).min(width), (y + tile).min(height));
            let mean = |image: &Image| {
                let row =
                    |v: u32| &image.pixels[(v * width + x) as usize..][..(right - x) as usize];
                let sum: f64 = (y..bottom).flat_map(row).map(luminance).sum();
                sum / f64::from((right - x) * (bottom - y))
            };
            means.push(images.iter().map(mean).collect());
        }
    }
    means
}

/// True if any pixel differs between images.
fn has_noise(images: &[Image]) -> bool {
    images.iter().any(|image| image.pixels != images[0].pixels)
}

/// Variance of replicates over reference parts: the median over tiles with noise in both.
fn noise_ratio([ours, theirs]: &[Vec<Vec<f64>>; 2]) -> f64 {
    let ratio = |(a, b): (&Vec<f64>, &Vec<f64>)| Some(variance(a)? / variance(b)?);
    let ratios = ours.iter().zip(theirs).filter_map(ratio);
    let ratios: Vec<f64> = ratios.filter(|r| r.is_finite() && *r > 0.0).collect();
    median(&ratios).unwrap_or(0.0)
}

/// Tests one mean. `noisier` is [`noise_ratio`], absent if no pixel has noise: then compares
/// directly.
///
/// If the replicates' variance is below [`LEAST_NOISE`] of the reference's times `noisier`, they
/// have missed the source of the noise there, and the predicted variance is used. And n replicates
/// that agree (up to rounding) weigh no more than they would with the reference's mean as an
/// additional one, which makes |t| = n.
fn careful_test(
    ours: &[f64],
    theirs: &[f64],
    rounding: f64,
    noisier: Option<f64>,
) -> Option<WelchTest> {
    let margin = rounding * mean_size(theirs);
    let found = capped_t_test(ours, theirs, margin)?;
    let Some(noisier) = noisier.filter(|_| found.t != 0.0) else {
        return Some(found);
    };
    let n = ours.len() as f64;
    let (own, foretold) = (variance(ours)?, noisier * variance(theirs)?);
    let missing = if own < LEAST_NOISE * foretold {
        foretold - own
    } else {
        0.0
    };
    let gap = (mean(ours)? - mean(theirs)?).abs() - margin;
    let standard_error = (found.standard_error.powi(2) + missing / n).sqrt();
    let alike = own.sqrt() <= margin;
    let most = if alike { n } else { f64::INFINITY };
    let size = (gap / standard_error).min(most);
    Some(WelchTest {
        t: size.copysign(found.t),
        p: student_t_two_sided(size, found.degrees_of_freedom),
        standard_error,
        ..found
    })
}

fn mean_size(values: &[f64]) -> f64 {
    values.iter().map(|v| v.abs()).sum::<f64>() / values.len() as f64
}

fn count_tiles(check: &mut BiasCheck, p_values: &[f64], width: u32, options: BiasOptions) {
    // A tile explained by rounding has p = 1 regardless of chance.
    for p in p_values.iter().filter(|p| **p < 1.0) {
        check.p_histogram[((p * 10.0) as usize).min(9)] += 1;
    }
    let tile = options.tile.max(1);
    let columns = width.div_ceil(tile);
    check.rejected = (0u32..)
        .zip(benjamini_hochberg(p_values, SHARE * options.alpha))
        .filter(|&(_, rejected)| rejected)
        .map(|(i, _)| [i % columns * tile, i / columns * tile])
        .collect();
    check.tiles = p_values.len();
    check.min_p = p_values.iter().copied().fold(1.0, f64::min);
}

#[cfg(test)]
mod tests;
