//! Materials: what surfaces do with light. A kind of material is three files: its kernel in
//! `kernels/shading/bsdf/`, its row here, and the row of its checks in `src/verify/materials/`. Each row stands on a list,
//! a kind of the program also in the table of kernels, `kernels/shading/bsdf.wesl`; for a kind from outside the table is
//! written from its row. Nothing else names kinds. How the parts fit: `docs/shading.md`.

mod cook_torrance;
mod dielectric;
mod diffuse;
mod mirror;
mod phong;
mod principled;

pub use cook_torrance::{COOK_TORRANCE, CookTorrance, Fresnel, Masking};
pub use dielectric::{DEFAULT_IOR, DIELECTRIC};
pub use diffuse::DIFFUSE;
pub use mirror::MIRROR;
pub use phong::PHONG;
pub use principled::{PRINCIPLED, reflectance_of_ior};

use super::{AlphaMask, TextureUse};
use glam::Vec3;
use raystone_core::params::Sources;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::Path;

/// What kernels ask of a kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lobes {
    /// `<feature>_sample(surface, u)` and `<feature>_scattering(surface, direction)`. What the lobes send behind a surface
    /// whose shading normal looks elsewhere is lost.
    Diffuse,
    /// The same two. What the lobes send behind the surface is mirrored at it.
    Glossy,
    /// `<feature>_sample(surface, u)` alone: there are single directions only, and light samples are of no use.
    Delta,
}

/// A kind of material.
#[derive(Clone)]
pub struct MaterialKind {
    /// Name.
    pub name: &'static str,
    /// The feature that brings its kernel into those of a scene: the name as kernels can write it.
    pub feature: &'static str,
    /// One line: what it does with light.
    pub description: &'static str,
    /// What [`Material::parameters`] holds, in this order.
    pub parameters: &'static [&'static str],
    /// What kernels ask of it.
    pub lobes: Lobes,
    /// Kernel modules that it brings along, because they are not the program's; `shading/bsdf/<feature>` is what kernels import.
    pub sources: Sources,
    /// How a material that a file describes looks as one of this kind, if it is one. What none recognises
    /// is diffuse.
    pub recognise: fn(&Description<'_>) -> Option<Look>,
}

/// The table of kinds; a kind's place is its number in `kernels/shading/bsdf.wesl`. Where a file's material
/// fits several, the last counts.
pub static MATERIAL_KINDS: [&MaterialKind; 6] = [
    &DIFFUSE,
    &PHONG,
    &COOK_TORRANCE,
    &PRINCIPLED,
    &MIRROR,
    &DIELECTRIC,
];

impl PartialEq for MaterialKind {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Eq for MaterialKind {}

impl fmt::Debug for MaterialKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

/// A surface material.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Name in the file, or a made-up one.
    pub name: String,
    /// What the kernels render.
    pub kind: &'static MaterialKind,
    /// Numbers that only this kind has, as [`MaterialKind::parameters`] names them.
    pub parameters: Vec<f32>,
    /// Linear RGB reflectance or tint, each in [0, 1]; multiplied by the texture if there is one.
    pub base_color: Vec3,
    /// What the base colour is multiplied by.
    pub base_color_texture: Option<TextureUse>,
    /// What the roughness (green) and the metalness (blue) of a principled material are multiplied by.
    pub metallic_roughness_texture: Option<TextureUse>,
    /// Directions of the normal in the frame of the texture.
    pub normal_texture: Option<TextureUse>,
    /// What the emission is multiplied by.
    pub emission_texture: Option<TextureUse>,
    /// What is cut out of the surface.
    pub mask: Option<AlphaMask>,
    /// Emitted radiance, linear RGB.
    pub emission: Vec3,
    /// Whether both sides of the triangle emit, or only that from which its corners turn counter-clockwise (glTF without
    /// `doubleSided`).
    pub emits_both_sides: bool,
    /// What else the file said.
    pub source: MaterialSource,
}

impl Material {
    /// A material of this kind that looks so.
    pub fn looking(name: impl Into<String>, kind: &'static MaterialKind, look: Look) -> Self {
        Self {
            name: name.into(),
            kind,
            parameters: look.parameters,
            base_color: reflectance(look.base_color),
            base_color_texture: None,
            metallic_roughness_texture: None,
            normal_texture: None,
            emission_texture: None,
            mask: None,
            emission: Vec3::ZERO,
            emits_both_sides: true,
            source: MaterialSource::default(),
        }
    }

