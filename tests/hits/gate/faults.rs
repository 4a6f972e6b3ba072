//! Faults in the structure, its kernel, or the reference tracer must fail the check.

use super::faulty::{SHORT_STACK, WRONG_INDEX, WRONG_INDEX_ROPED};
use super::{judge, verdict, wrong};
use crate::support::*;
use raystone::accel::{NO_HIT, Ray, TriangleSoup, brute_force_hits};
use raystone::gpu::KERNEL_ERRORS;
use raystone::measure::gate::ReferenceTracer;
use raystone::measure::record::{GateVerdict, RayClass};
use raystone::params::ParamValue;
use raystone::scene::SceneData;

const RAYS: u32 = 4096;

fn cornell() -> Stage {
    Stage::builtin(gpu(), "cornell-box", &[])
}

/// Parses a ray from text like `ray ox oy oz dx dy dz t_min t_max | …`.
fn parse_ray(text: &str) -> Ray {
    let ray = text.split(" | ").next();
    let ray = ray.and_then(|t| t.strip_prefix("ray "));
    ray.expect("a ray").parse().expect("eight numbers")
}

/// Checks that the first wrong ray reports the reference's answer, as does tracing every triangle.
fn check_replay(verdict: &GateVerdict, soup: &TriangleSoup) {
    let told = verdict.classes.iter().filter(|c| c.first_wrong.is_some());
    assert!(told.clone().count() > 0, "{verdict:?}");
    for class in told {
        let text = class.first_wrong.as_deref().expect("a text");
        let hit = brute_force_hits(soup, &[parse_ray(text)])[0];
        let expected = format!("| reference {hit}");
        assert!(text.contains(&expected), "{text}: no `{expected}`");
    }
    for class in &verdict.classes {
        assert_eq!(class.wrong > 0, class.first_wrong.is_some(), "{class:?}");
    }
}

fn hits_of(reference: &ReferenceTracer, triangle: u32) -> usize {
    let truth = reference.sets.iter().flat_map(|set| &set.truth);
    truth.filter(|hit| hit.triangle == triangle).count()
}

#[test]
fn one_triangle_index_changed_in_a_leaf_is_wrong_on_exactly_the_rays_that_hit_it() {
    if !is_exact(gpu()) {
        return;
    }
    let stage = cornell();
    let reference = judge(&stage, RAYS);
    let expected = hits_of(&reference, 0);
    assert!(expected > 0);
    for kind in [&WRONG_INDEX, &WRONG_INDEX_ROPED] {
        let verdict = verdict(gpu(), &stage, kind, &reference);
        assert!(!verdict.passed);
        assert_eq!(wrong(&verdict), expected, "{}", kind.name);
        check_replay(&verdict, &stage.soup);
    }
}

#[test]
fn a_kernel_that_drops_the_far_child_is_wrong() {
    let gpu = open(kernels_with(
        "accel/bvh/pairs",
        &[("if (far_enter < MISSED &&", "if (far_enter < 0.0 &&")],
    ));
    let stage = Stage::builtin(&gpu, "cornell-box", &[]);
    let reference = judge(&stage, RAYS);
    let faulty = verdict(&gpu, &stage, structure("bvh"), &reference);
    assert!(!faulty.passed && wrong(&faulty) > 0, "{faulty:?}");
    assert!(faulty.kernel_errors.is_empty(), "{faulty:?}");
    check_replay(&faulty, &stage.soup);
    // The other structures do not use that kernel.
    let other = verdict(&gpu, &stage, structure("roped-bvh"), &reference);
    assert!(other.passed, "{other:?}");
}

/// `scene` with a second copy of every triangle after the first ones.
fn doubled(mut scene: SceneData) -> SceneData {
    scene.triangles.extend_from_within(..);
    scene.material_ids.extend_from_within(..);
    scene
}

