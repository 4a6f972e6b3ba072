//! Procedural scenes without files, bit-exact on every platform.
//!
//! A new scene is one file here and one line in `BUILTINS`.

mod caustics;
mod city;
mod cornell_box;
mod displaced_sphere;
mod far_corners;
mod foliage;
mod furnace;
mod hairball;
mod instances;
mod lamps;
mod media;
pub(super) mod numeric;
mod single_triangle;
mod sphere;
mod teapot_in_a_stadium;
mod teapot_patches;
mod triangle_soup;

use super::builder::{Look, SceneBuilder};
use super::{SceneData, SceneError, common_parameters};
use raystone_core::params::{Entry, ParamError, ParameterSchema, Parameters, Params, Variant};

/// A built-in scene: its parameter struct.
trait BuiltinScene: Parameters {
    /// Name as typed.
    const NAME: &'static str;
    /// One-line description.
    const DESCRIPTION: &'static str;

    /// Returns triangles and look.
    fn build(&self) -> (SceneBuilder, Look);
}

struct Builtin {
    name: &'static str,
    description: &'static str,
    schema: fn() -> ParameterSchema,
    build: fn(&Params) -> Result<(SceneBuilder, Look), ParamError>,
}

impl Builtin {
    const fn of<S: BuiltinScene>() -> Self {
        Self {
            name: S::NAME,
            description: S::DESCRIPTION,
            schema: S::schema,
            build: |params| Ok(S::from_params(params)?.build()),
        }
    }
}

const BUILTINS: [Builtin; 18] = [
    Builtin::of::<cornell_box::CornellBox>(),
    Builtin::of::<displaced_sphere::DisplacedSphere>(),
    Builtin::of::<triangle_soup::TriangleSoup>(),
    Builtin::of::<teapot_in_a_stadium::TeapotInAStadium>(),
    Builtin::of::<instances::Instances>(),
    Builtin::of::<furnace::FurnaceBox>(),
    Builtin::of::<furnace::WhiteFurnace>(),
    Builtin::of::<single_triangle::SingleTriangle>(),
    Builtin::of::<far_corners::FarCorners>(),
    Builtin::of::<lamps::LampScene>(),
    Builtin::of::<lamps::Luminaire>(),
    Builtin::of::<lamps::ManyLights>(),
    Builtin::of::<foliage::Foliage>(),
    Builtin::of::<hairball::Hairball>(),
    Builtin::of::<city::City>(),
    Builtin::of::<media::Fog>(),
    Builtin::of::<media::Cloud>(),
    Builtin::of::<caustics::Caustics>(),
];

/// The built-in scenes and their parameters, for the parser, lists and docs.
pub fn builtin_scenes() -> Vec<Entry> {
    BUILTINS
        .iter()
        .map(|scene| Entry {
            name: scene.name.to_owned(),
            description: scene.description.to_owned(),
            schema: (scene.schema)()
                .into_iter()
                .chain(common_parameters())
                .collect(),
        })
        .collect()
}

/// The built-in scene named by `variant`, if any.
pub(super) fn build(variant: &Variant) -> Option<Result<SceneData, SceneError>> {
    let scene = BUILTINS.iter().find(|scene| scene.name == variant.name)?;
    let built = (scene.build)(&variant.params).map_err(SceneError::from);
    Some(built.and_then(|(builder, look)| builder.finish(&variant.name, look)))
}

