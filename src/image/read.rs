//! Reads linear images: references by other renderers, and environment maps.

use super::{FileFormat, Image, ImageError};
use half::f16;
use std::io::{self, ErrorKind};
use std::path::Path;

/// Pixel limit of images: 1.5 GiB as three floats.
pub(super) const MOST_PIXELS: u64 = 1 << 27;

/// Decoder of a file's bytes; the error describes the problem.
pub(super) type Decode = fn(&[u8]) -> Result<Image, String>;

/// Reads linear RGB from a file, whose extension determines the format, ignoring case.
///
/// * **EXR**: half, float or integer channels. Uses R, G and B without a layer name, or those of a
///   layer called `rgba`, `rgb`, `color`, `combined` or `beauty`, or those of the only layer that
///   has any. Y alone is grey. Alpha is ignored: EXR colours are premultiplied. Pixels of the
///   display window outside the data window are 0.
/// * **HDR**: Radiance RGBE, divided by `EXPOSURE` and `COLORCORR` if present.
/// * **PFM**: `PF` and grey `Pf`, of both byte orders; the magnitude of the scale is ignored.
/// * **NPY**: `[height, width, 3]`, `[height, width, 4]` (the fourth ignored), `[height, width, 1]`
///   or `[height, width]` (grey), of 16-, 32- or 64-bit floats in C order.
///
/// Values are unchanged, including NaN and infinity.
///
/// # Errors
/// [`ImageError::UnknownFormat`], [`ImageError::Read`], [`ImageError::Decode`] with the problem.
pub fn read_linear(path: &Path) -> Result<Image, ImageError> {
    let ending = path.extension().unwrap_or_default().to_ascii_lowercase();
    let format = FileFormat::linear().find(|format| ending == format.ending);
    let decode = format.and_then(|format| format.decode);
    let decode = decode.ok_or_else(|| {
        let known: Vec<String> = FileFormat::linear()
            .map(|format| format!(".{}", format.ending))
            .collect();
        ImageError::UnknownFormat {
            path: path.to_owned(),
            known: known.join(", "),
        }
    })?;
    let unreadable = |source| ImageError::Read {
        path: path.to_owned(),
        source,
    };
    let bytes = raystone_core::files::read(path).map_err(|error| match error.kind() {
        ErrorKind::IsADirectory => unreadable(io::Error::other("it is no regular file")),
        _ => unreadable(error),
    })?;
    decode(&bytes).map_err(|reason| ImageError::Decode {
        path: path.to_owned(),
        reason,
    })
}

pub(super) fn checked_size(width: u64, height: u64) -> Result<[u32; 2], String> {
    let pixels = width.checked_mul(height);
    match (u32::try_from(width), u32::try_from(height)) {
        (Ok(w), Ok(h)) if pixels.is_some_and(|n| n > 0 && n <= MOST_PIXELS) => Ok([w, h]),
        _ => Err(format!(
            "{width} × {height} pixels, which is none or more than {MOST_PIXELS}"
        )),
    }
}

/// The next word of a header, and the bytes after the single white space.
fn word(bytes: &[u8]) -> Option<(&str, &[u8])> {
    let start = bytes.iter().position(|b| !b.is_ascii_whitespace())?;
    let length = bytes[start..]
        .iter()
        .take(64)
        .position(u8::is_ascii_whitespace)?;
    let (word, rest) = bytes[start..].split_at(length);
    Some((std::str::from_utf8(word).ok()?, &rest[1..]))
}

