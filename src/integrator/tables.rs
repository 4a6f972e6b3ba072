//! Scene buffers for shading: canonical triangles, materials, lights, textures.

use super::offset::{RayOffset, TransformError};
use crate::accel::{TriangleBuffers, TriangleSoup};
use crate::gpu::{Bindings, Gpu, GpuError};
use crate::scene::{Daylight, MaterialKind, SceneData};
use glam::Vec3;

/// What a scene makes kernels carry; absent features are not in the kernel.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SceneFeatures {
    /// Some material has a base-colour texture.
    pub textures: bool,
    /// There are lights that can be sampled: materials that emit.
    pub lights: bool,
    /// Some material is a mirror.
    pub mirror: bool,
    /// The environment is the sky over a scene without a light.
    pub daylight: bool,
}

impl SceneFeatures {
    /// Feature names as kernels write them, with whether they are on.
    pub fn flags(&self) -> [(&'static str, bool); 4] {
        [
            ("textures", self.textures),
            ("lights", self.lights),
            ("mirror", self.mirror),
            ("daylight", self.daylight),
        ]
    }
}

/// A scene on the GPU.
pub struct SceneBuffers {
    /// `triangles`, `shading_tables`, `texture_data`.
    pub bindings: Bindings,
    /// The triangles alone, and how rays meet them.
    pub triangles: TriangleBuffers,
    /// Where rays that leave a surface start; integrators ask.
    pub offset: RayOffset,
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
    /// Length of the diagonal of the scene's box, scene units.
    pub diagonal: f64,
}

/// Relative luminance of linear sRGB, as in `kernels/shading/light.wesl`.
fn luminance(c: Vec3) -> f32 {
    0.212_671 * c.x + 0.715_160 * c.y + 0.072_169 * c.z
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
        let (texture_data, first_texels) = if textured {
            texture_words(scene)
        } else {
            (Vec::new(), Vec::new())
        };
        let mut tables = material_words(scene, &first_texels);
        let first_light = tables.len() as u32;
        let (lights, light_power) = light_words(scene);
        tables.extend_from_slice(&lights);
        let triangles = TriangleBuffers::upload(gpu, soup)?;
        let mut bindings = triangles.bindings.clone();
        bindings.buffer("shading_tables", &gpu.storage("shading_tables", &tables)?);
        if textured {
            bindings.buffer("texture_data", &gpu.storage("texture_data", &texture_data)?);
        }
        Ok(Self {
            bindings,
            triangles,
            offset: RayOffset::default(),
            transform_error: TransformError::of(soup),
            features: SceneFeatures {
                textures: textured,
                lights: !lights.is_empty(),
                mirror: scene
                    .materials
                    .iter()
                    .any(|m| m.kind == MaterialKind::Mirror),
                daylight: scene.daylight.is_some(),
            },
            environment: scene.environment.to_array(),
            daylight: scene.daylight.unwrap_or_default(),
            lights: lights.len() as u32,
            first_light,
            light_power,
            diagonal: f64::from(2.0 * scene.bounds().radius()),
        })
    }
}

/// Texture coordinates, then texels; and where each texture's texels begin.
fn texture_words(scene: &SceneData) -> (Vec<u32>, Vec<u32>) {
    let texels: usize = scene.textures.iter().map(|t| t.texels.len()).sum();
    let mut words = Vec::with_capacity(6 * scene.uvs.len() + texels);
    for corners in &scene.uvs {
        words.extend(
            corners
                .iter()
                .flat_map(|uv| [uv.x.to_bits(), uv.y.to_bits()]),
        );
    }
    let mut first = Vec::with_capacity(scene.textures.len());
    for texture in &scene.textures {
        first.push(words.len() as u32);
        words.extend(texture.texels.iter().map(|t| u32::from_le_bytes(*t)));
    }
    (words, first)
}

fn material_words(scene: &SceneData, first_texels: &[u32]) -> Vec<[u32; 4]> {
    let mut words = Vec::with_capacity(3 * scene.materials.len());
    for material in &scene.materials {
        let [r, g, b] = material.base_color.to_array().map(f32::to_bits);
        let kind = match material.kind {
            MaterialKind::Diffuse => 0,
            MaterialKind::Mirror => 1,
        };
        words.push([r, g, b, kind]);
        let [r, g, b] = material.emission.to_array().map(f32::to_bits);
        words.push([r, g, b, 0]);
        let texture = material.base_color_texture.and_then(|t| {
            let first = first_texels.get(t as usize)?;
            let texture = &scene.textures[t as usize];
            Some([*first, texture.width, texture.height, 1])
        });
        words.push(texture.unwrap_or_default());
    }
    words
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
