//! The oracle: known answers, planted faults, and agreement with two straightforward f32 tests.

use crate::support::cpu;
use glam::Vec3;
use raystone::geometry::{Ray, Triangle};
use raystone::oracle::{ClosestHit, Fault, Verdict, judge, judge_any_hits, judge_closest_hits};
use raystone::random::Pcg32;

struct Random(Pcg32);

impl Random {
    fn new(seed: u64) -> Self {
        Self(Pcg32::new(seed))
    }

    fn signed(&mut self) -> f32 {
        2.0 * self.0.uniform_f32() - 1.0
    }

    fn vector(&mut self) -> Vec3 {
        Vec3::new(self.signed(), self.signed(), self.signed())
    }

    fn ray(&mut self) -> Ray {
        ray(self.vector() * 1.5, self.vector())
    }

    fn soup(&mut self, count: usize, size: f32) -> Vec<Triangle> {
        let mut one = |_| {
            let centre = self.vector();
            triangle([0; 3].map(|_| centre + size * self.vector()))
        };
        (0..count).map(&mut one).collect()
    }
}

fn triangle(vertices: [Vec3; 3]) -> Triangle {
    Triangle { vertices }
}

fn ray(origin: Vec3, direction: Vec3) -> Ray {
    Ray::new(origin, direction).between(0.0, f32::INFINITY)
}

/// (0, 0, z), (1, 0, z), (0, 1, z).
fn corner(z: f32) -> Triangle {
    triangle([Vec3::ZERO, Vec3::X, Vec3::Y].map(|v| v + z * Vec3::Z))
}

fn towards(x: f32, y: f32) -> Ray {
    ray(Vec3::new(x, y, -1.0), Vec3::Z)
}

type Test32 = fn(&Triangle, &Ray) -> Option<f32>;

/// Normal first: det = d·n, t = c·n / det, u and v from d×c.
fn normal_first(triangle: &Triangle, ray: &Ray) -> Option<f32> {
    let [v0, v1, v2] = triangle.vertices;
    let direction = Vec3::from(ray.direction);
    let (e1, e2) = (v1 - v0, v2 - v0);
    let c = v0 - Vec3::from(ray.origin);
    let normal = e1.cross(e2);
    let inverse = 1.0 / normal.dot(direction);
    let r = direction.cross(c);
    let u = -r.dot(e2) * inverse;
    let v = r.dot(e1) * inverse;
    let t = normal.dot(c) * inverse;
    let inside = u >= 0.0 && v >= 0.0 && 1.0 - u - v >= 0.0;
    (inside && t > ray.t_min && t < ray.t_max).then_some(t)
}

/// Möller and Trumbore 1997, with divisions.
fn moeller_trumbore(triangle: &Triangle, ray: &Ray) -> Option<f32> {
    let [v0, v1, v2] = triangle.vertices;
    let direction = Vec3::from(ray.direction);
    let (e1, e2) = (v1 - v0, v2 - v0);
    let p = direction.cross(e2);
    let det = p.dot(e1);
    let s = Vec3::from(ray.origin) - v0;
    let u = s.dot(p) / det;
    let q = s.cross(e1);
    let v = direction.dot(q) / det;
    let t = e2.dot(q) / det;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > ray.t_min && t < ray.t_max).then_some(t)
}

/// Sheared vertices (Woop, Benthin and Wald 2013), with a reciprocal.
fn sheared(triangle: &Triangle, ray: &Ray) -> Option<f32> {
    let direction = Vec3::from(ray.direction);
    let size = direction.abs();
    let z = (0..3).max_by(|&a, &b| size[a].total_cmp(&size[b]))?;
    let (x, y) = ((z + 1) % 3, (z + 2) % 3);
    let inverse = 1.0 / direction[z];
    let (sx, sy) = (direction[x] * inverse, direction[y] * inverse);
    let [a, b, c] = triangle.vertices.map(|v| {
        let v = v - Vec3::from(ray.origin);
        Vec3::new(v[x] - sx * v[z], v[y] - sy * v[z], v[z])
    });
    let u = c.x * b.y - c.y * b.x;
    let v = a.x * c.y - a.y * c.x;
    let w = b.x * a.y - b.y * a.x;
    let area = u + v + w;
    let t = (u * a.z + v * b.z + w * c.z) * inverse / area;
    let inside = [u, v, w].iter().all(|e| *e >= 0.0) || [u, v, w].iter().all(|e| *e <= 0.0);
    (inside && area != 0.0 && t > ray.t_min && t < ray.t_max).then_some(t)
}