pub(super) fn read_pfm(bytes: &[u8]) -> Result<Image, String> {
    let header = || {
        let (kind, rest) = word(bytes)?;
        let (width, rest) = word(rest)?;
        let (height, rest) = word(rest)?;
        let (scale, rest) = word(rest)?;
        let channels = [("PF", 3), ("Pf", 1)];
        let (_, channels) = channels.into_iter().find(|(name, _)| *name == kind)?;
        let scale: f32 = scale.parse().ok().filter(|s| *s != 0.0)?;
        Some((
            channels,
            width.parse().ok()?,
            height.parse().ok()?,
            scale,
            rest,
        ))
    };
    let header = header().ok_or("the header is not `PF` or `Pf`, width, height and scale")?;
    let (channels, width, height, scale, data) = header;
    let [width, height] = checked_size(width, height)?;
    let expected = width as usize * height as usize * channels * 4;
    // A header whose lines end in CR LF.
    let has_crlf = bytes[..bytes.len() - data.len()].ends_with(b"\r") && data.len() == expected + 1;
    let data = data
        .strip_prefix(b"\n")
        .filter(|_| has_crlf)
        .unwrap_or(data);
    if data.len() != expected {
        return Err(format!(
            "{} bytes of values where {width} × {height} pixels of {channels} have {expected}",
            data.len()
        ));
    }
    let float = if scale < 0.0 {
        f32::from_le_bytes
    } else {
        f32::from_be_bytes
    };
    let values = pixels(&values(data, float), channels);
    // Rows go from bottom to top.
    let rows = values.rchunks(width as usize);
    Image::new(width, height, rows.flatten().copied().collect()).map_err(|e| e.to_string())
}

/// Values of `N` bytes each.
fn values<const N: usize>(data: &[u8], value: impl Fn([u8; N]) -> f32) -> Vec<f32> {
    data.as_chunks::<N>().0.iter().map(|b| value(*b)).collect()
}

/// Pixels of an array [height, width, channels].
fn pixels(values: &[f32], channels: usize) -> Vec<[f32; 3]> {
    let pixel = |of: &[f32]| match channels {
        1 => [of[0]; 3],
        _ => [of[0], of[1], of[2]],
    };
    values.chunks_exact(channels).map(pixel).collect()
}

/// The text after `'key':` in the literal of an NPY header, which may have either quotation mark.
fn entry<'a>(header: &'a str, key: &str) -> Option<&'a str> {
    let mut marks = ['\'', '"'].into_iter();
    let (_, rest) = marks.find_map(|mark| header.split_once(&format!("{mark}{key}{mark}")))?;
    Some(rest.trim_start().strip_prefix(':')?.trim_start())
}

/// The header and the values of an NPY file.
fn npy_parts(bytes: &[u8]) -> Option<(&str, &[u8])> {
    let rest = bytes.strip_prefix(b"\x93NUMPY")?;
    let (version, rest) = rest.split_at_checked(2)?;
    // The header length has two bytes in version 1 and four since.
    let (length, rest) = rest.split_at_checked(if version[0] == 1 { 2 } else { 4 })?;
    let length = length
        .iter()
        .rev()
        .fold(0, |n, byte| n << 8 | usize::from(*byte));
    let (header, data) = rest.split_at_checked(length)?;
    Some((std::str::from_utf8(header).ok()?, data))
}

/// The type of an NPY file's values, such as `<f4`.
fn kind_of(bytes: &[u8]) -> Option<&str> {
    let (header, _) = npy_parts(bytes)?;
    entry(header, "descr").and_then(|rest| rest.split(['\'', '"']).nth(1))
}

/// Reads an array of NumPy, of floats, integers or flags: its shape, and its values in C order.
/// Integers keep their values; those beyond 24 bits are rounded.
///
/// # Errors
/// A description of what is not so.
pub fn read_npy_array(bytes: &[u8]) -> Result<(Vec<u64>, Vec<f32>), String> {
    let (header, data) = npy_parts(bytes).ok_or("it does not begin with a header of NumPy")?;
    let kind = kind_of(bytes);
    let shape = entry(header, "shape").and_then(|rest| rest.strip_prefix('(')?.split(')').next());
    if entry(header, "descr").is_some_and(|rest| rest.starts_with('[')) {
        return Err("its values are records of fields: save one field alone".to_owned());
    }
    let (Some(kind), Some(shape)) = (kind, shape) else {
        return Err("its header has no `descr` or no `shape`".to_owned());
    };
    let is_fortran = entry(header, "fortran_order").is_some_and(|rest| rest.starts_with("True"));
    let sizes: Option<Vec<u64>> = shape
        .split(',')
        // Python 2 writes `3L`.
        .map(|size| size.trim().trim_end_matches('L'))
        .filter(|size| !size.is_empty())
        .map(|size| size.parse().ok())
        .collect();
    let sizes = sizes.ok_or_else(|| format!("its shape is ({shape})"))?;
    let (order, kind) = kind.split_at_checked(1).unwrap_or(("", kind));
    let Some((width, value)) = number_of(kind).filter(|_| ["<", ">", "|", "="].contains(&order))
    else {
        return Err(format!(
            "its values are `{order}{kind}`, which are neither floats of 16, 32 or 64 bits, integers nor flags"
        ));
    };
    let product = |bytes: Option<u64>, size: &u64| bytes?.checked_mul(*size);
    let expected = sizes.iter().fold(Some(width), product);
    if expected != Some(data.len() as u64) {
        return Err(format!(
            "{} bytes of values do not fill the shape ({shape}) of `{kind}`",
            data.len()
        ));
    }
    let number = |bytes: &[u8]| {
        let mut word = [0; 8];
        word[..bytes.len()].copy_from_slice(bytes);
        if order == ">" {
            word[..bytes.len()].reverse();
        }
        value(word)
    };
    let values: Vec<f32> = data.chunks_exact(width as usize).map(number).collect();
    let values = if is_fortran {
        in_c_order(&sizes, &values)
    } else {
        values
    };
    Ok((sizes, values))
}

