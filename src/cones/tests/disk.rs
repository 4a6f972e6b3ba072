//! Overlaps of triangles and the disk: the digest's vectors, closed forms, quadrature, and faults that these see.

use crate::check;
use crate::disk::{Overlap, Sum, V2, disk_triangle, edge, overlap, segment};
use crate::quadrature;
use glam::{DVec2, DVec3};
use raystone_core::random::Pcg32;
use raystone_specular::real::V3;
use std::collections::BTreeMap;
use std::f64::consts::PI;

fn uniform(random: &mut Pcg32) -> f64 {
    random.uniform()
}

fn flat(p: [f64; 2]) -> V3<f64> {
    V3::new(p[0], p[1], 1.0)
}

fn exact(triangle: [[f64; 2]; 3]) -> Overlap<f64> {
    let [a, b, c] = triangle.map(flat);
    disk_triangle(a, b, c)
}

fn by_quadrature(triangle: [[f64; 2]; 3]) -> (f64, DVec2) {
    quadrature::overlap(&triangle.map(DVec2::from))
}

/// Triangle, area and centroid: appendix A of the digest, which prints six digits.
#[expect(clippy::approx_constant, reason = "digits as printed")]
const VECTORS: [([[f64; 2]; 3], f64, [f64; 2]); 8] = [
    (
        [[0.0, 0.0], [2.0, 0.0], [0.0, 2.0]],
        0.785398,
        [0.424413, 0.424413],
    ),
    (
        [[-10.0, 0.5], [10.0, 0.5], [0.0, 20.0]],
        0.614185,
        [0.0, 0.705020],
    ),
    (
        [[-0.5, 0.0], [0.5, 0.0], [0.0, 2.0]],
        0.744472,
        [0.0, 0.440394],
    ),
    (
        [[-0.5, 0.0], [1.1, -0.9], [1.1, 0.9]],
        1.104521,
        [0.439209, 0.0],
    ),
    (
        [[-3.0, -0.5], [3.0, -0.5], [0.0, 0.9]],
        2.256030,
        [0.0, 0.096239],
    ),
    (
        [[-1.4, -0.9], [1.4, -0.9], [0.0, 1.5]],
        2.644841,
        [0.0, -0.050438],
    ),
    ([[-10.0, -5.0], [10.0, -5.0], [0.0, 20.0]], PI, [0.0, 0.0]),
    ([[2.0, 2.0], [3.0, 2.0], [2.0, 3.0]], 0.0, [0.0, 0.0]),
];

/// What a formula is off the vectors.
fn off(of: impl Fn([[f64; 2]; 3]) -> (f64, DVec2)) -> f64 {
    let each = VECTORS.iter().map(|(triangle, area, centroid)| {
        let (found, at) = of(*triangle);
        (found - area)
            .abs()
            .max((at - DVec2::from(*centroid)).abs().max_element())
    });
    each.fold(0.0, f64::max)
}

#[test]
fn the_digests_vectors_are_met_by_edges_and_by_quadrature() {
    let edges = off(|triangle| {
        let found = exact(triangle);
        (found.area, DVec2::new(found.centroid.x, found.centroid.y))
    });
    assert!(edges < 1e-6, "{edges}");
    let rows = off(by_quadrature);
    assert!(rows < 1e-6, "{rows}");
}

#[test]
fn segments_have_the_cube_of_the_sine_not_its_root() {
    let (area, at) = segment(1.0);
    assert!((area - 0.0792645).abs() < 1e-6, "{area}");
    assert!((at - 0.926816).abs() < 1e-6, "{at}");
    for angle in [0.3, 1.0, 2.0, PI, 4.0, 6.0] {
        let (area, at) = segment(angle);
        // A triangle whose lower edge is the chord, and whose others are far away.
        let height = (0.5 * angle).cos();
        let found = exact([[-1e3, height], [1e3, height], [0.0, 1e3]]);
        assert!((found.area - area).abs() < 1e-12, "{angle}: {found:?}");
        assert!((found.centroid.y - at).abs() < 1e-10, "{angle}: {found:?}");
        assert!(found.centroid.x.abs() < 1e-10);
        // As printed it is another place, outside the disk for small segments.
        let printed = 2.0 / (3.0 * area) * (0.5 * angle).sin().abs().powf(1.5);
        assert!(
            angle == PI || (printed - at).abs() > 1e-3,
            "{angle}: {printed}"
        );
    }
}

/// Random triangles: of the disk's size, tiny, slivers, and far larger.
fn triangles(count: usize) -> Vec<[[f64; 2]; 3]> {
    let mut random = Pcg32::new(7);
    let mut of = |size: f64| [(); 2].map(|()| (2.0 * uniform(&mut random) - 1.0) * size);
    let each = (0..count).map(|k| match k % 4 {
        0 => [of(2.0), of(2.0), of(2.0)],
        1 => {
            let (at, size) = (of(1.1), 0.05);
            [(); 3].map(|()| {
                let d = of(size);
                [at[0] + d[0], at[1] + d[1]]
            })
        }
        2 => {
            let (p, q) = (of(3.0), of(3.0));
            let d = of(0.01);
            [p, q, [q[0] + d[0], q[1] + d[1]]]
        }
        _ => [of(30.0), of(30.0), of(30.0)],
    });
    each.collect()
}

/// Vertices in the disk, and crossings of edges with the circle.
fn case(triangle: [[f64; 2]; 3]) -> (usize, usize) {
    let v = triangle.map(DVec2::from);
    let inside = v.iter().filter(|p| p.length() < 1.0).count();
    let crossings = (0..3).map(|k| {
        let (p, d) = (v[k], v[(k + 1) % 3] - v[k]);
        let (a, b, c) = (d.length_squared(), p.dot(d), p.length_squared() - 1.0);
        let inner = b * b - a * c;
        let roots = [-1.0, 1.0].map(|sign| (-b + sign * inner.max(0.0).sqrt()) / a);
        let on = roots.iter().filter(|t| (0.0..1.0).contains(*t)).count();
        if inner > 0.0 { on } else { 0 }
    });
    (inside, crossings.sum())
}

