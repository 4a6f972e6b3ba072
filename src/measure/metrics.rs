//! Error of images by versioned metrics.

use crate::image::{Image, ImageError, NON_FINITE_COLOUR, Picture, is_finite};
use std::collections::BTreeMap;

/// Added to the squared reference in relative metrics, so that dark pixels do not rule the mean.
pub const RELATIVE_EPSILON: f64 = 1e-2;

/// What an image is measured against: the mean of a reference, and its independent parts and their
/// two halves if there are.
#[derive(Debug, Clone)]
pub struct Reference {
    mean: Image,
    halves: Option<[Image; 2]>,
    parts: Vec<Image>,
}

impl Reference {
    /// A reference known as one image: metrics that need two halves are absent.
    ///
    /// # Errors
    /// [`ImageError::NonFiniteReference`].
    pub fn single(mean: Image) -> Result<Self, ImageError> {
        if let Some(i) = mean.pixels.iter().position(|p| !is_finite(p)) {
            return Err(ImageError::NonFiniteReference {
                count: mean.non_finite_pixels(),
                x: i % mean.width as usize,
                y: i / mean.width as usize,
            });
        }
        Ok(Self {
            mean,
            halves: None,
            parts: Vec::new(),
        })
    }

    /// A reference from independent renders of equal sample counts (other seeds): the first half of
    /// them against the second; of an odd number the last is left out.
    ///
    /// # Errors
    /// [`ImageError::TooFew`] below two parts, [`ImageError::SizeMismatch`],
    /// [`ImageError::NonFiniteReference`].
    pub fn from_parts(mut parts: Vec<Image>) -> Result<Self, ImageError> {
        let half = parts.len() / 2;
        if half == 0 {
            return Err(ImageError::TooFew { needed: 2 });
        }
        parts.truncate(2 * half);
        let mut reference = Self::single(Image::mean_of(&parts)?)?;
        let (a, b) = parts.split_at(half);
        reference.halves = Some([Image::mean_of(a)?, Image::mean_of(b)?]);
        reference.parts = parts;
        Ok(reference)
    }

    /// The independent parts, those of the first half first; none if it is known as one image.
    pub fn parts(&self) -> &[Image] {
        &self.parts
    }

    /// How many estimates [`ErrorReport::without_part`] has: halves of one part have none left without
    /// it.
    fn estimates(&self) -> usize {
        if self.parts.len() < 4 {
            0
        } else {
            self.parts.len()
        }
    }

    /// The reference image itself.
    pub fn image(&self) -> &Image {
        &self.mean
    }

    /// Estimated mean squared error of the reference itself, mean (A − B)² / 4 over pixels and
    /// channels; absent without halves.
    pub fn own_mse(&self) -> Option<f64> {
        let [a, b] = self.halves.as_ref()?;
        let pairs = a.pixels.iter().flatten().zip(b.pixels.iter().flatten());
        let sum: f64 = pairs
            .map(|(&a, &b)| (f64::from(a) - f64::from(b)).powi(2))
            .sum();
        Some(sum / 4.0 / (3 * a.pixels.len()) as f64)
    }
}

/// One channel of one pixel, all that a metric sees.
pub(super) struct Sample {
    value: f64,
    reference: f64,
    half_a: f64,
    half_b: f64,
}

/// An error metric: a mean over pixels and channels, then perhaps a root.
pub struct Metric {
    /// Name with its constants and version, as records carry it.
    pub id: &'static str,
    /// One line: formula and use. `v` the image, `r` the reference, A and B its halves.
    pub description: &'static str,
    /// Whether it is absent for a reference without halves.
    pub needs_halves: bool,
    term: fn(&Sample) -> f64,
    finish: fn(f64) -> f64,
}

/// Every metric, in the order of tables. A changed formula gets a new version in its id.
pub const METRICS: &[Metric] = &[
    Metric {
        id: "mse/v1",
        description: "mean (v − r)²",
        needs_halves: false,
        term: |s| (s.value - s.reference).powi(2),
        finish: |mean| mean,
    },
    Metric {
        id: "rmse/v1",
        description: "√ mean (v − r)²",
        needs_halves: false,
        term: |s| (s.value - s.reference).powi(2),
        finish: f64::sqrt,
    },
    Metric {
        id: "mae/v1",
        description: "mean |v − r|",
        needs_halves: false,
        term: |s| (s.value - s.reference).abs(),
        finish: |mean| mean,
    },
    Metric {
        id: "relmse/eps=1e-2/v1",
        description: "mean (v − r)² / (r² + 0.01)",
        needs_halves: false,
        term: Sample::relative_squared_error,
        finish: |mean| mean,
    },
    Metric {
        id: "mse-unbiased/v1",
        description: "mean (v − A)(v − B): free of the reference's own noise, may be negative",
        needs_halves: true,
        term: |s| (s.value - s.half_a) * (s.value - s.half_b),
        finish: |mean| mean,
    },
    Metric {
        id: "relmse-unbiased/eps=1e-2/v1",
        description: "mean (v − A)(v − B) / (((A + B) / 2)² + 0.01), may be negative",
        needs_halves: true,
        term: |s| (s.value - s.half_a) * (s.value - s.half_b) / s.relative_scale(),
        finish: |mean| mean,
    },
];

