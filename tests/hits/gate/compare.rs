//! The comparison itself, on hand-made answers.

use glam::Vec3;
use raystone::accel::triangle::TriangleRecord;
use raystone::accel::{Hit, Intersection, NO_HIT, Ray, Space, TriangleRegistry, TriangleSoup};
use raystone::geometry::Triangle;
use raystone::measure::gate::compare;
use raystone::measure::rays::RaySet;
use raystone::measure::record::{ClassVerdict, RayClass};

/// Triangle 0 and its copy 1 in the plane z = 1, triangle 2 next to them, triangle 3 far behind.
fn soup() -> TriangleSoup {
    let triangle = |x: f32, z: f32| Triangle {
        vertices: [
            Vec3::new(x, -2.0, z),
            Vec3::new(x + 4.0, -2.0, z),
            Vec3::new(x, 6.0, z),
        ],
    };
    let all = [
        triangle(-1.0, 1.0),
        triangle(-1.0, 1.0),
        triangle(7.0, 1.0),
        triangle(-1.0, 9.0),
    ];
    let record = |(id, t): (usize, &Triangle)| TriangleRecord::new(t, id as u32, 0);
    all.iter()
        .enumerate()
        .map(record)
        .collect::<Vec<_>>()
        .into()
}

/// A ray along z that hits triangle 0, and one that misses everything.
fn set() -> RaySet {
    let ray = |x: f32| Ray {
        origin: [x, 0.0, 0.0],
        t_min: 0.0,
        direction: [0.0, 0.0, 1.0],
        t_max: 1e30,
    };
    let rays = vec![ray(0.0), ray(-5.0)];
    let truth = raystone::accel::brute_force_hits(&soup(), &rays);
    assert_eq!([truth[0].triangle, truth[1].triangle], [0, NO_HIT]);
    assert_eq!(truth[0].t, 1.0);
    RaySet {
        class: RayClass::Primary,
        rays,
        truth,
        shadow: Vec::new(),
    }
}

fn with(change: impl Fn(&mut Hit), exact: bool) -> ClassVerdict {
    let set = set();
    let mut hits = set.truth.clone();
    change(&mut hits[0]);
    compare(
        &set,
        &hits,
        &[Some(true), Some(false)],
        &soup(),
        Space::World,
        exact,
    )
}

fn wrong_and_ties(verdict: &ClassVerdict) -> [usize; 2] {
    assert_eq!(verdict.rays, 2);
    assert_eq!(verdict.first_wrong.is_some(), verdict.wrong > 0);
    [verdict.wrong, verdict.ties]
}

fn ulps_up(x: f32, ulps: u32) -> f32 {
    f32::from_bits(x.to_bits() + ulps)
}

#[test]
fn equal_answers_are_right() {
    for exact in [true, false] {
        assert_eq!(wrong_and_ties(&with(|_| {}, exact)), [0, 0]);
    }
}

#[test]
fn any_bit_is_wrong_on_an_exact_adapter() {
    let changes: [fn(&mut Hit); 5] = [
        |h| h.t = ulps_up(h.t, 1),
        |h| h.u = ulps_up(h.u, 1),
        |h| h.v = ulps_up(h.v, 1),
        |h| h.triangle = 1,
        |h| h.triangle = NO_HIT,
    ];
    for (index, change) in changes.iter().enumerate() {
        let verdict = with(change, true);
        assert_eq!(wrong_and_ties(&verdict), [1, 0], "change {index}");
    }
}

#[test]
fn ties_are_answers_within_4_ulp_on_an_adapter_that_rounds_otherwise() {
    let up = |ulps| move |h: &mut Hit| h.t = ulps_up(h.t, ulps);
    assert_eq!(wrong_and_ties(&with(up(4), false)), [0, 1]);
    assert_eq!(wrong_and_ties(&with(up(5), false)), [1, 0]);
    assert_eq!(
        wrong_and_ties(&with(|h| h.u = ulps_up(h.u, 1), false)),
        [0, 1]
    );
    assert_eq!(wrong_and_ties(&with(|h| h.triangle = 1, false)), [0, 1]);
    // Behind, missed, and no triangle at all.
    for id in [3, NO_HIT, 4] {
        assert_eq!(
            wrong_and_ties(&with(|h| h.triangle = id, false)),
            [1, 0],
            "{id}"
        );
    }
}

#[test]
fn a_triangle_elsewhere_in_the_same_plane_is_no_tie() {
    assert_eq!(wrong_and_ties(&with(|h| h.triangle = 2, false)), [1, 0]);
}

