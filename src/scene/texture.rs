//! Decoding of base-colour textures, all of a scene in parallel.

use super::error::read_regular;
use super::{LoadReport, Material, Texture};
use image::ImageReader;
use image::imageops::FilterType;
use rayon::prelude::*;
use std::borrow::Cow;
use std::io::Cursor;
use std::path::PathBuf;

/// Where the encoded image lies.
pub(super) enum Encoded<'a> {
    /// A PNG or JPEG file.
    File(PathBuf),
    /// The same, in memory.
    Memory(Cow<'a, [u8]>),
    /// It could not be found; the text says why.
    Missing(String),
}

/// An image still to be decoded.
pub(super) struct ImageSource<'a> {
    pub name: String,
    pub encoded: Encoded<'a>,
}

/// Decodes `sources` in parallel; images wider or higher than `max_size` are reduced.
///
/// `materials` refer to `sources` on entry and to the returned list on exit. An image that cannot
/// be decoded is a warning, and its materials keep their constant colour.
pub(super) fn decode_all(
    sources: &[ImageSource<'_>],
    max_size: u32,
    materials: &mut [Material],
    report: &mut LoadReport,
) -> Vec<Texture> {
    let decoded: Vec<_> = sources
        .par_iter()
        .map(|source| decode(source, max_size.max(1)))
        .collect();
    let mut textures = Vec::new();
    let mut new_index = Vec::new();
    for (source, result) in sources.iter().zip(decoded) {
        new_index.push(match result {
            Ok((texture, reduced_from)) => {
                if let Some((width, height)) = reduced_from {
                    report.warnings.push(format!(
                        "texture {}: reduced from {width}x{height} to {}x{}",
                        source.name, texture.width, texture.height
                    ));
                }
                textures.push(texture);
                Some(textures.len() as u32 - 1)
            }
            Err(problem) => {
                report.warnings.push(format!(
                    "texture {}: {problem}; drawn with the constant colour",
                    source.name
                ));
                None
            }
        });
    }
    for material in materials {
        material.base_color_texture = material
            .base_color_texture
            .and_then(|index| new_index[index as usize]);
    }
    textures
}

type Size = (u32, u32);

/// Bytes of texels that one byte of an image can stand for: deflate shrinks at most 1032 times, and
/// a texel of four bytes may take one.
const MOST_TEXEL_BYTES: u64 = 4 * 1032;

/// Bytes of texels that are always allowed.
const FREE_TEXEL_BYTES: u64 = 1 << 20;

/// Refuses an image that announces more texels than its bytes can hold, before there is memory for
/// them.
fn check_size(bytes: &[u8]) -> Result<(), String> {
    let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format();
    let reader = reader.map_err(|e| e.to_string())?;
    let (width, height) = reader.into_dimensions().map_err(|e| e.to_string())?;
    let needed = 4 * u64::from(width) * u64::from(height);
    let most = FREE_TEXEL_BYTES.max(MOST_TEXEL_BYTES * bytes.len() as u64);
    if needed > most {
        let length = bytes.len();
        return Err(format!(
            "{width}x{height} texels cannot be in {length} bytes"
        ));
    }
    Ok(())
}

/// The texture, and its size in the file if that was larger.
fn decode(source: &ImageSource<'_>, max_size: u32) -> Result<(Texture, Option<Size>), String> {
    let bytes = match &source.encoded {
        Encoded::File(path) => {
            Cow::Owned(read_regular(path).map_err(|e| format!("{}: {e}", path.display()))?)
        }
        Encoded::Memory(bytes) => Cow::Borrowed(bytes.as_ref()),
        Encoded::Missing(why) => return Err(why.clone()),
    };
    check_size(&bytes)?;
    let image = image::load_from_memory(&bytes).map_err(|e| e.to_string())?;
    let size = (image.width(), image.height());
    let larger = size.0 > max_size || size.1 > max_size;
    let image = if larger {
        image.resize(max_size, max_size, FilterType::Triangle)
    } else {
        image
    };
    let image = image.into_rgba8();
    let texture = Texture {
        name: source.name.clone(),
        width: image.width(),
        height: image.height(),
        texels: image.as_raw().as_chunks::<4>().0.to_vec(),
    };
    Ok((texture, larger.then_some(size)))
}
