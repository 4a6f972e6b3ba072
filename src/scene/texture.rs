//! Decodes all textures of a scene in parallel.

use super::disguise::Disguise;
use super::image_alpha;
use super::reduce::{Texels, encode, reduced};
use super::{LoadReport, Material, Texture, TextureUse};
use image::error::UnsupportedErrorKind;
use image::{DynamicImage, ImageError, ImageFormat, ImageReader, Pixel, Rgb32FImage, RgbaImage};
use rayon::prelude::*;
use std::borrow::Cow;
use std::io::Cursor;
use std::path::{Path, PathBuf};

/// Source of the encoded image.
pub(super) enum Encoded<'a> {
    /// A file in one of the formats that [`reader`] knows.
    File(PathBuf),
    /// The bytes of one in memory.
    Memory(Cow<'a, [u8]>),
    /// Not found, with the reason.
    Missing(String),
}

pub(super) struct ImageSource<'a> {
    pub name: String,
    pub encoded: Encoded<'a>,
}

/// Part of the adapter's binding reserved for materials and lights, bytes.
const OTHER_BYTES: u64 = 8 << 20;
/// Words of a triangle's texture coordinates and normals.
const TRIANGLE_WORDS: u64 = 9;

/// Words left for textures in tables of `table_bytes` bytes, next to `triangles` triangles.
pub(super) fn texel_room(table_bytes: u64, triangles: usize) -> u64 {
    let words = table_bytes.saturating_sub(OTHER_BYTES) / 4;
    words.saturating_sub(TRIANGLE_WORDS * triangles as u64)
}

/// Takes their textures from materials that no triangle has, since all textures share the room.
pub(super) fn forget_unused(materials: &mut [Material], ids: &[u32]) {
    let mut is_used = vec![false; materials.len()];
    for id in ids {
        is_used[*id as usize] = true;
    }
    let unused = materials.iter_mut().zip(is_used).filter(|(_, used)| !used);
    for slot in unused.flat_map(|(material, _)| material.texture_uses_mut()) {
        *slot = None;
    }
}

