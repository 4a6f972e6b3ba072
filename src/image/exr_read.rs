//! Reads OpenEXR files with the `exr` crate.

use super::Image;
use super::read::checked_size;
use exr::error::Error;
use exr::image::{AnyChannels, FlatSamples, Layer};
use exr::meta::MetaData;
use exr::prelude::{ReadChannels, ReadLayers, read};
use std::io::Cursor;

/// Preferred layers: names that renderers use for the main image.
const PICTURE_LAYERS: [&str; 6] = ["", "rgba", "rgb", "color", "combined", "beauty"];

/// Decodes the main image of a file; see [`super::read_linear`].
pub(super) fn read_exr(bytes: &[u8]) -> Result<Image, String> {
    // Check sizes first: the crate allocates all pixels that a header claims.
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false);
    for header in &meta.map_err(said)?.headers {
        checked_size(header.layer_size.x() as u64, header.layer_size.y() as u64)?;
    }
    let found = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(said)?;
    let layers = &found.layer_data;
    let candidates: Vec<Colours> = layers
        .iter()
        .enumerate()
        .flat_map(|(place, layer)| colours(layer, (layers.len() > 1).then_some(place)))
        .collect();
    let colours = chosen(&candidates)?.ok_or_else(|| no_picture(&candidates, layers))?;
    let window = found.attributes.display_window;
    let [width, height] = checked_size(window.size.x() as u64, window.size.y() as u64)?;
    let mut pixels = vec![[0.0; 3]; width as usize * height as usize];
    let offset = colours.layer.attributes.layer_position - window.position;
    let place = |at: usize, offset: i32, size: u32| {
        let at = i64::try_from(at).ok()? + i64::from(offset);
        usize::try_from(at).ok().filter(|at| *at < size as usize)
    };
    let layer_width = colours.layer.size.x();
    for (c, samples) in colours.samples.iter().enumerate() {
        for (i, value) in samples.values_as_f32().enumerate() {
            let x = place(i % layer_width, offset.x(), width);
            let y = place(i / layer_width, offset.y(), height);
            if let (Some(x), Some(y)) = (x, y) {
                pixels[y * width as usize + x][c] = value;
            }
        }
    }
    Image::new(width, height, pixels).map_err(|e| e.to_string())
}

/// What is wrong with a file, and what to do about one that is right and not read.
fn said(error: Error) -> String {
    match error {
        Error::NotSupported(_) => {
            format!("{error}; save it flat, with whole channels R, G and B, by ZIP or uncompressed")
        }
        error => error.to_string(),
    }
}

type FlatLayer = Layer<AnyChannels<FlatSamples>>;

struct Colours<'a> {
    /// Layer name, empty if it has none.
    name: String,
    /// Whether these are the channels without a layer of the first of several parts.
    is_first_part: bool,
    layer: &'a FlatLayer,
    samples: [&'a FlatSamples; 3],
}

fn split(name: &str) -> (&str, &str) {
    name.rsplit_once('.').unwrap_or(("", name))
}

/// The images in a part of a file. If it is the part of this index among several, part names count as well.
fn colours(layer: &FlatLayer, place: Option<usize>) -> Vec<Colours<'_>> {
    let list = &layer.channel_data.list;
    let names: Vec<String> = list.iter().map(|c| c.name.to_string()).collect();
    let mut prefixes: Vec<&str> = names.iter().map(|name| split(name).0).collect();
    // Channels of other layers may stand between those without any.
    prefixes.sort_unstable();
    prefixes.dedup();
    let part = layer.attributes.layer_name.as_ref();
    let part = part.filter(|_| place.is_some()).map(ToString::to_string);
    let of_prefix = |prefix: &str| {
        let channel = |wanted: &str| {
            let is_it = |name: &String| {
                let (of, own) = split(name);
                of == prefix && own.eq_ignore_ascii_case(wanted)
            };
            let samples = &list[names.iter().position(is_it)?].sample_data;
            (samples.len() == layer.size.area()).then_some(samples)
        };
        let rgb = || Some([channel("R")?, channel("G")?, channel("B")?]);
        // With any of these, Y is not grey: XYZ, or subsampled chroma.
        let coloured = || ["X", "Z", "RY", "BY"].iter().any(|c| channel(c).is_some());
        let grey = || channel("Y").filter(|_| !coloured()).map(|y| [y; 3]);
        let samples = rgb().or_else(grey)?;
        let name = [part.as_deref().unwrap_or_default(), prefix];
        let name: Vec<&str> = name.into_iter().filter(|n| !n.is_empty()).collect();
        Some(Colours {
            name: name.join("."),
            is_first_part: place == Some(0) && prefix.is_empty(),
            layer,
            samples,
        })
    };
    prefixes.into_iter().filter_map(of_prefix).collect()
}

/// What Blender calls the picture that is made of its view layers.
const COMPOSITE: &str = "Composite.Combined";

