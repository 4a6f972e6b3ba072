//! The bias check: do the replicates of a sampler have the mean that the reference has?
//!
//! Per tile of the image, Welch's t-test compares the luminance means of the replicates with those of
//! the independent parts of the reference (the idea of Jung, Hanika and Dachsbacher, JCGT 9(2), 2020,
//! with the replicate image as the unit of inference: the samples within one image may depend on each
//! other). Over all tiles the Benjamini–Hochberg procedure bounds the share of false alarms.
//!
//! The t-test supposes that tile means are about normal. Many samples per pixel make them so; at very
//! few, fireflies skew them and very small p-values come up too often.

use super::hypothesis::{benjamini_hochberg, welch_t_test, welch_t_test_beyond};
use super::image::{Image, ImageError, luminance};
use std::fmt;

/// How to test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BiasOptions {
    /// Edge of a tile in pixels, at least 1.
    pub tile: u32,
    /// Share of false alarms among the rejected tiles, in (0, 1).
    pub alpha: f64,
    /// Differences below this part of the reference are not bias but the rounding of sums in f32.
    pub rounding: f64,
}

impl Default for BiasOptions {
    /// 8 × 8 pixels, 1 %, and the worst case of 1024 additions, 2⁻¹⁵.
    fn default() -> Self {
        Self {
            tile: 8,
            alpha: 0.01,
            rounding: 1.0 / 32768.0,
        }
    }
}

/// What the test says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum BiasVerdict {
    /// No tile was rejected. This is not a proof: a bias far below the noise stays unseen.
    NoBiasFound,
    /// At least one tile was rejected.
    Biased,
    /// There is nothing to test, for this reason.
    NotTestable(String),
}

impl fmt::Display for BiasVerdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoBiasFound => f.write_str("no-bias-found"),
            Self::Biased => f.write_str("biased"),
            Self::NotTestable(reason) => write!(f, "not-testable: {reason}"),
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
    /// False-discovery rate asked for.
    pub alpha: f64,
    /// Smallest p-value; 1 if not testable.
    pub min_p: f64,
    /// p-values in ten equal bins of `[0, 1]`: flat if there is no bias.
    pub p_histogram: [usize; 10],
    /// z-score of the whole image: difference of the mean luminances over its standard error (Welch's
    /// t); absent if not testable.
    pub z: Option<f64>,
    /// The verdict.
    pub verdict: BiasVerdict,
}

/// Tests `replicates` (independent seeds of one sampler, one spp) against the independent
/// `reference_parts` (other seeds, better another sampler family).
///
/// Fewer than two images on a side, or NaN or infinite pixels, are [`BiasVerdict::NotTestable`]. A
/// tile without any variance on both sides counts as p = 1 if the means agree to the rounding, else
/// as p = 0.
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
    if let Some(reason) = why_not_testable(replicates, reference_parts) {
        return Ok(BiasCheck {
            tiles: 0,
            rejected: Vec::new(),
            alpha: options.alpha,
            min_p: 1.0,
            p_histogram: [0; 10],
            z: None,
            verdict: BiasVerdict::NotTestable(reason),
        });
    }
    let ours = tile_means(replicates, options.tile);
    let theirs = tile_means(reference_parts, options.tile);
    let p_values: Vec<f64> = (ours.iter().zip(&theirs))
        .map(|(a, b)| p_value(a, b, options.rounding))
        .collect();
    let whole = |images: &[Image]| {
        let edge = images[0].width.max(images[0].height);
        tile_means(images, edge).concat()
    };
    let z = welch_t_test(&whole(replicates), &whole(reference_parts)).map(|test| test.t);
    Ok(BiasCheck {
        z,
        ..summarise(&p_values, replicates[0].width, options)
    })
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

fn p_value(ours: &[f64], theirs: &[f64], rounding: f64) -> f64 {
    let size = theirs.iter().map(|v| v.abs()).sum::<f64>() / theirs.len() as f64;
    // Both sides have two finite samples or more, so the test exists.
    welch_t_test_beyond(ours, theirs, rounding * size).map_or(1.0, |test| test.p)
}

fn summarise(p_values: &[f64], width: u32, options: BiasOptions) -> BiasCheck {
    let mut p_histogram = [0; 10];
    for &p in p_values {
        p_histogram[((p * 10.0) as usize).min(9)] += 1;
    }
    let tile = options.tile.max(1);
    let columns = width.div_ceil(tile);
    let rejected: Vec<[u32; 2]> = (0u32..)
        .zip(benjamini_hochberg(p_values, options.alpha))
        .filter(|&(_, rejected)| rejected)
        .map(|(i, _)| [i % columns * tile, i / columns * tile])
        .collect();
    BiasCheck {
        tiles: p_values.len(),
        verdict: match rejected.is_empty() {
            true => BiasVerdict::NoBiasFound,
            false => BiasVerdict::Biased,
        },
        rejected,
        alpha: options.alpha,
        min_p: p_values.iter().copied().fold(1.0, f64::min),
        p_histogram,
        z: None,
    }
}

