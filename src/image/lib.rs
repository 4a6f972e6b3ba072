//! Linear RGB images, pictures of them to look at, colour maps, and the files that they are written to and read from.
#![warn(missing_docs)]

mod color;
mod exr_file;
#[cfg(feature = "exr")]
mod exr_read;
mod formats;
mod picture;
mod read;

pub use color::*;
pub use exr_file::Attribute;
pub use formats::*;
pub use picture::*;
pub use read::read_linear;

use std::io;
use std::path::PathBuf;
use thiserror::Error;

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
    /// A file could not be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why not.
        source: io::Error,
    },
    /// A file is not what its ending says, or not an image that is read.
    #[error("cannot read {} as an image: {reason}", path.display())]
    Decode {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// The encoder refused the picture.
    #[error("cannot encode {}: {source}", path.display())]
    Encode {
        /// Where it was to go.
        path: PathBuf,
        /// Why not.
        source: ::image::ImageError,
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

    /// Variance over several images of one size, by pixel and channel, of one of them: the sum of squares about
    /// the mean over one less than their number.
    ///
    /// # Errors
    /// [`ImageError::TooFew`] below two, [`ImageError::SizeMismatch`].
    pub fn variance_of(images: &[Image]) -> Result<Self, ImageError> {
        let [first, _, ..] = images else {
            return Err(ImageError::TooFew { needed: 2 });
        };
        for image in images {
            first.check_size(image, "an image of a variance")?;
        }
        let n = images.len() as f64;
        let variance = |i: usize, c: usize| {
            let values = || images.iter().map(|m| f64::from(m.pixels[i][c]));
            let mean = values().sum::<f64>() / n;
            (values().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0)) as f32
        };
        let pixels = (0..first.pixels.len()).map(|i| [0, 1, 2].map(|c| variance(i, c)));
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

    /// Fails unless `other`, called `what` in the message, has the size of this image.
    ///
    /// # Errors
    /// [`ImageError::SizeMismatch`].
    pub fn check_size(&self, other: &Image, what: &'static str) -> Result<(), ImageError> {
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

/// Whether no channel is NaN or infinite.
pub fn is_finite(pixel: &[f32; 3]) -> bool {
    pixel.iter().all(|v| v.is_finite())
}

/// Luminance of a linear RGB pixel.
pub fn luminance(pixel: &[f32; 3]) -> f64 {
    let terms = pixel.iter().zip(LUMINANCE);
    terms.map(|(&v, weight)| f64::from(v) * weight).sum()
}