impl Sample {
    /// (v − r)² / (r² + ε).
    pub(super) fn relative_squared_error(&self) -> f64 {
        (self.value - self.reference).powi(2) / self.relative_scale()
    }

    fn relative_scale(&self) -> f64 {
        self.reference * self.reference + RELATIVE_EPSILON
    }
}

/// Error of one image.
#[derive(Debug, Clone, PartialEq)]
pub struct ErrorReport {
    /// Metric id → value, over the finite pixels; metrics that cannot be computed are absent.
    pub metrics: BTreeMap<String, f64>,
    /// Id of a metric that needs halves → its values against the reference without its first part,
    /// without its second, …: how they differ tells what the reference's own noise makes of the
    /// metric. Empty without at least two parts in each half.
    pub without_part: BTreeMap<String, Vec<f64>>,
    /// Pixels that were NaN or infinite and are in no mean. Any is a failure of the renderer.
    pub non_finite_pixels: usize,
}

/// Every metric of `image` against `reference`.
///
/// # Errors
/// [`ImageError::SizeMismatch`].
pub fn measure(image: &Image, reference: &Reference) -> Result<ErrorReport, ImageError> {
    reference.mean.check_size(image, "the measured image")?;
    let mut sums = [0.0; METRICS.len()];
    let mut without = vec![[0.0; METRICS.len()]; reference.estimates()];
    let mut finite = 0usize;
    for (i, pixel) in image.pixels.iter().enumerate() {
        if !is_finite(pixel) {
            continue;
        }
        finite += 1;
        for (c, &value) in pixel.iter().enumerate() {
            let sample = reference.sample(i, c, value);
            for (sum, metric) in sums.iter_mut().zip(METRICS) {
                *sum += (metric.term)(&sample);
            }
            for (part, sums) in without.iter_mut().enumerate() {
                let sample = reference.without(part, i, c, &sample);
                for (sum, metric) in sums.iter_mut().zip(METRICS).filter(|(_, m)| m.needs_halves) {
                    *sum += (metric.term)(&sample);
                }
            }
        }
    }
    let present = |m: &Metric| finite > 0 && (!m.needs_halves || reference.halves.is_some());
    let value = |m: &Metric, sum: f64| (m.finish)(sum / (3 * finite) as f64);
    let metrics = METRICS.iter().zip(sums).filter(|(m, _)| present(m));
    let by_part = METRICS
        .iter()
        .enumerate()
        .filter(|(_, m)| m.needs_halves && present(m) && !without.is_empty());
    Ok(ErrorReport {
        metrics: metrics
            .map(|(m, sum)| (m.id.to_owned(), value(m, sum)))
            .collect(),
        without_part: by_part
            .map(|(k, m)| {
                (
                    m.id.to_owned(),
                    without.iter().map(|sums| value(m, sums[k])).collect(),
                )
            })
            .collect(),
        non_finite_pixels: image.pixels.len() - finite,
    })
}

impl Reference {
    pub(super) fn sample(&self, pixel: usize, channel: usize, value: f32) -> Sample {
        let at = |image: &Image| f64::from(image.pixels[pixel][channel]);
        let reference = at(&self.mean);
        let (half_a, half_b) = match &self.halves {
            Some([a, b]) => (at(a), at(b)),
            None => (reference, reference),
        };
        Sample {
            value: f64::from(value),
            reference,
            half_a,
            half_b,
        }
    }

    /// The sample against the reference without one of its parts.
    fn without(&self, part: usize, pixel: usize, channel: usize, sample: &Sample) -> Sample {
        let half = (self.parts.len() / 2) as f64;
        let value = f64::from(self.parts[part].pixels[pixel][channel]);
        let rest = |mean: f64| mean + (mean - value) / (half - 1.0);
        let (half_a, half_b) = match 2 * part < self.parts.len() {
            true => (rest(sample.half_a), sample.half_b),
            false => (sample.half_a, rest(sample.half_b)),
        };
        Sample {
            value: sample.value,
            reference: 0.5 * (half_a + half_b),
            half_a,
            half_b,
        }
    }
}

/// Picture of the error: per pixel √ of the mean over channels of (v − r)² / (r² + 0.01), over
/// `full_scale`, clamped to `[0, 1]` and coloured by `colour`.
///
/// # Errors
/// [`ImageError::SizeMismatch`].
pub fn error_map(
    image: &Image,
    reference: &Reference,
    full_scale: f32,
    colour: impl Fn(f32) -> [u8; 3],
) -> Result<Picture, ImageError> {
    reference.image().check_size(image, "the measured image")?;
    let map = |(i, pixel): (usize, &[f32; 3])| {
        let term = |c: usize| {
            let sample = reference.sample(i, c, pixel[c]);
            sample.relative_squared_error()
        };
        let error = ((term(0) + term(1) + term(2)) / 3.0).sqrt() as f32;
        match error.is_finite() {
            true => colour((error / full_scale).clamp(0.0, 1.0)),
            false => NON_FINITE_COLOUR,
        }
    };
    Ok(Picture {
        width: image.width,
        height: image.height,
        pixels: image.pixels.iter().enumerate().map(map).collect(),
    })
}

#[cfg(test)]
#[path = "metrics_tests.rs"]
mod tests;
