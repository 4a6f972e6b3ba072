//! Textures of glTF documents: images and texture transforms.

use super::gltf_data::Data;
use super::gltf_document::Item;
use super::gltf_files::{Files, is_data};
use super::texture::{Encoded, ImageSource};
use super::{TextureUse, Wrap};
use glam::{Mat2, Vec2};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// Images used by some material, without duplicates, and those left out.
pub(super) struct Images<'a> {
    files: &'a Files,
    document: Item<'a>,
    data: &'a Data<'a>,
    /// Index in `used` of each image.
    ids: BTreeMap<Source, u32>,
    pub used: Vec<ImageSource<'a>>,
}

/// The image of a texture, or a texture without any.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Source {
    Image(usize),
    None(usize),
}

pub(super) struct Placed {
    pub set: u32,
    pub place: TextureUse,
}

const TRANSFORM: &str = "KHR_texture_transform";

impl<'a> Images<'a> {
    pub(crate) fn new(files: &'a Files, document: Item<'a>, data: &'a Data<'a>) -> Self {
        Self {
            files,
            document,
            data,
            ids: BTreeMap::new(),
            used: Vec::new(),
        }
    }

    /// The texture that a material names by `info`, which may have a transform.
    pub(crate) fn place(&mut self, info: Item<'a>) -> Placed {
        let index = info.index("index").unwrap_or(usize::MAX);
        let texture = self.document.at("textures", index);
        let sampler = texture.and_then(|texture| texture.index("sampler"));
        let sampler = sampler.and_then(|sampler| self.document.at("samplers", sampler));
        let wrap = |key| match sampler.and_then(|sampler| sampler.index(key)) {
            Some(33071) => Wrap::Clamp,
            Some(33648) => Wrap::Mirrored,
            _ => Wrap::Repeat,
        };
        let mut place = TextureUse {
            wrap: [wrap("wrapS"), wrap("wrapT")],
            ..TextureUse::plain(self.id(index, texture))
        };
        let set = |part: Item<'_>| part.index("texCoord").map(|set| set as u32);
        let mut used = set(info).unwrap_or(0);
        if let Some(given) = info.extension(TRANSFORM).given() {
            let (sin, cos) = given.number("rotation").unwrap_or(0.0).sin_cos();
            let rotation = Mat2::from_cols(Vec2::new(cos, -sin), Vec2::new(sin, cos));
            let scale = Vec2::from(given.vector("scale", [1.0; 2]));
            place.linear = rotation * Mat2::from_diagonal(scale);
            place.offset = given.vector("offset", [0.0; 2]).into();
            used = set(given).unwrap_or(used);
        }
        Placed { set: used, place }
    }

    fn id(&mut self, index: usize, texture: Option<Item<'a>>) -> u32 {
        let source = texture.and_then(source);
        let key = source.map_or(Source::None(index), Source::Image);
        let (files, data, used) = (self.files, self.data, &mut self.used);
        let image = source.map(|source| (source, self.document.at("images", source)));
        *self.ids.entry(key).or_insert_with(|| {
            used.push(match image {
                Some((index, Some(image))) => image_source(files, data, index, image),
                Some((image, None)) => missing(index, format!("there is no image {image}")),
                None => missing(index, without_image(texture)),
            });
            used.len() as u32 - 1
        })
    }
}

/// The image of a texture: its own, which all can read, or that of an extension.
fn source(texture: Item<'_>) -> Option<usize> {
    let webp = texture.extension("EXT_texture_webp");
    texture.index("source").or_else(|| webp.index("source"))
}

fn without_image(texture: Option<Item<'_>>) -> String {
    let Some(texture) = texture else {
        return "there is no such texture".to_owned();
    };
    match texture.get("extensions").members().next() {
        Some((name, _)) => format!("its only image is that of `{name}`, which is not read"),
        None => "it names no image".to_owned(),
    }
}

fn missing<'a>(texture: usize, why: String) -> ImageSource<'a> {
    ImageSource {
        name: texture.to_string(),
        encoded: Encoded::Missing(why),
    }
}

fn image_source<'a>(
    files: &Files,
    data: &'a Data<'a>,
    index: usize,
    image: Item<'a>,
) -> ImageSource<'a> {
    let owned = |bytes| Encoded::Memory(Cow::Owned(bytes));
    let borrowed = |bytes| Encoded::Memory(Cow::Borrowed(bytes));
    let (uri, encoded) = match (image.index("bufferView"), image.text("uri")) {
        (Some(view), _) => (
            None,
            data.view(view).map_or_else(Encoded::Missing, borrowed),
        ),
        (None, Some(uri)) if is_data(uri) => {
            (None, files.read(uri).map_or_else(Encoded::Missing, owned))
        }
        (None, Some(uri)) => {
            let found = files.find(uri).map_or_else(Encoded::Missing, Encoded::File);
            (Some(uri), found)
        }
        (None, None) => (None, Encoded::Missing("it names no file".to_owned())),
    };
    ImageSource {
        // The ending of a file may be all that tells its format.
        name: uri
            .or(image.text("name"))
            .map_or_else(|| format!("image {index}"), str::to_owned),
        encoded,
    }
}
