//! Image file formats. By extension: PNG is for viewing, the others store linear radiance.

use super::exr_file::encode_exr;
use super::hdr_read::read_hdr;
use super::read::{Decode, read_npy, read_pfm};
use super::{Attribute, Image, ImageError, automatic_exposure, encode_png, tone_map};
use ::image::{ExtendedColorType, ImageFormat};
use raystone_core::atomic::write_atomic;
use std::io::Cursor;
use std::path::Path;

/// A file format that images can be written to and, if it stores linear values, read from.
#[derive(Debug)]
pub struct FileFormat {
    /// File extension, lower case, without the dot.
    pub ending: &'static str,
    /// One line: the content of the file.
    pub description: &'static str,
    encode: fn(&Image, &[Attribute]) -> Result<Vec<u8>, image::ImageError>,
    pub(super) decode: Option<Decode>,
    /// True if it keeps every bit.
    is_exact: bool,
}

#[cfg(feature = "exr")]
const READ_EXR: Option<Decode> = Some(super::exr_read::read_exr);
#[cfg(not(feature = "exr"))]
const READ_EXR: Option<Decode> = None;

/// All formats, in the order of messages.
pub(crate) const FILE_FORMATS: [FileFormat; 5] = [
    FileFormat {
        ending: "png",
        description: "tone-mapped sRGB with 8 bits",
        encode: |image, _| encode_png(&tone_map(image, automatic_exposure(image))),
        decode: None,
        is_exact: false,
    },
    FileFormat {
        ending: "exr",
        description: "OpenEXR, linear radiance as 32-bit floats, with attributes",
        encode: |image, attributes| Ok(encode_exr(image, attributes)),
        decode: READ_EXR,
        is_exact: true,
    },
    FileFormat {
        ending: "hdr",
        description: "Radiance RGBE, linear radiance to 1 %",
        encode: |image, _| encode_hdr(image),
        decode: Some(read_hdr),
        is_exact: false,
    },
    FileFormat {
        ending: "pfm",
        description: "portable float map, linear radiance as 32-bit floats",
        encode: |image, _| Ok(encode_pfm(image)),
        decode: Some(read_pfm),
        is_exact: true,
    },
    FileFormat {
        ending: "npy",
        description: "NumPy array [height, width, 3] of 32-bit floats, linear radiance",
        encode: |image, _| Ok(encode_npy(image)),
        decode: Some(read_npy),
        is_exact: true,
    },
];

impl FileFormat {
    /// The format of a file by its extension, ignoring case.
    ///
    /// # Errors
    /// [`ImageError::UnknownFormat`] with the known endings.
    pub fn of(path: &Path) -> Result<&'static Self, ImageError> {
        let ending = path.extension().unwrap_or_default().to_ascii_lowercase();
        let found = FILE_FORMATS.iter().find(|f| ending == f.ending);
        found.ok_or_else(|| ImageError::UnknownFormat {
            path: path.to_owned(),
            known: FILE_FORMATS.map(|f| format!(".{}", f.ending)).join(", "),
        })
    }

    /// Formats that store linear values.
    pub fn linear() -> impl Iterator<Item = &'static Self> {
        FILE_FORMATS.iter().filter(|format| format.decode.is_some())
    }

    /// The bytes of a file of this format, for those who have no files.
    ///
    /// # Errors
    /// [`ImageError::Encode`].
    pub fn encoded(&self, image: &Image, about: &[Attribute]) -> Result<Vec<u8>, ImageError> {
        (self.encode)(image, about).map_err(|source| ImageError::Encode {
            path: format!("image.{}", self.ending).into(),
            source,
        })
    }

    /// Writes an image atomically. Radiance is stored unchanged, including NaN, except by RGBE,
    /// which replaces NaN and negative numbers by 0. Only EXR stores the attributes. What has a decoder
    /// is read back by that, which shares nothing with the encoder, and compared: to the bit, or to 1 %.
    ///
    /// # Errors
    /// [`ImageError::Encode`], [`ImageError::Write`], [`ImageError::Altered`].
    pub fn write(
        &self,
        path: &Path,
        image: &Image,
        attributes: &[Attribute],
    ) -> Result<(), ImageError> {
        save(path, (self.encode)(image, attributes))?;
        // A pipe or a device cannot be read back.
        let Some(decode) = self.decode.filter(|_| path.is_file()) else {
            return Ok(());
        };
        let read = std::fs::read(path).map_err(|e| e.to_string());
        let read = read.and_then(|bytes| decode(&bytes));
        let fault = match read {
            Ok(read) => differing_pixel(&read, image, self.is_exact),
            Err(reason) => Some(reason),
        };
        fault.map_or(Ok(()), |fault| {
            let path = path.to_owned();
            Err(ImageError::Altered { path, fault })
        })
    }
}

