//! Closed meshes hit from inside by rays of every length: no miss for any direction length, zero
//! components, noisy seams or instance scale; all structures agree.

use crate::support;
use crate::support::{assert_same_hits, build, default_params, in_turn, scenes, trace};
use glam::{DVec3, Vec3};
use raystone::accel::triangle::{AnyTriangleTest, Compensated, Watertight};
use raystone::accel::{
    AccelRegistry, BuiltAccel, Counters, Hit, Intersection, NO_HIT, Placed, Ray, Space,
    TriangleSoup, brute_force_hits, brute_force_instances,
};
use raystone::geometry::Triangle;
use raystone::scene::{Assembly, Transform};

/// Direction lengths: those of integrators, and far beyond.
const LENGTHS: [f32; 10] = [1e-15, 1e-10, 1e-7, 1e-5, 1e-4, 1e-2, 1.0, 1e4, 1e10, 1e20];
/// Values in place of zero coordinates: sin π in f32, in f64 and in extended precision, and less.
const SEAMS: [f64; 7] = [
    -8.742_278e-8,
    1.224_646_8e-16,
    -5.42e-20,
    1e-25,
    1e-30,
    -1e-37,
    0.0,
];

/// A closed sphere of radius 1 whose meridians and equator are off their planes by `seam`.
fn sphere(seam: f64) -> Vec<Triangle> {
    const BANDS: usize = 8;
    let turn = |k: usize, of: usize| std::f64::consts::PI * k as f64 / of as f64;
    let clean = |x: f64| if x.abs() < 1e-9 { seam } else { x };
    let point = |i: usize, j: usize| {
        let (polar, around) = (turn(i, BANDS), turn(j % (2 * BANDS), BANDS));
        let across = if i.is_multiple_of(BANDS) {
            seam
        } else {
            polar.sin()
        };
        let p = DVec3::new(across * around.cos(), across * around.sin(), polar.cos());
        let p = if i.is_multiple_of(BANDS) {
            DVec3::new(seam, seam, p.z)
        } else {
            p
        };
        Vec3::from_array(p.to_array().map(|x| clean(x) as f32))
    };
    let mut out = Vec::new();
    for (i, j) in (0..BANDS).flat_map(|i| (0..2 * BANDS).map(move |j| (i, j))) {
        let [a, b, c, d] = [
            point(i, j),
            point(i + 1, j),
            point(i + 1, j + 1),
            point(i, j + 1),
        ];
        out.extend([[a, b, c], [a, c, d]].map(|vertices| Triangle { vertices }));
    }
    out.retain(|t| t.vertices[0] != t.vertices[1] && t.vertices[1] != t.vertices[2]);
    out.retain(|t| t.vertices[2] != t.vertices[0]);
    out
}

/// Directions with exact zeros of both signs, with noise in their place, and without either.
fn directions() -> Vec<Vec3> {
    let small = [0.0, -0.0, 1e-30, -1e-30, 1e-42, 1.2e-16, -8.7e-8];
    let mut out = Vec::new();
    for (&a, &b) in small.iter().flat_map(|a| small.iter().map(move |b| (a, b))) {
        for axis in 0..3 {
            for long in [1.0, -1.0] {
                let mut direction = Vec3::ZERO;
                (direction[axis], direction[(axis + 1) % 3]) = (long, a);
                direction[(axis + 2) % 3] = b;
                out.push(direction);
            }
        }
    }
    for (&zero, k) in small.iter().flat_map(|a| (0..12).map(move |k| (a, k))) {
        let (sin, cos) = (0.4 + 0.55 * k as f32).sin_cos();
        let mut direction = Vec3::ZERO;
        (
            direction[k % 3],
            direction[(k + 1) % 3],
            direction[(k + 2) % 3],
        ) = (zero, sin, cos);
        out.push(direction);
    }
    out
}

/// Rays of one length from inside, from planes of vertices and next to them.
fn rays(length: f32) -> Vec<Ray> {
    let origins = [
        Vec3::ZERO,
        Vec3::new(0.25, 0.0, -0.0),
        Vec3::new(0.0, 1.0 / 3.0, 0.1),
        Vec3::new(1.2e-16, -8.7e-8, 0.3),
    ];
    let one = |origin: Vec3, direction: Vec3| Ray {
        origin: origin.to_array(),
        t_min: 0.0,
        direction: (length * direction).to_array(),
        t_max: f32::MAX,
    };
    let pairs = origins
        .into_iter()
        .flat_map(|o| directions().into_iter().map(move |d| (o, d)));
    pairs.map(|(o, d)| one(o, d)).collect()
}

