//! Closed surfaces from inside: triangle tests that leak rays.

use super::{ray, tests_of};
use crate::support::{Pcg, scenes};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use raystone::accel::{
    BuildLog, BuiltBvh, BvhParameters, Counters, CpuTwin, NO_HIT, Ray, TriangleRegistry,
    TriangleSoup,
};

/// A closed surface of triangles with bit-identical shared corners: a sphere of radius 2 over the
/// faces of an octahedron, around `centre`.
pub fn sphere(steps: i32, centre: DVec3) -> Vec<[Vec3; 3]> {
    let vertex = |signs: [i32; 3], i: i32, j: i32| {
        let lattice = [i, j, steps - i - j];
        let direction = DVec3::from_array([0, 1, 2].map(|a| f64::from(lattice[a] * signs[a])));
        (centre + 2.0 * direction.normalize()).as_vec3()
    };
    let mut out = Vec::new();
    for octant in 0..8 {
        let signs = [0, 1, 2].map(|a| 1 - 2 * (octant >> a & 1));
        for i in 0..steps {
            for j in 0..steps - i {
                let corner = |di, dj| vertex(signs, i + di, j + dj);
                out.push([corner(0, 0), corner(1, 0), corner(0, 1)]);
                if i + j + 1 < steps {
                    out.push([corner(1, 0), corner(1, 1), corner(0, 1)]);
                }
            }
        }
    }
    out
}

/// A closed cube of side 4 around `centre`, each face a grid.
fn cube(steps: i32, centre: DVec3) -> Vec<[Vec3; 3]> {
    let mut out = Vec::new();
    for face in 0..6 {
        let (axis, side) = (face / 2, f64::from(face % 2 * 4 - 2));
        let vertex = |i: i32, j: i32| {
            let at = |k: i32| f64::from(k) * 4.0 / f64::from(steps) - 2.0;
            let mut point = DVec3::ZERO;
            (point[axis as usize], point[(axis as usize + 1) % 3]) = (side, at(i));
            point[(axis as usize + 2) % 3] = at(j);
            (centre + point).as_vec3()
        };
        for i in 0..steps {
            for j in 0..steps {
                let [a, b] = [vertex(i, j), vertex(i + 1, j)];
                let [c, d] = [vertex(i + 1, j + 1), vertex(i, j + 1)];
                if (i + j) % 2 == 0 {
                    out.extend([[a, b, c], [a, c, d]]);
                } else {
                    out.extend([[a, b, d], [b, c, d]]);
                }
            }
        }
    }
    out
}

/// Rays from inside: in all directions, at vertices and edges, along axes with zeros of both signs.
pub fn inner_rays(triangles: &[[Vec3; 3]], centre: DVec3, count: usize) -> Vec<Ray> {
    let one = |index: usize| {
        let mut rng = Pcg::new(index as u64);
        let point = |rng: &mut Pcg| Vec3::new(rng.signed(), rng.signed(), rng.signed());
        let mut origin = (centre + 0.7 * point(&mut rng).as_dvec3()).as_vec3();
        let triangle = triangles[rng.below(triangles.len() as u32) as usize];
        let direction = match index % 4 {
            0 => point(&mut rng),
            1 => triangle[rng.below(3) as usize] - origin,
            2 => triangle[0] + rng.unit() * (triangle[1] - triangle[0]) - origin,
            _ => {
                // From a vertex coordinate, so that the ray runs through vertices and edges.
                let axis = rng.below(3) as usize;
                let other = (axis + 1 + rng.below(2) as usize) % 3;
                let near = triangle[0][other] as f64 - centre[other];
                if near.abs() < 1.0 {
                    origin[other] = triangle[0][other];
                }
                let mut direction = Vec3::splat(if rng.below(2) == 0 { 0.0 } else { -0.0 });
                direction[axis] = if rng.below(2) == 0 { 1.0 } else { -1.0 };
                if rng.below(2) == 0 {
                    direction[3 - axis - other] = rng.signed();
                }
                direction
            }
        };
        ray(origin, direction)
    };
    (0..count).into_par_iter().map(one).collect()
}

fn leaks(soup: &TriangleSoup, rays: &[Ray]) -> Vec<usize> {
    let params = BvhParameters::default();
    let built = BuiltBvh::build(soup, &params, &mut BuildLog::default()).expect("a small scene");
    let twin = built.twin(soup);
    let leaks = |i: &usize| {
        let hit = twin.closest_hit(&rays[*i], &mut Counters::default());
        hit.triangle == NO_HIT
    };
    (0..rays.len()).into_par_iter().filter(leaks).collect()
}

pub const ORDINARY: DVec3 = DVec3::new(0.3, -0.2, 0.1);
/// Location of the meshes in Embree's own test.
const FAR_AWAY: DVec3 = DVec3::new(148_376.0, 1234.0, -223_423.0);

fn closed_meshes() -> [(&'static str, DVec3, Vec<[Vec3; 3]>); 4] {
    [
        ("sphere", ORDINARY, sphere(40, ORDINARY)),
        ("cube", ORDINARY, cube(16, ORDINARY)),
        ("sphere far away", FAR_AWAY, sphere(40, FAR_AWAY)),
        ("cube far away", FAR_AWAY, cube(16, FAR_AWAY)),
    ]
}

#[test]
fn closed_surfaces_are_watertight_and_another_test_leaks() {
    let mut leaking = vec![0; TriangleRegistry::default().iter().count()];
    for (mesh, centre, triangles) in closed_meshes() {
        let rays = inner_rays(&triangles, centre, 1_000_000);
        for (index, triangle) in TriangleRegistry::default().iter().enumerate() {
            let watertight = triangle.is_watertight();
            let rays = if watertight {
                &rays[..]
            } else {
                &rays[..200_000]
            };
            let soup = scenes::soup(triangles.iter().copied()).intersecting(tests_of(triangle));
            let lost = leaks(&soup, rays);
            println!(
                "{mesh}, {}: {} of {} rays leak {:?}",
                triangle.name(),
                lost.len(),
                rays.len(),
                lost.first().map(|&i| (i % 4, rays[i]))
            );
            leaking[index] += lost.len();
            if watertight {
                assert!(lost.is_empty(), "{mesh}, {}: leaks", triangle.name());
            }
        }
    }
    // Negative control.
    assert!(leaking[0] > 0, "Möller–Trumbore never leaked: {leaking:?}");
}
