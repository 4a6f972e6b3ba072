//! Images of a view with their linear radiance, to be compared pixel by pixel.

use crate::data::{RunData, View};
use crate::document::{Block, Comparer, Layer};
use crate::export::linear_file;
use crate::format;
use base64::Engine;
use half::f16;
use raystone_image::{Image, automatic_exposure, read_linear};
use std::path::Path;

/// Characters of radiance that all comparers of a page may hold together: the page stays below 10 MB.
const MOST_CHARACTERS: usize = 3_000_000;

/// Returns the reference and the first replicate of each sampler; `None` where there is nothing to compare.
pub(super) fn block(dir: &Path, data: &RunData, stem: &str, view: &View) -> Option<Block> {
    let pictured = view.samplers.iter().filter_map(|sampler| {
        let first = sampler
            .replicates
            .iter()
            .find_map(|r| Some((r, r.image.as_deref()?)))?;
        let spp = first.0.errors.last().map_or(0, |error| error.spp);
        Some((format!("{}, {spp} spp", sampler.name), first.1))
    });
    let reference = view.reference.filter(|r| !r.body.image.is_empty())?;
    let named = std::iter::once(("reference".to_owned(), reference.body.image.as_str()));
    let named: Vec<(String, &str)> = named.chain(pictured).collect();
    if named.len() < 2 {
        return None;
    }
    let mut comparer = Comparer {
        caption: format!("Compare the images with {} pixel by pixel", view.name),
        id: format!("{stem}-compare"),
        size: [0; 2],
        exposure: 1.0,
        layers: Vec::new(),
        note: String::new(),
    };
    let mut left = MOST_CHARACTERS / data.views().count().max(1);
    let (mut absent, mut large) = (0, 0);
    for (name, path) in named {
        let Some(image) = linear(dir, path) else {
            absent += 1;
            continue;
        };
        let size = [image.width, image.height];
        if comparer.layers.is_empty() {
            comparer.size = size;
            comparer.exposure = automatic_exposure(&image);
        }
        let radiance = radiance(&image);
        if size != comparer.size || radiance.len() > left {
            large += 1;
            continue;
        }
        left -= radiance.len();
        comparer.layers.push(Layer { name, radiance });
    }
    comparer.note = note(absent, large);
    if comparer.layers.len() < 2 {
        comparer.layers.clear();
    }
    Some(Block::Comparer(comparer))
}

fn note(absent: usize, large: usize) -> String {
    let mut note = String::new();
    if absent > 0 {
        note += &format!(
            "Not here: {} whose linear radiance the run did not keep (it keeps small images; `--images exr` keeps all). ",
            format::plural(absent, "image")
        );
    }
    if large > 0 {
        note += &format!(
            "Not here: {} for which this page has no room; the tone-mapped pictures stand below.",
            format::plural(large, "image")
        );
    }
    note.trim_end().into()
}

/// Returns the linear image beside a picture of the run: the same name with another ending.
fn linear(dir: &Path, picture: &str) -> Option<Image> {
    read_linear(&linear_file(dir, picture.strip_suffix(".png")?)?).ok()
}

/// Returns 16-bit floats in Base64; values beyond their range become the largest.
fn radiance(image: &Image) -> String {
    let bits = |v: &f32| {
        if v.is_finite() {
            f16::from_f32(v.clamp(-65504.0, 65504.0))
        } else {
            f16::from_f32(*v)
        }
    };
    let halves = image.pixels.as_flattened().iter().map(bits);
    let bytes: Vec<u8> = halves.flat_map(f16::to_le_bytes).collect();
    base64::engine::general_purpose::STANDARD.encode(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radiance_is_kept_as_half_floats_and_stays_finite() {
        let image = Image::new(2, 1, vec![[1.0, 0.5, -2.0], [1e9, f32::NAN, 0.0]]).unwrap();
        let bytes = base64::engine::general_purpose::STANDARD
            .decode(radiance(&image))
            .unwrap();
        let halves = bytes
            .chunks(2)
            .map(|b| f16::from_le_bytes([b[0], b[1]]).to_f32());
        let halves: Vec<f32> = halves.collect();
        assert_eq!(halves[..4], [1.0, 0.5, -2.0, 65504.0]);
        assert!(halves[4].is_nan() && halves[5] == 0.0);
    }
}
