//! The bias check: do the replicates of a sampler have the mean that the reference has?
//!
//! For the whole image and per tile, a t-test ([`capped_t_test`]) compares the luminance means of the replicates with
//! those of the independent parts of the reference (the idea of Jung, Hanika and Dachsbacher, JCGT 9(2),
//! 2020, with the replicate image as the unit of inference: the samples within one image may depend on
//! each other). The whole image sees a small bias that all pixels share, tiles one that stays in its
//! place. Each gets half of the level: over all tiles the Benjamini–Hochberg procedure bounds the share
//! of false alarms, so that a sampler without bias is called biased with at most the whole probability.
//!
//! The t-test supposes that means are about normal. Many samples per pixel make them so; at very
//! few, fireflies skew them and very small p-values come up too often.

use super::hypothesis::{WelchTest, benjamini_hochberg, capped_t_test, t_test_power};
use crate::image::{Image, ImageError, luminance};
use serde::{Deserialize, Serialize};
use std::fmt;

/// A sampler may be said to have no bias found only if one of so many standard errors of the mean
/// luminance of the whole image …
pub const EFFECT: f64 = 10.0;
/// … would have been found with this probability.
pub const POWER: f64 = 0.9;
/// Most replicates that an experiment may have.
const MOST_REPLICATES: u32 = 1024;

/// How to test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BiasOptions {
    /// Edge of a tile in pixels, at least 1.
    pub tile: u32,
    /// Greatest probability of a false alarm, in (0, 1): half for the whole image, half for the tiles.
    pub alpha: f64,
    /// Differences below this part of the reference are not bias but rounding, see
    /// [`crate::integrator::rounding_bound`].
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

/// What the test says.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
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
    /// Tiles tested; 0 if not testable.
    pub tiles: usize,
    /// Top left pixels `[x, y]` of the rejected tiles.
    pub rejected: Vec<[u32; 2]>,
    /// Probability of a false alarm asked for.
    pub alpha: f64,
    /// Smallest p-value of a tile; 1 if not testable.
    pub min_p: f64,
    /// p-values of tiles in ten equal bins of `[0, 1]`: flat if there is no bias.
    pub p_histogram: [usize; 10],
    /// Test of the mean luminance of the whole image, the difference shortened by the rounding; absent
    /// if not testable.
    pub whole: Option<WelchTest>,
    /// The verdict.
    pub verdict: BiasVerdict,
}

/// Tests `replicates` (independent seeds of one sampler, one spp) against the independent
/// `reference_parts` (other seeds, better another sampler family).
///
/// Fewer than two images on a side, or NaN or infinite pixels, are [`BiasVerdict::NotTestable`], and so
/// are fewer than [`replicates_needed`] in which no bias was found, unless there is no noise at all. A
/// tile without any variance on both sides counts as p = 1 if the means agree to the rounding, else as
/// p = 0.
///
/// # Errors
/// [`ImageError::SizeMismatch`] if the images are not all of one size.
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
        p_histogram: [0; 10],
        whole: None,
        verdict: BiasVerdict::NoBiasFound,
    };
    if let Some(reason) = why_not_testable(replicates, reference_parts) {
        check.verdict = BiasVerdict::NotTestable(reason);
        return Ok(check);
    }
    let tests = |tile: u32| -> Vec<Option<WelchTest>> {
        let theirs = tile_means(reference_parts, tile);
        let pairs = tile_means(replicates, tile).into_iter().zip(theirs);
        pairs.map(|(a, b)| test(&a, &b, options.rounding)).collect()
    };
    let (width, height) = (replicates[0].width, replicates[0].height);
    check.whole = tests(width.max(height))[0];
    // Both sides have two finite samples or more, so the tests exist.
    let p_value = |test: Option<WelchTest>| test.map_or(1.0, |test| test.p);
    let p_values: Vec<f64> = tests(options.tile).into_iter().map(p_value).collect();
    count_tiles(&mut check, &p_values, width, options);
    let biased = p_value(check.whole) <= 0.5 * options.alpha || !check.rejected.is_empty();
    let means = tile_means(replicates, width.max(height)).concat();
    let noisy = means.iter().any(|mean| *mean != means[0]);
    let needed = replicates_needed(options.alpha);
    if biased {
        check.verdict = BiasVerdict::Biased;
    } else if noisy && (replicates.len() as u64) < u64::from(needed) {
        check.verdict = BiasVerdict::NotTestable(format!(
            "{} replicates, {needed} are needed to find a bias of {EFFECT} standard errors in {:.0} % \
             of all cases at this level ({:.1e})",
            replicates.len(),
            100.0 * POWER,
            options.alpha
        ));
    }
    Ok(check)
}

