//! Ray counts against numbers that follow from the scene.

use crate::support::*;
use raystone::accel::AccelKind;
use raystone::integrator::RAY_COUNT_CLASSES;
use raystone::params::{ParamValue, Variant};

const SIZE: [u32; 2] = [16, 16];
const SPP: u32 = 16;
const SAMPLES: u64 = 16 * 16 * SPP as u64;

/// Primary, shadow, AO, bounce and skipped rays of an image, equal for all `kinds` of structures.
fn counts(stage: &Stage, what: &Variant, kinds: &[&dyn AccelKind]) -> [u64; 5] {
    assert_eq!(
        RAY_COUNT_CLASSES,
        ["primary", "shadow", "ao", "bounce", "skipped"]
    );
    let sampler = sampler("pixel-hash", "none");
    let mut all = Vec::new();
    for kind in kinds {
        let traced = stage.traced(gpu(), *kind);
        let renderer = stage.renderer(gpu(), &traced, &sampler, what, SIZE, true);
        // Twice: a reset clears earlier counts.
        for _ in 0..2 {
            renderer.render(&[SPP], 4).expect("a render");
        }
        all.push(renderer.ray_counts().expect("counts"));
    }
    assert!(all.iter().all(|c| *c == all[0]), "{all:?}");
    all[0]
}

#[test]
fn a_closed_box_has_the_rays_that_its_bounces_ask_for() {
    let stage = Stage::builtin(gpu(), "furnace-box", &[("albedo", ParamValue::Number(0.8))]);
    let kinds = in_turn("structures that count rays", inline_structures());
    let [primary, shadow, ao, bounce, skipped] = counts(&stage, &path(3), &kinds);
    assert_eq!(shadow + skipped, 3 * SAMPLES);
    assert_eq!([primary, ao, bounce], [SAMPLES, 0, 3 * SAMPLES]);
    // One in six emitter points is on the surface's own wall, which needs no ray.
    let fraction = shadow as f64 / (3 * SAMPLES) as f64;
    let expected = 5.0 / 6.0;
    let error = (expected / 6.0 / (3 * SAMPLES) as f64).sqrt();
    assert!(
        (fraction - expected).abs() < 5.0 * error,
        "{fraction} of the draws cost a ray"
    );
    let [primary, shadow, ao, bounce, _] = counts(&stage, &integrator_variant("ao", &[]), &kinds);
    assert_eq!([primary, shadow, ao, bounce], [SAMPLES, 0, SAMPLES, 0]);
}

#[test]
fn counts_go_beyond_a_word() {
    // As if each ray were so many, which makes more than 2³² of an image.
    const EACH: u64 = (1 << 20) + 1;
    let change = ("ray_counts[kind]++", "ray_counts[kind] += 0x100001u");
    let gpu = open(kernels_with("common/ray_counts", &[change]));
    let stage = Stage::builtin(&gpu, "furnace-box", &[("albedo", ParamValue::Number(0.8))]);
    let traced = stage.traced(&gpu, structure("bvh"));
    let sampler = sampler("pixel-hash", "none");
    let renderer = stage.renderer(&gpu, &traced, &sampler, &path(3), SIZE, true);
    renderer.render(&[SPP], 4).expect("a render");
    let [primary, _, _, bounce, _] = renderer.ray_counts().expect("counts");
    assert_eq!([primary, bounce], [SAMPLES * EACH, 3 * SAMPLES * EACH]);
}

#[test]
fn an_open_scene_has_fewer_rays_after_the_first_hit() {
    let sphere = [("triangles", ParamValue::Integer(2000))];
    let bvh = [structure("bvh")];
    let stage = Stage::builtin(gpu(), "displaced-sphere", &sphere);
    let [primary, shadow, ao, bounce, _] = counts(&stage, &integrator_variant("ao", &[]), &bvh);
    assert_eq!([primary, shadow, bounce], [SAMPLES, 0, 0]);
    assert!(ao > SAMPLES / 10 && ao < primary, "{ao}");
    let [primary, shadow, none, bounce, _] = counts(&stage, &path(1), &bvh);
    assert_eq!([primary, shadow, none], [SAMPLES, 0, 0], "no emitter");
    // With one bounce, each first hit has one further ray in either integrator.
    assert_eq!(bounce, ao);
}
