//! Closed meshes: from inside, every miss is a crack.

use super::super::case::{Maker, Random, Truth, ray, towards};
use super::super::place::Place;
use super::super::shapes::{Mesh, RADIUS, cube, sphere};
use crate::accel::Ray;
use crate::geometry::Triangle;
use glam::{DVec3, Vec3};

/// Bands of the sphere: 528 triangles.
const BANDS: usize = 12;
/// Cells along an edge of the box: 300 triangles.
const CELLS: usize = 5;
/// Bounces of a chain.
const BOUNCES: usize = 100;
/// How far inside the analytic surface a chain turns, as a fraction: facets lie within.
const INSIDE: f64 = 0.98;

type MakeMesh = fn(&Place) -> Mesh;

fn meshes() -> [(&'static str, MakeMesh); 2] {
    [
        ("sphere", |place| sphere(BANDS, place)),
        ("box", |place| cube(CELLS, place)),
    ]
}

/// A mesh that rounding has crushed is as closed as before, but has no inside.
pub fn truth(place: &Place) -> Truth {
    match place.keeps_shape() {
        true => Truth::Closed,
        false => Truth::Exact,
    }
}

/// A point well inside the sphere and the box.
pub fn inside(random: &mut Random, place: &Place) -> Vec3 {
    place.point(0.45 * RADIUS * random.in_cube())
}

/// Adds each mesh at each place with rays made one by one.
fn on_every_rung(
    maker: &mut Maker,
    suffix: &str,
    truth: fn(&Place) -> Truth,
    one: fn(&Place, &[Triangle], &mut Random) -> Ray,
) {
    for place in maker.places() {
        for (name, mesh) in meshes() {
            let label = format!("{name}{suffix}, {place}");
            maker.add(
                label,
                place,
                truth(&place),
                |_| mesh(&place),
                |mesh, random, count| (0..count).map(|_| one(&place, mesh, random)).collect(),
            );
        }
    }
}

pub fn watertight(maker: &mut Maker) {
    on_every_rung(maker, "", truth, |place, _, random| {
        ray(inside(random, place), random.direction().as_vec3())
    });
}

pub fn vertices(maker: &mut Maker) {
    on_every_rung(maker, "", truth, |place, mesh, random| {
        let at = random.below(mesh.len());
        let vertex = mesh[at].vertices[random.below(3)];
        towards(inside(random, place), vertex)
    });
    on_every_rung(
        maker,
        " from outside",
        |_| Truth::Exact,
        |place, mesh, random| {
            let at = random.below(mesh.len());
            let vertex = mesh[at].vertices[random.below(3)];
            towards(place.point(3.0 * RADIUS * random.direction()), vertex)
        },
    );
}

/// A point of an edge, as near as f32 comes.
pub fn on_edge(triangle: &Triangle, random: &mut Random) -> Vec3 {
    let k = random.below(3);
    let [a, b] = [k, (k + 1) % 3].map(|k| triangle.vertices[k].as_dvec3());
    // Middles are points of f32 more often than others.
    let share = if random.below(4) == 0 {
        0.5
    } else {
        random.unit()
    };
    (a + (b - a) * share).as_vec3()
}

pub fn edges(maker: &mut Maker) {
    on_every_rung(maker, "", truth, |place, mesh, random| {
        let at = random.below(mesh.len());
        towards(inside(random, place), on_edge(&mesh[at], random))
    });
    on_every_rung(
        maker,
        " from outside",
        |_| Truth::Exact,
        |place, mesh, random| {
            let at = random.below(mesh.len());
            let target = on_edge(&mesh[at], random);
            towards(place.point(3.0 * RADIUS * random.direction()), target)
        },
    );
}

/// One bounce from `p` along `d`: where and where to, on the analytic surface.
type Bounce = fn(DVec3, DVec3) -> (DVec3, DVec3);

fn bounce_in_box(p: DVec3, d: DVec3) -> (DVec3, DVec3) {
    let half = INSIDE * RADIUS;
    let distance = |axis: usize| match d[axis] {
        0.0 => f64::INFINITY,
        slope => (half.copysign(slope) - p[axis]) / slope,
    };
    let nearest = |a: usize, b: usize| if distance(b) < distance(a) { b } else { a };
    let axis = nearest(nearest(0, 1), 2);
    let mut turned = d;
    turned[axis] = -d[axis];
    (
        (p + d * distance(axis)).clamp(DVec3::splat(-half), DVec3::splat(half)),
        turned,
    )
}

fn bounce_in_sphere(p: DVec3, d: DVec3) -> (DVec3, DVec3) {
    let radius = INSIDE * RADIUS;
    let along = p.dot(d);
    let reach = (along * along + radius * radius - p.length_squared())
        .max(0.0)
        .sqrt();
    let normal = (p + d * (reach - along)).normalize();
    (
        radius * normal,
        (d - normal * (2.0 * d.dot(normal))).normalize(),
    )
}

pub fn mirror_chains(maker: &mut Maker) {
    let bounces: [Bounce; 2] = [bounce_in_sphere, bounce_in_box];
    for place in maker.places() {
        for ((name, mesh), bounce) in meshes().into_iter().zip(bounces) {
            let label = format!("{name}, {place}");
            maker.add(
                label,
                place,
                truth(&place),
                |_| mesh(&place),
                |_, random, count| {
                    let mut rays = Vec::with_capacity(count);
                    while rays.len() < count {
                        let (mut p, mut d) = (0.4 * random.in_cube(), random.direction());
                        for _ in 0..BOUNCES {
                            (p, d) = bounce(p, d);
                            rays.push(ray(place.point(p), d.as_vec3()));
                        }
                    }
                    rays
                },
            );
        }
    }
}
