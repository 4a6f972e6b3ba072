//! Scene buffers for shading: canonical triangles, materials, lights, textures.

use super::offset::TransformError;
use super::surface_tables::{MATERIAL_WORDS, Places, SurfaceFeatures, append};
use crate::accel::{TriangleBuffers, TriangleSoup};
use crate::gpu::{Bindings, Gpu, GpuError};
use crate::scene::{DIFFUSE, Daylight, MATERIAL_KINDS, MaterialKind, SceneData};
use glam::Vec3;

/// What a scene makes kernels carry; absent features are not in the kernel.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SceneFeatures {
    /// Textures and normals.
    pub surfaces: SurfaceFeatures,
    /// There are lights that can be sampled: materials that emit.
    pub lights: bool,
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
        flags.extend([("lights", self.lights), ("daylight", self.daylight)]);
        flags.extend(self.surfaces.flags());
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
    /// Number of emissive triangles.
    pub lights: u32,
    /// Where they begin in `shading_tables`, in `vec4`.
    pub first_light: u32,
    /// Sum over emissive triangles of area times luminance.
    pub light_power: f32,
    /// Where texture coordinates begin in `shading_tables`, in words.
    pub first_uv: u32,
    /// Where normals begin in `shading_tables`, in words.
    pub first_normal: u32,
    /// Length of the diagonal of the scene's box, scene units.
    pub diagonal: f64,
}

/// Relative luminance of linear sRGB, as in `kernels/shading/light/triangles.wesl`.
fn luminance(c: Vec3) -> f32 {
    0.212_671 * c.x + 0.715_160 * c.y + 0.072_169 * c.z
}

impl SceneBuffers {
    /// Uploads what shading needs.
    ///
    /// # Errors
    /// A buffer exceeds the adapter's limit.
    pub fn upload(gpu: &Gpu, scene: &SceneData, soup: &TriangleSoup) -> Result<Self, GpuError> {
        let surfaces = SurfaceFeatures::of(scene);
        let (lights, light_power) = light_words(scene);
        let tables = Tables::of(scene, &lights, &surfaces);
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
                surfaces,
                lights: !lights.is_empty(),
                daylight: scene.daylight.is_some(),
                materials: MATERIAL_KINDS
                    .map(|kind| scene.materials.iter().any(|m| m.kind == kind)),
            },
            environment: scene.environment.to_array(),
            daylight: scene.daylight.unwrap_or_default(),
            lights: lights.len() as u32,
            first_light: tables.first_light,
            light_power,
            first_uv: tables.places.first_uv,
            first_normal: tables.places.first_normal,
            diagonal: f64::from(2.0 * scene.bounds().radius()),
        })
    }
}

/// Content of `shading_tables`, in this order: three `vec4` per material, parameters of materials, lights, and what
/// [`surface_tables`](super::surface_tables) appends.
///
/// A material: base colour and number of its kind; emission and place of its parameters, in `vec4`; places of its
/// textures, 0 where it has none.
struct Tables {
    words: Vec<u32>,
    /// In `vec4`.
    first_light: u32,
    places: Places,
}

impl Tables {
    fn of(scene: &SceneData, lights: &[[u32; 4]], surfaces: &SurfaceFeatures) -> Self {
        let mut words = vec![0; MATERIAL_WORDS * scene.materials.len()];
        for (index, material) in scene.materials.iter().enumerate() {
            let parameters = words.len() as u32 / 4;
            words.extend(material.parameters.iter().map(|x| x.to_bits()));
            words.resize(words.len().next_multiple_of(4), 0);
            let [r, g, b] = material.base_color.to_array().map(f32::to_bits);
            let [er, eg, eb] = material.emission.to_array().map(f32::to_bits);
            let row = [r, g, b, number(material.kind), er, eg, eb, parameters];
            let first = MATERIAL_WORDS * index;
            words[first..first + row.len()].copy_from_slice(&row);
        }
        let first_light = words.len() as u32 / 4;
        words.extend_from_slice(lights.as_flattened());
        let places = append(scene, surfaces, &mut words);
        words.resize(words.len().next_multiple_of(4), 0);
        Self {
            words,
            first_light,
            places,
        }
    }
}

/// Of a kind of material, in kernels.
fn number(kind: &MaterialKind) -> u32 {
    let place = MATERIAL_KINDS.iter().position(|known| *known == kind);
    place.unwrap_or_default() as u32
}

/// One row per emissive triangle: index and cumulative probability; and the total power.
fn light_words(scene: &SceneData) -> (Vec<[u32; 4]>, f32) {
    let mut powers = Vec::new();
    for (id, (triangle, material)) in scene.triangles.iter().zip(&scene.material_ids).enumerate() {
        let emission = scene.materials[*material as usize].emission;
        let [a, b, c] = triangle.vertices.map(|v| v.as_dvec3());
        let area = 0.5 * (b - a).cross(c - a).length();
        let power = area * f64::from(luminance(emission));
        if power > 0.0 {
            powers.push((id as u32, power));
        }
    }
    let total: f64 = powers.iter().map(|(_, p)| p).sum();
    let mut sum = 0.0;
    let rows = powers
        .iter()
        .map(|(id, power)| {
            sum += power;
            [*id, ((sum / total) as f32).to_bits(), 0, 0]
        })
        .collect();
    (rows, total as f32)
}