/// The first pixel that differs in a bit, all numbers that are none being alike; or by more than RGBE loses.
fn differing_pixel(read: &Image, written: &Image, is_exact: bool) -> Option<String> {
    let size = |image: &Image| [image.width, image.height];
    if size(read) != size(written) {
        let ([w, h], [width, height]) = (size(read), size(written));
        return Some(format!("{w} × {h} pixels, not {width} × {height}"));
    }
    let bits = |pixel: &[f32; 3]| pixel.map(|v| if v.is_nan() { f32::NAN } else { v }.to_bits());
    let mut pairs = read.pixels.iter().zip(&written.pixels);
    let place = pairs.position(|(read, written)| {
        if is_exact {
            bits(read) != bits(written)
        } else {
            !is_near(read, written)
        }
    })?;
    let [x, y] = [place as u32 % read.width, place as u32 / read.width];
    let (read, written) = (read.pixels[place], written.pixels[place]);
    Some(format!("pixel ({x}, {y}) is {read:?}, not {written:?}"))
}

/// True if a pixel is another by RGBE's loss only: a part in a hundred of its greatest channel. What is beyond its range is
/// not compared.
fn is_near(read: &[f32; 3], written: &[f32; 3]) -> bool {
    const RANGE: std::ops::Range<f32> = 1e-30..1e30;
    let greatest = written.iter().copied().fold(0.0, f32::max);
    let is_in_range = RANGE.contains(&greatest) && written.iter().all(|v| v.is_finite());
    let mut pairs = read.iter().zip(written);
    !is_in_range || pairs.all(|(a, b)| (a - b.max(0.0)).abs() <= 0.01 * greatest)
}

/// Writes an encoded picture atomically.
pub(super) fn save(
    path: &Path,
    encoded: Result<Vec<u8>, image::ImageError>,
) -> Result<(), ImageError> {
    let bytes = encoded.map_err(|source| ImageError::Encode {
        path: path.to_owned(),
        source,
    })?;
    write_atomic(path, &bytes).map_err(|source| ImageError::Write {
        path: path.to_owned(),
        source,
    })
}

fn encode_hdr(image: &Image) -> Result<Vec<u8>, image::ImageError> {
    let values = image.pixels.as_flattened();
    let values: Vec<f32> = values.iter().copied().map(in_range_of_rgbe).collect();
    let mut bytes = Cursor::new(Vec::new());
    image::write_buffer_with_format(
        &mut bytes,
        bytemuck::cast_slice(&values),
        image.width,
        image.height,
        ExtendedColorType::Rgb32F,
        ImageFormat::Hdr,
    )?;
    Ok(bytes.into_inner())
}

/// Limits a value to the range of an eight-bit shared exponent (Ward 1991), outside of which the
/// library's encoder wraps around. NaN becomes 0.
fn in_range_of_rgbe(value: f32) -> f32 {
    if value > 1e-32 {
        value.min(1.6e38)
    } else {
        0.0
    }
}

/// Portable float map: rows from bottom to top; a negative scale means little endian.
fn encode_pfm(image: &Image) -> Vec<u8> {
    let mut bytes = format!("PF\n{} {}\n-1.0\n", image.width, image.height).into_bytes();
    for row in image.pixels.rchunks(image.width as usize) {
        push_floats(&mut bytes, row);
    }
    bytes
}

