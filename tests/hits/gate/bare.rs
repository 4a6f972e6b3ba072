//! Structures with the triangle test `bare`, whose hits rounding may change: they pass up to that, and no further.

use super::{judge, verdict, wrong};
use crate::support::{self, Stage, in_turn, inline_structures, kernels_with, open, structure};
use raystone::accel::{Intersection, TriangleRegistry};
use raystone::gpu::Gpu;
use raystone::measure::record::RayClass;

fn stage(gpu: &Gpu, scene: &str) -> Stage {
    let mut stage = Stage::builtin(gpu, scene, &[]);
    stage.set_tests(Intersection {
        triangle: TriangleRegistry::default().get("bare").expect("a test"),
        ..Intersection::default()
    });
    stage
}

#[test]
fn structures_pass_with_other_hits_where_rounding_explains_them() {
    let gpu = support::gpu();
    for scene in ["cornell-box", "teapot-in-a-stadium"] {
        let stage = stage(gpu, scene);
        let reference = judge(&stage, 4096);
        assert!(reference.is_sound(), "{scene}");
        let hard = |class: RayClass| class == RayClass::Hard;
        assert!(!reference.sets.iter().any(|set| hard(set.class)));
        for kind in in_turn("structures with the bare test", inline_structures()) {
            let verdict = verdict(gpu, &stage, kind, &reference);
            let what = format!("{scene}, {}: {verdict:?}", kind.name());
            assert!(verdict.passed && verdict.inexact, "{what}");
            let [rays, ties] = verdict.classes.iter().fold([0, 0], |[rays, ties], class| {
                [rays + class.rays, ties + class.ties]
            });
            assert!(ties * 100 < rays, "{what}");
        }
    }
}

#[test]
fn faults_that_rounding_does_not_explain_fail() {
    const MODULE: &str = "accel/triangle/bare";
    let faults = [
        ("found.t < (*hit).t", "found.t < 1e30"),
        ("found.t >= ray.t_min && ", ""),
        (
            "found.t < (*hit).t",
            "found.t < (*hit).t && u_of(found) > 0.02",
        ),
        ("Hit(abs(found.t), ", "Hit(1.002 * abs(found.t), "),
        ("triangle.v0.w, u, v", "triangle.v0.w ^ 1u, u, v"),
        ("triangle.v0.w, u, v", "triangle.v0.w, v, u"),
        ("triangle.v0.w, u, v", "triangle.v0.w, 0.99 * u, v"),
    ];
    let gpu = support::gpu();
    let stage = stage(gpu, "teapot-in-a-stadium");
    let reference = judge(&stage, 4096);
    let unseen: Vec<_> = (faults.iter())
        .filter(|(from, to)| {
            let to = to.replace("u_of(found)", "abs(found.u) / found.area");
            let faulty = open(kernels_with(MODULE, &[(from, &to)]));
            let verdict = verdict(&faulty, &stage, structure("bvh"), &reference);
            assert_ne!(verdict.passed, wrong(&verdict) > 0, "{verdict:?}");
            verdict.passed
        })
        .collect();
    assert!(unseen.is_empty(), "not seen: {unseen:?}");
}