#[test]
fn all_eight_cases_agree_with_quadrature() {
    let mut cases: BTreeMap<(usize, usize), usize> = BTreeMap::new();
    for triangle in triangles(20_000) {
        *cases.entry(case(triangle)).or_default() += 1;
        let found = exact(triangle);
        let (area, at) = by_quadrature(triangle);
        assert!(
            (found.area - area).abs() < 1e-10,
            "{triangle:?}: {found:?}, {area}"
        );
        let moment = DVec2::new(found.centroid.x, found.centroid.y) * found.area - at * area;
        assert!(moment.length() < 1e-10, "{triangle:?}: {found:?}, {at}");
    }
    let eight = [
        (0, 0),
        (0, 2),
        (0, 4),
        (0, 6),
        (1, 2),
        (1, 4),
        (2, 2),
        (3, 0),
    ];
    let seen: Vec<(usize, usize)> = cases.keys().copied().collect();
    assert_eq!(seen, eight, "{cases:?}");
    assert!(cases.values().all(|count| *count >= 20), "{cases:?}");
}

#[test]
fn triangles_around_a_point_tile_the_disk() {
    let mut random = Pcg32::new(11);
    for _ in 0..500 {
        let middle = DVec2::new(uniform(&mut random) - 0.5, uniform(&mut random) - 0.5) * 3.0;
        let spokes = 3 + (5.0 * uniform(&mut random)) as usize;
        let rim = |k: usize| middle + 50.0 * DVec2::from_angle(2.0 * PI * k as f64 / spokes as f64);
        let mut sum = (0.0, DVec2::ZERO);
        for k in 0..spokes {
            let found = exact([middle, rim(k), rim(k + 1)].map(DVec2::into));
            sum.0 += found.area;
            sum.1 += found.area * DVec2::new(found.centroid.x, found.centroid.y);
        }
        assert!((sum.0 - PI).abs() < 1e-11, "{middle}: {}", sum.0);
        assert!(sum.1.length() < 1e-11, "{middle}: {}", sum.1);
    }
}

#[test]
fn order_turn_and_depth_of_vertices_change_nothing() {
    let mut random = Pcg32::new(13);
    for triangle in triangles(2000) {
        let found = exact(triangle);
        let [a, b, c] = triangle;
        let swapped = exact([a, c, b]);
        assert!((found.area - swapped.area).abs() < 1e-12);
        let turn = DVec2::from_angle(2.0 * PI * uniform(&mut random));
        let turned = exact(triangle.map(|p| DVec2::from(p).rotate(turn).into()));
        assert!((found.area - turned.area).abs() < 1e-11, "{triangle:?}");
        let deep = triangle.map(|p| {
            let z = 0.1 + 5.0 * uniform(&mut random);
            V3::of(DVec3::new(p[0] * z, p[1] * z, z))
        });
        let deep: Overlap<f64> = disk_triangle(deep[0], deep[1], deep[2]);
        assert!((found.area - deep.area).abs() < 1e-11, "{triangle:?}");
    }
}

#[test]
fn single_precision_is_off_by_no_more_than_its_bounds() {
    let triangles = check::triangles(20_000, 3);
    let found: Vec<Overlap<f32>> = triangles
        .iter()
        .map(|[a, b, c]| disk_triangle(*a, *b, *c))
        .collect();
    let worst = check::overlaps(&triangles, &found, true).unwrap();
    eprintln!("f32: area off by {worst:.2e}");
    assert!(worst > 1e-8, "f32 cannot be exact: {worst}");
}

type Formula = fn([[f64; 2]; 3]) -> (f64, DVec2);

fn of(sum: Sum<f64>) -> (f64, DVec2) {
    let found = overlap(sum);
    (found.area, DVec2::new(found.centroid.x, found.centroid.y))
}

/// Faults of a formula on the host.
const FAULTS: [(&str, Formula); 6] = [
    ("an edge is missing", |t| {
        let [a, b, c] = t.map(flat);
        of(edge(edge(Sum::none(), a, b), b, c))
    }),
    ("an edge is backwards", |t| {
        let [a, b, c] = t.map(flat);
        of(edge(edge(edge(Sum::none(), a, b), b, c), a, c))
    }),
    ("the centroid is that of the triangle", |t| {
        let found = exact(t);
        let sum = t.iter().map(|p| DVec2::from(*p)).sum::<DVec2>();
        (found.area, sum / 3.0)
    }),
    ("coordinates are mixed", |t| {
        let found = exact(t);
        (found.area, DVec2::new(found.centroid.y, found.centroid.x))
    }),
    ("a crossing is forgotten", |t| {
        let [a, b, c] = t.map(flat);
        let mut sum = edge(edge(edge(Sum::none(), a, b), b, c), c, a);
        sum.crossing = 0;
        of(sum)
    }),
    ("the moment is not that of the sector", |t| {
        let [a, b, c] = t.map(flat);
        let mut sum = edge(edge(edge(Sum::none(), a, b), b, c), c, a);
        sum.moment = V2::new(sum.moment.x * 1.01, sum.moment.y * 1.01);
        of(sum)
    }),
];

#[test]
fn faults_of_the_formula_are_seen_by_the_vectors() {
    for (name, formula) in FAULTS {
        assert!(off(formula) > 1e-6, "not seen: {name}");
    }
}