/// The picture, if one is known by its name or place.
///
/// # Errors
/// Several of one part have the same name, as those of view layers.
fn chosen<'a, 'b>(candidates: &'b [Colours<'a>]) -> Result<Option<&'b Colours<'a>>, String> {
    for wanted in PICTURE_LAYERS {
        let is_it = |c: &&Colours| split(&c.name).1.eq_ignore_ascii_case(wanted);
        let Some(first) = candidates.iter().find(is_it) else {
            continue;
        };
        let of_part = |c: &&Colours| is_it(c) && std::ptr::eq(c.layer, first.layer);
        let alike: Vec<_> = candidates.iter().filter(of_part).collect();
        let composite = alike.iter().find(|c| c.name == COMPOSITE);
        if let Some(picture) = composite.or(alike.first().filter(|_| alike.len() == 1)) {
            return Ok(Some(picture));
        }
        let names: Vec<&str> = alike.iter().map(|c| c.name.as_str()).collect();
        let names = names.join(", ");
        return Err(format!(
            "its layers {names} are pictures alike: save the one that is meant alone"
        ));
    }
    // Programs that know of one part only read the first.
    let first = candidates.first();
    Ok(first.filter(|c| candidates.len() == 1 || c.is_first_part))
}

fn no_picture(candidates: &[Colours], layers: &[FlatLayer]) -> String {
    let list = |names: Vec<String>| names.join(", ");
    if candidates.is_empty() {
        let channels = layers.iter().flat_map(|l| &l.channel_data.list);
        let channels = list(channels.map(|c| c.name.to_string()).collect());
        return format!("it has no channels R, G and B, and no Y alone, but {channels}");
    }
    let names = list(candidates.iter().map(|c| c.name.clone()).collect());
    let known = PICTURE_LAYERS[1..].join(", ");
    format!("its layers {names} all have colours, and none is called {known}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exr_file::encode_exr;
    use exr::image::{AnyChannel, Encoding, Image as File, Layers};
    use exr::meta::attribute::{AttributeValue, IntegerBounds, Text};
    use exr::meta::header::{ImageAttributes, LayerAttributes};
    use exr::prelude::{WritableImage, f16};

    /// A part of 2 × 1 pixels with one value per channel.
    fn part(name: Option<&str>, channels: &[(&str, f32)]) -> FlatLayer {
        let channel = |(name, value): &(&str, f32)| {
            let samples = match name.len() % 2 {
                0 => FlatSamples::F16(vec![f16::from_f32(*value); 2]),
                _ => FlatSamples::F32(vec![*value; 2]),
            };
            AnyChannel::new(*name, samples)
        };
        let attributes = LayerAttributes {
            layer_name: name.map(Text::from),
            ..LayerAttributes::default()
        };
        let channels = AnyChannels::sort(channels.iter().map(channel).collect());
        Layer::new((2, 1), attributes, Encoding::SMALL_LOSSLESS, channels)
    }

    fn file(parts: Vec<FlatLayer>, window: IntegerBounds) -> Vec<u8> {
        let image: File<Layers<AnyChannels<FlatSamples>>> = File {
            attributes: ImageAttributes::new(window),
            layer_data: parts.into(),
        };
        let mut bytes = Cursor::new(Vec::new());
        image.write().to_buffered(&mut bytes).unwrap();
        bytes.into_inner()
    }

    fn of_parts(parts: Vec<FlatLayer>) -> Result<Image, String> {
        read_exr(&file(parts, IntegerBounds::from_dimensions((2, 1))))
    }

    const RGB: [(&str, f32); 3] = [("R", 1.0), ("G", 2.0), ("B", 0.25)];

    fn of_layer(layer: &str, by: f32) -> Vec<(String, f32)> {
        let name = |(c, v): (&str, f32)| (format!("{layer}.{c}"), by * v);
        RGB.map(name).to_vec()
    }

    fn colour_of(channels: &[(String, f32)]) -> Result<[f32; 3], String> {
        let channels: Vec<(&str, f32)> = channels.iter().map(|(n, v)| (n.as_str(), *v)).collect();
        of_parts(vec![part(None, &channels)]).map(|image| image.pixels[0])
    }

    #[test]
    fn the_crate_reads_what_is_written_here_with_its_attributes() {
        let pixels = vec![[1.0, f32::NAN, -0.5], [0.1, 1e-40, f32::INFINITY]];
        let image = Image::new(2, 1, pixels).unwrap();
        let bytes = encode_exr(&image, &[("seed", "9001".to_owned())]);
        let bits = |image: &Image| -> Vec<u32> {
            let values = image.pixels.as_flattened().iter();
            values.map(|v| v.to_bits()).collect()
        };
        assert_eq!(bits(&read_exr(&bytes).unwrap()), bits(&image));
        let meta = MetaData::read_from_buffered(Cursor::new(&bytes), true).unwrap();
        let attributes = &meta.headers[0].own_attributes.other;
        let others = &meta.headers[0].shared_attributes.other;
        let mut found = attributes.iter().chain(others);
        assert!(
            found.any(|(name, value)| name.eq("seed")
                && *value == AttributeValue::Text(Text::from("9001")))
        );
    }

    #[test]
    fn the_picture_is_found_among_channels_and_layers() {
        let plain = [1.0, 2.0, 0.25];
        let with = |mut more: Vec<(String, f32)>, layer: &str, by: f32| {
            more.extend(of_layer(layer, by));
            more
        };
        let rgb: Vec<(String, f32)> = RGB.map(|(c, v)| (c.to_owned(), v)).to_vec();
        let alpha = [rgb.clone(), vec![("A".to_owned(), 0.5)]].concat();
        assert_eq!(colour_of(&alpha), Ok(plain));
        assert_eq!(
            colour_of(&with(rgb, "albedo", 3.0)),
            Ok(plain),
            "no name is first"
        );
        let depth = [alpha.clone(), vec![("Z".to_owned(), 9.0)]].concat();
        assert_eq!(colour_of(&with(depth, "Normal", 3.0)), Ok(plain));
        let blender = with(of_layer("View.Normal", 3.0), "View.Combined", 1.0);
        assert_eq!(colour_of(&blender), Ok(plain));
        let views = with(of_layer("Back.Combined", 3.0), "Front.Combined", 1.0);
        let composed = with(views.clone(), "Composite.Combined", 1.0);
        let composed = [composed, of_layer("AO.Combined", 4.0)].concat();
        assert_eq!(colour_of(&composed), Ok(plain));
        let views = colour_of(&views).unwrap_err();
        assert!(
            views.contains("Back.Combined, Front.Combined are pictures alike"),
            "{views}"
        );
        let only = [of_layer("diffuse", 1.0), vec![("depth.Z".to_owned(), 9.0)]].concat();
        assert_eq!(colour_of(&only), Ok(plain), "the only one with colours");
        assert_eq!(colour_of(&[("Y".to_owned(), 0.5)]), Ok([0.5; 3]));
        let two = colour_of(&with(of_layer("direct", 1.0), "indirect", 1.0)).unwrap_err();
        assert!(
            two.contains("direct, indirect") && two.contains("combined"),
            "{two}"
        );
        let xyz = ["X", "Y", "Z"].map(|c| (c.to_owned(), 1.0));
        assert!(colour_of(&xyz).unwrap_err().contains("X, Y, Z"));
        let depth = part(Some("depth"), &[("Z", 1.0)]);
        let parts = vec![depth, part(Some("rgba"), &RGB)];
        assert_eq!(of_parts(parts).unwrap().pixels[1], plain, "parts");
        // As readers of one part have it: the colours of the first.
        let darker = RGB.map(|(c, v)| (c, 0.5 * v));
        for names in [["C", "N"], ["rgba.left", "rgba.right"], ["left", "right"]] {
            let parts = vec![part(Some(names[0]), &RGB), part(Some(names[1]), &darker)];
            assert_eq!(of_parts(parts).unwrap().pixels[1], plain, "{names:?}");
        }
        let depth = part(Some("depth"), &[("Z", 1.0)]);
        let parts = vec![depth, part(Some("C"), &RGB), part(Some("N"), &darker)];
        assert!(of_parts(parts).unwrap_err().contains("C, N"));
    }

    #[test]
    fn pixels_lie_in_the_display_window() {
        let mut small = part(None, &RGB);
        small.attributes.layer_position = exr::math::Vec2(1, 0);
        let window = IntegerBounds::new((0, -1), (2, 2));
        let image = read_exr(&file(vec![small], window)).unwrap();
        assert_eq!((image.width, image.height), (2, 2));
        let lit: Vec<bool> = image.pixels.iter().map(|p| p[0] > 0.0).collect();
        assert_eq!(lit, [false, false, false, true]);
    }

    #[test]
    fn what_is_right_and_not_read_is_named_with_what_to_do() {
        let mut bytes = file(
            vec![part(None, &RGB)],
            IntegerBounds::from_dimensions((2, 1)),
        );
        let name = b"chlist\0";
        let start = bytes.windows(name.len()).position(|w| w == name).unwrap() + name.len();
        // Columns of B for one sample: behind the size of the list, its name, its type and four flags.
        bytes[start + 4 + b"B\0".len() + 8] = 2;
        let message = read_exr(&bytes).unwrap_err();
        assert!(message.contains("subsampling"), "{message}");
        assert!(message.contains("; save it flat"), "{message}");
    }

    #[test]
    fn files_cut_short_and_sizes_beyond_memory_are_refused() {
        let bytes = file(
            vec![part(None, &RGB)],
            IntegerBounds::from_dimensions((2, 1)),
        );
        for length in 0..bytes.len() {
            assert!(read_exr(&bytes[..length]).is_err(), "{length}");
        }
        let at = bytes
            .windows(11)
            .position(|w| w == b"dataWindow\0")
            .unwrap();
        let mut huge = bytes;
        // Right end of the window, after names, size and the upper left corner.
        let right = at + b"dataWindow\0box2i\0".len() + 4 + 8;
        huge[right..right + 4].copy_from_slice(&0x3fff_ffff_u32.to_le_bytes());
        let message = read_exr(&huge).unwrap_err();
        assert!(!message.is_empty());
    }
}
