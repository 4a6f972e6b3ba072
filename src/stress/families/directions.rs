//! Ordinary meshes; directions, origins and intervals that are not.

use super::super::case::{Maker, Meshes, Truth, towards};
use super::super::placement::Placement;
use super::super::shapes::{RADIUS, on, on_edge, on_mesh, sphere, vertex};
use super::closed::{inside, truth};
use glam::{DVec3, Vec3};
use raystone_accel::Ray;
use raystone_accel::oracle::ExactCrossing;
use raystone_core::geometry::Triangle;
use raystone_core::random::Pcg32;
use raystone_scene::Bounds;

/// A coarse sphere and a coarse box.
const MESHES: Meshes = Meshes { bands: 8, cells: 4 };

/// Adds the meshes at each place with rays made one by one.
fn on_every_rung(maker: &mut Maker, one: fn(&Placement, &[Triangle], &mut Pcg32) -> Ray) {
    maker.add_on_every_rung(MESHES, "", |_| Truth::Exact, one);
}

pub(super) fn axis_parallel(maker: &mut Maker) {
    on_every_rung(maker, |place, mesh, random| {
        let triangle = random.one_of(mesh);
        let target = match random.below(3) {
            0 => vertex(&triangle, random),
            1 => on_edge(&triangle, random),
            _ => on(&triangle, random),
        };
        let mut direction = [0; 3].map(|_| random.one_of(&[0.0, -0.0]));
        let axis = random.below(3);
        direction[axis] = random.one_of(&[1.0, -1.0]);
        if random.below(3) == 0 {
            direction[(axis + 1) % 3] = random.one_of(&[1.0, -1.0, 0.5]);
        }
        // Start outside, inside, or somewhere along the line beyond the mesh.
        let back = (random.one_of(&[0.5, 1.0, 3.0]) * 2.0 * RADIUS * place.scale) as f32;
        Ray::new(target - back * Vec3::from(direction), direction)
    });
}

pub(super) fn in_plane(maker: &mut Maker) {
    on_every_rung(maker, |_, mesh, random| {
        let triangle = random.one_of(mesh);
        let [a, b, _] = triangle.vertices;
        let target = on(&triangle, random);
        match random.below(3) {
            // Along an edge, from beyond it.
            0 => towards(a + (a - b), b),
            1 => towards(a, b),
            // Across the plane: exactly in it on the box, nearly on the sphere.
            _ => {
                let from = a.as_dvec3() + (a - b).as_dvec3() * (1.0 + random.uniform());
                towards(from.as_vec3(), target)
            }
        }
    });
}

/// Returns a point of a plane that cuts the scene's box into equal cells.
fn on_cell_border(bounds: &Bounds, random: &mut Pcg32) -> Vec3 {
    let cells = 1 + random.below(8);
    let size = (bounds.max - bounds.min).as_dvec3();
    let mut p = bounds.min.as_dvec3() + size * (0.5 * (random.in_cube() + DVec3::ONE));
    for _ in 0..1 + random.below(3) {
        let axis = random.below(3);
        let border = random.below(cells + 1) as f64 / cells as f64;
        p[axis] = f64::from(bounds.min[axis]) + size[axis] * border;
    }
    p.as_vec3()
}

pub(super) fn origins(maker: &mut Maker) {
    on_every_rung(maker, |place, mesh, random| {
        let triangle = random.one_of(mesh);
        let bounds = Bounds::of(mesh);
        let origin = match random.below(5) {
            0 => vertex(&triangle, random),
            1 => on_edge(&triangle, random),
            2 => on(&triangle, random),
            3 => on_cell_border(&bounds, random),
            _ => inside(random, place),
        };
        match random.below(2) {
            0 => Ray::new(origin, random.direction().as_vec3()),
            _ => towards(origin, on_mesh(mesh, random)),
        }
    });
}

pub(super) fn interval_ends(maker: &mut Maker) {
    on_every_rung(maker, |place, mesh, random| {
        let triangle = random.one_of(mesh);
        let whole = towards(inside(random, place), on(&triangle, random));
        let t = ExactCrossing::new(&triangle, &whole).t as f32;
        if !(t > 0.0 && t < Ray::FAR) {
            return whole;
        }
        let (t_min, t_max) = match random.below(5) {
            0 => (0.0, t),
            1 => (t, Ray::FAR),
            2 => (t, t),
            3 => (0.0, t.next_down()),
            _ => (t.next_up(), Ray::FAR),
        };
        whole.between(t_min, t_max)
    });
}

/// Values of a direction that mean 0: zeros of both signs, sin π in f32 and in f64, and less.
const NOTHINGS: [f32; 8] = [
    0.0,
    -0.0,
    -8.742_278e-8,
    1.224_646_8e-16,
    -1e-20,
    1e-30,
    -1e-38,
    1e-44,
];

/// Returns a ray of any length from 10⁻¹⁰ to 10¹⁰, most often with a component or two that are next to nothing, and
/// from the coordinates of a vertex along those.
fn of_any_length(from: Vec3, mesh: &[Triangle], random: &mut Pcg32) -> Ray {
    let mut from = from;
    let mut direction = random.direction().as_vec3();
    let triangle = random.one_of(mesh);
    let vertex = vertex(&triangle, random);
    let first = random.below(3);
    for k in 0..random.below(3) {
        let axis = (first + k) % 3;
        direction[axis] = random.one_of(&NOTHINGS);
        if (vertex[axis] - from[axis]).abs() < 0.25 * from.distance(vertex) {
            from[axis] = vertex[axis];
        }
    }
    let length = 10_f64.powf(10.0 * random.signed()) as f32;
    Ray::new(from, length * direction)
}

/// Returns a ray of any length from around the middle of a mesh.
pub(super) fn from_the_middle(place: &Placement, mesh: &[Triangle], random: &mut Pcg32) -> Ray {
    of_any_length(place.point(0.2 * RADIUS * random.in_cube()), mesh, random)
}

pub(super) fn lengths(maker: &mut Maker) {
    let meshes = Meshes {
        bands: 12,
        ..MESHES
    };
    maker.add_on_every_rung(meshes, "", truth, from_the_middle);
}

pub(super) fn seams(maker: &mut Maker) {
    let place = Placement::ORDINARY;
    for seam in [
        8.742_278e-8,
        -8.742_278e-8,
        1.224_646_8e-16,
        -5.42e-20,
        1e-30,
    ] {
        let noisy = |x: f32| if x.abs() < 1e-6 { seam } else { x };
        let mesh = |_: &mut Pcg32| {
            let noisy = |v: Vec3| Vec3::from_array(v.to_array().map(noisy));
            let sphere = sphere(12, &place).into_iter();
            sphere.map(|t| t.map(noisy)).collect()
        };
        let label = format!("{seam:e} for 0");
        maker.add_each(label, place, Truth::Closed, mesh, |mesh, random| {
            let mut from = place.point(0.2 * RADIUS * random.in_cube());
            for _ in 0..random.below(4) {
                from[random.below(3)] = random.one_of(&NOTHINGS);
            }
            of_any_length(from, mesh, random)
        });
    }
}
