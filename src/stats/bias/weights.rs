//! Image means that weight noisy places less, to detect a bias proportional to every pixel.
//!
//! Of all weighted means, weights of expected radiance over its variance give the least relative
//! error (as in weighted least squares). Both are estimated from the reference, in blocks of
//! pixels. A weight that depends on the values it multiplies would itself cause bias, since noise
//! is skewed: so each half of the reference is weighted by the other, and the replicates by both.

use crate::statistics::{median, variance};
use raystone_image::{Image, luminance};

const BLOCK: usize = 4;
/// Lower bound on a block's relative variance, as a fraction of the median over blocks, so that a
/// few blocks that look even by chance do not dominate the mean.
const LEAST_VARIANCE: f64 = 0.25;

/// Weighted means of the replicates and reference parts, relative to the image's own: about 1.
/// `None` below two parts per half, or if a half has no noise. Images are finite and of one size.
pub(super) fn weighted_means(replicates: &[Image], parts: &[Image]) -> Option<[Vec<f64>; 2]> {
    let half = parts.len() / 2;
    let (a, b) = (parts.get(..half)?, parts.get(half..2 * half)?);
    let (by_a, by_b) = (weights(a)?, weights(b)?);
    let both: Vec<f64> = by_a.iter().zip(&by_b).map(|(a, b)| 0.5 * (a + b)).collect();
    let means = |images: &[Image], weights: &[f64]| -> Vec<f64> {
        images
            .iter()
            .map(|image| weighted(image, weights))
            .collect()
    };
    let theirs = [means(a, &by_b), means(b, &by_a)].concat();
    Some([means(replicates, &both), theirs])
}

fn weighted(image: &Image, weights: &[f64]) -> f64 {
    let pixels = image.pixels.iter().zip(weights);
    pixels
        .map(|(pixel, weight)| weight * luminance(pixel))
        .sum()
}

/// Weights per pixel for which the weighted mean of these images is 1.
fn weights(images: &[Image]) -> Option<Vec<f64>> {
    let first = images.first().filter(|_| images.len() > 1)?;
    let columns = (first.width as usize).div_ceil(BLOCK);
    let block_of = |pixel: usize| {
        let (x, y) = (pixel % first.width as usize, pixel / first.width as usize);
        y / BLOCK * columns + x / BLOCK
    };
    // Per block: pixels, and the sums of their means and variances.
    let mut blocks = vec![[0.0; 3]; columns * (first.height as usize).div_ceil(BLOCK)];
    for pixel in 0..first.pixels.len() {
        let of_image = |image: &Image| luminance(&image.pixels[pixel]);
        let values: Vec<f64> = images.iter().map(of_image).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let sums = &mut blocks[block_of(pixel)];
        for (sum, term) in sums.iter_mut().zip([1.0, mean, variance(&values)?]) {
            *sum += term;
        }
    }
    let relative = |[count, mean, variance]: &[f64; 3]| count * variance / (mean * mean);
    let bright = blocks.iter().filter(|block| block[1] > 0.0);
    let noisy: Vec<f64> = bright.map(relative).filter(|v| *v > 0.0).collect();
    let least = LEAST_VARIANCE * median(&noisy)?;
    let weight = |block: &[f64; 3]| {
        if block[1] > 0.0 {
            block[0] / (block[1] * relative(block).max(least))
        } else {
            0.0
        }
    };
    let by_block: Vec<f64> = blocks.iter().map(weight).collect();
    let whole: f64 = blocks
        .iter()
        .zip(&by_block)
        .map(|(block, weight)| block[1] * weight)
        .sum();
    let pixels = 0..first.pixels.len();
    Some(
        pixels
            .map(|pixel| by_block[block_of(pixel)] / whole)
            .collect(),
    )
}
