//! Surface data in `shading_tables` apart from material numbers: texture placements, texture
//! coordinates, normals, vertex colours, texels.

use raystone_scene::{Material, SceneData, TextureUse, Wrap};

/// Words of a material without its parameters; the last four refer to texture placements.
pub(super) const MATERIAL_WORDS: usize = 12;
const USE_WORDS: usize = 12;

/// Features that the surfaces of a scene require; absent ones are not in the kernel.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SurfaceFeatures {
    /// A material has a texture.
    pub textures: bool,
    /// A texture holds metalness and roughness.
    pub metallic_roughness_textures: bool,
    /// There is a normal map.
    pub normal_maps: bool,
    /// There is an emission texture.
    pub emission_textures: bool,
    /// A texture is transformed, or does not repeat.
    pub texture_transforms: bool,
    /// A vertex has its own normal.
    pub normals: bool,
    /// A vertex has a colour.
    pub vertex_colors: bool,
}

impl SurfaceFeatures {
    pub(super) fn of(scene: &SceneData, is_among: impl Fn(&Material) -> bool) -> Self {
        // Without coordinates, materials use their constants.
        let is_mapped = scene.uvs.len() == scene.triangles.len();
        let materials = scene.materials.iter();
        let materials = materials.filter(|material| is_mapped && is_among(material));
        let uses: Vec<[Option<TextureUse>; 4]> = materials.map(Material::texture_uses).collect();
        let some = |slot: usize| uses.iter().any(|of_one| of_one[slot].is_some());
        let mut all = uses.iter().flatten().flatten();
        Self {
            textures: (0..4).any(some),
            metallic_roughness_textures: some(1),
            normal_maps: some(2),
            emission_textures: some(3),
            texture_transforms: all.any(|used| !used.is_plain()),
            normals: scene.normals.len() == scene.triangles.len(),
            vertex_colors: scene.colors.len() == scene.triangles.len(),
        }
    }

    /// Feature names in kernels, and whether they are enabled.
    pub(super) fn flags(&self) -> [(&'static str, bool); 7] {
        [
            ("textures", self.textures),
            (
                "metallic_roughness_textures",
                self.metallic_roughness_textures,
            ),
            ("normal_maps", self.normal_maps),
            ("emission_textures", self.emission_textures),
            ("texture_transforms", self.texture_transforms),
            ("normals", self.normals),
            ("vertex_colors", self.vertex_colors),
        ]
    }

    /// Features that a kernel for these surfaces omits, whatever else is in the scene. Emission and
    /// its textures also belong to lights.
    pub(super) fn unneeded(&self) -> impl Iterator<Item = &'static str> {
        let of_one_surface = [
            "textures",
            "metallic_roughness_textures",
            "normal_maps",
            "normals",
            "vertex_colors",
        ];
        let unneeded = move |(name, on): &(&str, bool)| !on && of_one_surface.contains(name);
        let flags = self.flags().into_iter();
        flags.filter(unneeded).map(|(name, _)| name)
    }
}

/// Start offsets in words; 0 if the scene has no such data.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Places {
    pub first_uv: u32,
    pub first_normal: u32,
    pub first_color: u32,
    pub first_mirrored: u32,
}

/// Appends, in this order: texture placements, three `vec4` each; per triangle, six words of
/// texture coordinates, three of normals, six of colours and a mirrored bit; texels. Sets the
/// indices of the materials' texture placements, in `vec4`.
///
/// A placement: first texel, in words, width, height, and wrap modes (u plus 4 times v); the matrix
/// by columns; the translation, and the scale of normals.
pub(super) fn append(
    scene: &SceneData,
    features: &SurfaceFeatures,
    words: &mut Vec<u32>,
) -> Places {
    let mut rows = Vec::new();
    if features.textures {
        words.resize(words.len().next_multiple_of(4), 0);
        for (index, material) in scene.materials.iter().enumerate() {
            for (slot, used) in material.texture_uses().iter().enumerate() {
                let Some(used) = used else { continue };
                words[MATERIAL_WORDS * index + 8 + slot] = words.len() as u32 / 4;
                rows.push((words.len(), used.texture));
                words.extend(place(scene, used));
            }
        }
    }
    // Materials come first, so 0 never is a valid start.
    let place_of = |there: bool, words: &[u32]| if there { words.len() as u32 } else { 0 };
    let first_uv = place_of(features.textures, words);
    let texels = if features.textures {
        scene.textures.iter().map(|t| t.texels.len()).sum()
    } else {
        0
    };
    let corners = 6 * scene.uvs.len() + 3 * scene.normals.len() + 6 * scene.colors.len();
    let mirrored = scene.mirrored.len().div_ceil(32);
    words.reserve_exact(corners + mirrored + texels + 3);
    if features.textures {
        let uvs = scene.uvs.iter().flatten();
        words.extend(uvs.flat_map(|uv| [uv.x.to_bits(), uv.y.to_bits()]));
    }
    let first_normal = place_of(features.normals, words);
    if features.normals {
        words.extend_from_slice(scene.normals.as_flattened());
    }
    let first_color = place_of(features.vertex_colors, words);
    if features.vertex_colors {
        words.extend_from_slice(scene.colors.as_flattened().as_flattened());
    }
    let first_mirrored = place_of(!scene.mirrored.is_empty(), words);
    words.extend(scene.mirrored.chunks(32).map(|bits| {
        let set = (0..).zip(bits).map(|(place, bit)| u32::from(*bit) << place);
        set.sum::<u32>()
    }));
    if features.textures {
        // Textures used only by masks are stored with the triangles.
        let shown = (0_u32..).zip(&scene.textures);
        for (id, texture) in shown.filter(|(id, _)| rows.iter().any(|(_, used)| used == id)) {
            let first = words.len() as u32;
            words.extend(texture.texels.iter().map(|t| u32::from_le_bytes(*t)));
            for (row, _) in rows.iter().filter(|(_, used)| *used == id) {
                words[*row] = first;
            }
        }
    }
    Places {
        first_uv,
        first_normal,
        first_color,
        first_mirrored,
    }
}

fn place(scene: &SceneData, used: &TextureUse) -> [u32; USE_WORDS] {
    let texture = &scene.textures[used.texture as usize];
    let number = |wrap| match wrap {
        Wrap::Repeat => 0,
        Wrap::Mirrored => 1,
        Wrap::Clamp => 2,
    };
    let [u, v] = used.wrap.map(number);
    let [a, b, c, d] = used.linear.to_cols_array().map(f32::to_bits);
    let [x, y] = used.offset.to_array().map(f32::to_bits);
    let (width, height) = (texture.width, texture.height);
    let scale = used.scale.to_bits();
    [0, width, height, 4 * v + u, a, b, c, d, x, y, scale, 0]
}