/// Suggestions for `name`: the nearest built-in name, or all of them.
pub(super) fn hint(name: &str) -> String {
    let nearest = BUILTINS
        .iter()
        .map(|scene| (strsim::damerau_levenshtein(scene.name, name), scene.name))
        .min()
        .filter(|(distance, _)| *distance <= 3);
    match nearest {
        Some((_, nearest)) => format!("did you mean `{nearest}`?"),
        None => {
            let names: Vec<_> = BUILTINS.iter().map(|scene| scene.name).collect();
            format!(
                "built-in scenes are {}; a file ends in .obj, .gltf, .glb, .ply or .xml (Nori)",
                names.join(", ")
            )
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::medium::MediumParameters;
    use crate::{LoadOptions, SceneError, load};
    use raystone_core::params::{ParamRange, ParamValue};
    use std::collections::{BTreeMap, HashMap};

    /// A built-in scene with some parameters changed from their defaults.
    pub(crate) fn load_with(name: &str, changes: &[(&str, ParamValue)]) -> SceneData {
        try_load_with(name, changes).unwrap()
    }

    /// A one-triangle model without light, with these common parameters.
    pub(crate) fn load_unlit(changes: &[(&str, ParamValue)]) -> SceneData {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("unlit.obj");
        std::fs::write(&path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
        let changes = changes
            .iter()
            .map(|(key, v)| ((*key).to_owned(), v.clone()));
        let name = path.to_str().unwrap().to_owned();
        let variant = Variant {
            label: name.clone(),
            name,
            params: Params(changes.collect()),
        };
        load(&variant, &LoadOptions::default()).unwrap()
    }

    /// [`load_with`] for a scene that may not exist.
    pub(crate) fn try_load_with(
        name: &str,
        changes: &[(&str, ParamValue)],
    ) -> Result<SceneData, SceneError> {
        let entries = builtin_scenes();
        let entry = entries.iter().find(|entry| entry.name == name).unwrap();
        let defaults = entry.schema.iter();
        let mut params: BTreeMap<_, _> = defaults
            .map(|p| (p.name.to_owned(), p.default.clone()))
            .collect();
        for (key, value) in changes {
            *params.get_mut(*key).unwrap() = value.clone();
        }
        let variant = Variant {
            name: name.to_owned(),
            params: Params(params),
            label: name.to_owned(),
        };
        load(&variant, &LoadOptions::default())
    }

    pub(crate) fn load_default(name: &str) -> SceneData {
        load_with(name, &[])
    }

    /// True if every edge is used once in each direction: closed and consistently oriented.
    pub(crate) fn is_closed(scene: &SceneData) -> bool {
        let mut balance: HashMap<[[u32; 3]; 2], i32> = HashMap::new();
        let key = |v: glam::Vec3| v.to_array().map(f32::to_bits);
        for triangle in &scene.triangles {
            for k in 0..3 {
                let (a, b) = (
                    key(triangle.vertices[k]),
                    key(triangle.vertices[(k + 1) % 3]),
                );
                *balance.entry([a, b]).or_default() += 1;
                *balance.entry([b, a]).or_default() -= 1;
            }
        }
        balance.values().all(|n| *n == 0)
    }

    #[test]
    fn every_built_in_scene_loads_with_its_defaults_and_is_deterministic() {
        let mut hashes = Vec::new();
        for entry in builtin_scenes() {
            let scene = load_default(&entry.name);
            assert_eq!(scene.hash, load_default(&entry.name).hash);
            assert!(scene.report.warnings.is_empty(), "{}", entry.name);
            assert_eq!(scene.report.zero_area, 0, "{}", entry.name);
            assert_eq!(scene.triangles.len(), scene.material_ids.len());
            let materials = scene.materials.len() as u32;
            assert!(scene.material_ids.iter().all(|id| *id < materials));
            hashes.push(scene.hash);
        }
        assert!(!hashes.is_empty());
        hashes.sort();
        hashes.dedup();
        assert_eq!(hashes.len(), BUILTINS.len());
    }

    #[test]
    fn every_numeric_parameter_changes_the_scene_and_works_at_its_least_value() {
        let mut parameters = 0;
        for entry in builtin_scenes() {
            for parameter in &entry.schema {
                let least = match parameter.range {
                    ParamRange::Integer { min, .. } => ParamValue::Integer(min),
                    ParamRange::Number { min, .. } => ParamValue::Number(min),
                    _ => continue,
                };
                if least == parameter.default {
                    continue;
                }
                // Those of the medium say nothing where there is none.
                let of_medium = MediumParameters::schema();
                let cloud = ("medium", ParamValue::Name("cloud".to_owned()));
                let cloud = of_medium
                    .iter()
                    .any(|p| p.name == parameter.name)
                    .then_some(cloud);
                // The box of a scene may be flat.
                let corners = [-1.0, -1.0, -1.0, 1.0, 1.0, 1.0].map(ParamValue::Number);
                let corners = ("medium_box", ParamValue::List(corners.to_vec()));
                let corners = cloud.as_ref().map(|_| corners);
                let base: Vec<_> = cloud.into_iter().chain(corners).collect();
                let changed = [&base[..], &[(parameter.name, least)]].concat();
                let scene = load_with(&entry.name, &changed);
                assert_ne!(scene.hash, load_with(&entry.name, &base).hash);
                parameters += 1;
            }
        }
        assert!(parameters >= 5);
    }

    #[test]
    fn an_unknown_name_is_answered_with_the_nearest_one() {
        assert_eq!(hint("cornel-box"), "did you mean `cornell-box`?");
        assert!(hint("something else entirely").contains("triangle-soup"));
    }
}