fn closest(test: Test32, triangles: &[Triangle], ray: &Ray) -> ClosestHit {
    let mut best: ClosestHit = None;
    for (id, triangle) in (0..).zip(triangles) {
        if let Some(t) = test(triangle, ray) {
            best = best.filter(|b| b.1 <= t).or(Some((id, t)));
        }
    }
    best
}

type IsFault = fn(&Fault) -> bool;

#[track_caller]
fn assert_wrong(verdict: Verdict, expected: IsFault) {
    match verdict {
        Verdict::Wrong(fault) if expected(&fault) => assert!(!fault.to_string().is_empty()),
        other => panic!("unexpected verdict {other:?}"),
    }
}

#[test]
fn known_hits_and_misses_agree() {
    let scene = [corner(3.0), corner(1.0), corner(-2.0)];
    assert_eq!(
        judge(&scene, towards(0.25, 0.3), Some((1, 2.0))),
        Verdict::Agrees
    );
    assert_eq!(judge(&scene, towards(0.75, 0.75), None), Verdict::Agrees);
    // The direction's length is the unit of t, and both sides of a triangle count.
    let back = ray(Vec3::new(0.2, 0.2, 5.0), Vec3::new(0.0, 0.0, -0.5));
    assert_eq!(judge(&scene, back, Some((0, 4.0))), Verdict::Agrees);
    assert_eq!(judge(&[], towards(0.0, 0.0), None), Verdict::Agrees);
}

#[test]
fn planted_faults_are_wrong_each_for_its_own_reason() {
    let scene = [corner(3.0), corner(1.0), corner(-2.0)];
    let through = towards(0.25, 0.3);
    let faults: [(ClosestHit, IsFault); 7] = [
        (None, |f| matches!(f, Fault::FalseMiss { id: 1, .. })),
        (Some((0, 4.0)), |f| {
            matches!(f, Fault::NotNearest { nearer: 1, .. })
        }),
        (Some((0, 2.0)), |f| {
            matches!(f, Fault::Distance { id: 0, .. })
        }),
        (Some((1, 2.00001)), |f| matches!(f, Fault::Distance { .. })),
        (Some((1, f32::NAN)), |f| {
            matches!(f, Fault::OutOfInterval { .. })
        }),
        (Some((2, -1.0)), |f| {
            matches!(f, Fault::OutOfInterval { .. })
        }),
        (Some((3, 2.0)), |f| {
            matches!(f, Fault::NoSuchTriangle { .. })
        }),
    ];
    for (answer, expected) in faults {
        assert_wrong(judge(&scene, through, answer), expected);
    }
    let beside = judge(&scene, towards(0.75, 0.75), Some((1, 2.0)));
    assert_wrong(beside, |f| matches!(f, Fault::FalseHit { id: 1, .. }));
}

#[test]
fn the_interval_of_the_ray_decides_what_counts() {
    let scene = [corner(3.0), corner(1.0)];
    let mut short = towards(0.25, 0.3);
    short.t_max = 1.9;
    assert_eq!(judge(&scene, short, None), Verdict::Agrees);
    short.t_max = 2.0;
    assert_eq!(judge(&scene, short, None), Verdict::Ambiguous);
    assert_eq!(judge(&scene, short, Some((1, 2.0))), Verdict::Ambiguous);
    let mut late = towards(0.25, 0.3);
    late.t_min = 2.5;
    assert_eq!(judge(&scene, late, Some((0, 4.0))), Verdict::Agrees);
}

