//! Reports parts of a glTF document that are not drawn as the file says, each once.

use super::gltf_document::Item;
use super::gltf_instancing::OF_NODES;
use super::gltf_meshopt::COMPRESSIONS;
use super::tally::unread_warning;
use glam::{Mat4, Vec4};
use std::collections::BTreeMap;

/// Extensions that are read, or that change nothing once the data is.
const READ: [&str; 10] = [
    "EXT_texture_webp",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_transmission",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

/// Lists of the document whose elements may have extensions, and the word for one.
const LISTS: [(&str, &str); 13] = [
    ("accessors", "accessor"),
    ("animations", "animation"),
    ("buffers", "buffer"),
    ("bufferViews", "buffer view"),
    ("cameras", "camera"),
    ("images", "image"),
    ("materials", "material"),
    ("meshes", "mesh"),
    ("nodes", "node"),
    ("samplers", "sampler"),
    ("scenes", "scene"),
    ("skins", "skin"),
    ("textures", "texture"),
];

/// `magFilter` of a sampler that does not interpolate.
const NEAREST: usize = 9728;

/// `wrapS` and `wrapT` of the standard: repeat, clamp, mirror.
const WRAPS: [usize; 3] = [10_497, 33_071, 33_648];

/// Deviations of a matrix below this are rounding.
const ROUNDING: f32 = 1e-4;

/// How often something was met, and the first place of it.
struct Met {
    count: usize,
    first: String,
}

#[derive(Default)]
pub(super) struct Notes {
    /// Sentences, one warning each.
    told: BTreeMap<String, Met>,
    /// Names of what is drawn as if it were not there, in one warning.
    unread: BTreeMap<String, Met>,
}

impl Notes {
    pub(crate) fn tell(&mut self, what: impl Into<String>, place: impl FnOnce() -> String) {
        add(&mut self.told, what.into(), place);
    }

    pub(crate) fn unread(&mut self, what: impl Into<String>, place: impl FnOnce() -> String) {
        add(&mut self.unread, what.into(), place);
    }

    /// Records what is odd about a node's own transform.
    pub(crate) fn see_transform(&mut self, node: Item<'_>, own: Mat4, place: impl Fn() -> String) {
        let parts = ["translation", "rotation", "scale"];
        if node.get("matrix").is_given() && parts.iter().any(|key| node.get(key).is_given()) {
            let what =
                "nodes have a matrix besides a translation, rotation or scale: the matrix counts";
            self.tell(what, &place);
        }
        let is_odd = |key: &&str| node.lacks_list(key);
        if parts.iter().chain(&["matrix"]).any(is_odd) {
            let what = "nodes have a transform that is no list of numbers, which is left out";
            self.tell(what, &place);
        }
        if !own.is_finite() {
            let what = "nodes have a transform with numbers missing: what they show is dropped";
            self.tell(what, place);
        } else if !own.row(3).abs_diff_eq(Vec4::W, ROUNDING) {
            let what = "nodes have a matrix whose last row is not 0, 0, 0, 1, which is not read: its numbers go \
                        column by column";
            self.tell(what, place);
        }
    }

    /// Records everything in the document that no reader sees: extensions, except those `named`
    /// elsewhere, and animations.
    pub(crate) fn see_document(&mut self, document: Item<'_>, named: &[&str]) {
        let is_read = |name: &str| {
            let mut known = READ.iter().chain(&OF_NODES).chain(&COMPRESSIONS);
            known.any(|read| *read == name) || named.contains(&name)
        };
        self.see_lists(document);
        for (index, sampler) in document.list("samplers").enumerate() {
            if sampler.index("magFilter") == Some(NEAREST) {
                let what = "samplers ask for the nearest texel: four are interpolated";
                self.tell(what, || sampler.place("sampler", index));
            }
            let is_odd = |key: &str| {
                let wrap = sampler.get(key).given();
                wrap.is_some_and(|wrap| wrap.as_index().is_none_or(|code| !WRAPS.contains(&code)))
            };
            let mut textures = document.list("textures");
            if textures.any(|texture| texture.index("sampler") == Some(index))
                && ["wrapS", "wrapT"].into_iter().any(is_odd)
            {
                let what = "samplers wrap in an unknown way: their textures repeat";
                self.tell(what, || sampler.place("sampler", index));
            }
        }
        for (key, kind) in LISTS {
            for (index, item) in document.list(key).enumerate() {
                each_extension(item, &mut |name| {
                    if !is_read(name) {
                        let what = format!("the extension `{name}`");
                        self.unread(what, || item.place(kind, index));
                    }
                });
            }
        }
        // Those that no element has are the document's own, or only declared.
        let own = document.get("extensions").members().map(|(name, _)| name);
        let own: Vec<&str> = own.filter(|name| !is_read(name)).collect();
        for name in own {
            self.unread(format!("the extension `{name}`"), String::new);
        }
        for key in ["extensionsUsed", "extensionsRequired"] {
            for name in document.list(key).filter_map(Item::as_text) {
                let what = format!("the extension `{name}`");
                if !is_read(name) && !self.unread.contains_key(&what) {
                    self.unread(what, String::new);
                }
            }
        }
        for (index, animation) in document.list("animations").enumerate() {
            self.unread("animations", || animation.place("animation", index));
        }
    }

    /// Records what is written in place of the lists that are read.
    fn see_lists(&mut self, document: Item<'_>) {
        let what = "not a list, and left out";
        for (key, _) in LISTS
            .into_iter()
            .filter(|(key, _)| document.lacks_list(key))
        {
            self.tell(format!("`{key}` is {what}"), String::new);
        }
        for (index, mesh) in document.list("meshes").enumerate() {
            if mesh.lacks_list("primitives") {
                self.tell(format!("`primitives` is {what}"), || {
                    mesh.place("mesh", index)
                });
            }
        }
    }

    pub(crate) fn warnings(self) -> impl Iterator<Item = String> {
        let unread = unread_warning(self.unread.into_iter().map(written));
        self.told.into_iter().map(written).chain(unread)
    }
}

fn add(met: &mut BTreeMap<String, Met>, what: String, place: impl FnOnce() -> String) {
    let first = || Met {
        count: 0,
        first: place(),
    };
    met.entry(what).or_insert_with(first).count += 1;
}

fn written((what, met): (String, Met)) -> String {
    match (met.count, met.first.as_str()) {
        (_, "") => what,
        (1, place) => format!("{what} ({place})"),
        (count, place) => format!("{what} ({count}, the first: {place})"),
    }
}

/// Calls `found` with every extension of a part and of the parts within it, but for what
/// applications keep in `extras`.
fn each_extension(part: Item<'_>, found: &mut impl FnMut(&str)) {
    for (name, _) in part.get("extensions").members() {
        found(name);
    }
    for inner in part.parts() {
        each_extension(inner, found);
    }
}
