//! Correct structures pass.

use super::{judge, verdict};
use crate::support::*;
use raystone::params::ParamValue;

/// 144 × 144 rays in each of five classes, plus the hard ones.
const RAYS: u32 = 20_736;
/// With more triangles than this, brute force takes a minute on two cores.
const MOST_FOR_BRUTE_FORCE: usize = 6000;

fn every_structure_passes(scene: &str, changes: &[(&str, ParamValue)]) {
    let stage = Stage::builtin(gpu(), scene, changes);
    let reference = judge(&stage, RAYS);
    assert!(reference.is_sound(), "{:?}", reference.first_wrong());
    assert!(reference.brute_force.rays >= 2000 && reference.oracle.rays >= 256);
    // In any turn, each structure is checked in one scene.
    let kinds = match scene {
        "triangle-soup" => structures(),
        _ => in_turn("structures at the gate", structures()),
    };
    for kind in kinds {
        let triangles = stage.scene.triangles.len();
        if kind.name() == "brute-force" && triangles > MOST_FOR_BRUTE_FORCE {
            println!("skipped: brute-force on the {triangles} triangles of {scene}");
            continue;
        }
        let verdict = verdict(gpu(), &stage, kind, &reference);
        let what = format!("{scene}, {}: {verdict:?}", kind.name());
        assert!(verdict.passed, "{what}");
        let rays: usize = verdict.classes.iter().map(|class| class.rays).sum();
        assert!(verdict.classes.len() == 6 && rays >= 100_000, "{what}");
        let ties: usize = verdict.classes.iter().map(|class| class.ties).sum();
        assert!(ties == 0 || !is_exact(gpu()), "{what}");
    }
    // Rays that all miss, or all hit, would prove little.
    let fractions: Vec<f64> = reference
        .sets
        .iter()
        .map(|set| set.hit_fraction())
        .collect();
    let hits = fractions.iter().sum::<f64>() / fractions.len() as f64;
    assert!((0.05..0.98).contains(&hits), "{fractions:?}");
}

#[test]
fn every_structure_passes_the_gate_in_the_cornell_box() {
    every_structure_passes("cornell-box", &[]);
}

#[test]
fn every_structure_passes_the_gate_on_a_displaced_sphere() {
    every_structure_passes(
        "displaced-sphere",
        &[("triangles", ParamValue::Integer(5000))],
    );
}

#[test]
fn every_structure_passes_the_gate_in_a_triangle_soup() {
    every_structure_passes("triangle-soup", &[("triangles", ParamValue::Integer(2000))]);
}

#[test]
fn every_structure_passes_the_gate_on_a_teapot_in_a_stadium() {
    every_structure_passes("teapot-in-a-stadium", &[]);
}