/// Decodes those of `sources` that materials use, in parallel. Images wider or higher than `max_size`
/// are reduced, and all of them further until they fit into `room` words. Their use decides how.
///
/// `materials` refer to `sources` on entry and to the returned list on exit. An image that cannot
/// be decoded is a warning, and its materials keep their constant.
pub(super) fn decode_all(
    sources: &[ImageSource<'_>],
    [max_size, room]: [u64; 2],
    materials: &mut [Material],
    report: &mut LoadReport,
) -> Vec<Texture> {
    let mut is_used = vec![false; sources.len()];
    let uses = materials.iter_mut().flat_map(Material::texture_uses_mut);
    for used in uses.flatten() {
        is_used[used.texture as usize] = true;
    }
    let read: Vec<_> = sources
        .par_iter()
        .zip(&is_used)
        .map(|(source, is_used)| is_used.then(|| read(source)))
        .collect();
    let sizes = read.iter().flatten().flatten().map(|(_, size)| *size);
    let max_size = u32::try_from(max_size.max(1)).unwrap_or(u32::MAX);
    let max_size = fitting_size(&sizes.collect::<Vec<_>>(), max_size, room);
    let kinds = kinds(sources.len(), materials);
    let decoded: Vec<_> = sources
        .par_iter()
        .zip(read)
        .zip(kinds)
        .map(|((source, read), kind)| {
            Some(read?.and_then(|(bytes, _)| decode(source, &bytes, max_size, kind)))
        })
        .collect();
    let mut textures = Vec::new();
    let mut new_index = Vec::new();
    for (source, result) in sources.iter().zip(decoded) {
        new_index.push(match result {
            None => None,
            Some(Ok((texture, notes))) => {
                let named = notes
                    .iter()
                    .map(|note| format!("texture {}: {note}", source.name));
                report.warnings.extend(named);
                textures.push(texture);
                Some(textures.len() as u32 - 1)
            }
            Some(Err(problem)) => {
                let is_it = |used: TextureUse| used.texture as usize == new_index.len();
                let mut masks = materials.iter().filter_map(|m| m.mask?.texture);
                let uncut = if masks.any(is_it) {
                    "; surfaces that it cuts out are whole"
                } else {
                    ""
                };
                report.warnings.push(format!(
                    "texture {}: {problem}; drawn with the constant{uncut}",
                    source.name
                ));
                None
            }
        });
    }
    for slot in materials.iter_mut().flat_map(Material::texture_uses_mut) {
        *slot = slot.and_then(|used| {
            let texture = new_index[used.texture as usize]?;
            Some(TextureUse { texture, ..used })
        });
    }
    textures
}

/// Meaning of each image's texels: colours if some material shows them, else normals, else numbers. Only masks read the
/// alpha of colours (glTF 2.0, 3.9.4).
fn kinds(count: usize, materials: &[Material]) -> Vec<Texels> {
    let mut kinds = vec![Texels::Numbers; count];
    for (slot, kind) in [
        (2, Texels::Normals),
        (0, Texels::Opaque),
        (3, Texels::Opaque),
    ] {
        let used = materials.iter().filter_map(|m| m.texture_uses()[slot]);
        for used in used {
            kinds[used.texture as usize] = kind;
        }
    }
    for used in materials.iter().filter_map(|m| m.mask?.texture) {
        let kind = &mut kinds[used.texture as usize];
        if *kind == Texels::Opaque {
            *kind = Texels::Colours;
        }
    }
    kinds
}

type Size = (u32, u32);

/// Largest ratio of texel bytes to file bytes: deflate expands at most 1032 times.
const MOST_TEXEL_BYTES: u64 = 4 * 1032;

/// Texel bytes that are always allowed.
const FREE_TEXEL_BYTES: u64 = 1 << 20;

/// The largest size up to `max_size`, halved until all texels fit, at one word each.
fn fitting_size(sizes: &[Size], max_size: u32, room: u64) -> u32 {
    let needed = |limit: u32| -> u64 {
        let one = |(width, height): &Size| {
            let scale = (f64::from(limit) / f64::from((*width).max(*height).max(1))).min(1.0);
            (f64::from(*width) * f64::from(*height) * scale * scale) as u64
        };
        sizes.iter().map(one).sum()
    };
    let mut limit = max_size;
    while limit > 1 && needed(limit) > room {
        limit /= 2;
    }
    limit
}

fn said(error: ImageError) -> String {
    let formats = match &error {
        ImageError::Unsupported(what) if matches!(what.kind(), UnsupportedErrorKind::Format(_)) => {
            " (PNG, JPEG, WebP, TGA, BMP, GIF, TIFF, PNM, HDR, and of DDS BC1 to BC3 are read)"
        }
        _ => "",
    };
    format!("{error}{formats}")
}

/// Returns what decodes an image. Its format is that of its first bytes, whatever its ending says; TGA has none that
/// are its own, so that there the ending counts.
fn reader<'a>(name: &str, bytes: &'a [u8]) -> Result<ImageReader<Cursor<&'a [u8]>>, String> {
    let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format();
    let mut reader = reader.map_err(|e| e.to_string())?;
    let is_tga = Path::new(name)
        .extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("tga"));
    if bytes.starts_with(b"#?") {
        reader.set_format(ImageFormat::Hdr);
    } else if reader.format().is_none() && is_tga {
        reader.set_format(ImageFormat::Tga);
    }
    Ok(reader)
}

/// The size of an image, refused before allocation if its bytes cannot hold so many texels.
fn checked_size(name: &str, bytes: &[u8]) -> Result<Size, String> {
    if bytes.is_empty() {
        return Err("the file is empty".to_owned());
    }
    if let Some(Disguise { problem, advice }) = Disguise::of(bytes) {
        return Err(format!("{problem} ({advice})"));
    }
    let reader = reader(name, bytes)?;
    let (width, height) = match reader.format() {
        Some(ImageFormat::Hdr) => raystone_image::hdr_size(bytes)?.into(),
        _ => reader.into_dimensions().map_err(said)?,
    };
    let needed = 4 * u64::from(width) * u64::from(height);
    let most = FREE_TEXEL_BYTES.max(MOST_TEXEL_BYTES * bytes.len() as u64);
    if needed > most {
        let length = bytes.len();
        return Err(format!(
            "{width}x{height} texels cannot be in {length} bytes"
        ));
    }
    Ok((width, height))
}

