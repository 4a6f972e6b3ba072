//! Linear RGB images and their error by versioned metrics.

use std::collections::BTreeMap;
use std::io;
use std::path::PathBuf;
use thiserror::Error;

/// Added to the squared reference in relative metrics, so that dark pixels do not rule the mean.
pub const RELATIVE_EPSILON: f64 = 1e-2;

/// Weights of linear RGB (Rec. 709 primaries) in luminance.
pub const LUMINANCE: [f64; 3] = [0.212671, 0.715160, 0.072169];

/// What can be wrong with an image.
#[derive(Debug, Error)]
pub enum ImageError {
    /// The pixels do not fill the rectangle.
    #[error(
        "an image of {width} × {height} needs that many pixels, and at least one, but got {pixels}"
    )]
    WrongPixelCount {
        /// Pixels in x.
        width: u32,
        /// Pixels in y.
        height: u32,
        /// Pixels given.
        pixels: usize,
    },
    /// Two images that belong together differ in size.
    #[error("{what} is {}×{} pixels, expected {}×{}: render both at one resolution",
        actual[0], actual[1], expected[0], expected[1])]
    SizeMismatch {
        /// Which image is at fault.
        what: &'static str,
        /// Size of the first image.
        expected: [u32; 2],
        /// Size of the image at fault.
        actual: [u32; 2],
    },
    /// No image where at least one is needed.
    #[error("no image was given where at least {needed} are needed")]
    TooFew {
        /// Least number of images.
        needed: usize,
    },
    /// A reference with NaN or infinite pixels measures nothing.
    #[error(
        "the reference image has {count} NaN or infinite pixels, the first at ({x}, {y}): \
        find the path that produced it before measuring against this image"
    )]
    NonFiniteReference {
        /// Pixels at fault.
        count: usize,
        /// Column of the first.
        x: usize,
        /// Row of the first, from the top.
        y: usize,
    },
    /// A file could not be written.
    #[error("cannot write {}: {source}; check that the folder exists, is writable and has space",
        path.display())]
    Write {
        /// Where to.
        path: PathBuf,
        /// Why not.
        source: io::Error,
    },
    /// The ending of a file name belongs to no format.
    #[error("{}: unknown kind of picture; the file name must end in one of {known}", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
        /// Endings of all formats.
        known: String,
    },
    /// The encoder refused the picture.
    #[error("cannot encode {}: {source}", path.display())]
    Encode {
        /// Where it was to go.
        path: PathBuf,
        /// Why not.
        source: image::ImageError,
    },
}

/// A linear RGB image, radiance units, row by row from the top left pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    /// Pixels in x.
    pub width: u32,
    /// Pixels in y.
    pub height: u32,
    /// `width * height` pixels.
    pub pixels: Vec<[f32; 3]>,
}

impl Image {
    /// An image of these pixels.
    ///
    /// # Errors
    /// [`ImageError::WrongPixelCount`], also for an image without pixels.
    pub fn new(width: u32, height: u32, pixels: Vec<[f32; 3]>) -> Result<Self, ImageError> {
        let expected = u64::from(width) * u64::from(height);
        if pixels.len() as u64 != expected || pixels.is_empty() {
            return Err(ImageError::WrongPixelCount {
                width,
                height,
                pixels: pixels.len(),
            });
        }
        Ok(Self {
            width,
            height,
            pixels,
        })
    }

    /// Mean of several images of one size, summed in f64.
    ///
    /// # Errors
    /// [`ImageError::TooFew`] for none, [`ImageError::SizeMismatch`].
    pub fn mean_of(images: &[Image]) -> Result<Self, ImageError> {
        let first = images.first().ok_or(ImageError::TooFew { needed: 1 })?;
        for image in images {
            first.check_size(image, "an image of a mean")?;
        }
        let n = images.len() as f64;
        let mean = |i: usize, c: usize| {
            (images
                .iter()
                .map(|m| f64::from(m.pixels[i][c]))
                .sum::<f64>()
                / n) as f32
        };
        let pixels = (0..first.pixels.len()).map(|i| [0, 1, 2].map(|c| mean(i, c)));
        Self::new(first.width, first.height, pixels.collect())
    }

    /// Mean over pixels and channels.
    pub fn mean(&self) -> f64 {
        let values = self.pixels.iter().flatten().map(|&v| f64::from(v));
        values.sum::<f64>() / (3 * self.pixels.len()) as f64
    }

    /// Pixels of which a channel is NaN or infinite.
    pub fn non_finite_pixels(&self) -> usize {
        self.pixels.iter().filter(|p| !is_finite(p)).count()
    }

    pub(super) fn check_size(&self, other: &Image, what: &'static str) -> Result<(), ImageError> {
        let (expected, actual) = ([self.width, self.height], [other.width, other.height]);
        match expected == actual && self.pixels.len() == other.pixels.len() {
            true => Ok(()),
            false => Err(ImageError::SizeMismatch {
                what,
                expected,
                actual,
            }),
        }
    }
}

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
}

impl Reference {
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

pub(super) fn is_finite(pixel: &[f32; 3]) -> bool {
    pixel.iter().all(|v| v.is_finite())
}

/// Luminance of a linear RGB pixel.
pub fn luminance(pixel: &[f32; 3]) -> f64 {
    let terms = pixel.iter().zip(LUMINANCE);
    terms.map(|(&v, weight)| f64::from(v) * weight).sum()
}

#[cfg(test)]
#[path = "image_tests.rs"]
mod tests;
