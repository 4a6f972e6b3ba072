//! Metrics of displayed images: the reference's exposure, sRGB in [0, 1], not rounded to 8 bits.

use crate::flip::Seen;
use raystone_image::{Image, LUMINANCE, displayed};

/// Standard deviation of SSIM's window in pixels, and its radius: 11 × 11 pixels.
const SSIM_SIGMA: f64 = 1.5;
const SSIM_REACH: usize = 5;
/// Stabilisers of SSIM's quotients: (0.01)² and (0.03)² of the range, which is 1.
const SSIM_CONSTANTS: [f64; 2] = [1e-4, 9e-4];

pub(super) struct Shown {
    width: usize,
    pixels: Vec<[f64; 3]>,
    seen: Seen,
}

impl Shown {
    pub(crate) fn new(image: &Image, exposure: f32) -> Self {
        let shown = |pixel| displayed(pixel, exposure);
        let pixels: Vec<[f64; 3]> = image.pixels.iter().map(shown).collect();
        let width = image.width as usize;
        Self {
            width,
            seen: Seen::new(&pixels, width),
            pixels,
        }
    }

    /// Mean ꟻLIP, see [`crate::flip`].
    pub(crate) fn flip(&self, other: &Self) -> f64 {
        mean(&self.seen.difference(&other.seen))
    }

    /// Peak signal-to-noise ratio in decibels, for a peak of 1; infinite for equal pictures.
    pub(crate) fn psnr(&self, other: &Self) -> f64 {
        let pairs = self
            .pixels
            .iter()
            .flatten()
            .zip(other.pixels.iter().flatten());
        let squares: Vec<f64> = pairs.map(|(a, b)| (a - b).powi(2)).collect();
        -10.0 * mean(&squares).log10()
    }

    /// Mean structural similarity of luma over all windows inside the picture (Wang, Bovik, Sheikh,
    /// Simoncelli 2004, equation 13, their Gaussian window and constants); `None` if none fits.
    pub(crate) fn ssim(&self, other: &Self) -> Option<f64> {
        let luma = |shown: &Self| -> Vec<f64> {
            let weighted = |p: &[f64; 3]| (0..3).map(|c| LUMINANCE[c] * p[c]).sum();
            shown.pixels.iter().map(weighted).collect()
        };
        let (a, b) = (luma(self), luma(other));
        let product = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).collect();
        let windows = |values: Vec<f64>| window_means(&values, self.width);
        let [squares_a, squares_b, products] =
            [product(&a, &a), product(&b, &b), product(&a, &b)].map(windows);
        let [mean_a, mean_b] = [windows(a), windows(b)];
        let [c1, c2] = SSIM_CONSTANTS;
        let similarity = |i: usize| {
            let (x, y) = (mean_a[i], mean_b[i]);
            let variances = squares_a[i] - x * x + squares_b[i] - y * y;
            let covariance = products[i] - x * y;
            (2.0 * x * y + c1) * (2.0 * covariance + c2) / ((x * x + y * y + c1) * (variances + c2))
        };
        let values: Vec<f64> = (0..mean_a.len()).map(similarity).collect();
        (!values.is_empty()).then(|| mean(&values))
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Means by SSIM's window around every pixel whose window lies in the picture.
fn window_means(values: &[f64], width: usize) -> Vec<f64> {
    let weight = |d: usize| {
        let x = d.abs_diff(SSIM_REACH) as f64 / SSIM_SIGMA;
        (-0.5 * x * x).exp()
    };
    let mut taps = [0.0; 2 * SSIM_REACH + 1];
    taps.iter_mut()
        .enumerate()
        .for_each(|(d, w)| *w = weight(d));
    let sum: f64 = taps.iter().sum();
    let across = |row: &[f64]| -> Vec<f64> {
        let at = |window: &[f64]| window.iter().zip(taps).map(|(v, w)| v * w / sum).sum();
        row.windows(taps.len()).map(at).collect()
    };
    let rows: Vec<Vec<f64>> = values.chunks_exact(width).map(across).collect();
    let down = |rows: &[Vec<f64>]| -> Vec<f64> {
        let at = |x: usize| rows.iter().zip(taps).map(|(row, w)| row[x] * w / sum).sum();
        (0..rows[0].len()).map(at).collect()
    };
    rows.windows(taps.len()).flat_map(down).collect()
}
