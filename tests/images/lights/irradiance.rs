//! Radiance of a grey floor below a lamp: irradiance times 0.5/π.

use super::closed::{LAMPS, PLACES, irradiance};
use super::{estimate, lamp, path_with, towards};
use crate::support::*;
use glam::Vec3;
use raystone::gpu::Gpu;
use raystone::scene::{Light, SceneData};
use std::f64::consts::PI;

pub fn fault(gpu: &Gpu, kind: &str, strategy: &str) -> Option<String> {
    let scene = lamp(kind);
    let what = path_with(1, &[("strategy", strategy)]);
    PLACES.iter().find_map(|place| {
        let expected = irradiance(kind, *place) * 0.5 / PI;
        let found = estimate(gpu, &scene, towards(*place), &what, 256);
        let is_exact = found.error <= 1e-3 * expected.max(1e-3);
        let agrees = (found.mean - expected).abs() <= 5.0 * found.error + 1e-4 * expected;
        (!(is_exact && agrees))
            .then(|| format!("{kind} at {place:?}, {strategy}: {found:?}, not {expected}"))
    })
}

#[test]
fn a_floor_below_every_kind_of_lamp_has_its_closed_form() {
    for kind in LAMPS {
        for strategy in ["mis-balance", "light"] {
            assert_eq!(fault(gpu(), kind, strategy), None);
        }
    }
}

fn radiance(scene: &SceneData, place: [f64; 2]) -> f64 {
    let what = path_with(1, &[("lights", "all")]);
    estimate(gpu(), scene, towards(place), &what, 64).mean
}

#[test]
fn a_sphere_is_seen_casts_a_shadow_and_shines_inside() {
    let mut scene = lamp("sphere");
    let mut above = towards([0.0, 0.0]);
    (above.eye, above.target, above.up) = (Vec3::Y, 2.0 * Vec3::Y, Vec3::X);
    let what = path_with(1, &[]);
    let seen = estimate(gpu(), &scene, above, &what, 4);
    assert!((seen.mean - 10.0).abs() < 1e-4, "{seen:?}");
    // A point behind the sphere shines past it, but not through it.
    let behind = Light::Point {
        position: Vec3::new(0.0, 2.5, 0.0),
        intensity: Vec3::splat(1000.0),
    };
    let [below, beside] = [[0.0, 0.0], [1.9, 0.0]].map(|place| radiance(&scene, place));
    scene.lights.push(behind);
    let [below_too, beside_too] = [[0.0, 0.0], [1.9, 0.0]].map(|place| radiance(&scene, place));
    assert!(
        (below_too / below - 1.0).abs() < 0.02,
        "{below_too}, {below}"
    );
    assert!(beside_too > 10.0 * beside, "{beside_too}, {beside}");
    // From inside all directions above the floor see it: π times its radiance.
    scene.lights = vec![Light::Sphere {
        center: Vec3::new(0.5, 1.0, 0.0),
        radius: 10.0,
        radiance: Vec3::ONE,
    }];
    for strategy in ["mis-balance", "light", "bsdf"] {
        let what = path_with(1, &[("strategy", strategy)]);
        let found = estimate(gpu(), &scene, towards([0.0, 0.0]), &what, 256);
        // The eye is inside, too, and sees the floor first.
        assert!(
            found.agrees_with(0.5) && found.error < 3e-3,
            "{strategy}: {found:?}"
        );
    }
}

#[test]
fn a_lamp_that_emits_in_front_alone_is_dark_behind() {
    let mut scene = lamp("rectangle");
    let mut above = towards([0.0, 0.0]);
    (above.eye, above.target, above.up) = (3.0 * Vec3::Y, 2.0 * Vec3::Y, Vec3::X);
    let what = path_with(1, &[]);
    let behind = |scene: &SceneData| estimate(gpu(), scene, above, &what, 4).mean;
    assert_eq!(behind(&scene), 0.0);
    scene.materials[1].emits_both_sides = true;
    assert_eq!(behind(&scene), 10.0);
}

#[test]
fn a_spot_without_decay_is_as_bright_at_any_distance() {
    let mut scene = lamp("spot");
    for height in [1.0_f32, 4.0] {
        scene.lights = vec![Light::Spot {
            position: height * Vec3::Y,
            direction: Vec3::NEG_Y,
            intensity: Vec3::splat(3.0),
            inner: 0.3,
            outer: 0.5,
            decay: false,
        }];
        let expected = 3.0 * 0.5 / PI;
        assert!((radiance(&scene, [0.0, 0.0]) / expected - 1.0).abs() < 1e-4);
    }
}

#[test]
fn shadow_rays_to_where_no_light_comes_from_are_skipped() {
    let count = |scene: &SceneData| {
        let mut scene = scene.clone();
        scene.camera = Some(towards([1.9, 1.9]));
        let stage = Stage::new(gpu(), scene);
        let traced = stage.traced(gpu(), structure("bvh"));
        let sampler = sampler("pixel-hash", "none");
        let renderer = stage.renderer(gpu(), &traced, &sampler, &path_with(1, &[]), [8, 8], true);
        renderer.render(&[4], 4).expect("a render");
        let [_, shadow, _, _, skipped] = renderer.ray_counts().expect("counts");
        (shadow, skipped)
    };
    let mut scene = lamp("spot");
    assert_eq!(count(&scene), (0, 256), "outside of the cone");
    scene = lamp("point");
    assert_eq!(count(&scene), (256, 0));
    scene.lights = vec![Light::Point {
        position: Vec3::NEG_Y,
        intensity: Vec3::ONE,
    }];
    assert_eq!(count(&scene), (0, 256), "behind the surface");
    scene = lamp("rectangle");
    scene.triangles[2..]
        .iter_mut()
        .for_each(|t| t.vertices.swap(0, 1));
    assert_eq!(count(&scene), (0, 256), "dark on this side");
}
