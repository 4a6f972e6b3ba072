//! Reads Radiance files (`.hdr`), their header with the `image` crate.

use super::Image;
use super::hdr_lines;
use super::read::checked_size;
use ::image::codecs::hdr::{HdrDecoder, HdrMetadata};
use std::io::Cursor;

/// Decodes a Radiance file from memory, divided by `EXPOSURE` and `COLORCORR` if present.
///
/// # Errors
/// What is wrong with it.
pub fn read_hdr(bytes: &[u8]) -> Result<Image, String> {
    if let Some((file, turn)) = super::upright::upright(bytes) {
        return turn.undone(&read_hdr(&file)?);
    }
    let header = header(bytes)?;
    check_factors(&header.custom_attributes)?;
    let [width, height] = checked_size(header.width.into(), header.height.into())?;
    let lines = hdr_lines::pixels(behind_header(bytes), [width, height])?;
    let exposure = header.exposure.unwrap_or(1.0);
    let (r, g, b) = header.color_correction.unwrap_or((1.0, 1.0, 1.0));
    let scale = [r, g, b].map(|correction| exposure * correction);
    if scale.iter().any(|s| !s.is_finite() || *s <= 0.0) {
        return Err(format!(
            "the factors of EXPOSURE and COLORCORR are {scale:?}, which are not above 0: without these lines of its header the pixels are read as they are"
        ));
    }
    let pixels = lines.into_iter().map(|pixel| {
        let values = hdr_lines::radiance(pixel);
        [0, 1, 2].map(|c| values[c] / scale[c])
    });
    Image::new(width, height, pixels.collect()).map_err(|e| e.to_string())
}

/// Width and height of a Radiance file, of which nothing else is read.
///
/// # Errors
/// What is wrong with its header.
pub fn hdr_size(bytes: &[u8]) -> Result<[u32; 2], String> {
    let (size, turn) = match super::upright::upright(bytes) {
        Some((file, turn)) => (header(&file)?, Some(turn)),
        None => (header(bytes)?, None),
    };
    let size = [size.width, size.height];
    Ok(turn.map_or(size, |turn| turn.size(size)))
}

fn header(bytes: &[u8]) -> Result<HdrMetadata, String> {
    // Programs write their own name first, or that of the encoding; the rest is the same.
    if !bytes.starts_with(b"#?") {
        return Err("it does not begin with `#?`, as Radiance files do".to_owned());
    }
    let first = bytes.split(|byte| *byte == b'\n').next();
    if first.is_some_and(|line| line.ends_with(b"\r")) {
        let problem = "the lines of its header end in CR LF, as after a transfer as text, which spoils pixels; fetch it as binary data";
        return Err(problem.to_owned());
    }
    let decoder = HdrDecoder::new_nonstrict(Cursor::new(bytes));
    let decoder = decoder.map_err(|error| match error {
        ::image::ImageError::Unsupported(what) if what.to_string().contains("xyze") => {
            format!("{what}; convert it: `ra_xyze -r IN OUT`")
        }
        error => error.to_string(),
    })?;
    Ok(decoder.metadata())
}

/// What is behind the line of the resolution, which an empty line parts from the others.
fn behind_header(bytes: &[u8]) -> &[u8] {
    let end = bytes.array_windows().position(|pair| pair == b"\n\n");
    let resolution = end.map_or(&[][..], |end| &bytes[end + 2..]);
    let length = resolution.iter().position(|byte| *byte == b'\n');
    length.map_or(&[], |length| &resolution[length + 1..])
}

/// Refuses lines of a Radiance header that would change its pixels, and are no numbers.
fn check_factors(lines: &[(String, String)]) -> Result<(), String> {
    for (key, value) in lines {
        let count = match key.as_str() {
            "EXPOSURE" => 1,
            "COLORCORR" => 3,
            _ => continue,
        };
        let is_number = |word: &str| word.parse::<f32>().is_ok();
        let words: Vec<&str> = value.split_whitespace().collect();
        if words.len() != count || !words.into_iter().all(is_number) {
            let value = value.trim();
            let numbers = if count == 1 {
                "no number"
            } else {
                "not three numbers"
            };
            return Err(format!(
                "the value of `{key}={value}` in its header is {numbers}"
            ));
        }
    }
    Ok(())
}
