//! The kinds of lights of a scene in the order of their numbers in kernels: those of the program, then those that the scene brings
//! from outside.

use raystone_gpu::Composition;
use raystone_scene::{LIGHT_KINDS, LightKind, LightList, SceneData};
use std::fmt::Write as _;

/// The feature of kernels that ask the table of kinds from outside, and its module.
const OTHERS: (&str, &str) = ("other_lights", "active/lights");

/// The kinds, each with whether some light is of it; a place is a number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SceneLightKinds(Vec<(&'static LightKind, bool)>);

/// Those of the program, none of which is there.
impl Default for SceneLightKinds {
    fn default() -> Self {
        Self(LIGHT_KINDS.map(|kind| (kind, false)).into())
    }
}

impl SceneLightKinds {
    /// The kinds of these lights of a scene.
    pub(super) fn of(scene: &SceneData, list: &LightList) -> Self {
        let mut kinds = Self::default();
        for kind in list.lights.iter().map(|light| light.kind(scene)) {
            match kinds.0.iter_mut().find(|(known, _)| *known == kind) {
                Some((_, is_there)) => *is_there = true,
                None => kinds.0.push((kind, true)),
            }
        }
        kinds
    }

    /// The number of a kind.
    pub(super) fn number(&self, kind: &LightKind) -> u32 {
        let place = self.0.iter().position(|(known, _)| *known == kind);
        place.unwrap_or_default() as u32
    }

    /// Whether some light is of the kind of this name.
    pub(super) fn has(&self, name: &str) -> bool {
        self.0
            .iter()
            .any(|(kind, there)| *there && kind.name == name)
    }

    /// Features, with whether they are on.
    pub(super) fn flags(&self) -> impl Iterator<Item = (&'static str, bool)> {
        self.0.iter().map(|(kind, there)| (kind.feature, *there))
    }

    /// Whether there is more than one.
    pub(super) fn are_several(&self) -> bool {
        self.0.iter().filter(|(_, there)| *there).count() > 1
    }

    /// The kernel with the kinds from outside: their table, as `kernels/shading/lights.wesl` asks it, and the modules that they bring.
    pub(super) fn activate(&self, mut kernel: Composition) -> Composition {
        let (feature, module) = OTHERS;
        let others = || self.0.iter().enumerate().skip(LIGHT_KINDS.len());
        if others().next().is_none() {
            return kernel;
        }
        let mut table = "import package::shading::light::sample::{LightSample, dark};
import package::shading::light::table::Light;
import package::shading::surface::Surface;
"
        .to_owned();
        let mut answers = String::new();
        for (number, (kind, _)) in others() {
            let name = kind.feature;
            let _ = writeln!(
                table,
                "import package::shading::light::{name}::{name}_sample;"
            );
            let _ = writeln!(
                answers,
                "if (light.kind == {number}u) {{ return {name}_sample(light, surface, point); }}"
            );
            for (module, text) in kind.sources {
                kernel = kernel.bringing(module, *text);
            }
        }
        let head = "fn other_light_sample(light: Light, surface: Surface, point: vec2<f32>)";
        let _ = writeln!(
            table,
            "{head} -> LightSample {{\n{answers}return dark();\n}}"
        );
        kernel.feature(feature, true).bringing(module, table)
    }
}
