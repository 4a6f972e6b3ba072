//! Surface materials. A kind of material is three files: its kernel in `kernels/shading/bsdf/`, its
//! entry here, and its checks in `src/verify/materials/`. Kinds of the program are also listed in
//! the table of kernels, `kernels/shading/bsdf.wesl`; for outside kinds the table is generated from
//! the entry. Nothing else names kinds. Overview: `docs/shading.md`.

mod cook_torrance;
mod dielectric;
mod diffuse;
mod mirror;
mod phong;
mod principled;

pub use cook_torrance::{COOK_TORRANCE, CookTorrance, Fresnel, Masking};
pub(super) use dielectric::refracts;
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

/// Functions that kernels call on a kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lobes {
    /// `<feature>_sample(surface, u)` and `<feature>_scattering(surface, direction)`. Samples below
    /// the surface, due to the shading normal, are lost.
    Diffuse,
    /// As [`Lobes::Diffuse`], but samples below the surface are mirrored at it.
    Glossy,
    /// Only `<feature>_sample(surface, u)`: directions are discrete, and light sampling is useless.
    Delta,
}

/// A kind of material.
#[derive(Clone)]
pub struct MaterialKind {
    /// Name.
    pub name: &'static str,
    /// The feature that adds its kernel to a scene's kernels, as spelled in kernels.
    pub feature: &'static str,
    /// One line: how it scatters light.
    pub description: &'static str,
    /// Names of [`Material::parameters`], in order.
    pub parameters: &'static [&'static str],
    /// Functions that kernels call.
    pub lobes: Lobes,
    /// Kernel modules of a kind from outside the program; kernels import `shading/bsdf/<feature>`.
    pub sources: Sources,
    /// Converts a file's material to this kind, if it is one; unrecognised ones are diffuse.
    pub recognise: fn(&Description<'_>) -> Option<Look>,
}

/// All kinds by their number in `kernels/shading/bsdf.wesl`. The last matching kind wins.
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
    /// Name in the file, or a generated one.
    pub name: String,
    /// The kind that kernels render.
    pub kind: &'static MaterialKind,
    /// Parameters specific to the kind, named by [`MaterialKind::parameters`].
    pub parameters: Vec<f32>,
    /// Linear RGB reflectance or tint in [0, 1]; multiplied by the texture if there is one.
    pub base_color: Vec3,
    /// Multiplier of the base colour.
    pub base_color_texture: Option<TextureUse>,
    /// Multiplier of a principled material's roughness (green) and metalness (blue).
    pub metallic_roughness_texture: Option<TextureUse>,
    /// Normal map, in the texture's tangent frame.
    pub normal_texture: Option<TextureUse>,
    /// Multiplier of the emission.
    pub emission_texture: Option<TextureUse>,
    /// Alpha mask of the surface.
    pub mask: Option<AlphaMask>,
    /// Emitted radiance, linear RGB.
    pub emission: Vec3,
    /// True if both sides emit; false if only the side from which the corners turn
    /// counter-clockwise does (glTF without `doubleSided`).
    pub emits_both_sides: bool,
    /// Other properties in the file.
    pub source: MaterialSource,
}

impl Material {
    /// A material of this kind and look.
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

    /// The material that `file` describes, of one of these kinds, without texture and emission. If
    /// it would reflect more than arrives, it is scaled down, with a warning.
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

    /// Textures in the kernels' order: base colour, metalness and roughness, normal, emission.
    pub fn texture_uses(&self) -> [Option<TextureUse>; 4] {
        [
            self.base_color_texture,
            self.metallic_roughness_texture,
            self.normal_texture,
            self.emission_texture,
        ]
    }

    /// [`Self::texture_uses`] plus the mask, mutable.
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

    /// The material emitting `radiance` (linear RGB) from both sides.
    pub fn emitting(self, radiance: Vec3) -> Self {
        Self {
            emission: radiance,
            emits_both_sides: true,
            ..self
        }
    }

    /// The material emitting `radiance` (linear RGB) from the counter-clockwise side only.
    pub fn emitting_from_front(self, radiance: Vec3) -> Self {
        Self {
            emission: radiance,
            emits_both_sides: false,
            ..self
        }
    }
}

/// Properties in the file beyond what [`MaterialKind`] renders, preserved for later use. Absent
/// values are `None`, never a default.
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
    /// Fraction of light left after passing through the body (MTL `Tf`).
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

/// File formats that describe materials, each with its own rules.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Wavefront MTL.
    Mtl,
    /// glTF 2.0.
    Gltf,
}

/// A file's description of a material, for kinds to recognise.
pub struct Description<'a> {
    /// The format of the file.
    pub format: Format,
    /// MTL `Kd`, glTF base or diffuse colour.
    pub base_color: Vec3,
    /// True if a texture scales metalness, roughness or transmission.
    pub is_varied: bool,
    /// True if the metalness and roughness texture will be present.
    pub is_followed: bool,
    /// Other properties.
    pub source: &'a MaterialSource,
}

/// A description as rendered by one kind.
pub struct Look {
    /// Linear RGB reflectance or tint.
    pub base_color: Vec3,
    /// Parameters, named by [`MaterialKind::parameters`].
    pub parameters: Vec<f32>,
    /// Largest reflected fraction of the description. If above 1, colours are divided by it.
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

    /// Two colours that reflect together; the second is the first three parameters.
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

/// Deviations from 1 below this are rounding.
const ROUNDING: f32 = 1e-4;

/// `x` clamped to these bounds; the lower one for NaN.
pub(crate) fn within(x: f32, least: f32, most: f32) -> f32 {
    if x.is_nan() {
        least
    } else {
        x.clamp(least, most)
    }
}

/// Makes a colour finite and within [0, 1].
pub(super) fn reflectance(color: Vec3) -> Vec3 {
    Vec3::select(color.is_finite_mask(), color, Vec3::ZERO).clamp(Vec3::ZERO, Vec3::ONE)
}

/// Makes a colour finite and non-negative.
pub(super) fn emitted(color: impl Into<Vec3>) -> Vec3 {
    let color = color.into();
    Vec3::select(color.is_finite_mask(), color, Vec3::ZERO).max(Vec3::ZERO)
}