fn missed(rays: &[Ray], hits: &[Hit]) -> Vec<Ray> {
    let pairs = rays.iter().zip(hits);
    pairs
        .filter(|(_, hit)| hit.triangle == NO_HIT)
        .map(|(ray, _)| *ray)
        .collect()
}

/// Checks that every structure on host and device equals the reference, for both kinds of query.
fn structures_agree(what: &str, soup: &TriangleSoup, rays: &[Ray], flat: &[Hit], placed: &[Hit]) {
    let kinds = AccelRegistry::default();
    for kind in in_turn("structures without cracks", kinds.iter()) {
        let what = format!("{what}: {}", kind.name());
        let built: Box<dyn BuiltAccel> = build(kind, soup, &default_params(&kind.parameters()));
        let expected = if built.space() == Space::Instances {
            placed
        } else {
            flat
        };
        let twin = built
            .cpu_twin(soup)
            .expect("a structure of the program has a twin");
        let mut counters = Counters::default();
        let hits: Vec<Hit> = rays
            .iter()
            .map(|r| twin.closest_hit(r, &mut counters))
            .collect();
        assert_same_hits(&what, rays, expected, &hits);
        assert!(
            rays.iter().all(|r| twin.any_hit(r, &mut counters)),
            "{what}: any hit"
        );
        if support::is_exact(support::gpu()) {
            assert_same_hits(
                &what,
                rays,
                expected,
                &trace(support::gpu(), &*built, soup, rays, &[]).hits,
            );
            let any = trace(support::gpu(), &*built, soup, rays, &["any"]).found();
            assert!(
                any.iter().all(|found| *found),
                "{what}: any hit on the device"
            );
        }
    }
}

#[test]
fn no_length_of_a_direction_opens_a_crack() {
    let triangles = |seam| sphere(seam).into_iter().map(|t| t.vertices);
    for test in [&Watertight as AnyTriangleTest, &Compensated] {
        let tests = Intersection {
            triangle: test,
            ..Default::default()
        };
        for seam in SEAMS {
            let soup = scenes::soup(triangles(seam)).intersecting(tests);
            let mut all = Vec::new();
            for length in LENGTHS {
                let rays = rays(length);
                let lost = missed(&rays, &brute_force_hits(&soup, &rays));
                let what = format!("{}, seam {seam:e}, length {length:e}", test.name());
                assert!(
                    lost.is_empty(),
                    "{what}: {} of {}: {:?}",
                    lost.len(),
                    rays.len(),
                    lost[0]
                );
                all.extend(rays.into_iter().step_by(7));
            }
            let expected = brute_force_hits(&soup, &all);
            structures_agree(&format!("seam {seam:e}"), &soup, &all, &expected, &expected);
        }
    }
}

#[test]
fn no_scale_of_an_instance_opens_a_crack() {
    for scale in [1e-6_f32, 1e-4, 1.0, 1e4, 1e5, 1e6] {
        let mut assembly = Assembly::default();
        let object = assembly
            .add_object(sphere(1.224_646_8e-16))
            .expect("an object");
        let columns = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| scale * axis);
        assembly
            .place(object, Transform::new(columns, Vec3::ZERO))
            .expect("a place");
        let instances = assembly.instances().iter();
        let copies = instances.flat_map(|i| assembly.copy(i).map(|t| t.vertices));
        let soup = TriangleSoup {
            placed: Some(Placed::new(&assembly)),
            ..scenes::soup(copies)
        };
        let mut all = Vec::new();
        for length in [1e-10, 1e-6, 1e-4, 1.0, 1e6, 1e10] {
            let scaled = rays(length).into_iter().step_by(3).map(|mut ray| {
                ray.origin = ray.origin.map(|x| x * scale);
                ray
            });
            let rays: Vec<Ray> = scaled.collect();
            let placed = soup.placed.as_ref().expect("instances");
            let lost = missed(&rays, &brute_force_instances(placed, &rays));
            let what = format!("scale {scale:e}, length {length:e}");
            assert!(
                lost.is_empty(),
                "{what}: {} of {}: {:?}",
                lost.len(),
                rays.len(),
                lost[0]
            );
            all.extend(rays.into_iter().step_by(3));
        }
        let placed = brute_force_instances(soup.placed.as_ref().expect("instances"), &all);
        let flat = brute_force_hits(&soup, &all);
        structures_agree(&format!("scale {scale:e}"), &soup, &all, &flat, &placed);
    }
}