fn read<'a>(source: &'a ImageSource<'_>) -> Result<(Cow<'a, [u8]>, Size), String> {
    let bytes = match &source.encoded {
        Encoded::File(path) => Cow::Owned(
            raystone_core::files::read(path).map_err(|e| format!("{}: {e}", path.display()))?,
        ),
        Encoded::Memory(bytes) => Cow::Borrowed(bytes.as_ref()),
        Encoded::Missing(why) => return Err(why.clone()),
    };
    let size = checked_size(&source.name, &bytes)?;
    Ok((bytes, size))
}

/// True for a JPEG without its end, from which decoders make a whole image all the same. Both marks
/// cannot occur within the data of an image.
fn ends_early(bytes: &[u8]) -> bool {
    let last = |mark: [u8; 2]| bytes.array_windows().rposition(|pair| *pair == mark);
    let [start, end] = [[0xff, 0xda], [0xff, 0xd9]].map(last);
    bytes.starts_with(&[0xff, 0xd8]) && end < start
}

/// Eight bits per channel, and how many texels were brighter than 1, which becomes 1. Floats are linear light, whole numbers are
/// as they are to be used; colours become sRGB, in which textures of colours are kept.
fn eight_bits(image: DynamicImage, kind: Texels) -> (RgbaImage, usize) {
    let is_float = matches!(
        image,
        DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_)
    );
    if !matches!(kind, Texels::Colours | Texels::Opaque) || !is_float {
        return (image.into_rgba8(), 0);
    }
    let mut light = image.into_rgba32f();
    let mut bright = 0;
    for pixel in light.pixels_mut() {
        bright += usize::from(pixel.0[..3].iter().any(|part| *part > 1.0));
        pixel.apply_without_alpha(|part| encode(part.clamp(0.0, 1.0)));
    }
    (DynamicImage::from(light).into_rgba8(), bright)
}

/// The light of a Radiance file, whose exposure and order of pixels the `image` crate passes over.
fn light(bytes: &[u8]) -> Result<DynamicImage, String> {
    let image = raystone_image::read_hdr(bytes)?;
    let values = image.pixels.into_flattened();
    let image = Rgb32FImage::from_vec(image.width, image.height, values);
    Ok(image.unwrap_or_default().into())
}

/// The texture, and what of it is not as in the file.
fn decode(
    source: &ImageSource<'_>,
    bytes: &[u8],
    max_size: u32,
    kind: Texels,
) -> Result<(Texture, Vec<String>), String> {
    let reader = reader(&source.name, bytes)?;
    let format = reader.format();
    let image = match format {
        Some(ImageFormat::Hdr) => light(bytes)?,
        _ => reader.decode().map_err(said)?,
    };
    let (mut image, bright) = eight_bits(image, kind);
    image_alpha::mend(bytes, format, &mut image);
    let size = image.dimensions();
    let texels = image.as_raw().as_chunks::<4>().0;
    let larger = size.0.max(size.1) > max_size;
    let scale = f64::from(max_size) / f64::from(size.0.max(size.1));
    let to = if larger {
        <[u32; 2]>::from(size).map(|n| ((f64::from(n) * scale).round() as u32).max(1))
    } else {
        size.into()
    };
    let [width, height] = to;
    let mut notes = Vec::new();
    if ends_early(bytes) {
        let note = "the file ends before the image does; the rest of it is made up";
        notes.push(note.to_owned());
    }
    if bright > 0 {
        let all = texels.len();
        notes.push(format!(
            "{bright} of its {all} texels are brighter than 1, which becomes 1"
        ));
    }
    if larger {
        let (w, h) = size;
        notes.push(format!("reduced from {w}x{h} to {width}x{height}"));
    }
    let texture = Texture {
        name: source.name.clone(),
        width,
        height,
        texels: if larger {
            reduced(texels, size.into(), to, kind)
        } else {
            texels.to_vec()
        },
    };
    Ok((texture, notes))
}

