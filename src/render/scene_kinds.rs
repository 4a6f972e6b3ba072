//! The kinds of materials or lights of a scene, ordered by their kernel numbers: the built-in ones,
//! then external ones, whose tables are generated here.

use raystone_core::params::Sources;
use raystone_gpu::Composition;
use raystone_scene::{DIFFUSE, LIGHT_KINDS, LightKind, Lobes, MATERIAL_KINDS, MaterialKind};

/// The interface of kinds for their tables.
pub trait SceneKind: PartialEq + Sized + 'static {
    /// All built-in kinds.
    fn built_in() -> &'static [&'static Self];
    /// The feature that enables it in kernels; `None` if always enabled.
    fn feature(&self) -> Option<&'static str>;
    /// Its own kernel modules.
    fn sources(&self) -> Sources;
    /// The feature of kernels with external kinds, its module, and their table with these numbers.
    fn table(others: &[(usize, &'static Self)]) -> (&'static str, &'static str, String);
}

/// The kinds, each with `true` if the scene uses it; the index is the number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SceneKinds<K: 'static>(Vec<(&'static K, bool)>);

/// The built-in kinds, none of them in use.
impl<K: SceneKind> Default for SceneKinds<K> {
    fn default() -> Self {
        Self(K::built_in().iter().map(|kind| (*kind, false)).collect())
    }
}

impl<K: SceneKind> SceneKinds<K> {
    pub(super) fn of(used: impl Iterator<Item = &'static K>) -> Self {
        let mut kinds = Self::default();
        for kind in used {
            match kinds.0.iter_mut().find(|(known, _)| *known == kind) {
                Some((_, is_there)) => *is_there = true,
                None => kinds.0.push((kind, true)),
            }
        }
        kinds
    }

    pub(super) fn count(&self) -> usize {
        self.0.len()
    }

    pub(super) fn kind(&self, number: usize) -> &'static K {
        self.0[number].0
    }

    pub(super) fn number(&self, kind: &K) -> u32 {
        let place = self.0.iter().position(|(known, _)| *known == kind);
        place.unwrap_or_default() as u32
    }

    /// Numbers of the kinds in use.
    pub(super) fn present(&self) -> impl Iterator<Item = usize> {
        (0..self.0.len()).filter(|number| self.0[*number].1)
    }

    /// True if more than one is in use.
    pub(super) fn are_several(&self) -> bool {
        self.present().count() > 1
    }

    /// Features, and whether they are enabled.
    pub(super) fn flags(&self) -> impl Iterator<Item = (&'static str, bool)> {
        let flag = |(kind, there): &(&'static K, bool)| Some((kind.feature()?, *there));
        self.0.iter().filter_map(flag)
    }

    /// The kernel with the external kinds: their table and modules.
    pub(super) fn activate(&self, mut kernel: Composition) -> Composition {
        let others = self.0.iter().map(|(kind, _)| *kind).enumerate();
        let others: Vec<_> = others.skip(K::built_in().len()).collect();
        if others.is_empty() {
            return kernel;
        }
        for (name, text) in others.iter().flat_map(|(_, kind)| kind.sources()) {
            kernel = kernel.bringing(name, *text);
        }
        let (feature, module, table) = K::table(&others);
        kernel.feature(feature, true).bringing(module, table)
    }
}

impl SceneKind for LightKind {
    fn built_in() -> &'static [&'static Self] {
        &LIGHT_KINDS
    }

    fn feature(&self) -> Option<&'static str> {
        Some(self.feature)
    }

    fn sources(&self) -> Sources {
        self.sources
    }

    /// The table for `kernels/shading/lights.wesl`.
    fn table(others: &[(usize, &'static Self)]) -> (&'static str, &'static str, String) {
        let import = |(_, kind): &(usize, &Self)| {
            let name = kind.feature;
            format!("import package::shading::light::{name}::{name}_sample;\n")
        };
        let answer = |(number, kind): &(usize, &Self)| {
            let answer = format!("{}_sample(light, surface, point)", kind.feature);
            format!("if (light.kind == {number}u) {{ return {answer}; }}\n")
        };
        let imports: String = others.iter().map(import).collect();
        let answers: String = others.iter().map(answer).collect();
        let table = format!(
            "import package::shading::light::sample::{{LightSample, dark}};
import package::shading::light::table::Light;
import package::shading::surface::Surface;
{imports}
fn other_light_sample(light: Light, surface: Surface, point: vec2<f32>) -> LightSample {{
{answers}return dark();
}}
"
        );
        ("other_lights", "active/lights", table)
    }
}

impl SceneKind for MaterialKind {
    fn built_in() -> &'static [&'static Self] {
        &MATERIAL_KINDS
    }

    fn feature(&self) -> Option<&'static str> {
        (self != &DIFFUSE).then_some(self.feature)
    }

    fn sources(&self) -> Sources {
        self.sources
    }

    /// The table for `kernels/shading/bsdf.wesl`.
    fn table(others: &[(usize, &'static Self)]) -> (&'static str, &'static str, String) {
        let import = |(_, kind): &(usize, &Self)| {
            let name = kind.feature;
            let one = |what| {
                format!("@if({name}) import package::shading::bsdf::{name}::{name}_{what};\n")
            };
            let is_delta = kind.lobes == Lobes::Delta;
            one("sample")
                + &if is_delta {
                    String::new()
                } else {
                    one("scattering")
                }
        };
        let function = |head: &str, of: &[Lobes], answer: &str, other: &str| {
            let asked = others.iter().filter(|(_, kind)| of.contains(&kind.lobes));
            let line = |(number, kind): &(usize, &Self)| {
                let (name, answer) = (kind.feature, answer.replace("KIND", kind.feature));
                format!("@if({name}) if (is_of(surface, {number}u)) {{ return {answer}; }}\n")
            };
            let lines: String = asked.map(line).collect();
            format!("fn other_{head} {{\n{lines}return {other};\n}}\n")
        };
        let [diffuse, glossy, delta] = [Lobes::Diffuse, Lobes::Glossy, Lobes::Delta];
        let table = [
            "import package::shading::bsdf::{BsdfSample, is_of};
import package::shading::bsdf::diffuse::diffuse_sample;
import package::shading::bsdf::lobes::{NOTHING, Scattering};
import package::shading::surface::Surface;
"
            .to_owned(),
            others.iter().map(import).collect(),
            function(
                "is_there(surface: Surface) -> bool",
                &[diffuse, glossy, delta],
                "true",
                "false",
            ),
            function(
                "is_delta(surface: Surface) -> bool",
                &[delta],
                "true",
                "false",
            ),
            function(
                "is_glossy(surface: Surface) -> bool",
                &[glossy],
                "true",
                "false",
            ),
            function(
                "scattering(surface: Surface, direction: vec3<f32>) -> Scattering",
                &[diffuse, glossy],
                "KIND_scattering(surface, direction)",
                "NOTHING",
            ),
            function(
                "sample(surface: Surface, u: vec2<f32>) -> BsdfSample",
                &[diffuse, glossy, delta],
                "KIND_sample(surface, u)",
                "diffuse_sample(surface, u)",
            ),
        ];
        ("other_materials", "active/materials", table.concat())
    }
}
