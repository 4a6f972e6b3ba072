//! Linear RGB images, displayable pictures, colour maps, and image file formats.
#![warn(missing_docs)]

mod color;
mod exr_file;
#[cfg(feature = "exr")]
mod exr_read;
mod formats;
mod hdr_lines;
mod hdr_read;
mod picture;
mod primaries;
mod read;
mod upright;

pub use color::*;
pub use exr_file::Attribute;
pub use formats::*;
pub use hdr_read::{hdr_size, read_hdr};
pub use picture::*;
pub use primaries::{is_cube_map, other_primaries, primaries_note};
pub use read::{read_linear, read_npy_array};

use std::io;
use std::path::PathBuf;
use thiserror::Error;

/// Luminance weights of linear RGB (Rec. 709 primaries).
pub const LUMINANCE: [f64; 3] = [0.212671, 0.715160, 0.072169];

/// Errors of images.
#[derive(Debug, Error)]
pub enum ImageError {
    /// The number of pixels does not match the size.
    #[error(
        "an image of {width} × {height} needs that many pixels, and at least one, but got {pixels}"
    )]
    WrongPixelCount {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
        /// Pixels given.
        pixels: usize,
    },
    /// Two images differ in size.
    #[error("{what} is {}×{} pixels, expected {}×{}: render both at one resolution",
        actual[0], actual[1], expected[0], expected[1])]
    SizeMismatch {
        /// The image at fault.
        what: &'static str,
        /// Size of the first image.
        expected: [u32; 2],
        /// Size of the image at fault.
        actual: [u32; 2],
    },
    /// Too few images.
    #[error("no image was given where at least {needed} are needed")]
    TooFew {
        /// Minimum number of images.
        needed: usize,
    },
    /// The reference has NaN or infinite pixels.
    #[error(
        "the reference image has {count} NaN or infinite pixels, the first at ({x}, {y}): \
        find the path that produced it before measuring against this image"
    )]
    NonFiniteReference {
        /// Number of invalid pixels.
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
        /// The file.
        path: PathBuf,
        /// The reason.
        source: io::Error,
    },
    /// The file extension belongs to no format.
    #[error("{}: unknown kind of picture; the file name must end in one of {known}", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
        /// Extensions of all formats.
        known: String,
    },
    /// A file could not be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: io::Error,
    },
    /// The file is not what its extension says, or not a supported image.
    #[error("cannot read {} as an image: {reason}", path.display())]
    Decode {
        /// The file.
        path: PathBuf,
        /// The problem.
        reason: String,
    },
    /// A file that was just written holds another image.
    #[error("{} does not hold the image that was written to it: {fault}; a disk or this program is at fault, keep no file of it", path.display())]
    Altered {
        /// The file.
        path: PathBuf,
        /// The first difference.
        fault: String,
    },
    /// The encoder refused the image.
    #[error("cannot encode {}: {source}", path.display())]
    Encode {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: ::image::ImageError,
    },
}

/// A linear RGB image in radiance units, row by row from the top left pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// `width * height` pixels.
    pub pixels: Vec<[f32; 3]>,
}

impl Image {
    /// Creates an image.
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

    /// Sample variance over several images of one size, by pixel and channel (divided by n − 1).
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

    /// Number of pixels with a NaN or infinite channel.
    pub fn non_finite_pixels(&self) -> usize {
        self.pixels.iter().filter(|p| !is_finite(p)).count()
    }

    /// Checks that `other`, called `what` in the message, has the size of this image.
    ///
    /// # Errors
    /// [`ImageError::SizeMismatch`].
    pub fn check_size(&self, other: &Image, what: &'static str) -> Result<(), ImageError> {
        let (expected, actual) = ([self.width, self.height], [other.width, other.height]);
        if expected == actual && self.pixels.len() == other.pixels.len() {
            Ok(())
        } else {
            Err(ImageError::SizeMismatch {
                what,
                expected,
                actual,
            })
        }
    }
}

/// True if no channel is NaN or infinite.
pub fn is_finite(pixel: &[f32; 3]) -> bool {
    pixel.iter().all(|v| v.is_finite())
}

/// Luminance of a linear RGB pixel.
pub fn luminance(pixel: &[f32; 3]) -> f64 {
    let terms = pixel.iter().zip(LUMINANCE);
    terms.map(|(&v, weight)| f64::from(v) * weight).sum()
}