#[test]
fn edges_and_coincident_surfaces_are_ambiguous_but_only_there() {
    let scene = [corner(1.0)];
    for (x, y) in [(0.5, 0.5), (0.0, 0.3), (0.3, 0.0), (0.0, 0.0), (1.0, 0.0)] {
        let edge = towards(x, y);
        assert_eq!(
            judge(&scene, edge, Some((0, 2.0))),
            Verdict::Ambiguous,
            "{x} {y}"
        );
        assert_eq!(judge(&scene, edge, None), Verdict::Ambiguous, "{x} {y}");
        let (inside, outside) = (
            towards(x + 1e-4 * (0.3 - x), y + 1e-4 * (0.3 - y)),
            towards(x - 1e-4 * (0.3 - x), y - 1e-4 * (0.3 - y)),
        );
        assert_eq!(
            judge(&scene, inside, Some((0, 2.0))),
            Verdict::Agrees,
            "{x} {y}"
        );
        assert_eq!(judge(&scene, outside, None), Verdict::Agrees, "{x} {y}");
    }
    let twice = [corner(1.0), corner(1.0)];
    for id in 0..2 {
        let verdict = judge(&twice, towards(0.25, 0.3), Some((id, 2.0)));
        assert_eq!(verdict, Verdict::Ambiguous);
    }
}

#[test]
fn grazing_rays_are_ambiguous_and_degenerate_triangles_are_never_hit() {
    let scene = [corner(0.0)];
    // In the plane z = 0, crossing the triangle: det = 0 exactly, and known to be.
    let in_plane = ray(Vec3::new(-1.0, 0.25, 0.0), Vec3::X);
    assert_eq!(judge(&scene, in_plane, None), Verdict::Agrees);
    // Not axis-aligned, det = 0 is not certain in f32.
    let tilted = |v: Vec3| Vec3::new(v.x, v.y, 0.3 * v.x + 0.7 * v.y);
    let slope = [triangle(scene[0].vertices.map(tilted))];
    let graze = ray(tilted(Vec3::new(-1.0, 0.25, 0.0)), tilted(Vec3::X));
    assert_eq!(judge(&slope, graze, None), Verdict::Ambiguous);
    assert_eq!(judge(&slope, graze, Some((0, 1.5))), Verdict::Ambiguous);
    // Slightly above the plane the same ray certainly misses.
    let above = ray(Vec3::from(graze.origin) + 1e-4 * Vec3::Z, tilted(Vec3::X));
    assert_eq!(judge(&slope, above, None), Verdict::Agrees);
    assert_wrong(judge(&slope, above, Some((0, 1.5))), |f| {
        matches!(f, Fault::FalseHit { .. })
    });
    let point = [triangle([Vec3::new(0.25, 0.25, 0.0); 3])];
    assert_eq!(judge(&point, towards(0.25, 0.25), None), Verdict::Agrees);
    assert_wrong(judge(&point, towards(0.25, 0.25), Some((0, 1.0))), |f| {
        matches!(f, Fault::FalseHit { .. })
    });
}

#[test]
fn any_hit_answers_are_judged_by_whether_something_blocks() {
    let scene = [corner(3.0), corner(1.0)];
    let verdicts = judge_any_hits(
        &scene,
        &[
            (towards(0.25, 0.3), true),
            (towards(0.25, 0.3), false),
            (towards(0.75, 0.75), true),
            (towards(0.75, 0.75), false),
            (towards(0.5, 0.5), true),
            (towards(0.5, 0.5), false),
        ],
    );
    assert_eq!(verdicts[0], Verdict::Agrees);
    assert_wrong(verdicts[1].clone(), |f| {
        matches!(f, Fault::FalseMiss { .. })
    });
    assert_wrong(verdicts[2].clone(), |f| matches!(f, Fault::FalseBlock));
    assert_eq!(verdicts[3], Verdict::Agrees);
    assert_eq!(verdicts[4..], [Verdict::Ambiguous, Verdict::Ambiguous]);
}

/// Checks the answers of `test` over a soup; returns (hits, ambiguous).
fn reference_soup(test: Test32, triangles: &[Triangle], rays: &[Ray]) -> (usize, usize) {
    let answer = |ray: &Ray| (*ray, closest(test, triangles, ray));
    let queries: Vec<_> = rays.iter().map(answer).collect();
    let verdicts = judge_closest_hits(triangles, &queries);
    for (query, verdict) in queries.iter().zip(&verdicts) {
        if let Verdict::Wrong(fault) = verdict {
            panic!("{query:?}: {fault}");
        }
    }
    let hits = queries.iter().filter(|q| q.1.is_some()).count();
    let ambiguous = verdicts.iter().filter(|v| **v == Verdict::Ambiguous);
    (hits, ambiguous.count())
}

