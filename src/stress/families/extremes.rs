//! Numbers at the ends of f32, and beyond.

use super::super::case::{Maker, Truth, towards};
use super::super::placement::Placement;
use super::super::shapes::{Mesh, RADIUS, cube, on_mesh, sphere};
use super::closed::inside;
use glam::Vec3;
use raystone_accel::Ray;
use raystone_accel::ray::SMALLEST_DIRECTION;
use raystone_core::random::Pcg32;
use raystone_scene::MAX_COORDINATE;

pub(super) fn denormal(maker: &mut Maker) {
    for scale in [1e-37, 1e-39, 1e-42] {
        let place = Placement { scale, shift: 0.0 };
        maker.add(
            format!("vertices, {place}"),
            place,
            Truth::Exact,
            |_| sphere(8, &place),
            |mesh, random, count| {
                let one = |_| {
                    let target = on_mesh(mesh, random);
                    let from = inside(random, &place);
                    // The difference itself is too small for a direction.
                    let direction = (target.as_dvec3() - from.as_dvec3()) / scale;
                    Ray::new(from, direction.as_vec3())
                };
                let rays = (0..).map(one).filter(Ray::is_ray);
                rays.take(count).collect()
            },
        );
    }
    let place = Placement::ORDINARY;
    let tiny = [1e-30, 1e-38, 1e-40, 1e-45, -1e-45];
    let cube = |_: &mut Pcg32| cube(4, &place);
    maker.add_each("directions", place, Truth::Exact, cube, |_, random| {
        let mut direction = random.direction().as_vec3();
        for axis in 0..random.below(3) {
            direction[axis] = random.one_of(&tiny);
        }
        Ray::new(inside(random, &place), direction)
    });
    maker.add_each("origins", place, Truth::Exact, cube, |_, random| {
        let origin = [0; 3].map(|_| random.one_of(&tiny));
        Ray::new(origin, random.direction().as_vec3())
    });
}

/// Values put into a ray.
const STRANGE: [(&str, [f32; 3]); 2] = [
    // NaN with either sign and another payload.
    (
        "NaN",
        [
            f32::NAN,
            f32::from_bits(0xffc0_0000),
            f32::from_bits(0x7f80_0001),
        ],
    ),
    (
        "infinite",
        [f32::INFINITY, f32::NEG_INFINITY, f32::INFINITY],
    ),
];

pub(super) fn non_finite(maker: &mut Maker) {
    let place = Placement::ORDINARY;
    let mut add = |label: &str, truth: Truth, spoil: &dyn Fn(&mut Ray, &mut Pcg32)| {
        let sphere = |_: &mut Pcg32| sphere(12, &place);
        maker.add_each(label, place, truth, sphere, |_, random| {
            let mut one = Ray::new(inside(random, &place), random.direction().as_vec3());
            spoil(&mut one, random);
            one
        });
    };
    for (name, values) in STRANGE {
        add(&format!("{name} origin"), Truth::Miss, &|ray, random| {
            ray.origin[random.below(3)] = random.one_of(&values);
        });
        add(&format!("{name} direction"), Truth::Miss, &|ray, random| {
            ray.direction[random.below(3)] = random.one_of(&values);
        });
    }
    add("NaN t_min", Truth::Miss, &|ray, _| ray.t_min = f32::NAN);
    add("NaN t_max", Truth::Miss, &|ray, _| ray.t_max = f32::NAN);
    add("zero direction", Truth::Miss, &|ray, random| {
        ray.direction = [0; 3].map(|_| random.one_of(&[0.0, -0.0]));
    });
    add("direction of nearly zero", Truth::Miss, &|ray, _| {
        ray.direction = ray.direction.map(|d| d * SMALLEST_DIRECTION.next_down());
    });
    add("empty interval", Truth::Exact, &|ray, _| {
        (ray.t_min, ray.t_max) = (2.0, 1.0);
    });
}

/// Returns random bits that are a number no greater than `limit`.
fn number(random: &mut Pcg32, limit: f32) -> f32 {
    loop {
        let x = f32::from_bits(random.next_u32());
        if x.abs() <= limit {
            return x;
        }
    }
}

/// Triangles of random corners.
fn shapeless(corner: impl Fn(&mut Pcg32) -> Vec3) -> impl Fn(&mut Pcg32) -> Mesh {
    move |random| {
        let mut one = || [0; 3].map(|_| corner(random)).into();
        (0..400).map(|_| one()).collect()
    }
}

pub(super) fn random_bits(maker: &mut Maker) {
    for (name, limit) in [
        ("up to 1e6", 1e6),
        ("up to the limit of coordinates", MAX_COORDINATE),
    ] {
        let vector = move |random: &mut Pcg32| Vec3::from([0; 3].map(|_| number(random, limit)));
        let (mesh, place) = (shapeless(vector), Placement::ORDINARY);
        maker.add(name, place, Truth::Exact, mesh, |mesh, random, count| {
            let one = |i: usize| {
                let from = vector(random);
                match i % 4 {
                    0 => Ray::new(from, vector(random)),
                    1 => Ray {
                        t_max: number(random, Ray::FAR).abs(),
                        ..Ray::new(from, vector(random))
                    },
                    _ => towards(from, on_mesh(mesh, random)),
                }
            };
            (0..).map(one).filter(Ray::is_ray).take(count).collect()
        });
    }
    // Even numbers of about the same size are rarely random bits, so that these rays often hit.
    let place = Placement {
        scale: RADIUS,
        shift: 0.0,
    };
    let nearby = |random: &mut Pcg32| f32::from_bits(0x3f00_0000 | random.next_u32() >> 8);
    let mesh = shapeless(move |random| Vec3::from([0; 3].map(|_| nearby(random))));
    let name = "random mantissas";
    maker.add_each(name, place, Truth::Exact, mesh, |mesh, random| {
        let target = on_mesh(mesh, random);
        towards(place.point(random.in_cube()), target)
    });
}