/// A value from its little-endian bytes, the first of eight.
type Value = fn([u8; 8]) -> f32;

/// Bytes of a value of NumPy's type, and the value of little-endian bytes.
fn number_of(kind: &str) -> Option<(u64, Value)> {
    fn of<const N: usize>(word: [u8; 8]) -> [u8; N] {
        std::array::from_fn(|k| word[k])
    }
    Some(match kind {
        "b1" | "u1" => (1, |w| f32::from(w[0])),
        "i1" => (1, |w| f32::from(i8::from_le_bytes(of(w)))),
        "u2" => (2, |w| f32::from(u16::from_le_bytes(of(w)))),
        "i2" => (2, |w| f32::from(i16::from_le_bytes(of(w)))),
        "f2" => (2, |w| f16::from_le_bytes(of(w)).to_f32()),
        "u4" => (4, |w| u32::from_le_bytes(of(w)) as f32),
        "i4" => (4, |w| i32::from_le_bytes(of(w)) as f32),
        "f4" => (4, |w| f32::from_le_bytes(of(w))),
        "u8" => (8, |w| u64::from_le_bytes(w) as f32),
        "i8" => (8, |w| i64::from_le_bytes(w) as f32),
        "f8" => (8, |w| f64::from_le_bytes(w) as f32),
        _ => return None,
    })
}

/// The values of an array whose first index runs fastest, with the last one fastest.
fn in_c_order(sizes: &[u64], values: &[f32]) -> Vec<f32> {
    let mut place = vec![0; sizes.len()];
    let next = |_| {
        let at = (sizes.iter().zip(&place)).rfold(0, |at, (size, k)| at * size + k);
        for (size, k) in sizes.iter().zip(&mut place).rev() {
            *k += 1;
            if *k < *size {
                break;
            }
            *k = 0;
        }
        values[at as usize]
    };
    (0..values.len()).map(next).collect()
}

