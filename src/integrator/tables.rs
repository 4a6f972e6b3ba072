//! Scene buffers for shading: canonical triangles, materials, lights, textures.

use super::light_tables::LightTables;
use super::offset::TransformError;
use crate::accel::{TriangleBuffers, TriangleSoup};
use crate::gpu::{Bindings, Gpu, GpuError};
use crate::scene::{
    DIFFUSE, Daylight, LIGHT_KINDS, LightList, MATERIAL_KINDS, Material, MaterialKind, SceneData,
};
use glam::Vec3;

/// What a scene makes kernels carry; absent features are not in the kernel.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SceneFeatures {
    /// Some material has a base-colour texture.
    pub textures: bool,
    /// There are lights that can be sampled.
    pub lights: bool,
    /// Which of [`LIGHT_KINDS`] they are of.
    pub light_kinds: [bool; LIGHT_KINDS.len()],
    /// Some surface emits from its front alone.
    pub one_sided_lights: bool,
    /// The environment is the sky over a scene without a light.
    pub daylight: bool,
    /// Which of [`MATERIAL_KINDS`] some material is of.
    pub materials: [bool; MATERIAL_KINDS.len()],
}

impl SceneFeatures {
    /// Feature names as kernels write them, with whether they are on. Diffuse, which every kernel has, is none.
    pub fn flags(&self) -> Vec<(&'static str, bool)> {
        let kinds = MATERIAL_KINDS.iter().map(|kind| kind.feature);
        let mut flags: Vec<_> = kinds.zip(self.materials).collect();
        flags.retain(|(name, _)| *name != DIFFUSE.feature);
        flags.extend([
            ("textures", self.textures),
            ("lights", self.lights),
            ("one_sided_lights", self.one_sided_lights),
            ("daylight", self.daylight),
        ]);
        flags.extend(LightTables::flags(&self.light_kinds));
        flags
    }
}

/// A scene on the GPU.
pub struct SceneBuffers {
    /// `triangles`, `shading_tables`.
    pub bindings: Bindings,
    /// The triangles alone, and how rays meet them.
    pub triangles: TriangleBuffers,
    /// What instances add to the error of points.
    pub transform_error: TransformError,
    /// What kernels must carry.
    pub features: SceneFeatures,
    /// Radiance of the environment.
    pub environment: [f32; 3],
    /// The sky; kernels without its feature do not read it.
    pub daylight: Daylight,
    /// What is sampled.
    pub lights: LightTables,
    /// Where texture coordinates begin in `shading_tables`, in words.
    pub first_uv: u32,
    /// Length of the diagonal of the scene's box, scene units.
    pub diagonal: f64,
}

impl SceneBuffers {
    /// Uploads what shading needs.
    ///
    /// # Errors
    /// A buffer exceeds the adapter's limit.
    pub fn upload(gpu: &Gpu, scene: &SceneData, soup: &TriangleSoup) -> Result<Self, GpuError> {
        let textured = scene.uvs.len() == scene.triangles.len()
            && scene
                .materials
                .iter()
                .any(|m| m.base_color_texture.is_some());
        let mut lights = LightTables::of(scene, &LightList::of(scene));
        let tables = Tables::of(scene, &mut lights, textured);
        let triangles = TriangleBuffers::upload(gpu, soup)?;
        let mut bindings = triangles.bindings.clone();
        bindings.buffer(
            "shading_tables",
            &gpu.storage("shading_tables", &tables.words)?,
        );
        Ok(Self {
            bindings,
            triangles,
            transform_error: TransformError::of(soup),
            features: SceneFeatures {
                textures: textured,
                lights: lights.lights > 0,
                light_kinds: lights.kinds,
                one_sided_lights: lights.one_sided,
                daylight: scene.daylight.is_some(),
                materials: MATERIAL_KINDS
                    .map(|kind| scene.materials.iter().any(|m| m.kind == kind)),
            },
            environment: scene.environment.to_array(),
            daylight: scene.daylight.unwrap_or_default(),
            lights,
            first_uv: tables.first_uv,
            diagonal: f64::from(2.0 * scene.bounds().radius()),
        })
    }
}

/// Words of a material without its parameters.
const MATERIAL_WORDS: usize = 12;

/// Content of `shading_tables`, in this order: three `vec4` per material, parameters of materials, lights,
/// six words of texture coordinates per triangle, texels.
///
/// A material: base colour and number of its kind, with the highest bit set where it emits from its front alone; emission and place of its parameters, in `vec4`; place of its
/// first texel, in words, width and height of its texture, and 1 if it has one.
struct Tables {
    words: Vec<u32>,
    /// In words.
    first_uv: u32,
}

impl Tables {
    fn of(scene: &SceneData, lights: &mut LightTables, textured: bool) -> Self {
        let mut words = vec![0; MATERIAL_WORDS * scene.materials.len()];
        for (index, material) in scene.materials.iter().enumerate() {
            let parameters = words.len() as u32 / 4;
            words.extend(material.parameters.iter().map(|x| x.to_bits()));
            words.resize(words.len().next_multiple_of(4), 0);
            let [r, g, b] = material.base_color.to_array().map(f32::to_bits);
            let [er, eg, eb] = material.emission.to_array().map(f32::to_bits);
            let one_sided = u32::from(emits_in_front(material)) << 31;
            let kind = number(material.kind) | one_sided;
            let row = [r, g, b, kind, er, eg, eb, parameters];
            let first = MATERIAL_WORDS * index;
            words[first..first + row.len()].copy_from_slice(&row);
        }
        lights.append(&mut words);
        let first_uv = words.len() as u32;
        if textured {
            push_textures(scene, &mut words);
        }
        words.resize(words.len().next_multiple_of(4), 0);
        Self { words, first_uv }
    }
}

/// Whether the material emits, and from its front alone.
pub(super) fn emits_in_front(material: &Material) -> bool {
    !material.emits_both_sides && material.emission != Vec3::ZERO
}

/// Of a kind of material, in kernels.
fn number(kind: &MaterialKind) -> u32 {
    let place = MATERIAL_KINDS.iter().position(|known| *known == kind);
    place.unwrap_or_default() as u32
}

/// Appends texture coordinates and texels, and tells the materials where theirs are.
fn push_textures(scene: &SceneData, words: &mut Vec<u32>) {
    let texels: usize = scene.textures.iter().map(|t| t.texels.len()).sum();
    words.reserve_exact(6 * scene.uvs.len() + texels + 3);
    let uvs = scene.uvs.iter().flatten();
    words.extend(uvs.flat_map(|uv| [uv.x.to_bits(), uv.y.to_bits()]));
    for (id, texture) in (0_u32..).zip(&scene.textures) {
        let row = [words.len() as u32, texture.width, texture.height, 1];
        words.extend(texture.texels.iter().map(|t| u32::from_le_bytes(*t)));
        for (index, material) in scene.materials.iter().enumerate() {
            if material.base_color_texture == Some(id) {
                words[MATERIAL_WORDS * index + 8..][..4].copy_from_slice(&row);
            }
        }
    }
}
