//! Textures of glTF documents: images and texture transforms.

use super::gltf_files::Files;
use super::texture::{Encoded, ImageSource};
use super::{TextureUse, Wrap};
use glam::{Mat2, Vec2};
use gltf::texture::WrappingMode;
use std::borrow::Cow;

/// Images used by some material, without duplicates, and those left out.
pub(super) struct Images<'a> {
    files: &'a Files,
    buffers: &'a [Vec<u8>],
    /// Index in `used` of each of the document's images.
    ids: Vec<Option<u32>>,
    pub used: Vec<ImageSource<'a>>,
}

pub(super) struct Placed {
    pub set: u32,
    pub place: TextureUse,
}

/// `KHR_texture_transform` as given in the file.
struct Given {
    offset: Vec2,
    rotation: f32,
    scale: Vec2,
    set: Option<u32>,
}

impl<'a> Images<'a> {
    pub(crate) fn new(files: &'a Files, document: &gltf::Document, buffers: &'a [Vec<u8>]) -> Self {
        Self {
            files,
            buffers,
            ids: vec![None; document.images().len()],
            used: Vec::new(),
        }
    }

    pub(crate) fn place(&mut self, info: &gltf::texture::Info<'_>) -> Placed {
        let given = info.texture_transform().map(|t| Given {
            offset: t.offset().into(),
            rotation: t.rotation(),
            scale: t.scale().into(),
            set: t.tex_coord(),
        });
        self.placed(&info.texture(), info.tex_coord(), given)
    }

    pub(crate) fn place_normals(&mut self, info: &gltf::material::NormalTexture<'_>) -> Placed {
        let given = info
            .extension_value("KHR_texture_transform")
            .map(given_by_json);
        let mut found = self.placed(&info.texture(), info.tex_coord(), given);
        found.place.scale = info.scale();
        found
    }

    fn placed(&mut self, texture: &gltf::Texture<'_>, set: u32, given: Option<Given>) -> Placed {
        let sampler = texture.sampler();
        let wrap = |mode| match mode {
            WrappingMode::Repeat => Wrap::Repeat,
            WrappingMode::MirroredRepeat => Wrap::Mirrored,
            WrappingMode::ClampToEdge => Wrap::Clamp,
        };
        let mut place = TextureUse {
            wrap: [wrap(sampler.wrap_s()), wrap(sampler.wrap_t())],
            ..TextureUse::plain(self.id(&texture.source()))
        };
        let mut used = set;
        if let Some(given) = given {
            let (sin, cos) = given.rotation.sin_cos();
            let rotation = Mat2::from_cols(Vec2::new(cos, -sin), Vec2::new(sin, cos));
            place.linear = rotation * Mat2::from_diagonal(given.scale);
            place.offset = given.offset;
            used = given.set.unwrap_or(set);
        }
        Placed { set: used, place }
    }

    fn id(&mut self, image: &gltf::Image<'_>) -> u32 {
        let (files, buffers, used) = (self.files, self.buffers, &mut self.used);
        *self.ids[image.index()].get_or_insert_with(|| {
            used.push(image_source(files, image, buffers));
            used.len() as u32 - 1
        })
    }
}

/// Missing and non-numeric values count as not given.
fn given_by_json(value: &serde_json::Value) -> Given {
    let number = |value: Option<&serde_json::Value>| {
        let number = value.and_then(serde_json::Value::as_f64);
        number.map(|x| x as f32).filter(|x| x.is_finite())
    };
    let pair = |key: &str, default: f32| {
        let values = value.get(key);
        let part = |k: usize| number(values.and_then(|v| v.get(k))).unwrap_or(default);
        Vec2::new(part(0), part(1))
    };
    let set = value.get("texCoord").and_then(serde_json::Value::as_u64);
    Given {
        offset: pair("offset", 0.0),
        rotation: number(value.get("rotation")).unwrap_or(0.0),
        scale: pair("scale", 1.0),
        set: set.and_then(|set| u32::try_from(set).ok()),
    }
}

fn image_source<'a>(
    files: &Files,
    image: &gltf::Image<'_>,
    buffers: &'a [Vec<u8>],
) -> ImageSource<'a> {
    let index = image.index();
    let (uri_name, encoded) = match image.source() {
        gltf::image::Source::View { view, .. } => {
            let range = view.offset()..view.offset().saturating_add(view.length());
            let buffer = buffers.get(view.buffer().index());
            let bytes = buffer.and_then(|data| data.get(range));
            let missing = || Encoded::Missing("its bytes lie outside the buffer".to_owned());
            let encoded = bytes.map_or_else(missing, |b| Encoded::Memory(Cow::Borrowed(b)));
            (None, encoded)
        }
        gltf::image::Source::Uri { uri, .. } if uri.starts_with("data:") => {
            let owned = |bytes| Encoded::Memory(Cow::Owned(bytes));
            (None, files.read(uri).map_or_else(Encoded::Missing, owned))
        }
        gltf::image::Source::Uri { uri, .. } => (
            Some(uri),
            files.find(uri).map_or_else(Encoded::Missing, Encoded::File),
        ),
    };
    ImageSource {
        name: image
            .name()
            .or(uri_name)
            .map_or_else(|| format!("image {index}"), str::to_owned),
        encoded,
    }
}