#[test]
fn a_kernel_that_ignores_ties_is_wrong_on_every_hit_of_a_scene_made_of_ties() {
    let nearer = "t < (*hit).t || (t == (*hit).t && triangle.v0.w < (*hit).triangle)";
    let scene = || doubled(builtin("cornell-box", &[]));
    let right = Stage::new(gpu(), scene());
    let reference = judge(&right, RAYS);
    let hits: usize = reference
        .sets
        .iter()
        .map(|set| {
            set.truth
                .iter()
                .filter(|hit| hit.triangle != NO_HIT)
                .count()
        })
        .sum();
    assert!(hits > 0);
    assert!(verdict(gpu(), &right, structure("brute-force"), &reference).passed);

    // Brute force tests the copies last: the last of equals always wins.
    let last_wins = open(kernels_with("accel/triangle", &[(nearer, "t <= (*hit).t")]));
    let stage = Stage::new(&last_wins, scene());
    let faulty = verdict(&last_wins, &stage, structure("brute-force"), &reference);
    assert!(!faulty.passed);
    assert_eq!(wrong(&faulty), hits);
    check_replay(&faulty, &stage.soup);

    // The first of equals wins: correct only if triangles come in order.
    let first_wins = open(kernels_with("accel/triangle", &[(nearer, "t < (*hit).t")]));
    let stage = Stage::new(&first_wins, scene());
    let in_order = verdict(&first_wins, &stage, structure("brute-force"), &reference);
    // Hard rays that end exactly at a hit lose it.
    for class in &in_order.classes {
        let is_hard = class.class == RayClass::Hard;
        assert_eq!(class.wrong > 0, is_hard, "{in_order:?}");
    }
    let faulty = verdict(&first_wins, &stage, structure("bvh"), &reference);
    assert!(!faulty.passed && wrong(&faulty) > 0, "{faulty:?}");
    check_replay(&faulty, &stage.soup);
}

#[test]
fn a_blown_step_fuse_and_a_stack_overflow_are_named() {
    let [(_, fuse), (_, overflow), ..] = KERNEL_ERRORS;
    let impatient = open(kernels_with(
        "accel/bvh/roped",
        &[(
            "step < limits.step_fuse",
            "step < min(limits.step_fuse, 3u)",
        )],
    ));
    let sphere = [("triangles", ParamValue::Integer(500))];
    let stage = Stage::builtin(&impatient, "displaced-sphere", &sphere);
    let reference = judge(&stage, RAYS);
    let faulty = verdict(&impatient, &stage, structure("roped-bvh"), &reference);
    assert!(!faulty.passed);
    assert_eq!(faulty.kernel_errors, [fuse]);

    let stage = Stage::builtin(gpu(), "displaced-sphere", &sphere);
    let faulty = verdict(gpu(), &stage, &SHORT_STACK, &reference);
    assert!(!faulty.passed && wrong(&faulty) > 0);
    assert_eq!(faulty.kernel_errors, [overflow]);
    let right = verdict(gpu(), &stage, structure("bvh"), &reference);
    assert!(right.passed && right.kernel_errors.is_empty());
}

#[test]
fn a_structure_does_not_pass_before_a_judge_that_is_itself_wrong() {
    let stage = cornell();
    let sound = judge(&stage, 1024);
    assert!(sound.is_sound() && sound.first_wrong().is_none());

    // The reference has a floor elsewhere; structures built on the same data agree with it.
    let mut misled = cornell();
    for record in &mut misled.soup.records[..2] {
        record.v0[1] += 50.0;
    }
    let wrong_reference = judge(&misled, 1024);
    assert!(!wrong_reference.is_sound() && wrong_reference.oracle.wrong > 0);
    let text = wrong_reference.first_wrong().expect("a ray");
    assert!(text.contains("f64:"), "{text}");
    parse_ray(text);
    let buffers = raystone::integrator::SceneBuffers::upload(gpu(), &misled.scene, &misled.soup);
    misled.buffers = buffers.expect("buffers that fit");
    let agreed = verdict(gpu(), &misled, structure("bvh"), &wrong_reference);
    assert_eq!(wrong(&agreed), 0, "{agreed:?}");
    assert!(!agreed.passed);

    let mut contradicted = sound;
    contradicted.brute_force.wrong = 1;
    assert!(!verdict(gpu(), &stage, structure("bvh"), &contradicted).passed);
}