pub(super) fn read_npy(bytes: &[u8]) -> Result<Image, String> {
    // Integers of an image would be codes of a display, not radiance.
    let is_float = |kind: &str| {
        kind.trim_start_matches(['<', '>', '=', '|'])
            .starts_with('f')
    };
    if let Some(kind) = kind_of(bytes).filter(|kind| !is_float(kind)) {
        return Err(format!(
            "its values are `{kind}`, not floats of 16, 32 or 64 bits"
        ));
    }
    let (sizes, values) = read_npy_array(bytes)?;
    let (size, channels) = match sizes.as_slice() {
        [height, width] => (checked_size(*width, *height)?, 1),
        [height, width, channels @ (1 | 3 | 4)] => {
            (checked_size(*width, *height)?, *channels as usize)
        }
        _ => {
            return Err(format!(
                "its shape is {sizes:?}, not (height, width) or (height, width, 3)"
            ));
        }
    };
    Image::new(size[0], size[1], pixels(&values, channels)).map_err(|e| e.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn read(name: &str, bytes: &[u8]) -> Result<Image, ImageError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        fs::write(&path, bytes).unwrap();
        read_linear(&path)
    }

    fn refused(name: &str, bytes: &[u8]) -> String {
        read(name, bytes).unwrap_err().to_string()
    }

    #[test]
    fn what_is_written_reads_back_the_same() {
        let values = |i: usize| [i as f32 / 3.0, -2.5 * i as f32, 1e5 / (1 + i) as f32];
        let mut pixels: Vec<[f32; 3]> = (0..15).map(values).collect();
        pixels[6] = [f32::INFINITY, 1e-40, -0.0];
        let image = Image::new(5, 3, pixels).unwrap();
        let folder = tempfile::tempdir().unwrap();
        for ending in ["exr", "PFM", "npy"] {
            let path = folder.path().join(format!("a.{ending}"));
            let format = FileFormat::of(&path).unwrap();
            format.write(&path, &image, &[]).unwrap();
            assert_eq!(read_linear(&path).unwrap(), image, "{ending}");
        }
        let grey = Image::new(2, 2, vec![[0.5; 3], [2.0; 3], [8.0; 3], [0.0; 3]]).unwrap();
        let path = folder.path().join("a.hdr");
        let format = FileFormat::of(&path).unwrap();
        format.write(&path, &grey, &[]).unwrap();
        assert_eq!(read_linear(&path).unwrap(), grey);
    }

    #[test]
    fn exposure_and_correction_of_a_radiance_header_are_divided_out() {
        let file = |header: &str| {
            let mut bytes = format!("{header}FORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n").into_bytes();
            bytes.extend([128, 64, 32, 129]);
            bytes
        };
        let plain = read("a.hdr", &file("#?RADIANCE\n")).unwrap();
        assert_eq!(plain.pixels, [[1.0, 0.5, 0.25]]);
        assert_eq!(read("a.hdr", &file("#?RGBE\n")).unwrap(), plain);
        let header = "#?RADIANCE\nEXPOSURE=2\nEXPOSURE=2\nCOLORCORR=1 2 0.5\n";
        let scaled = read("a.hdr", &file(header)).unwrap();
        assert_eq!(scaled.pixels, [[0.25, 0.0625, 0.125]]);
        let odd = "#?AUTOPANO\nrpict -vp 1 2 3\nPIXASPECT=wide\n";
        assert_eq!(read("a.hdr", &file(odd)).unwrap(), plain);
        for (header, says) in [
            ("#?RADIANCE\nEXPOSURE=0\n", "EXPOSURE"),
            ("#?RGBE\nEXPOSURE=bright\n", "`EXPOSURE=bright`"),
            ("#?RADIANCE\nCOLORCORR=1 1\n", "not three numbers"),
            ("#?RADIANCE\r\n", "CR LF"),
            ("RADIANCE\n", "`#?`"),
            ("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n", "ra_xyze -r IN OUT"),
        ] {
            let message = refused("a.hdr", &file(header));
            assert!(message.contains(says), "{message}");
        }
    }

    #[test]
    fn float_maps_of_both_byte_orders_and_grey_ones_are_read_from_the_bottom_up() {
        let mut big = b"Pf\n2 2\n1.0\n".to_vec();
        big.extend(
            [1.0_f32, 2.0, 3.0, 4.0]
                .iter()
                .flat_map(|v| v.to_be_bytes()),
        );
        let read_big = read("a.pfm", &big).unwrap();
        assert_eq!(read_big.pixels, [[3.0; 3], [4.0; 3], [1.0; 3], [2.0; 3]]);
        let crlf = [&b"PF\r\n1 1\r\n-1.0\r\n"[..], &[0, 0, 128, 63].repeat(3)].concat();
        assert_eq!(read("a.pfm", &crlf).unwrap().pixels, [[1.0; 3]]);
        for (bytes, says) in [
            (&b"P6\n2 2\n1.0\n"[..], "header"),
            (&b"PF\n2 2\n0\n"[..], "header"),
            (&big[..big.len() - 1], "15 bytes"),
            (&b"PF\n400000 400000\n-1\n"[..], "400000 × 400000"),
            (&b"PF\n0 5\n-1\n"[..], "0 × 5"),
        ] {
            let message = refused("a.pfm", bytes);
            assert!(
                message.contains(says) && message.contains("a.pfm"),
                "{message}"
            );
        }
    }

    fn npy(version: u8, header: &str, data: &[u8]) -> Vec<u8> {
        let mut bytes = b"\x93NUMPY".to_vec();
        bytes.extend([version, 0]);
        match version {
            1 => bytes.extend((header.len() as u16).to_le_bytes()),
            _ => bytes.extend((header.len() as u32).to_le_bytes()),
        }
        [&bytes, header.as_bytes(), data].concat()
    }

    #[test]
    fn arrays_of_every_float_and_shape_are_read_and_others_refused() {
        let header = |kind: &str, shape: &str| {
            format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({shape}), }}\n")
        };
        let doubles: Vec<u8> = [1.0_f64, 2.0, 3.0, 9.0]
            .iter()
            .flat_map(|v| v.to_be_bytes())
            .collect();
        let four = read("a.npy", &npy(2, &header(">f8", "1, 1, 4"), &doubles)).unwrap();
        assert_eq!(four.pixels, [[1.0, 2.0, 3.0]]);
        let grey = read("a.npy", &npy(1, &header(">f8", "2, 2"), &doubles)).unwrap();
        assert_eq!((grey.width, grey.pixels[3]), (2, [9.0; 3]));
        let half = read("a.npy", &npy(1, &header("<f2", "1, 1, 1"), &[0, 0x3c])).unwrap();
        assert_eq!(half.pixels, [[1.0; 3]]);
        for (kind, shape, says) in [
            ("<i4", "1, 1", "<i4"),
            ("é", "1, 1", "`é`"),
            ("<f4", "4", "shape"),
            ("<f4", "1, 1, 2", "shape"),
            ("<f4", "1, 2, 3", "4 bytes"),
        ] {
            let message = refused("a.npy", &npy(1, &header(kind, shape), &[0; 4]));
            assert!(message.contains(says), "{message}");
        }
        // The first index runs fastest: columns 1, 2 and 3, 9 of two rows.
        let turned = header(">f8", "2, 2").replace("False", "True");
        let turned = read("a.npy", &npy(1, &turned, &doubles)).unwrap();
        assert_eq!(turned.pixels, [[1.0; 3], [3.0; 3], [2.0; 3], [9.0; 3]]);
        let long = read("a.npy", &npy(1, &header("<f4", "1L, 1L"), &[0; 4])).unwrap();
        assert_eq!((long.width, long.height), (1, 1));
        let quoted = header("<f4", "1, 1")
            .replace('\'', "\"")
            .replace("\":", "\" :");
        let quoted = read("a.npy", &npy(3, &quoted, &[0, 0, 128, 63])).unwrap();
        assert_eq!(quoted.pixels, [[1.0; 3]]);
        let values = |kind: &str, data: &[u8]| {
            let bytes = npy(1, &header(kind, "2"), data);
            read_npy_array(&bytes).map(|(_, values)| values)
        };
        for (kind, data) in [
            ("|b1", &[1, 0][..]),
            ("|u1", &[1, 0]),
            ("|i1", &[1, 0]),
            (">u2", &[0, 1, 0, 0]),
            ("<i4", &[1, 0, 0, 0, 0, 0, 0, 0]),
            (">i8", &[0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0]),
        ] {
            assert_eq!(values(kind, data).as_deref(), Ok(&[1.0, 0.0][..]), "{kind}");
        }
        assert_eq!(values("<i2", &[0xff, 0xff, 1, 1]), Ok(vec![-1.0, 257.0]));
        assert!(values("<c8", &[0; 16]).unwrap_err().contains("`<c8`"));
        assert!(refused("a.npy", b"\x93NUMPY\x01").contains("NumPy"));
        let fields = header("<f4", "2").replace("'<f4'", "[('r', '<f4'), ('g', '<f4')]");
        let message = read_npy_array(&npy(1, &fields, &[0; 16])).unwrap_err();
        assert!(message.contains("records of fields"), "{message}");
    }

    #[test]
    fn what_is_no_linear_image_is_refused_with_what_is() {
        let message = refused("a.png", b"");
        assert!(message.contains(".exr, .hdr, .pfm, .npy"), "{message}");
        let missing = read_linear(Path::new("no/such.exr")).unwrap_err();
        assert!(missing.to_string().contains("no/such.exr"), "{missing}");
        let folder = tempfile::tempdir().unwrap();
        let inner = folder.path().join("folder.exr");
        fs::create_dir(&inner).unwrap();
        let message = read_linear(&inner).unwrap_err().to_string();
        assert!(message.contains("regular file"), "{message}");
        for name in ["a.exr", "a.hdr"] {
            assert!(refused(name, b"nothing of the kind").contains(name));
        }
    }
}
