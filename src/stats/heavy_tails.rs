//! Detects unreliable intervals of a mean error dominated by a pixel that replicates seldom hit.
//!
//! The relMSE of an image is a mean over pixels. If a pixel contains a sliver of a lamp, one image
//! in a hundred hits it, with many times the error of the others. A few replicates then contain no
//! such image: they agree, and their interval lies below the truth. The replicates alone cannot
//! reveal this. The reference can: with thousands of samples it has hit the sliver, and the
//! variance of its parts predicts the error of each pixel at fewer samples.

use crate::interval::Interval;
use crate::metrics::{RELATIVE_EPSILON, Reference};
use raystone_image::{Image, ImageError};
use serde::{Deserialize, Serialize};

/// Influence of single pixels on a mean relMSE, by the variance between the reference's parts.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Tail {
    /// The greatest share of one pixel in the expected error.
    pub greatest_share: f64,
    /// The greatest expected error of a pixel in which all replicates are darker than the reference, less the error that they
    /// show there, as a fraction of the relMSE of the image.
    pub missed: f64,
}

/// Largest share of the expected error in one pixel for a reliable interval. In images of five
/// scenes with 48 × 36 to 80 × 60 pixels and 1, 4 and 16 samples it is smaller where intervals hold
/// in 93 to 97 % of cases, and larger where they do not.
const MOST_SHARE: f64 = 0.035;

/// Largest missed error of one pixel, relative to the upper half of the interval.
const MOST_MISSED: f64 = 0.5;

/// True if a single pixel makes the interval of a mean relMSE unreliable.
pub fn is_heavy(tail: Tail, relmse: Interval) -> bool {
    tail.greatest_share > MOST_SHARE || tail.missed > MOST_MISSED * (relmse.high - relmse.value)
}

/// Per-pixel errors over replicates, next to those predicted by the reference.
#[derive(Debug, Clone)]
pub struct PixelErrors {
    /// Sum over replicates of each pixel's contribution to the relMSE.
    sums: Vec<f64>,
    /// True if some replicate is at least as bright as the reference there.
    reached: Vec<bool>,
    replicates: u32,
    /// Channel sum of each pixel's variance between reference parts, over r² + 0.01; or empty.
    of_parts: Vec<f64>,
}

impl PixelErrors {
    /// Starts without replicates.
    pub fn new(reference: &Reference) -> Self {
        let pixels = reference.image().pixels.len();
        Self {
            sums: vec![0.0; pixels],
            reached: vec![false; pixels],
            replicates: 0,
            of_parts: match reference.parts().len() {
                0 | 1 => Vec::new(),
                _ => (0..pixels)
                    .map(|i| reference.relative_variance_of_parts(i))
                    .collect(),
            },
        }
    }

    /// Adds a replicate's image.
    ///
    /// # Errors
    /// [`ImageError::SizeMismatch`].
    pub fn add(&mut self, image: &Image, reference: &Reference) -> Result<(), ImageError> {
        reference.image().check_size(image, "the measured image")?;
        let sum = |pixel: &[f32; 3]| pixel.iter().sum::<f32>();
        for (i, pixel) in image.pixels.iter().enumerate() {
            let terms = pixel.iter().enumerate();
            let terms = terms.map(|(c, v)| reference.relative_term(i, c, *v));
            self.sums[i] += terms.sum::<f64>();
            self.reached[i] |= sum(pixel) >= sum(&reference.image().pixels[i]);
        }
        self.replicates += 1;
        Ok(())
    }

    /// Effect of single pixels on the mean at `spp` samples, for reference parts of `part_spp`.
    ///
    /// A pixel's expected variance is that of independent samples, σ² / spp, with σ² / `part_spp`
    /// between the parts. A better sampler shows in replicates on both sides of the reference: the
    /// observed error is then used if it is smaller. If all are darker than the reference, they may
    /// have missed something bright and show nothing.
    ///
    /// `None` without parts or replicates, or if no error is expected.
    pub fn tail(&self, spp: u32, part_spp: u32) -> Option<Tail> {
        if self.of_parts.is_empty() || self.replicates == 0 || part_spp == 0 {
            return None;
        }
        let factor = f64::from(part_spp) / f64::from(spp);
        let (mut greatest, mut all, mut missed) = (0.0_f64, 0.0, 0.0_f64);
        for (i, (sum, of_parts)) in self.sums.iter().zip(&self.of_parts).enumerate() {
            let foretold = factor * of_parts;
            let seen = (sum / f64::from(self.replicates)).max(0.0);
            let expected = if self.reached[i] {
                foretold.min(seen)
            } else {
                missed = missed.max(foretold - seen);
                foretold
            };
            greatest = greatest.max(expected);
            all += expected;
        }
        let greatest_share = greatest / all;
        greatest_share.is_finite().then_some(Tail {
            greatest_share,
            missed: missed / (3 * self.sums.len()) as f64,
        })
    }
}

impl Reference {
    /// (v − A)(v − B) / (((A + B) / 2)² + 0.01) of one channel.
    fn relative_term(&self, pixel: usize, channel: usize, value: f32) -> f64 {
        self.sample(pixel, channel, value).unbiased_relative_error()
    }

    /// Sum over channels of the variance between parts over r² + 0.01.
    fn relative_variance_of_parts(&self, pixel: usize) -> f64 {
        let parts = self.parts();
        let n = parts.len() as f64;
        let of = |channel: usize| {
            let values = || {
                parts
                    .iter()
                    .map(|part| f64::from(part.pixels[pixel][channel]))
            };
            let mean = values().sum::<f64>() / n;
            let squares: f64 = values().map(|value| (value - mean).powi(2)).sum();
            squares / (n - 1.0) / (mean * mean + RELATIVE_EPSILON)
        };
        [0, 1, 2].map(of).iter().sum()
    }
}
