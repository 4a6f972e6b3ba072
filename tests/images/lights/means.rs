//! Light selection changes an image's noise, not its mean.

use super::density::sky;
use super::{estimate, path_with};
use crate::support::*;
use glam::Vec3;
use raystone::gpu::Gpu;
use raystone::params::ParamValue;
use raystone::scene::{Light, SceneData};

/// Lights of all kinds except those from files.
fn mixed() -> SceneData {
    let mut scene = builtin("many-lights", &[("lamps", ParamValue::Integer(6))]);
    scene.lights = vec![
        Light::Sphere {
            center: Vec3::new(2.0, 1.5, 3.0),
            radius: 0.4,
            radiance: Vec3::splat(20.0),
        },
        Light::Point {
            position: Vec3::new(-2.0, 2.0, 3.0),
            intensity: Vec3::new(5.0, 9.0, 7.0),
        },
        Light::Spot {
            position: Vec3::new(0.0, 3.0, 6.0),
            direction: Vec3::new(0.1, -1.0, -0.3),
            intensity: Vec3::splat(30.0),
            inner: 0.3,
            outer: 0.7,
            decay: true,
        },
        Light::Directional {
            direction: Vec3::new(1.0, -2.0, -0.5),
            irradiance: Vec3::new(0.5, 0.4, 0.3),
        },
        sky(),
    ];
    scene
}

fn image(gpu: &Gpu, scene: &SceneData, choice: &str, lights: &str) -> Estimate {
    let what = path_with(3, &[("light_choice", choice), ("lights", lights)]);
    estimate(gpu, scene, scene.camera.expect("a camera"), &what, 384)
}

pub fn fault(gpu: &Gpu, choice: &str, lights: &str, right: &Estimate) -> Option<String> {
    let found = image(gpu, &mixed(), choice, lights);
    let difference = found.minus(right);
    (!(difference.agrees_with(0.0) && difference.error < 0.01 * right.mean))
        .then(|| format!("{choice}, {lights}: {found:?}, not {right:?}"))
}

/// The mean used as reference.
pub fn right() -> Estimate {
    image(gpu(), &mixed(), "power", "one")
}

#[test]
fn every_choice_of_lights_has_the_same_mean() {
    let right = right();
    let choices = ["power", "uniform", "tree"].into_iter();
    let all = choices.flat_map(|choice| ["one", "all"].map(|lights| (choice, lights)));
    for (choice, lights) in in_turn("choices of lights", all) {
        assert_eq!(fault(gpu(), choice, lights, &right), None);
    }
}

#[test]
fn a_tree_has_less_noise_than_a_choice_by_power_where_lights_are_many() {
    let scene = builtin("many-lights", &[]);
    let error = |choice| image(gpu(), &scene, choice, "one").error;
    let [power, tree] = ["power", "tree"].map(error);
    println!("standard error by power {power:.3e}, by the tree {tree:.3e}");
    assert!(tree < power, "{tree} by the tree, {power} by power");
}
