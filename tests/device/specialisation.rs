//! Kernels without features that a scene does not need give bit-identical images.

use crate::support::*;
use glam::Vec3;
use raystone::integrator::Renderer;
use raystone::measure::trial_scenes::trial_scenes;
use raystone::params::ParamValue;
use raystone::scene::{EnvironmentMap, Light, Material, SceneData};
use std::sync::Arc;

const GROUPS: [&str; 7] = [
    "materials",
    "textures",
    "normals",
    "lights",
    "choice",
    "background",
    "transforms",
];

type Changes<'a> = Vec<(&'a str, ParamValue)>;

fn word<'a>(key: &'a str, value: &str) -> (&'a str, ParamValue) {
    (key, ParamValue::Name(value.to_owned()))
}

/// A kernel's image, the features it was compiled with and without, and its hash.
struct Rendered {
    bits: Vec<[u32; 3]>,
    features: Vec<String>,
    left_out: Vec<String>,
    kernel: String,
}

fn rendered(stage: &Stage, changes: &Changes, carry: &str) -> Rendered {
    let mut changes = changes.clone();
    changes.push(word("carry", carry));
    let what = integrator_variant("path", &changes);
    let traced = stage.traced(gpu(), structure("brute-force"));
    let sampler = sampler("pixel-hash", "none");
    let renderer: Renderer = stage.renderer(gpu(), &traced, &sampler, &what, [24, 16], false);
    let shots = renderer.render(&[8], 5).expect("a render");
    let image = &shots.last().expect("a snapshot").image;
    Rendered {
        bits: image.pixels.iter().map(|p| p.map(f32::to_bits)).collect(),
        features: renderer.features(),
        left_out: renderer.left_out(),
        kernel: renderer.kernel_hash(),
    }
}

/// Pixels in which kernels with these groups differ from the specialised one.
fn differing(stage: &Stage, changes: &Changes, carried: &[&str]) -> Vec<String> {
    let plain = rendered(stage, changes, "none");
    let mut wrong = Vec::new();
    for carry in carried {
        let full = rendered(stage, changes, carry);
        let differ = plain.bits.iter().zip(&full.bits);
        let differ = differ.filter(|(a, b)| a != b).count();
        if differ > 0 {
            wrong.push(format!("{}, {carry}: {differ} pixels", stage.scene.name));
        }
        if *carry == "all" {
            assert_eq!(full.left_out, Vec::<String>::new());
        }
        let gained = |name: &&String| !full.left_out.contains(name);
        let gained: Vec<&String> = plain.left_out.iter().filter(gained).collect();
        let has = |name: &&&String| full.features.contains(**name);
        assert!(gained.iter().all(|name| has(&name)), "{gained:?}");
        // Estimators that choose no light carry no choice.
        let same = plain.kernel == full.kernel;
        assert!(same == gained.is_empty() || !changes.is_empty(), "{carry}");
    }
    wrong
}

/// A grey floor under an environment map, alone or with a lamp.
fn under_a_map(lamp: bool) -> SceneData {
    let mut scene = builtin("lamp", &[word("kind", "rectangle")]);
    if !lamp {
        for material in &mut scene.materials {
            *material = Material::diffuse("grey", material.base_color);
        }
    }
    let texel = |i: u32| Vec3::new(0.1 + (i % 5) as f32, 0.3 + (i % 3) as f32, 0.5);
    let map = EnvironmentMap::new(
        "a map",
        [8, 4],
        (0..32).map(texel).collect(),
        &mut Vec::new(),
    );
    scene.lights.push(Light::Environment {
        map: Arc::new(map.expect("a map")),
        scale: 1.5,
        turn: 0.4,
    });
    scene.name = format!("map, lamp: {lamp}");
    scene
}

/// Scenes that need little, much, and each kind of light.
fn scenes() -> Vec<SceneData> {
    let mut scenes: Vec<SceneData> = ["displaced-sphere", "white-furnace", "far-corners"]
        .map(|name| match name {
            "displaced-sphere" => builtin(name, &[("triangles", ParamValue::Integer(64))]),
            _ => builtin(name, &[]),
        })
        .into();
    let kinds = [
        "rectangle",
        "disk",
        "sphere",
        "point",
        "spot",
        "directional",
    ];
    scenes.extend(kinds.map(|kind| builtin("lamp", &[word("kind", kind)])));
    scenes.extend([false, true].map(under_a_map));
    let trials = trial_scenes().expect("scenes");
    scenes.extend(trials.into_iter().map(|trial| trial.scene));
    scenes
}

#[test]
fn the_full_kernel_gives_the_image_of_the_specialised_one_on_every_scene() {
    if !is_exact(gpu()) {
        return;
    }
    let mut wrong = Vec::new();
    for scene in in_turn("scenes of full kernels", scenes()) {
        let stage = Stage::new(gpu(), scene);
        wrong.extend(differing(&stage, &Vec::new(), &["all"]));
    }
    assert_eq!(wrong, Vec::<String>::new());
}

#[test]
fn each_group_alone_changes_no_image_with_any_estimator() {
    if !is_exact(gpu()) {
        return;
    }
    let stage = Stage::builtin(gpu(), "cornell-box", &[]);
    let mut wrong = differing(&stage, &Vec::new(), &GROUPS);
    let estimators: [Changes; 4] = [
        vec![word("strategy", "light"), word("light_choice", "uniform")],
        vec![word("strategy", "bsdf")],
        vec![word("strategy", "mis-power"), word("light_choice", "tree")],
        vec![word("lights", "all")],
    ];
    let under_map = Stage::new(gpu(), under_a_map(false));
    for changes in in_turn("estimators of full kernels", &estimators) {
        wrong.extend(differing(&stage, changes, &["choice", "all"]));
        wrong.extend(differing(&under_map, changes, &["all"]));
    }
    assert_eq!(wrong, Vec::<String>::new());
}

#[test]
fn a_scene_that_needs_nothing_has_a_kernel_without_it_all() {
    let stage = Stage::builtin(gpu(), "cornell-box", &[]);
    let plain = rendered(&stage, &Vec::new(), "none");
    for needed in ["lights", "rectangle_lights"] {
        assert!(plain.features.iter().any(|name| name == needed), "{needed}");
    }
    for needless in [
        "many_lights",
        "textures",
        "normals",
        "background",
        "transforms",
        "phong",
    ] {
        assert!(
            plain.left_out.iter().any(|name| name == needless),
            "{needless}"
        );
    }
}
