//! Meshes of the suite, modelled about two units around the origin in f64 and rounded once.

use super::placement::Placement;
use glam::{DVec3, Vec3};
use raystone_core::geometry::Triangle;
use raystone_core::random::Pcg32;
use std::collections::{HashMap, HashSet};

/// Triangles in the scene.
pub(crate) type Mesh = Vec<Triangle>;

/// Radius of the sphere and half the side of the box, units; Embree's test has the same.
pub(crate) const RADIUS: f64 = 2.0;

/// Returns a closed grid of longitude and latitude, `bands` × 2 `bands`; the polar bands are fans.
pub(crate) fn sphere(bands: usize, place: &Placement) -> Mesh {
    let sectors = 2 * bands;
    let at = |band: usize, sector: usize| {
        // Both poles and the seam are the same point to the bit however they are reached.
        let (sin, cos) = (std::f64::consts::PI * band as f64 / bands as f64).sin_cos();
        let (y, x) = (std::f64::consts::TAU * (sector % sectors) as f64 / sectors as f64).sin_cos();
        let radius = if band == 0 || band == bands { 0.0 } else { sin };
        place.point(RADIUS * DVec3::new(radius * x, cos, radius * y))
    };
    let mut mesh = Mesh::new();
    for band in 0..bands {
        for sector in 0..sectors {
            let [a, b] = [at(band, sector), at(band, sector + 1)];
            let [c, d] = [at(band + 1, sector + 1), at(band + 1, sector)];
            if band > 0 {
                mesh.push([a, b, c].into());
            }
            if band + 1 < bands {
                mesh.push([a, c, d].into());
            }
        }
    }
    mesh
}

/// Returns a level square of `cells` × `cells` quadrilaterals, `side` units wide, through the origin.
pub(crate) fn plane(cells: usize, side: f64, place: &Placement) -> Mesh {
    grid(cells, place, |u, v| {
        DVec3::new(side * (u - 0.5), 0.0, side * (v - 0.5))
    })
}

/// Returns a closed box, each face `cells` × `cells` quadrilaterals.
pub(crate) fn cube(cells: usize, place: &Placement) -> Mesh {
    let face = |axis: usize, end: f64| {
        move |u: f64, v: f64| {
            let mut p = DVec3::ZERO;
            p[axis] = RADIUS * end;
            p[(axis + 1) % 3] = RADIUS * (2.0 * u - 1.0);
            p[(axis + 2) % 3] = RADIUS * (2.0 * v - 1.0);
            p
        }
    };
    let faces = (0..3).flat_map(|axis| [(axis, -1.0), (axis, 1.0)]);
    faces
        .flat_map(|(axis, end)| grid(cells, place, face(axis, end)))
        .collect()
}

fn grid(cells: usize, place: &Placement, at: impl Fn(f64, f64) -> DVec3) -> Mesh {
    let corner =
        |i: usize, k: usize| place.point(at(i as f64 / cells as f64, k as f64 / cells as f64));
    let mut mesh = Mesh::with_capacity(2 * cells * cells);
    for i in 0..cells {
        for k in 0..cells {
            let [a, b] = [corner(i, k), corner(i, k + 1)];
            let [c, d] = [corner(i + 1, k + 1), corner(i + 1, k)];
            mesh.extend([[a, b, c], [a, c, d]].map(Triangle::from));
        }
    }
    mesh
}

/// Returns a point of a triangle's plane, inside it, rounded.
pub(crate) fn on(triangle: &Triangle, random: &mut Pcg32) -> Vec3 {
    let root = random.uniform().sqrt();
    let v = random.uniform();
    let [a, b, c] = triangle.vertices.map(|p| p.as_dvec3());
    (a + (b - a) * (root * (1.0 - v)) + (c - a) * (root * v)).as_vec3()
}

/// Returns a point of an edge, as near as f32 comes.
pub(crate) fn on_edge(triangle: &Triangle, random: &mut Pcg32) -> Vec3 {
    let k = random.below(3);
    let [a, b] = [k, (k + 1) % 3].map(|k| triangle.vertices[k].as_dvec3());
    // Middles are points of f32 more often than others.
    let share = match random.below(4) {
        0 => 0.5,
        _ => random.uniform(),
    };
    (a + (b - a) * share).as_vec3()
}

/// Returns a corner of a triangle.
pub(crate) fn vertex(triangle: &Triangle, random: &mut Pcg32) -> Vec3 {
    random.one_of(&triangle.vertices)
}

