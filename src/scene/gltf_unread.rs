//! What a glTF document says and nothing here reads: each is named once.

use super::gltf_instancing::OF_NODES;
use super::obj_statements::unread_warning;
use gltf::Semantic;
use std::collections::BTreeSet;

/// Extensions that are read, by the crate or here, whether with the nodes, the materials or the textures that have them. Quantised
/// data are read or refused attribute by attribute.
const READ: [&str; 8] = [
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_transmission",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

/// What was come across.
pub(super) struct Unread {
    extensions: BTreeSet<String>,
    pub attributes: BTreeSet<String>,
}

/// What the document as a whole has: extensions and animations.
pub(super) fn of_document(document: &gltf::Document) -> Unread {
    let is_read = |name: &&str| READ.contains(name) || OF_NODES.contains(name);
    let extensions = document.extensions_used().filter(|name| !is_read(name));
    let animations = document.animations().len();
    let animations = (animations > 0).then(|| format!("{animations} animations"));
    Unread {
        extensions: extensions.map(str::to_owned).collect(),
        attributes: animations.into_iter().collect(),
    }
}

impl Unread {
    /// Takes note of the attributes of a primitive that are not read. Skins and morph targets, and texture coordinates without
    /// a texture, are a matter of their own: nothing is lost without the latter.
    pub(crate) fn see(&mut self, primitive: &gltf::Primitive<'_>, set: Option<u32>) {
        for (semantic, _) in primitive.attributes() {
            let name = match semantic {
                Semantic::Positions | Semantic::Normals => continue,
                Semantic::Tangents => "TANGENT".to_owned(),
                // Named where they were not read.
                Semantic::Colors(0) => continue,
                Semantic::Colors(k) => format!("COLOR_{k}"),
                Semantic::TexCoords(k) if k == 0 || set == Some(k) => continue,
                Semantic::TexCoords(k) => format!("TEXCOORD_{k}"),
                Semantic::Joints(k) => format!("JOINTS_{k}"),
                Semantic::Weights(k) => format!("WEIGHTS_{k}"),
                Semantic::Extras(name) => format!("_{name}"),
            };
            self.attributes.insert(format!("`{name}`"));
        }
    }

    /// A line for extensions, and one for the rest. `named` are those that materials have and other lines name.
    pub(crate) fn warnings(&self, named: &[&str]) -> impl Iterator<Item = String> {
        let extensions = self.extensions.iter();
        let extensions = extensions.filter(|name| !named.contains(&name.as_str()));
        let extensions = extensions.map(|name| format!("the extension `{name}`"));
        let all = extensions.chain(self.attributes.iter().cloned());
        unread_warning(all).into_iter()
    }
}
