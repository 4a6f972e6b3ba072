//! The kinds of materials of a scene in the order of their numbers in kernels: those of the program, then those that the scene
//! brings from outside.

use super::surface_tables::SurfaceFeatures;
use raystone_gpu::Composition;
use raystone_scene::{DIFFUSE, Lobes, MATERIAL_KINDS, MaterialKind, SceneData};
use std::fmt::Write as _;

/// The feature of kernels that ask the table of kinds from outside, and its module.
const OTHERS: (&str, &str) = ("other_materials", "active/materials");

/// A kind of material, and what of it a scene has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct KindInScene {
    /// The kind.
    pub kind: &'static MaterialKind,
    /// Whether some material is of it.
    pub is_there: bool,
    /// Textures of its materials, normals and colours of vertices.
    pub surfaces: SurfaceFeatures,
}

/// The kinds; a place is a number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SceneKinds(Vec<KindInScene>);

/// Those of the program, none of which is there.
impl Default for SceneKinds {
    fn default() -> Self {
        let none = |kind| KindInScene {
            kind,
            is_there: false,
            surfaces: SurfaceFeatures::default(),
        };
        Self(MATERIAL_KINDS.map(none).into())
    }
}

impl SceneKinds {
    /// The kinds of a scene.
    pub(super) fn of(scene: &SceneData) -> Self {
        let mut kinds = MATERIAL_KINDS.to_vec();
        for material in &scene.materials {
            if !kinds.contains(&material.kind) {
                kinds.push(material.kind);
            }
        }
        let in_scene = |kind| KindInScene {
            kind,
            is_there: scene.materials.iter().any(|m| m.kind == kind),
            surfaces: SurfaceFeatures::of(scene, |m| m.kind == kind),
        };
        Self(kinds.into_iter().map(in_scene).collect())
    }

    /// The kinds by number.
    pub fn numbered(&self) -> &[KindInScene] {
        &self.0
    }

    /// Numbers of the kinds that there are.
    pub(super) fn present(&self) -> impl Iterator<Item = usize> {
        (0..self.0.len()).filter(|number| self.0[*number].is_there)
    }

    /// The number of a kind.
    pub(super) fn number(&self, kind: &MaterialKind) -> u32 {
        let place = self.0.iter().position(|known| known.kind == kind);
        place.unwrap_or_default() as u32
    }

    /// Features, with whether they are on. Diffuse, which every kernel has, is none.
    pub(super) fn flags(&self) -> impl Iterator<Item = (&'static str, bool)> {
        let several = ("several_materials", self.present().count() > 1);
        let kinds = self.0.iter().filter(|known| known.kind != &DIFFUSE);
        kinds
            .map(|known| (known.kind.feature, known.is_there))
            .chain([several])
    }

    /// The kernel with the kinds from outside: their table, and the modules that they bring.
    pub(super) fn activate(&self, mut kernel: Composition) -> Composition {
        let Some(table) = self.table() else {
            return kernel;
        };
        let (feature, module) = OTHERS;
        for (name, text) in self.others().flat_map(|(_, kind)| kind.sources) {
            kernel = kernel.bringing(name, *text);
        }
        kernel.feature(feature, true).bringing(module, table)
    }

    fn others(&self) -> impl Iterator<Item = (usize, &'static MaterialKind)> {
        let all = self.0.iter().map(|known| known.kind).enumerate();
        all.skip(MATERIAL_KINDS.len())
    }

    /// The table of the kinds from outside, if there are any, as `kernels/shading/bsdf.wesl` asks it.
    fn table(&self) -> Option<String> {
        self.others().next()?;
        let mut table = "import package::shading::bsdf::{BsdfSample, is_of};
import package::shading::bsdf::diffuse::diffuse_sample;
import package::shading::bsdf::lobes::{NOTHING, Scattering};
import package::shading::surface::Surface;
"
        .to_owned();
        for (_, MaterialKind { feature, lobes, .. }) in self.others() {
            let module = format!("package::shading::bsdf::{feature}");
            let _ = writeln!(table, "@if({feature}) import {module}::{feature}_sample;");
            if *lobes != Lobes::Delta {
                let import = format!("import {module}::{feature}_scattering;");
                let _ = writeln!(table, "@if({feature}) {import}");
            }
        }
        let mut function = |head: &str, answers: &[Lobes], answer: &str, other: &str| {
            let _ = writeln!(table, "fn {head} {{");
            let asked = self.others().filter(|(_, k)| answers.contains(&k.lobes));
            for (number, MaterialKind { feature, .. }) in asked {
                let answer = answer.replace("KIND", feature);
                let is_of = format!("is_of(surface, {number}u)");
                let _ = writeln!(table, "@if({feature}) if ({is_of}) {{ return {answer}; }}");
            }
            let _ = writeln!(table, "return {other};\n}}");
        };
        let all = [Lobes::Diffuse, Lobes::Glossy, Lobes::Delta];
        function("is_other(surface: Surface) -> bool", &all, "true", "false");
        let delta = "other_is_delta(surface: Surface) -> bool";
        function(delta, &all[2..], "true", "false");
        let glossy = "other_is_glossy(surface: Surface) -> bool";
        function(glossy, &all[1..2], "true", "false");
        let scattering = "other_scattering(surface: Surface, direction: vec3<f32>) -> Scattering";
        let answer = "KIND_scattering(surface, direction)";
        function(scattering, &all[..2], answer, "NOTHING");
        let sample = "other_sample(surface: Surface, u: vec2<f32>) -> BsdfSample";
        let diffuse = "diffuse_sample(surface, u)";
        function(sample, &all, "KIND_sample(surface, u)", diffuse);
        Some(table)
    }
}
