//! Reports parts of a glTF document that are ignored, each once.

use super::gltf_instancing::OF_NODES;
use super::tally::unread_warning;
use gltf::Semantic;
use std::collections::BTreeSet;

/// Supported extensions of nodes, materials and textures, read here or by the crate. Quantised data
/// is read or refused per attribute.
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

pub(super) struct Unread {
    extensions: BTreeSet<String>,
    pub attributes: BTreeSet<String>,
}

/// Ignored features of the whole document: extensions and animations.
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
    /// Records a primitive's ignored attributes. Skins and morph targets are handled elsewhere, and
    /// unused texture coordinates lose nothing.
    pub(crate) fn see(&mut self, primitive: &gltf::Primitive<'_>, set: Option<u32>) {
        for (semantic, _) in primitive.attributes() {
            let name = match semantic {
                Semantic::Positions | Semantic::Normals => continue,
                Semantic::Tangents => "TANGENT".to_owned(),
                // Reported by its reader.
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

    /// One line for extensions, one for the rest; `named` extensions are covered elsewhere.
    pub(crate) fn warnings(&self, named: &[&str]) -> impl Iterator<Item = String> {
        let extensions = self.extensions.iter();
        let extensions = extensions.filter(|name| !named.contains(&name.as_str()));
        let extensions = extensions.map(|name| format!("the extension `{name}`"));
        let all = extensions.chain(self.attributes.iter().cloned());
        unread_warning(all).into_iter()
    }
}