/// Returns a point of a random triangle, rounded.
pub(crate) fn on_mesh(mesh: &[Triangle], random: &mut Pcg32) -> Vec3 {
    on(&random.one_of(mesh), random)
}

/// Returns a model moved and scaled to the sphere's size, its holes closed by fans.
pub(crate) fn model(triangles: &[Triangle], place: &Placement) -> Mesh {
    let points = || triangles.iter().flat_map(|t| t.vertices);
    let low = points().fold(Vec3::INFINITY, Vec3::min).as_dvec3();
    let high = points().fold(Vec3::NEG_INFINITY, Vec3::max).as_dvec3();
    let factor = 2.0 * RADIUS / (high - low).max_element().max(f64::MIN_POSITIVE);
    let moved = |v: Vec3| factor * (v.as_dvec3() - 0.5 * (low + high));
    let corners: Vec<[DVec3; 3]> = triangles.iter().map(|t| t.vertices.map(moved)).collect();
    let closed = close_holes(&corners);
    let placed = |t: [DVec3; 3]| t.map(|v| place.point(v)).into();
    closed.into_iter().map(placed).collect()
}

/// Returns a point as a key.
fn bits(v: DVec3) -> [u64; 3] {
    v.to_array().map(|x| (x + 0.0).to_bits())
}

/// Returns the triangles, and a fan over every loop of edges that only one triangle has.
fn close_holes(triangles: &[[DVec3; 3]]) -> Vec<[DVec3; 3]> {
    let directed = || {
        triangles
            .iter()
            .flat_map(|t| [0, 1, 2].map(|k| (t[k], t[(k + 1) % 3])))
    };
    let present: HashSet<_> = directed().map(|(a, b)| [bits(a), bits(b)]).collect();
    // The fan runs along each open edge the other way.
    let open = directed().filter(|(a, b)| !present.contains(&[bits(*b), bits(*a)]));
    let mut after: HashMap<[u64; 3], Vec<(DVec3, DVec3)>> = HashMap::new();
    for (a, b) in open {
        after.entry(bits(b)).or_default().push((b, a));
    }
    let mut starts: Vec<[u64; 3]> = after.keys().copied().collect();
    starts.sort_unstable();
    let mut closed = triangles.to_vec();
    for start in starts {
        while let Some(mut edge) = after.get_mut(&start).and_then(Vec::pop) {
            let mut rim = vec![edge];
            while bits(edge.1) != start {
                let Some(next) = after.get_mut(&bits(edge.1)).and_then(Vec::pop) else {
                    break;
                };
                edge = next;
                rim.push(edge);
            }
            let middle = rim.iter().map(|(a, _)| *a).sum::<DVec3>() / rim.len() as f64;
            closed.extend(rim.iter().map(|(a, b)| [*a, *b, middle]));
        }
    }
    closed
}

/// Returns `true` if every edge belongs to an even number of triangles of any orientation. Vertices joined by
/// rounding do not affect this.
#[cfg(test)]
fn is_closed(mesh: &[Triangle]) -> bool {
    let mut uses: HashMap<[[u32; 3]; 2], u32> = HashMap::new();
    let key = |v: Vec3| v.to_array().map(|x| (x + 0.0).to_bits());
    for triangle in mesh {
        for k in 0..3 {
            let mut edge = [k, (k + 1) % 3].map(|k| key(triangle.vertices[k]));
            edge.sort_unstable();
            *uses.entry(edge).or_default() += 1;
        }
    }
    uses.values().all(|n| n % 2 == 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sphere_and_box_are_closed_wherever_they_stand_and_the_plane_is_not() {
        for place in Placement::ladder(false) {
            assert!(is_closed(&sphere(8, &place)), "{place}");
            assert!(is_closed(&cube(3, &place)), "{place}");
        }
        assert!(!is_closed(&plane(4, 2.0, &Placement::ORDINARY)));
        assert_eq!(sphere(8, &Placement::ORDINARY).len(), 2 * 16 * 7);
    }

    #[test]
    fn a_model_with_holes_is_closed_by_fans() {
        let mut mesh = sphere(8, &Placement::ORDINARY);
        for hole in [3, 40, 41, 42, 100] {
            mesh.remove(hole);
        }
        assert!(!is_closed(&mesh));
        assert!(is_closed(&model(&mesh, &Placement::FAR)));
    }
}