#[cfg(test)]
mod tests {
    use super::super::{AlphaChannel, AlphaMask};
    use super::*;

    #[test]
    fn a_jpeg_that_is_cut_short_is_told_from_a_whole_one() {
        let mut whole = Cursor::new(Vec::new());
        let image =
            image::RgbImage::from_fn(32, 32, |x, y| image::Rgb([x as u8 * 7, y as u8 * 5, 9]));
        image
            .write_to(&mut whole, image::ImageFormat::Jpeg)
            .expect("an image");
        let whole = whole.into_inner();
        assert!(!ends_early(&whole));
        assert!(!ends_early(&[&whole[..], b"\0\0 more"].concat()));
        assert!(ends_early(&whole[..whole.len() - 9]));
        assert!(ends_early(&whole[..whole.len() - 1]));
        assert!(!ends_early(b"\x89PNG"));
    }

    #[test]
    fn alpha_counts_for_colours_that_a_mask_reads_and_for_no_others() {
        let used = |texture| Some(TextureUse::plain(texture));
        let of = |base, mask: Option<u32>| Material {
            base_color_texture: used(base),
            mask: mask.map(|texture| {
                AlphaMask::of(TextureUse::plain(texture), AlphaChannel::Alpha, None)
            }),
            ..Material::diffuse("", glam::Vec3::ONE)
        };
        let shining = Material {
            emission_texture: used(4),
            ..of(0, None)
        };
        let materials = [
            of(0, None),
            of(1, Some(1)),
            of(2, Some(3)),
            of(1, None),
            shining,
        ];
        let [a, b, numbers] = [Texels::Opaque, Texels::Colours, Texels::Numbers];
        assert_eq!(kinds(6, &materials), [a, b, a, numbers, a, numbers]);
    }

    #[test]
    fn textures_of_materials_that_no_triangle_has_are_not_read() {
        let materials = || {
            [0, 1].map(|texture| Material {
                base_color_texture: Some(TextureUse::plain(texture)),
                mask: Some(AlphaMask::of(
                    TextureUse::plain(texture),
                    AlphaChannel::Alpha,
                    None,
                )),
                ..Material::diffuse("", glam::Vec3::ONE)
            })
        };
        let source = |name: &str, red: u8| ImageSource {
            name: name.to_owned(),
            encoded: Encoded::Memory([&b"P6 2 1 255\n"[..], &[red; 6]].concat().into()),
        };
        for (ids, expected) in [(&[0, 1][..], &["a", "b"][..]), (&[1], &["b"]), (&[], &[])] {
            let (mut all, mut report) = (materials(), LoadReport::default());
            forget_unused(&mut all, ids);
            let sources = [source("a", 1), source("b", 2)];
            // Two textures have room for one texel each, one of them for both of its own.
            let textures = decode_all(&sources, [64, 3], &mut all, &mut report);
            let names: Vec<_> = textures.iter().map(|t| &*t.name).collect();
            assert_eq!(names, expected);
            let widths = textures.iter().all(|t| t.width == 3 - ids.len() as u32);
            assert!(widths, "{ids:?}: {textures:?}");
            assert_eq!(report.warnings.len(), if ids.len() == 2 { 2 } else { 0 });
            let of_b = all[1].mask.and_then(|mask| mask.texture);
            assert_eq!(
                of_b.map(|b| b.texture),
                ids.len().checked_sub(1).map(|k| k as u32)
            );
        }
    }

    #[test]
    fn textures_are_halved_until_they_fit_and_no_further() {
        let sizes = [(1024, 512), (2048, 2048)];
        assert_eq!(fitting_size(&sizes, 4096, 1 << 30), 4096);
        let all = 1024 * 512 + 2048 * 2048;
        assert_eq!(fitting_size(&sizes, 2048, all), 2048);
        assert_eq!(fitting_size(&sizes, 2048, all - 1), 1024);
        assert_eq!(fitting_size(&sizes, 1024, 1 << 17), 256);
        assert_eq!(fitting_size(&sizes, 1024, 0), 1);
    }
}
