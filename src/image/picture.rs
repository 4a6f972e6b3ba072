//! Displayable pictures: tone mapping, error maps and PNG files.

use super::formats::save;
use super::{Image, ImageError, is_finite, luminance};
use std::io;
use std::path::Path;

/// Colour of NaN and infinite pixels in every picture.
pub const NON_FINITE_COLOUR: [u8; 3] = [255, 0, 255];

/// An 8-bit sRGB picture, row by row from the top left pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// `width * height` pixels.
    pub pixels: Vec<[u8; 3]>,
}

/// Exposure that maps the log-average luminance of the finite, non-black pixels to 0.36 (Reinhard
/// et al. 2002, equation 2, with twice their key: white skies look dull at 0.18); 1 if there are no
/// such pixels. Use the reference's exposure for all images of a scene.
pub fn automatic_exposure(image: &Image) -> f32 {
    let lit = |p: &&[f32; 3]| is_finite(p) && luminance(p) > 1e-6;
    let (sum, count) = image
        .pixels
        .iter()
        .filter(lit)
        .fold((0.0, 0usize), |(sum, n), p| {
            (sum + luminance(p).ln(), n + 1)
        });
    match count {
        0 => 1.0,
        _ => (0.36 / (sum / count as f64).exp()) as f32,
    }
}

/// A finite pixel as displayed: exposure, then the luminance curve L (1 + L / 16) / (1 + L), which
/// maps 4 to white and preserves hue (Reinhard et al. 2002, equation 4), clamp, sRGB encoding (IEC
/// 61966-2-1) to [0, 1].
pub fn displayed(pixel: &[f32; 3], exposure: f32) -> [f64; 3] {
    let bright = luminance(pixel).max(0.0) * f64::from(exposure);
    let scale = f64::from(exposure) * (1.0 + bright / 16.0) / (1.0 + bright);
    pixel.map(|v| encode_srgb(f64::from(v) * scale))
}

/// Tone-maps every pixel as [`displayed`]; non-finite ones become [`NON_FINITE_COLOUR`].
pub fn tone_map(image: &Image, exposure: f32) -> Picture {
    let map = |pixel: &[f32; 3]| {
        if is_finite(pixel) {
            displayed(pixel, exposure).map(|v| (v * 255.0).round() as u8)
        } else {
            NON_FINITE_COLOUR
        }
    };
    Picture {
        width: image.width,
        height: image.height,
        pixels: image.pixels.iter().map(map).collect(),
    }
}

/// Writes a picture as PNG, atomically. What was encoded is decoded first, and compared.
///
/// # Errors
/// [`ImageError::Write`], [`ImageError::Encode`], [`ImageError::Altered`].
pub fn write_png(path: &Path, picture: &Picture) -> Result<(), ImageError> {
    let encoded = encode_png(picture);
    let fault = encoded
        .as_ref()
        .ok()
        .and_then(|bytes| differing(picture, bytes));
    if let Some(fault) = fault {
        let path = path.to_owned();
        return Err(ImageError::Altered { path, fault });
    }
    save(path, encoded)
}

/// The first pixel of an encoded picture that is another.
fn differing(picture: &Picture, bytes: &[u8]) -> Option<String> {
    let read = match image::load_from_memory_with_format(bytes, image::ImageFormat::Png) {
        Ok(read) => read.into_rgb8(),
        Err(error) => return Some(error.to_string()),
    };
    let is_other = |place: u32| {
        let [x, y] = [place % picture.width, place / picture.width];
        let found = read.get_pixel_checked(x, y).map(|pixel| pixel.0);
        found.as_ref() != picture.pixels.get(place as usize)
    };
    let place = (0..picture.width * picture.height).find(|place| is_other(*place))?;
    let [x, y] = [place % picture.width, place / picture.width];
    Some(format!("pixel ({x}, {y}) is not the one that was encoded"))
}

/// Encodes a PNG file.
pub(super) fn encode_png(picture: &Picture) -> Result<Vec<u8>, image::ImageError> {
    let mut bytes = io::Cursor::new(Vec::new());
    image::write_buffer_with_format(
        &mut bytes,
        picture.pixels.as_flattened(),
        picture.width,
        picture.height,
        image::ExtendedColorType::Rgb8,
        image::ImageFormat::Png,
    )?;
    Ok(bytes.into_inner())
}

fn encode_srgb(linear: f64) -> f64 {
    let v = linear.clamp(0.0, 1.0);
    if v <= 0.0031308 {
        12.92 * v
    } else {
        1.055 * v.powf(1.0 / 2.4) - 0.055
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(values: &[f32]) -> Image {
        let pixels = values.iter().map(|&v| [v; 3]).collect();
        Image::new(values.len() as u32, 1, pixels).unwrap()
    }

    #[test]
    fn tone_mapping_is_monotonic_and_has_its_fixed_points() {
        let mapped = tone_map(&grey(&[-1.0, 0.0, 0.18, 1.0, 4.0, 1e9, f32::NAN]), 1.0);
        assert_eq!(mapped.pixels[0], [0; 3]);
        assert_eq!(mapped.pixels[1], [0; 3]);
        assert_eq!(mapped.pixels[4], [255; 3], "4 is white");
        assert_eq!(mapped.pixels[5], [255; 3]);
        assert_eq!(mapped.pixels[6], NON_FINITE_COLOUR);
        assert!(mapped.pixels[1..5].is_sorted_by(|a, b| a[0] < b[0]));
        // 17/32 of linear light is 0.7556 encoded.
        assert_eq!(mapped.pixels[3], [193; 3]);
        let exposure = automatic_exposure(&grey(&[0.18, 0.72, 0.0, f32::NAN]));
        assert!((exposure - 1.0).abs() < 1e-5, "{exposure}");
        assert_eq!(automatic_exposure(&grey(&[0.0])), 1.0);
    }

    #[test]
    fn a_png_reads_back_as_written_and_leaves_no_litter() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture.png");
        let picture = Picture {
            width: 2,
            height: 1,
            pixels: vec![[1, 2, 3], [250, 128, 0]],
        };
        write_png(&path, &picture).unwrap();
        write_png(&path, &picture).unwrap();
        let read = image::open(&path).unwrap().to_rgb8();
        assert_eq!(read.dimensions(), (2, 1));
        assert_eq!(read.as_raw().as_slice(), picture.pixels.as_flattened());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
        let missing = folder.path().join("no/such/folder.png");
        let error = write_png(&missing, &picture).unwrap_err();
        assert!(error.to_string().contains("folder.png"), "{error}");
    }
}