#[cfg(test)]
mod tests {
    use super::super::statistics::Pcg32;
    use super::*;

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

    #[test]
    fn the_z_score_is_small_without_bias_and_large_with_it() {
        let mut generator = Pcg32::new(77);
        let reference = noisy(16, 0.2, &mut generator);
        let z = |images: &[Image]| {
            let check = check_bias(images, &reference, BiasOptions::default());
            check.unwrap().z.unwrap()
        };
        let mut images = noisy(16, 0.2, &mut generator);
        assert!(z(&images).abs() < 4.0, "{}", z(&images));
        brighten_tile(&mut images, 1.5);
        assert!(z(&images) > 8.0, "{}", z(&images));
    }

    fn brighten_tile(images: &mut [Image], factor: f32) {
        for image in images {
            for (x, y) in (0..64).map(|i| (16 + i % 8, 8 + i / 8)) {
                let pixel = &mut image.pixels[y * WIDTH as usize + x];
                *pixel = pixel.map(|v| v * factor);
            }
        }
    }

    #[test]
    fn a_planted_bias_of_a_few_percent_in_one_tile_is_found_there() {
        let mut generator = Pcg32::new(5);
        let parts = noisy(8, 0.1, &mut generator);
        let mut replicates = noisy(8, 0.2, &mut generator);
        let before = check_bias(&replicates, &parts, BiasOptions::default()).unwrap();
        assert_eq!(before.verdict, BiasVerdict::NoBiasFound);
        assert_eq!(before.tiles, 6 * 3);
        assert_eq!(before.p_histogram.iter().sum::<usize>(), before.tiles);
        brighten_tile(&mut replicates, 1.06);
        let after = check_bias(&replicates, &parts, BiasOptions::default()).unwrap();
        assert_eq!(after.verdict, BiasVerdict::Biased);
        assert_eq!(after.rejected, [[16, 8]]);
        assert!(after.min_p < 1e-4);
    }

    #[test]
    fn without_bias_alarms_are_as_rare_as_promised() {
        let mut generator = Pcg32::new(6);
        let trials = 200;
        let options = BiasOptions {
            alpha: 0.05,
            ..BiasOptions::default()
        };
        let mut histogram = [0; 10];
        let alarms = (0..trials)
            .filter(|_| {
                let parts = noisy(4, 0.3, &mut generator);
                let replicates = noisy(8, 0.5, &mut generator);
                let check = check_bias(&replicates, &parts, options).unwrap();
                histogram
                    .iter_mut()
                    .zip(check.p_histogram)
                    .for_each(|(h, c)| *h += c);
                check.verdict == BiasVerdict::Biased
            })
            .count();
        // 10 expected of 200, standard deviation 3.1.
        assert!(alarms <= 22, "{alarms} false alarms in {trials}");
        let tiles: usize = histogram.iter().sum();
        for count in histogram {
            let share = count as f64 / tiles as f64;
            assert!(
                (0.08..0.12).contains(&share),
                "p-values not flat: {histogram:?}"
            );
        }
    }

    #[test]
    fn tiles_without_noise_are_equal_or_biased() {
        let mut generator = Pcg32::new(7);
        let flat = noisy(3, 0.0, &mut generator);
        let equal = check_bias(&flat, &flat, BiasOptions::default()).unwrap();
        assert_eq!(equal.verdict, BiasVerdict::NoBiasFound);
        assert_eq!((equal.min_p, equal.p_histogram[9]), (1.0, equal.tiles));
        let mut rounded = flat.clone();
        brighten_tile(&mut rounded, 1.0 + 1e-6);
        let rounded = check_bias(&rounded, &flat, BiasOptions::default()).unwrap();
        assert_eq!(rounded.verdict, BiasVerdict::NoBiasFound);
        let mut brighter = flat.clone();
        brighten_tile(&mut brighter, 1.001);
        let brighter = check_bias(&brighter, &flat, BiasOptions::default()).unwrap();
        assert_eq!((brighter.rejected.len(), brighter.min_p), (1, 0.0));
    }

    #[test]
    fn what_cannot_be_tested_says_why() {
        let mut generator = Pcg32::new(8);
        let mut images = noisy(3, 0.1, &mut generator);
        let options = BiasOptions::default();
        let single = check_bias(&images[..1], &images, options).unwrap();
        assert!(
            single
                .verdict
                .to_string()
                .starts_with("not-testable: 1 replicates")
        );
        images[2].pixels[0][1] = f32::NAN;
        let nan = check_bias(&images[..2], &images, options).unwrap();
        assert!(
            nan.verdict.to_string().contains("1 pixels of the parts"),
            "{}",
            nan.verdict
        );
        let other = Image::new(1, 1, vec![[0.0; 3]]).unwrap();
        assert!(check_bias(&[other.clone(), other], &images, options).is_err());
    }
}
