//! Reads Radiance files (`.hdr`) with the `image` crate.

use super::Image;
use super::read::checked_size;
use ::image::ImageDecoder;
use ::image::codecs::hdr::HdrDecoder;
use std::io::{Cursor, ErrorKind};

/// Decodes a file; see [`super::read_linear`].
pub(super) fn read_hdr(bytes: &[u8]) -> Result<Image, String> {
    if let Some((file, turn)) = super::upright::upright(bytes) {
        return turn.undone(&read_hdr(&file)?);
    }
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
    let header = decoder.metadata();
    check_factors(&header.custom_attributes)?;
    let [width, height] = checked_size(header.width.into(), header.height.into())?;
    let mut values = vec![0.0_f32; 3 * width as usize * height as usize];
    let target = bytemuck::cast_slice_mut(&mut values);
    decoder.read_image(target).map_err(|error| match error {
        ::image::ImageError::IoError(error) if error.kind() == ErrorKind::UnexpectedEof => {
            "it ends before its last pixel".to_owned()
        }
        error => error.to_string(),
    })?;
    let exposure = header.exposure.unwrap_or(1.0);
    let (r, g, b) = header.color_correction.unwrap_or((1.0, 1.0, 1.0));
    let scale = [r, g, b].map(|correction| exposure * correction);
    if scale.iter().any(|s| !s.is_finite() || *s <= 0.0) {
        return Err(format!(
            "the factors of EXPOSURE and COLORCORR are {scale:?}, which are not above 0: without these lines of its header the pixels are read as they are"
        ));
    }
    let pixels = values
        .chunks_exact(3)
        .map(|p| [0, 1, 2].map(|c| p[c] / scale[c]));
    Image::new(width, height, pixels.collect()).map_err(|e| e.to_string())
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