/// NumPy's format 1.0: magic, header length, a Python literal padded so that the data begins at a
/// multiple of 64, then the array in C order, rows from the top.
fn encode_npy(image: &Image) -> Vec<u8> {
    const PREFIX: usize = 10;
    let shape = format!("({}, {}, 3)", image.height, image.width);
    let mut header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}");
    let padded = (PREFIX + header.len() + 1).next_multiple_of(64) - PREFIX;
    header = format!("{header:<width$}\n", width = padded - 1);
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend_from_slice(&(padded as u16).to_le_bytes());
    bytes.extend_from_slice(header.as_bytes());
    push_floats(&mut bytes, &image.pixels);
    bytes
}

fn push_floats(bytes: &mut Vec<u8>, pixels: &[[f32; 3]]) {
    bytes.extend(pixels.as_flattened().iter().flat_map(|v| v.to_le_bytes()));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::read_linear;

    /// Odd sizes without symmetry, to detect flips and swaps of axes or channels.
    fn sample() -> Image {
        let value = |i: usize| match i {
            4 => 1.5e5,
            7 => 1e-4,
            _ => 0.25 + i as f32 / 3.0,
        };
        let pixels = (0..15).map(|p| [0, 1, 2].map(|c| value(3 * p + c)));
        Image::new(5, 3, pixels.collect()).unwrap()
    }

    fn written(ending: &str, image: &Image) -> Vec<u8> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(format!("picture.{ending}"));
        let format = FileFormat::of(&path).unwrap();
        let attributes = [
            ("spp", "64".to_owned()),
            ("sampler", "sobol × none".to_owned()),
        ];
        format.write(&path, image, &attributes).unwrap();
        std::fs::read(&path).unwrap()
    }

    fn attribute<'a>(bytes: &'a [u8], name: &str, kind: &str) -> &'a [u8] {
        let key = format!("{name}\0{kind}\0").into_bytes();
        let at = bytes.windows(key.len()).position(|w| w == key).unwrap() + key.len();
        let size = u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
        &bytes[at + 4..][..size as usize]
    }

    #[test]
    fn exr_keeps_every_bit_also_of_what_is_no_number() {
        let mut image = sample();
        image.pixels[6] = [f32::INFINITY, -2.5, 1e-40];
        image.pixels[2][1] = f32::NAN;
        let bytes = written("exr", &image);
        let window: Vec<u8> = [0u32, 0, 4, 2]
            .iter()
            .flat_map(|v| v.to_le_bytes())
            .collect();
        assert_eq!(attribute(&bytes, "dataWindow", "box2i"), window);
        assert_eq!(attribute(&bytes, "displayWindow", "box2i"), window);
        assert_eq!(attribute(&bytes, "compression", "compression"), [0]);
        let channels = attribute(&bytes, "channels", "chlist");
        assert_eq!(channels.len(), 3 * 18 + 1);
        assert_eq!(attribute(&bytes, "spp", "string"), b"64");
        let sampler = "sobol × none".as_bytes();
        assert_eq!(attribute(&bytes, "sampler", "string"), sampler);
        // The row table follows the header, which ends in the last attribute and a zero.
        let table = bytes.len() - 3 * (8 + 60) - 3 * 8;
        assert!(bytes[..table].ends_with(&[sampler, &[0]].concat()));
        for (y, row) in image.pixels.chunks(5).enumerate() {
            let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
            let at = word(table + 8 * y) as usize;
            assert_eq!((word(at), word(at + 4)), (y as u32, 60));
            for (channel, offset) in [(2, 0), (1, 20), (0, 40)] {
                for (x, pixel) in row.iter().enumerate() {
                    let bits = word(at + 8 + offset + 4 * x);
                    assert_eq!(bits, pixel[channel].to_bits(), "{x}, {y}, {channel}");
                }
            }
        }
    }

    #[test]
    fn a_file_that_holds_another_image_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let image = sample();
        for format in FILE_FORMATS.iter().filter(|format| format.is_exact) {
            let path = folder.path().join(format!("picture.{}", format.ending));
            format.write(&path, &image, &[]).unwrap();
            let changes: [fn(&mut Image); 3] = [
                |image| image.pixels.iter_mut().for_each(|p| p.swap(0, 2)),
                |image| image.pixels.reverse(),
                |image| image.pixels[14][1] = image.pixels[14][1].next_up(),
            ];
            for change in changes {
                let mut other = image.clone();
                change(&mut other);
                let fault = differing_pixel(&read_linear(&path).unwrap(), &other, true);
                assert!(fault.unwrap().starts_with("pixel ("), "{}", format.ending);
            }
            let swapped = FileFormat {
                encode: |image, attributes| {
                    let mut other = image.clone();
                    other.pixels[14].swap(0, 1);
                    let path = Path::new("x.npy");
                    (FileFormat::of(path).unwrap().encode)(&other, attributes)
                },
                ..FILE_FORMATS[4]
            };
            let written = swapped.write(&path, &image, &[]);
            assert!(matches!(written, Err(ImageError::Altered { .. })));
        }
    }

    #[test]
    fn hdr_keeps_what_a_shared_exponent_can() {
        let mut image = sample();
        let odd = [f32::NAN, -1.0, 1e-39, 1e-30, f32::INFINITY, 3e38];
        image.pixels[0] = [odd[0], odd[1], odd[2]];
        image.pixels[1] = [odd[3]; 3];
        image.pixels[2] = [odd[4], odd[5], odd[5]];
        let read = image::load_from_memory_with_format(&written("hdr", &image), ImageFormat::Hdr);
        let read = read.unwrap().into_rgb32f();
        let read: Vec<[f32; 3]> = read.pixels().map(|p| p.0).collect();
        assert_eq!(read[0], [0.0; 3]);
        assert!(read[2].iter().all(|v| (1e38..2e38).contains(v)), "{read:?}");
        for (read, pixel) in read[1..].iter().zip(&image.pixels[1..]) {
            let expected = pixel.map(in_range_of_rgbe);
            let brightest = expected.into_iter().fold(0.0, f32::max);
            for (value, expected) in read.iter().zip(expected) {
                let error = (value - expected).abs() / brightest;
                assert!(error <= 1.0 / 128.0, "{value} for {expected}");
            }
        }
    }

    #[test]
    fn pfm_is_bottom_up_and_little_endian() {
        let image = sample();
        let bytes = written("pfm", &image);
        let data = &bytes[b"PF\n5 3\n-1.0\n".len()..];
        assert_eq!(data.len(), 5 * 3 * 12);
        let first = f32::from_le_bytes(data[..4].try_into().unwrap());
        assert_eq!(first, image.pixels[10][0], "the last row comes first");
        let last = f32::from_le_bytes(data[data.len() - 4..].try_into().unwrap());
        assert_eq!(last, image.pixels[4][2]);
    }

    #[test]
    fn npy_has_its_shape_and_begins_at_a_multiple_of_64() {
        for width in [5, 12345] {
            let pixels = vec![[1.0, 2.0, 3.0]; width];
            let image = Image::new(width as u32, 1, pixels).unwrap();
            let bytes = written("npy", &image);
            let header = u16::from_le_bytes([bytes[8], bytes[9]]) as usize;
            assert_eq!((10 + header) % 64, 0);
            let text = std::str::from_utf8(&bytes[10..10 + header]).unwrap();
            let shape = format!("'descr': '<f4', 'fortran_order': False, 'shape': (1, {width}, 3)");
            assert!(text.contains(&shape) && text.ends_with('\n'), "{text:?}");
            assert_eq!(bytes.len(), 10 + header + 12 * width);
            assert_eq!(bytes[10 + header..][..4], 1.0f32.to_le_bytes());
        }
    }
}