#[test]
fn a_wrong_any_hit_answer_is_wrong_on_every_adapter() {
    let set = set();
    for exact in [true, false] {
        for found in [[Some(false); 2], [Some(true); 2], [Some(true), None]] {
            let verdict = compare(&set, &set.truth, &found, &soup(), Space::World, exact);
            assert_eq!(
                wrong_and_ties(&verdict),
                [1, 0],
                "{found:?}, exact: {exact}"
            );
            let text = verdict.first_wrong.expect("a ray");
            assert!(text.ends_with("any-hit answer differs"), "{text}");
        }
    }
}

#[test]
fn missing_answers_are_wrong() {
    let set = set();
    let verdict = compare(&set, &[], &[], &soup(), Space::World, true);
    assert_eq!(wrong_and_ties(&verdict), [2, 0]);
    let verdict = compare(
        &set,
        &set.truth[..1],
        &[Some(true), Some(false)],
        &soup(),
        Space::World,
        false,
    );
    assert_eq!(wrong_and_ties(&verdict), [1, 0]);
}

/// Wrong rays and ties of one answer with the test `bare` to a ray through `(x, 0.1, 1)`: closest hit, made of the reference's,
/// and any hit.
fn by_bare(x: f32, answer: impl Fn(Hit) -> Hit, any: bool) -> [usize; 2] {
    let mut set = set();
    set.rays.truncate(1);
    let origin = [0.37, 0.21, -0.77];
    set.rays[0].origin = origin;
    set.rays[0].direction = [x - origin[0], 0.1 - origin[1], 1.0 - origin[2]];
    set.truth = raystone::accel::brute_force_hits(&soup(), &set.rays);
    let hit = answer(set.truth[0]);
    let soup = soup().intersecting(Intersection {
        triangle: TriangleRegistry::default().get("bare").expect("a test"),
        ..Intersection::default()
    });
    let verdict = compare(&set, &[hit], &[Some(any)], &soup, Space::World, true);
    [verdict.wrong, verdict.ties]
}

#[test]
fn a_test_that_is_not_exact_may_answer_otherwise_where_rounding_explains_it() {
    type Change = fn(Hit) -> Hit;
    let miss: Change = |_| Hit {
        t: 1e30,
        triangle: NO_HIT,
        u: 0.0,
        v: 0.0,
    };
    let copy: Change = |hit| Hit { triangle: 1, ..hit };
    let longer: Change = |hit| Hit {
        t: ulps_up(hit.t, 30),
        ..hit
    };
    // In the middle of 0 and its copy 1: either, and nothing else.
    assert_eq!(by_bare(0.0, |hit| hit, true), [0, 0]);
    assert_eq!(by_bare(0.0, copy, true), [0, 1]);
    assert_eq!(by_bare(0.0, longer, true), [0, 0]);
    let wrong: [(Change, bool); 11] = [
        (
            |hit| Hit {
                t: 1.01 * hit.t,
                ..hit
            },
            true,
        ),
        (
            |hit| Hit {
                t: 0.99 * hit.t,
                triangle: 1,
                ..hit
            },
            true,
        ),
        (|hit| Hit { triangle: 2, ..hit }, true),
        (|hit| Hit { triangle: 3, ..hit }, true),
        (|hit| Hit { triangle: 4, ..hit }, true),
        (miss, false),
        (miss, true),
        (|hit| hit, false),
        (
            |hit| Hit {
                u: hit.u + 0.05,
                ..hit
            },
            true,
        ),
        (
            |hit| Hit {
                v: hit.v - 0.05,
                triangle: 1,
                ..hit
            },
            true,
        ),
        (|hit| Hit { u: f32::NAN, ..hit }, true),
    ];
    for (place, (answer, any)) in wrong.into_iter().enumerate() {
        assert_eq!(by_bare(0.0, answer, any), [1, 0], "{place}");
    }
    // A miss has the distance of one.
    assert_eq!(by_bare(-5.0, |hit| hit, false), [0, 0]);
    assert_eq!(by_bare(-5.0, |hit| Hit { t: 9.0, ..hit }, false), [1, 0]);
    // A ray along their edge may miss both, one beside it may not.
    let at_edge = (0..16).map(|i| by_bare(-1.0 + 1e-8 * i as f32, miss, false));
    assert!(at_edge.into_iter().any(|found| found == [0, 1]));
    assert_eq!(by_bare(-0.999, miss, false), [1, 0]);
    assert_eq!(by_bare(-0.999, miss, true), [1, 0]);
}