    /// The material of one of these kinds that `file` describes, without texture and emission. One that would reflect more than
    /// arrives is scaled, with a warning.
    pub(super) fn described(
        name: String,
        description: &Description<'_>,
        kinds: &[&'static MaterialKind],
        file: &Path,
        warnings: &mut Vec<String>,
    ) -> Self {
        let mut kinds = kinds.iter().rev();
        let found = kinds.find_map(|&kind| Some((kind, (kind.recognise)(description)?)));
        let plain = || (&DIFFUSE, Look::plain(description.base_color));
        let (kind, look) = found.unwrap_or_else(plain);
        if look.reflected > 1.0 + ROUNDING {
            warnings.push(format!(
                "{}: material `{name}` reflects {:.4} times what arrives; its colours are divided by that",
                file.display(),
                look.reflected
            ));
        }
        Self {
            source: description.source.clone(),
            ..Self::looking(name, kind, look)
        }
    }

    /// The uses of textures: of the base colour, of metalness and roughness, of the normal, of the emission. Kernels have them in
    /// this order.
    pub fn texture_uses(&self) -> [Option<TextureUse>; 4] {
        [
            self.base_color_texture,
            self.metallic_roughness_texture,
            self.normal_texture,
            self.emission_texture,
        ]
    }

    /// The same and that of the mask, to be changed.
    pub(super) fn texture_uses_mut(&mut self) -> impl Iterator<Item = &mut Option<TextureUse>> {
        let of_mask = self.mask.iter_mut().map(|mask| &mut mask.texture);
        let shown = [
            &mut self.base_color_texture,
            &mut self.metallic_roughness_texture,
            &mut self.normal_texture,
            &mut self.emission_texture,
        ];
        shown.into_iter().chain(of_mask)
    }

    /// The same material, emitting `radiance` (linear RGB) from both sides.
    pub fn emitting(self, radiance: Vec3) -> Self {
        Self {
            emission: radiance,
            emits_both_sides: true,
            ..self
        }
    }

    /// The same material, emitting `radiance` (linear RGB) from the side on which the triangle's corners turn
    /// counter-clockwise alone.
    pub fn emitting_from_front(self, radiance: Vec3) -> Self {
        Self {
            emission: radiance,
            emits_both_sides: false,
            ..self
        }
    }
}

/// What the file said of a material beyond what [`MaterialKind`] renders: kept, because more of it
/// will be rendered later. Absent values are `None`, never a default.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct MaterialSource {
    /// Linear roughness in [0, 1] (glTF), or derived from the Phong exponent (MTL).
    pub roughness: Option<f32>,
    /// Metalness in [0, 1] (glTF).
    pub metallic: Option<f32>,
    /// Specular colour (MTL `Ks`, glTF specular-glossiness).
    pub specular: Option<[f32; 3]>,
    /// Phong exponent (MTL `Ns`).
    pub shininess: Option<f32>,
    /// Index of refraction (MTL `Ni`, glTF `KHR_materials_ior`).
    pub ior: Option<f32>,
    /// Fraction of light transmitted, in [0, 1].
    pub transmission: Option<f32>,
    /// What is left of light that passed through the body (MTL `Tf`).
    pub filter: Option<[f32; 3]>,
    /// Thickness of the body below the surface (`KHR_materials_volume`); 0 is a thin wall.
    pub thickness: Option<f32>,
    /// Opacity in [0, 1] (MTL `d`, glTF alpha).
    pub opacity: Option<f32>,
    /// glTF alpha mode, as in the file (`OPAQUE`, `MASK`, `BLEND`).
    pub alpha_mode: Option<String>,
    /// MTL illumination model.
    pub illum: Option<u8>,
}

/// The file formats that describe materials, each with its own rules.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Wavefront MTL.
    Mtl,
    /// glTF 2.0.
    Gltf,
}

/// What a file says of a material, for the kinds to recognise themselves in.
pub struct Description<'a> {
    /// The format of the file.
    pub format: Format,
    /// MTL `Kd`, glTF base or diffuse colour.
    pub base_color: Vec3,
    /// Whether a texture scales metalness, roughness or transmission: the numbers alone say nothing then.
    pub is_varied: bool,
    /// Whether the texture of metalness and roughness will be there.
    pub is_followed: bool,
    /// The rest of what it says.
    pub source: &'a MaterialSource,
}

/// A description as one kind renders it.
pub struct Look {
    /// Linear RGB reflectance or tint.
    pub base_color: Vec3,
    /// As [`MaterialKind::parameters`] names them.
    pub parameters: Vec<f32>,
    /// The largest part of light that the description reflects. Beyond 1, colours are divided by it.
    pub reflected: f32,
}

impl Look {
    /// One colour and no parameters.
    pub fn plain(color: Vec3) -> Self {
        Self {
            parameters: Vec::new(),
            ..Self::balanced(color, Vec3::ZERO, &[])
        }
    }

    /// Two colours that reflect together, the second of which is the first three of the parameters.
    pub fn balanced(base: Vec3, specular: Vec3, others: &[f32]) -> Self {
        let (base, specular) = (emitted(base), emitted(specular));
        let reflected = (base + specular).max_element();
        let scale = 1.0 / reflected.max(1.0);
        let specular = (specular * scale).to_array();
        Self {
            base_color: base * scale,
            parameters: [&specular, others].concat(),
            reflected,
        }
    }
}

/// What is within it of 1 was meant to be 1.
const ROUNDING: f32 = 1e-4;

/// `x` within these bounds; the lower one where it is NaN.
pub(crate) fn within(x: f32, least: f32, most: f32) -> f32 {
    if x.is_nan() {
        least
    } else {
        x.clamp(least, most)
    }
}

/// Finite and within [0, 1].
pub(super) fn reflectance(color: Vec3) -> Vec3 {
    Vec3::select(color.is_finite_mask(), color, Vec3::ZERO).clamp(Vec3::ZERO, Vec3::ONE)
}

/// Finite and not negative.
pub(super) fn emitted(color: impl Into<Vec3>) -> Vec3 {
    let color = color.into();
    Vec3::select(color.is_finite_mask(), color, Vec3::ZERO).max(Vec3::ZERO)
}