/// From how many replicates on a bias of [`EFFECT`] standard errors in the whole image is found with
/// probability [`POWER`] at level `alpha`, if the noise of the reference is far smaller than theirs.
pub fn replicates_needed(alpha: f64) -> u32 {
    let finds = |&n: &u32| t_test_power(EFFECT, 0.5 * alpha, f64::from(n - 1)) >= POWER;
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

/// Luminance means, by tile (row by row) and then by image.
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

fn test(ours: &[f64], theirs: &[f64], rounding: f64) -> Option<WelchTest> {
    let size = theirs.iter().map(|v| v.abs()).sum::<f64>() / theirs.len() as f64;
    capped_t_test(ours, theirs, rounding * size)
}

fn count_tiles(check: &mut BiasCheck, p_values: &[f64], width: u32, options: BiasOptions) {
    for &p in p_values {
        check.p_histogram[((p * 10.0) as usize).min(9)] += 1;
    }
    let tile = options.tile.max(1);
    let columns = width.div_ceil(tile);
    check.rejected = (0u32..)
        .zip(benjamini_hochberg(p_values, 0.5 * options.alpha))
        .filter(|&(_, rejected)| rejected)
        .map(|(i, _)| [i % columns * tile, i / columns * tile])
        .collect();
    check.tiles = p_values.len();
    check.min_p = p_values.iter().copied().fold(1.0, f64::min);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Pcg32;

    const WIDTH: u32 = 44; // not a multiple of the tile
    const HEIGHT: u32 = 24;

    /// Images with mean 1 and uniform noise of ± `noise` per pixel.
    fn noisy(count: usize, noise: f64, generator: &mut Pcg32) -> Vec<Image> {
        let mut pixel = |_| [(1.0 + noise * (2.0 * generator.uniform() - 1.0)) as f32; 3];
        let mut image = |_| {
            let pixels = (0..WIDTH * HEIGHT).map(&mut pixel).collect();
            Image::new(WIDTH, HEIGHT, pixels).unwrap()
        };
        (0..count).map(&mut image).collect()
    }

    /// All pixels of each image times one factor.
    fn scaled(images: &[Image], factor: f64) -> Vec<Image> {
        let scale = |image: &Image| Image {
            pixels: (image.pixels.iter())
                .map(|p| p.map(|v| (f64::from(v) * factor) as f32))
                .collect(),
            ..image.clone()
        };
        images.iter().map(scale).collect()
    }

    /// The check with default options.
    fn check(replicates: &[Image], parts: &[Image]) -> BiasCheck {
        check_bias(replicates, parts, BiasOptions::default()).unwrap()
    }

    #[test]
    fn a_bias_of_the_whole_image_is_found_in_either_direction_though_no_tile_shows_it() {
        let mut generator = Pcg32::new(77);
        let reference = noisy(16, 0.2, &mut generator);
        let images = noisy(16, 0.2, &mut generator);
        // Standard error of the mean of 16 images of 1,056 pixels, against 16 more.
        let error = 0.2 / 3f64.sqrt() / (1056.0f64 * 16.0).sqrt() * 2f64.sqrt();
        for (bias, expected) in [
            (0.0, BiasVerdict::NoBiasFound),
            (8.0, BiasVerdict::Biased),
            (-8.0, BiasVerdict::Biased),
        ] {
            let images = scaled(&images, 1.0 + bias * error);
            let options = BiasOptions {
                tile: 2,
                ..BiasOptions::default()
            };
            let check = check_bias(&images, &reference, options).unwrap();
            let whole = check.whole.unwrap();
            assert!((whole.t - bias).abs() < 3.5, "{bias}: {whole:?}");
            assert_eq!(check.rejected.len(), 0, "{bias}");
            assert_eq!(whole.degrees_of_freedom, 15.0, "those of the images alone");
            assert_eq!(check.verdict, expected, "{bias}: {whole:?}");
        }
    }

    #[test]
    fn too_few_replicates_say_how_many_are_needed_and_find_a_large_bias_still() {
        let mut generator = Pcg32::new(78);
        let reference = noisy(8, 0.2, &mut generator);
        let images = noisy(3, 0.2, &mut generator);
        let few = check(&images, &reference);
        let needed = replicates_needed(BiasOptions::default().alpha);
        let words = format!("not testable: 3 replicates, {needed} are needed");
        let said = few.verdict.to_string();
        assert!(said.starts_with(&words), "{said}");
        assert!(few.whole.is_some(), "the figures are told all the same");
        let biased = check(&scaled(&images, 1.5), &reference);
        assert_eq!(biased.verdict, BiasVerdict::Biased);
    }

    #[test]
    fn the_replicates_needed_give_the_power_that_is_stated() {
        assert!(replicates_needed(0.01) < replicates_needed(1e-4));
        let needed = replicates_needed(0.01);
        let mut generator = Pcg32::new(79);
        let reference = noisy(8, 0.001, &mut generator);
        let error = 0.2 / 3f64.sqrt() / (f64::from(WIDTH * HEIGHT * needed)).sqrt();
        let found = (0..200).filter(|_| {
            let images = noisy(needed as usize, 0.2, &mut generator);
            let images = scaled(&images, 1.0 - EFFECT * error);
            check(&images, &reference).verdict == BiasVerdict::Biased
        });
        // 90 % or a little more, standard deviation 2 %.
        let share = found.count() as f64 / 200.0;
        assert!(share > 0.84, "{share}");
    }

    fn brighten_tile(images: &[Image], factor: f32) -> Vec<Image> {
        let mut images = images.to_vec();
        for image in &mut images {
            for (x, y) in (0..64).map(|i| (16 + i % 8, 8 + i / 8)) {
                let pixel = &mut image.pixels[y * WIDTH as usize + x];
                *pixel = pixel.map(|v| v * factor);
            }
        }
        images
    }

    #[test]
    fn rounding_of_a_constant_is_no_bias_and_one_percent_in_a_tile_is() {
        let exact = noisy(8, 0.0, &mut Pcg32::new(80));
        let rounding = crate::integrator::rounding_bound(1 << 16);
        let options = BiasOptions {
            rounding,
            ..BiasOptions::default()
        };
        // What a plain sum of 65,536 numbers in f32 makes of one tenth.
        let sum = (0..1 << 16).fold(0.0f32, |sum, _| sum + 0.1);
        let plain = f64::from(sum / 65_536.0) / f64::from(0.1f32);
        assert!((plain - 1.0).abs() > 1e-4, "{plain}");
        for (images, verdict, rejected) in [
            (
                scaled(&exact, 1.0 + 0.9 * rounding),
                BiasVerdict::NoBiasFound,
                0,
            ),
            (
                scaled(&exact, 1.0 - 0.9 * rounding),
                BiasVerdict::NoBiasFound,
                0,
            ),
            (
                scaled(&exact, 1.0 + 1.1 * rounding),
                BiasVerdict::Biased,
                18,
            ),
            (brighten_tile(&exact, 1.01), BiasVerdict::Biased, 1),
        ] {
            let check = check_bias(&images, &exact, options).unwrap();
            assert_eq!((check.verdict, check.rejected.len()), (verdict, rejected));
        }
    }

    #[test]
    fn a_planted_bias_of_a_few_percent_in_one_tile_is_found_there() {
        let mut generator = Pcg32::new(5);
        let parts = noisy(8, 0.1, &mut generator);
        let replicates = noisy(8, 0.2, &mut generator);
        let before = check(&replicates, &parts);
        assert_eq!(before.verdict, BiasVerdict::NoBiasFound);
        assert_eq!(before.tiles, 6 * 3);
        assert_eq!(before.p_histogram.iter().sum::<usize>(), before.tiles);
        let after = check(&brighten_tile(&replicates, 1.06), &parts);
        assert_eq!(after.verdict, BiasVerdict::Biased);
        assert_eq!(after.rejected, [[16, 8]]);
        assert!(after.min_p < 1e-4);
    }

    #[test]
    fn without_bias_alarms_are_as_rare_as_promised() {
        let mut generator = Pcg32::new(6);
        let trials = 400;
        let options = BiasOptions {
            alpha: 0.05,
            ..BiasOptions::default()
        };
        let (mut alarms, mut histogram) = (0, [0; 10]);
        for _ in 0..trials {
            let parts = noisy(4, 0.3, &mut generator);
            let replicates = noisy(8, 0.5, &mut generator);
            let check = check_bias(&replicates, &parts, options).unwrap();
            let bins = histogram.iter_mut().zip(check.p_histogram);
            bins.for_each(|(sum, count)| *sum += count);
            alarms += u32::from(check.verdict == BiasVerdict::Biased);
        }
        // At most 20 expected of 400, standard deviation 4.4.
        assert!(alarms <= 30, "{alarms} false alarms in {trials}");
        let tiles: usize = histogram.iter().sum();
        let shares = histogram.map(|count| count as f64 / tiles as f64);
        let flat = shares.iter().all(|share| (0.08..0.12).contains(share));
        assert!(flat, "p-values not flat: {shares:?}");
    }

    #[test]
    fn tiles_without_noise_are_equal_or_biased() {
        let flat = noisy(3, 0.0, &mut Pcg32::new(7));
        let equal = check(&flat, &flat);
        assert_eq!(equal.verdict, BiasVerdict::NoBiasFound);
        assert_eq!((equal.min_p, equal.p_histogram[9]), (1.0, equal.tiles));
        let rounded = check(&brighten_tile(&flat, 1.0 + 1e-6), &flat);
        assert_eq!(rounded.verdict, BiasVerdict::NoBiasFound);
        let brighter = check(&brighten_tile(&flat, 1.001), &flat);
        assert_eq!((brighter.rejected.len(), brighter.min_p), (1, 0.0));
    }

    #[test]
    fn what_cannot_be_tested_says_why() {
        let mut images = noisy(3, 0.1, &mut Pcg32::new(8));
        let said = |check: BiasCheck| check.verdict.to_string();
        let single = said(check(&images[..1], &images));
        assert!(single.starts_with("not testable: 1 replicates"), "{single}");
        images[2].pixels[0][1] = f32::NAN;
        let nan = said(check(&images[..2], &images));
        assert!(nan.contains("1 pixels of the parts"), "{nan}");
        let other = Image::new(1, 1, vec![[0.0; 3]]).unwrap();
        assert!(check_bias(&[other.clone(), other], &images, BiasOptions::default()).is_err());
    }
}