#[test]
fn straightforward_f32_tests_are_never_wrong_on_random_rays() {
    let mut random = Random::new(1);
    for (count, size) in [(200, 0.5), (2000, 0.1), (2000, 0.02)] {
        let soup = random.soup(count, size);
        let rays: Vec<_> = (0..10_000).map(|_| random.ray()).collect();
        for test in [normal_first, moeller_trumbore, sheared] {
            let (hits, ambiguous) = reference_soup(test, &soup, &rays);
            println!("size {size}: {hits} hits, {ambiguous} ambiguous");
            assert!(hits > 100, "{hits}");
            assert!(
                ambiguous < 100,
                "{ambiguous} of 10000 ambiguous: bounds too wide"
            );
        }
    }
}

#[test]
fn rays_aimed_at_edges_needles_and_far_scenes_are_never_wrong() {
    let mut random = Random::new(2);
    let mut soup = random.soup(100, 0.3);
    // Needles: two nearly coincident vertices.
    for triangle in &mut soup[..50] {
        triangle.vertices[2] = triangle.vertices[1] + 1e-5 * random.vector();
    }
    let far = Vec3::new(148376.0, 1234.0, -223423.0);
    let moved: Vec<_> = soup
        .iter()
        .map(|t| triangle(t.vertices.map(|v| v * 50.0 + far)))
        .collect();
    for (triangles, offset, scale) in [(soup.clone(), Vec3::ZERO, 1.0), (moved, far, 50.0)] {
        let aimed = |i: usize| {
            let [a, b, _] = triangles[i % triangles.len()].vertices;
            let target = a.lerp(b, 0.5 + 0.5 * random.signed());
            let origin = offset + scale * random.vector();
            ray(origin, target - origin)
        };
        let rays: Vec<_> = (0..10_000).map(aimed).collect();
        for test in [normal_first, moeller_trumbore, sheared] {
            let (_, ambiguous) = reference_soup(test, &triangles, &rays);
            // Far from the origin the vertices' own spacing keeps most targets off the edges.
            assert!(ambiguous > 3000 || scale > 1.0, "{ambiguous} near edges");
        }
    }
}

#[test]
fn random_answers_with_a_planted_fault_are_wrong() {
    let mut random = Random::new(3);
    let soup = random.soup(500, 0.2);
    let mut planted = 0;
    for _ in 0..1000 {
        let ray = random.ray();
        let Some((id, t)) = closest(normal_first, &soup, &ray) else {
            continue;
        };
        if judge(&soup, ray, Some((id, t))) != Verdict::Agrees {
            continue;
        }
        planted += 1;
        for fault in [
            None,
            Some(((id + 1) % 500, t)),
            Some((id, t * 1.001)),
            Some((id, t * 0.999)),
        ] {
            let verdict = judge(&soup, ray, fault);
            assert!(
                matches!(verdict, Verdict::Wrong(_)),
                "{fault:?}: {verdict:?}"
            );
        }
        let mut without = soup.clone();
        without.remove(id as usize);
        let verdict = judge(&without, ray, Some((id, t)));
        assert!(matches!(verdict, Verdict::Wrong(_)), "{verdict:?}");
    }
    assert!(planted > 100, "{planted}");
}

/// Exact arithmetic for every triangle needs hundreds of times as long as an f32 test.
const MOST: f64 = 2.0;

#[test]
fn judging_rays_against_many_triangles_costs_about_what_tracing_them_does() {
    let mut random = Random::new(5);
    let soup = random.soup(262_267, 0.01);
    let queries: Vec<_> = (0..200).map(|_| (random.ray(), None)).collect();
    let verdicts = judge_closest_hits(&soup, &queries);
    assert!(verdicts.iter().any(|v| *v != Verdict::Agrees));
    let judged = || judge_closest_hits(&soup, &queries);
    let nearest = |ray: &Ray| {
        let hits = soup.iter().filter_map(|t| normal_first(t, ray));
        hits.fold(f32::INFINITY, f32::min)
    };
    let traced = || queries.iter().map(|q| nearest(&q.0)).sum::<f32>();
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let [judged, traced] = alone
        .expect("a thread")
        .install(|| [cpu::seconds(judged), cpu::seconds(traced)]);
    println!("{judged:.3} s to judge, {traced:.3} s to trace with every triangle");
    assert!(judged < MOST * traced, "{judged} s and {traced} s");
}
