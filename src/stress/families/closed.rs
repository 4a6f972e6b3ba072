//! Closed meshes: from inside, every miss is a crack.

use super::super::case::{Maker, Meshes, Truth, towards};
use super::super::placement::Placement;
use super::super::shapes::{RADIUS, on_edge, vertex};
use glam::{DVec3, Vec3};
use raystone_accel::Ray;
use raystone_core::random::Pcg32;

/// 528 and 300 triangles.
const MESHES: Meshes = Meshes {
    bands: 12,
    cells: 5,
};
/// Bounces of a chain.
const BOUNCES: usize = 100;
/// Size of the surface at which a chain turns, over that of the analytic one, which contains the facets.
const INSIDE: f64 = 0.98;

/// Returns the source of the right answers: a mesh crushed by rounding is as closed as before, but has no inside.
pub(super) fn truth(place: &Placement) -> Truth {
    if place.keeps_shape() {
        Truth::Closed
    } else {
        Truth::Exact
    }
}

/// Returns a point well inside the sphere and the box.
pub(super) fn inside(random: &mut Pcg32, place: &Placement) -> Vec3 {
    place.point(0.45 * RADIUS * random.in_cube())
}

/// Returns a point around the meshes.
fn outside(random: &mut Pcg32, place: &Placement) -> Vec3 {
    place.point(3.0 * RADIUS * random.direction())
}

pub(super) fn watertight(maker: &mut Maker) {
    maker.add_on_every_rung(MESHES, "", truth, |place, _, random| {
        Ray::new(inside(random, place), random.direction().as_vec3())
    });
}

pub(super) fn vertices(maker: &mut Maker) {
    let exact = |_: &Placement| Truth::Exact;
    maker.add_on_every_rung(MESHES, "", truth, |place, mesh, random| {
        let triangle = random.one_of(mesh);
        let vertex = vertex(&triangle, random);
        towards(inside(random, place), vertex)
    });
    maker.add_on_every_rung(MESHES, " from outside", exact, |place, mesh, random| {
        let triangle = random.one_of(mesh);
        let vertex = vertex(&triangle, random);
        towards(outside(random, place), vertex)
    });
}

pub(super) fn edges(maker: &mut Maker) {
    let exact = |_: &Placement| Truth::Exact;
    maker.add_on_every_rung(MESHES, "", truth, |place, mesh, random| {
        let triangle = random.one_of(mesh);
        let from = inside(random, place);
        towards(from, on_edge(&triangle, random))
    });
    maker.add_on_every_rung(MESHES, " from outside", exact, |place, mesh, random| {
        let triangle = random.one_of(mesh);
        let target = on_edge(&triangle, random);
        towards(outside(random, place), target)
    });
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

pub(super) fn mirror_chains(maker: &mut Maker) {
    let bounces: [Bounce; 2] = [bounce_in_sphere, bounce_in_box];
    for place in maker.places() {
        for ((name, mesh), bounce) in MESHES.at(&place).into_iter().zip(bounces) {
            let label = format!("{name}, {place}");
            maker.add(
                label,
                place,
                truth(&place),
                |_| mesh,
                |_, random, count| {
                    let mut rays = Vec::with_capacity(count);
                    while rays.len() < count {
                        let (mut p, mut d) = (0.4 * random.in_cube(), random.direction());
                        for _ in 0..BOUNCES {
                            (p, d) = bounce(p, d);
                            rays.push(Ray::new(place.point(p), d.as_vec3()));
                        }
                    }
                    rays
                },
            );
        }
    }
}
