//! The triangle test against exact integer arithmetic, and on closed surfaces: all structures are
//! compared with it, so it must be right.

use crate::support::{Pcg, brute_force, scenes};
use raystone::accel::triangle::{
    AnyTriangleTest, Compensated, MoellerTrumbore, TriangleRecord, TriangleTest as _, Watertight,
};
use raystone::accel::{Intersection, NO_HIT, Ray, TriangleSoup};

/// The exact result for one ray and one triangle.
enum Exact {
    Miss,
    /// The triangle is edge-on or has no area: its rounded weights are arbitrary.
    EdgeOn,
    /// On an edge or corner: either answer is right.
    Edge,
    /// Strictly inside, at the distance `numerator / denominator`.
    Inside(i64, i64),
}

/// Intersects lattice geometry exactly: every coordinate is a multiple of one half.
fn exactly(triangle: &TriangleRecord, ray: &Ray) -> Exact {
    let whole = |v: [f32; 3]| v.map(|x| (2.0 * x) as i64);
    let cross = |a: [i64; 3], b: [i64; 3]| -> [i64; 3] {
        let term = |i: usize, j: usize| a[i] * b[j] - a[j] * b[i];
        [term(1, 2), term(2, 0), term(0, 1)]
    };
    let dot = |a: [i64; 3], b: [i64; 3]| -> i64 { (0..3).map(|i| a[i] * b[i]).sum() };
    let subtract = |a: [i64; 3], b: [i64; 3]| -> [i64; 3] { [0, 1, 2].map(|i| a[i] - b[i]) };
    let edge_1 = subtract(whole(triangle.v1), whole(triangle.v0));
    let edge_2 = subtract(whole(triangle.v2), whole(triangle.v0));
    let direction = whole(ray.direction);
    let to_origin = subtract(whole(ray.origin), whole(triangle.v0));
    // Cramer's rule for origin + t · direction = v0 + u · edge_1 + v · edge_2.
    let normal = cross(edge_1, edge_2);
    let sign = -dot(normal, direction).signum();
    let area = -sign * dot(normal, direction);
    let t = sign * dot(normal, to_origin);
    let moment = cross(to_origin, direction);
    let u = sign * dot(edge_2, moment);
    let v = sign * -dot(edge_1, moment);
    if area == 0 {
        return Exact::EdgeOn;
    }
    if u < 0 || v < 0 || u + v > area {
        return Exact::Miss;
    }
    if u == 0 || v == 0 || u + v == area {
        return Exact::Edge;
    }
    Exact::Inside(t, area)
}

/// True if a test uses only products of edges.
fn is_exact(test: AnyTriangleTest) -> bool {
    test.name() == MoellerTrumbore.name()
}

/// Rounding error of the distance `t`. Products of edges are exact on a lattice, so only the
/// quotient is rounded; a shearing test averages the distances of the vertices.
fn tolerance(test: AnyTriangleTest, record: &TriangleRecord, ray: &Ray, t: f64) -> f64 {
    let size = ray.direction.map(f32::abs);
    let longest = (0..3).fold(0, |z, a| if size[a] > size[z] { a } else { z });
    let far = record
        .vertices()
        .map(|v| (v[longest] - ray.origin[longest]).abs());
    let far = f64::from(far.into_iter().fold(0.0, f32::max) / size[longest]);
    let reach = if is_exact(test) {
        t.abs()
    } else {
        t.abs().max(far)
    };
    reach * 2.0_f64.powi(-21)
}

#[test]
fn moeller_trumbore_agrees_with_exact_integer_arithmetic() {
    agrees_with_integers(&MoellerTrumbore);
}

#[test]
fn watertight_agrees_with_exact_integer_arithmetic() {
    agrees_with_integers(&Watertight);
}

#[test]
fn compensated_agrees_with_exact_integer_arithmetic() {
    agrees_with_integers(&Compensated);
}

fn agrees_with_integers(triangle: AnyTriangleTest) {
    let tests = Intersection {
        triangle,
        ..Intersection::default()
    };
    let (mut inside, mut edges) = (0, 0);
    for seed in 0..400 {
        let mut rng = Pcg::new(seed);
        let extent = rng.between(2, 12);
        let soup = scenes::lattice_soup(&mut rng, 24, extent);
        for ray in scenes::lattice_rays(&mut rng, 64, extent) {
            for record in &soup.records {
                let alone = TriangleSoup::from(vec![*record]).intersecting(tests);
                let hit = brute_force(&alone, &[ray])[0];
                let found = hit.triangle != NO_HIT;
                match exactly(record, &ray) {
                    Exact::Miss => assert!(!found, "{ray:?} misses {record:?}, found {hit:?}"),
                    // Products of edges are exact here.
                    Exact::EdgeOn => {
                        let exact = is_exact(triangle);
                        assert!(!found || !exact, "{ray:?} grazes {record:?}, found {hit:?}");
                    }
                    Exact::Edge => edges += 1,
                    Exact::Inside(t, area) => {
                        inside += 1;
                        let t = t as f64 / area as f64;
                        let (low, high) = (f64::from(ray.t_min), f64::from(ray.t_max));
                        let slack = tolerance(triangle, record, &ray, t);
                        // A rounded distance may fall on either side of an end.
                        let near = |end: f64| (t - end).abs() <= slack;
                        let exact = is_exact(triangle);
                        assert!(
                            found == (low..=high).contains(&t)
                                || !exact && (near(low) || near(high)),
                            "{ray:?} meets {record:?} at {t}"
                        );
                        let close = (f64::from(hit.t) - t).abs() <= slack;
                        assert!(!found || close, "{ray:?}: {} is not {t}", hit.t);
                    }
                }
            }
        }
    }
    assert!(
        inside > 1000 && edges > 1000,
        "blunt: {inside} inside, {edges} on edges"
    );
}

#[test]
fn rays_through_corners_and_edges_of_a_closed_surface_never_pass() {
    // A flat wall of quads, cut along alternating diagonals.
    let quad = |i: usize| {
        let corner = glam::Vec3::new((i % 8) as f32, (i / 8) as f32, 2.0);
        let [a, b] = [corner, corner + glam::Vec3::X];
        let [c, d] = [b + glam::Vec3::Y, corner + glam::Vec3::Y];
        if i.is_multiple_of(3) {
            [[a, b, c], [a, c, d]]
        } else {
            [[a, b, d], [b, c, d]]
        }
    };
    let wall = scenes::soup((0..64).flat_map(quad));
    let mut rays = Vec::new();
    for zeros in [[0.0, 0.0], [0.0, -0.0], [-0.0, 0.0], [-0.0, -0.0_f32]] {
        for step in 0..(15 * 15) {
            let [x, y] = [step % 15, step / 15].map(|i| 0.5 + 0.5 * i as f32);
            rays.push(Ray {
                origin: [x, y, 0.0],
                t_min: 0.0,
                direction: [zeros[0], zeros[1], 1.0],
                t_max: scenes::FAR,
            });
        }
    }
    for (ray, hit) in rays.iter().zip(brute_force(&wall, &rays)) {
        assert_eq!(hit.t, 2.0, "{ray:?} passes");
    }
}
