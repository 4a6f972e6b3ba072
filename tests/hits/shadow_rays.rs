//! Reversed and light-by-light shadow rays: the same segments, and structures match.

use crate::support;
use crate::support::Stage;
use raystone::accel::{BuildLog, BuiltBvh, BvhParameters, CpuTwin, Ray};
use raystone::config::Gate;
use raystone::measure::gate::{Checks, ReferenceTracer};
use raystone::measure::rays::RaySet;
use raystone::measure::record::RayClass;
use raystone::measure::shadow_rays::{Segment, by_light, unlike_shadow};
use raystone::params::ParamValue;

const SETTINGS: Gate = Gate {
    rays: 4096,
    brute_force_tests: 1_000_000,
    oracle_rays: 256,
    ao_length: 0.0,
    offset: 0.0,
    shadow_orders: true,
};

fn many_lights(lamps: i64) -> Stage {
    Stage::builtin(
        support::gpu(),
        "many-lights",
        &[("lamps", ParamValue::Integer(lamps))],
    )
}

fn judge(stage: &Stage) -> ReferenceTracer {
    let past = Checks::Repeated;
    ReferenceTracer::new(&stage.scene, &stage.soup, stage.camera, &SETTINGS, 1, past)
        .expect("a judge")
}

fn of(reference: &ReferenceTracer, class: RayClass) -> &RaySet {
    let mut sets = reference.sets.iter();
    sets.find(|set| set.class == class).expect("a class")
}

fn share(set: &RaySet, sets: &[RaySet]) -> f64 {
    unlike_shadow(set, sets).expect("a set made from shadow rays") as f64 / set.rays.len() as f64
}

const ORDERS: [RayClass; 3] = [
    RayClass::ShadowReversed,
    RayClass::ShadowClustered,
    RayClass::ShadowReversedClustered,
];

#[test]
fn all_orders_hold_the_same_segments_and_those_of_a_light_lie_side_by_side() {
    for lamps in [1, 2, 32] {
        let stage = many_lights(lamps);
        let reference = judge(&stage);
        let shadow = of(&reference, RayClass::Shadow);
        for class in ORDERS {
            let set = of(&reference, class);
            let mut places = set.shadow.clone();
            places.sort_unstable();
            assert!(places.iter().copied().eq(0..shadow.rays.len() as u32));
            for (ray, place) in set.rays.iter().zip(&set.shadow) {
                let forward = shadow.rays[*place as usize];
                match class {
                    RayClass::ShadowClustered => assert_eq!(*ray, forward),
                    _ => {
                        assert_eq!(ray.direction.map(|x| -x), forward.direction);
                        assert_eq!([ray.t_min, ray.t_max], [1.0 - forward.t_max, 1.0]);
                    }
                }
            }
            assert!(share(set, &reference.sets) < 2e-3, "{class:?}");
        }
        // A ray from a light begins on it: the lamp changes once less than there are lamps.
        let reversed = of(&reference, RayClass::ShadowReversedClustered);
        let lamp = |ray: &Ray| {
            let on = |t: &raystone::geometry::Triangle| {
                let [low, high] = [t.vertices.map(|v| v.min_element()), t.vertices.map(|v| v.y)];
                let flat =
                    high.iter().all(|y| *y == high[0]) && high[0] > 2.1 && low[0].is_finite();
                let inside = |axis: usize| {
                    let x = t.vertices.map(|v| v[axis]);
                    let (least, most) = (x[0].min(x[1]).min(x[2]), x[0].max(x[1]).max(x[2]));
                    least - 1e-5 <= ray.origin[axis] && ray.origin[axis] <= most + 1e-5
                };
                flat && (ray.origin[1] - high[0]).abs() < 1e-4 && inside(0) && inside(2)
            };
            let found = stage.scene.triangles.iter().position(on).expect("a lamp");
            stage.scene.material_ids[found]
        };
        let lamps_met: Vec<u32> = reversed.rays.iter().map(lamp).collect();
        let changes = lamps_met.windows(2).filter(|pair| pair[0] != pair[1]);
        assert_eq!(changes.count() as i64, lamps - 1);
        assert_eq!(unlike_shadow(shadow, &reference.sets), None);
    }
}

#[test]
fn segments_of_one_light_stay_in_order() {
    let segment = |number| Segment {
        surface: glam::Vec3::ZERO,
        light: glam::Vec3::X,
        number,
    };
    let numbers = [2, 0, 1, 0, 2, 2, 0];
    assert_eq!(by_light(&numbers.map(segment)), [1, 3, 6, 2, 0, 4, 5]);
    assert!(by_light(&[]).is_empty());
}

#[test]
fn every_structure_answers_them_as_the_judge_does() {
    let stage = many_lights(8);
    let reference = judge(&stage);
    for kind in support::in_turn("structures and shadow rays", support::structures()) {
        let traced = stage.traced(support::gpu(), kind);
        let verdict = stage.verdict(support::gpu(), &traced, &reference);
        let verdict = verdict.unwrap_or_else(|e| panic!("{}: {e}", kind.name()));
        assert!(verdict.passed, "{}: {verdict:?}", kind.name());
        let has = |class| verdict.classes.iter().any(|found| found.class == class);
        assert!(ORDERS.into_iter().all(has), "{}", kind.name());
    }
}

/// Fraction of a class that differs from the shadow rays with a fault in its rays or places.
fn with_fault(class: RayClass, fault: impl Fn(&mut RaySet)) -> f64 {
    let stage = many_lights(8);
    let reference = judge(&stage);
    let tree = BuiltBvh::build(
        &stage.soup,
        &BvhParameters::default(),
        &mut BuildLog::default(),
    );
    let tree = tree.expect("a tree");
    let twin: &dyn CpuTwin = &tree.twin(&stage.soup);
    let mut set = of(&reference, class).clone();
    fault(&mut set);
    share(&set.judged_by(twin), &reference.sets)
}

#[test]
fn wrong_ends_and_a_lost_order_are_seen() {
    let reversed = RayClass::ShadowReversed;
    assert!(with_fault(reversed, |_| {}) < 2e-3);
    // The ray continues through the surface where it should end.
    assert!(
        with_fault(reversed, |set| set
            .rays
            .iter_mut()
            .for_each(|r| r.t_max = 1.5))
            > 0.1
    );
    // It ends halfway.
    assert!(
        with_fault(reversed, |set| set
            .rays
            .iter_mut()
            .for_each(|r| r.t_max = 0.5))
            > 0.01
    );
    // The direction is that of the forward ray.
    let forward = |set: &mut RaySet| {
        (set.rays.iter_mut()).for_each(|r| r.direction = r.direction.map(|x| -x));
    };
    assert!(with_fault(reversed, forward) > 0.01);
    // Answers are returned to pixels in the order of lights.
    let lost = |set: &mut RaySet| set.shadow.sort_unstable();
    for class in [ORDERS[1], ORDERS[2]] {
        assert!(with_fault(class, lost) > 0.01, "{class:?}");
    }
}
