//! Meshes that are hard, with rays at their triangles.

use super::super::case::{Maker, Truth, towards};
use super::super::placement::Placement;
use super::super::shapes::{Mesh, RADIUS, cube, on, on_edge, on_mesh, plane, sphere, vertex};
use super::closed::inside;
use glam::{DVec3, Vec3};
use raystone_accel::Ray;
use raystone_core::geometry::Triangle;
use raystone_core::params::{ParamValue, Params, Variant};
use raystone_core::random::Pcg32;
use raystone_scene::{LoadOptions, load};

/// Returns rays at insides, edges and vertices of random triangles, from about the mesh.
fn shots(place: Placement) -> impl Fn(&[Triangle], &mut Pcg32) -> Ray {
    move |mesh, random| {
        let triangle = random.one_of(mesh);
        let target = match random.below(4) {
            0 => vertex(&triangle, random),
            1 => on_edge(&triangle, random),
            _ => on(&triangle, random),
        };
        towards(place.point(2.0 * RADIUS * random.in_cube()), target)
    }
}

/// Returns a triangle `1 : 10^-digits` in a random pose.
fn needle(random: &mut Pcg32, digits: f64) -> [DVec3; 3] {
    let start = RADIUS * random.in_cube();
    let along = random.direction();
    let aside = along.any_orthonormal_vector() * (RADIUS * 10f64.powf(-digits));
    [
        start,
        start + RADIUS * along,
        start + RADIUS * along * random.uniform() + aside,
    ]
}

pub(super) fn needles(maker: &mut Maker) {
    for place in maker.places() {
        let mesh = |random: &mut Pcg32| -> Mesh {
            let one = |i: usize| needle(random, i as f64 * 6.0 / 255.0);
            let placed = |vertices: [DVec3; 3]| vertices.map(|v| place.point(v)).into();
            (0..256).map(one).map(placed).collect()
        };
        let label = format!("scattered, {place}");
        maker.add_each(label, place, Truth::Exact, mesh, shots(place));
    }
    // A box a million times wider than high: its walls are closed by needles.
    for place in maker.places().into_iter().filter(|p| p.shift == 0.0) {
        let label = format!("flat box, {place}");
        let flat = |_: &mut Pcg32| {
            let flatten = |v: Vec3| Vec3::new(v.x, v.y * 1e-6, v.z);
            cube(4, &place)
                .into_iter()
                .map(|t| t.map(flatten))
                .collect()
        };
        maker.add_each(label, place, Truth::Closed, flat, |_, random| {
            let flatten = DVec3::new(1.0, 1e-6, 1.0);
            let from = place.point(0.9 * RADIUS * random.in_cube() * flatten);
            let to = place.point(RADIUS * random.direction() * flatten);
            towards(from, to)
        });
    }
}

pub(super) fn slivers(maker: &mut Maker) {
    for place in maker.places() {
        let mesh = |random: &mut Pcg32| {
            let mut mesh = sphere(8, &place);
            let whole = mesh.len();
            for i in 0..whole {
                let [a, b, c] = mesh[i].vertices;
                let nearly = |v: Vec3| Vec3::new(v.x.next_up(), v.y, v.z.next_down());
                let vertices = match i % 6 {
                    0 => [a, a, a],
                    1 => [a, b, b],
                    2 => [a, b, 0.5 * (a + b)],
                    3 => [a, b, nearly(a)],
                    4 => [a, c, nearly(0.5 * (a + c))],
                    // Duplicates, begun at another corner or turned over.
                    _ => random.one_of(&[[a, b, c], [b, c, a], [c, b, a]]),
                };
                mesh.push(vertices.into());
            }
            mesh
        };
        maker.add_each(format!("{place}"), place, Truth::Exact, mesh, shots(place));
    }
}

pub(super) fn coincident(maker: &mut Maker) {
    for place in maker.places() {
        let mesh = |random: &mut Pcg32| {
            let layer = plane(5, 2.0 * RADIUS, &place);
            let mut mesh = layer.clone();
            for copy in 0..5 {
                let mut again = layer.clone();
                for triangle in &mut again {
                    triangle.vertices.rotate_left(random.below(3));
                    *triangle = match copy {
                        3 => triangle.map(|v| v.with_y(v.y.next_up())),
                        4 => triangle.map(|v| v.with_y(v.y.next_down())),
                        _ => *triangle,
                    };
                }
                mesh.extend(again);
            }
            mesh
        };
        maker.add_each(format!("{place}"), place, Truth::Exact, mesh, shots(place));
    }
}

pub(super) fn huge_and_tiny(maker: &mut Maker) {
    for place in maker.places() {
        let mesh = |_: &mut Pcg32| {
            let far = 1e6 * RADIUS;
            let mut mesh = sphere(8, &place);
            mesh.extend(plane(6, 2.0 * far, &place));
            let wall = [
                DVec3::new(-far, -far, far),
                DVec3::new(far, -far, far),
                DVec3::new(0.0, far, far),
            ];
            mesh.push(wall.map(|v| place.point(v)).into());
            mesh
        };
        let label = format!("{place}");
        maker.add_each(label, place, Truth::Exact, mesh, |mesh, random| {
            let target = on_mesh(mesh, random);
            let far = place.point(1e6 * RADIUS * random.in_cube());
            let near = inside(random, &place);
            let from = if random.below(2) == 0 { far } else { near };
            if from == target {
                Ray::new(from, Vec3::X)
            } else {
                towards(from, target)
            }
        });
    }
    let scales: &[f64] = if maker.quick { &[] } else { &[1.0, 1e6] };
    for &scale in scales {
        let place = Placement { scale, shift: 0.0 };
        let Some(stadium) = stadium(scale as f32) else {
            continue;
        };
        let label = format!("stadium, {place}");
        let mesh = |_: &mut Pcg32| stadium;
        maker.add_each(label, place, Truth::Exact, mesh, |mesh, random| {
            let target = on_mesh(mesh, random);
            let near = place.point(DVec3::new(3.0, 4.0, 8.0) * random.in_cube().abs());
            towards(near, target)
        });
    }
}

/// Returns the built-in scene, coarse.
fn stadium(scale: f32) -> Option<Mesh> {
    let name = "teapot-in-a-stadium";
    let subdivision = ("subdivision".to_owned(), ParamValue::Integer(2));
    let variant = Variant {
        name: name.into(),
        params: Params([subdivision].into_iter().collect()),
        label: name.into(),
    };
    let scene = load(&variant, &LoadOptions::default()).ok()?;
    let scaled = scene.triangles.iter().map(|t| t.map(|v| v * scale));
    Some(scaled.collect())
}

pub(super) fn deep_trees(maker: &mut Maker) {
    let steps = 96;
    for (name, axes) in [("one axis", 1), ("three axes", 3)] {
        let mesh = move |_: &mut Pcg32| -> Mesh {
            let one = |i: usize| {
                let size = 2f64.powi(-(i as i32));
                let mut corner = DVec3::ZERO;
                for axis in 0..axes {
                    corner[axis] = RADIUS * size;
                }
                let [x, y] = [DVec3::X, DVec3::Y].map(|d| 0.4 * RADIUS * size * d);
                let lean = DVec3::Z * (0.1 * RADIUS * size);
                let vertices = [corner, corner + x + lean, corner + y - lean];
                vertices.map(|v| Placement::ORDINARY.point(v)).into()
            };
            (0..steps).map(one).collect()
        };
        let place = Placement::ORDINARY;
        maker.add_each(name, place, Truth::Exact, mesh, shots(place));
    }
}
