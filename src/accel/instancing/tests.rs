//! World boxes against grazing rays: no hit accepted by an object's triangles is culled.

use super::super::bounds::Bounds;
use super::super::intersection::Intersection;
use super::super::ray::{Hit, NO_HIT, Ray};
use super::super::triangle::{TriangleRecord, intersect_triangle};
use super::instance::{enter_grown, level, object_ray};
use super::world_box::BoxMap;
use glam::{DVec3, Mat3, Quat, Vec3};
use rayon::prelude::*;
use raystone_core::geometry::Triangle;
use raystone_core::random::Pcg32;
use raystone_scene::{Assembly, Instance, Transform};

fn signed(rng: &mut Pcg32) -> f32 {
    2.0 * rng.uniform() as f32 - 1.0
}

fn vector(rng: &mut Pcg32) -> Vec3 {
    Vec3::new(signed(rng), signed(rng), signed(rng))
}

/// One of five sorts of transform: rigid; uniformly scaled by 10⁻⁴ to 10⁴; unevenly scaled and
/// mirrored; sheared until nearly flat; and all of these far from the origin.
fn transform(rng: &mut Pcg32) -> Transform {
    let sort = rng.below(5);
    let turn = |rng: &mut Pcg32| {
        let q = Quat::from_xyzw(signed(rng), signed(rng), signed(rng), signed(rng));
        Mat3::from_quat(q.normalize())
    };
    let power = |rng: &mut Pcg32, range: f32| 10.0_f32.powf(range * signed(rng));
    let linear = match sort {
        0 => turn(rng),
        1 => turn(rng) * power(rng, 4.0),
        2 => {
            let scale = Vec3::new(power(rng, 2.0), -power(rng, 2.0), power(rng, 2.0));
            turn(rng) * Mat3::from_diagonal(scale) * turn(rng)
        }
        3 => turn(rng) * Mat3::from_diagonal(Vec3::new(1.0, 1.0, 1e-4)) * turn(rng),
        _ => turn(rng) * power(rng, 1.0),
    };
    let distance = if sort == 4 { 1e4 } else { 3.0 };
    let columns = [linear.x_axis, linear.y_axis, linear.z_axis];
    Transform::new(columns, vector(rng) * distance)
}

/// A triangle; one in three is axis-aligned, with a box of zero thickness.
fn triangle(rng: &mut Pcg32) -> Triangle {
    let mut vertices = [vector(rng), vector(rng), vector(rng)];
    let axis = rng.below(9);
    if axis < 3 {
        let flat = vertices[0][axis];
        vertices[1][axis] = flat;
        vertices[2][axis] = flat;
    }
    Triangle { vertices }
}

/// A ray from near or far towards a vertex, an edge or the inside of the instance's triangle.
fn ray(rng: &mut Pcg32, instance: &Instance, triangle: &Triangle) -> Ray {
    let world = triangle.vertices.map(|v| instance.to_world.point(v));
    let mut weights = [rng.uniform(), rng.uniform(), rng.uniform()].map(|w| w as f32);
    match rng.below(4) {
        0 => weights = [1.0, 0.0, 0.0],
        1 => weights[0] = 0.0,
        _ => {}
    }
    let sum: f32 = weights.iter().sum();
    let goal = (0..3).fold(Vec3::ZERO, |p, k| p + world[k] * (weights[k] / sum));
    let size = (world[1] - world[0]).length().max(1e-30);
    let away = size * 10.0_f32.powf(4.0 * rng.uniform() as f32 - 1.0);
    let mut direction = vector(rng).normalize_or(Vec3::X);
    if rng.below(4) == 0 {
        direction[rng.below(3)] = 0.0;
    }
    let origin = goal - direction * away;
    let scale = 10.0_f32.powf(2.0 * signed(rng));
    Ray::new(origin, (goal - origin) * scale)
}

/// Hits on single triangles in instances, and how many of them a world box with this pad culls.
fn hits_and_culled(seeds: std::ops::Range<u64>, pad: Option<f64>) -> (usize, usize) {
    let tests = Intersection::default();
    let one = |seed: u64| {
        let mut rng = Pcg32::new(seed);
        let mut counts = (0, 0);
        for _ in 0..50 {
            let mut assembly = Assembly::default();
            let target = triangle(&mut rng);
            let object = assembly.add_object(vec![target]).unwrap();
            let Ok(instance) = assembly.place(object, transform(&mut rng)) else {
                continue;
            };
            let record = TriangleRecord::new(&target, 0, 0);
            let map = pad.map_or(BoxMap::new(&instance), |p| BoxMap::with_pad(&instance, p));
            let world_box = map.world_box(&record.bounds());
            for _ in 0..20 {
                let ray = tests.raised(&ray(&mut rng, &instance, &target));
                let local = tests.raised(&object_ray(&instance, &ray));
                let mut hit = Hit::miss(&ray);
                intersect_triangle(
                    (&record, None),
                    &local,
                    tests.inverse(local.direction),
                    &mut hit,
                );
                if hit.triangle == NO_HIT {
                    continue;
                }
                counts.0 += 1;
                // The smallest t_best that the box may be tested with.
                let entered = enter_grown(&level(&ray, map.growth(), tests), &world_box, hit.t);
                counts.1 += usize::from(entered.is_none());
            }
        }
        counts
    };
    let add = |a: (usize, usize), b: (usize, usize)| (a.0 + b.0, a.1 + b.1);
    seeds.into_par_iter().map(one).reduce(|| (0, 0), add)
}

#[test]
fn no_hit_in_a_million_is_culled_by_its_world_box() {
    let (hits, culled) = hits_and_culled(0..1600, None);
    assert!(hits > 1_000_000, "only {hits} hits");
    assert_eq!(culled, 0, "of {hits} hits");
}

#[test]
fn without_the_pad_hits_are_culled() {
    let (hits, culled) = hits_and_culled(0..100, Some(0.0));
    assert!(culled > 20, "{culled} of {hits}");
}

#[test]
fn world_boxes_are_tight_and_those_of_the_identity_are_the_object_s() {
    let mut rng = Pcg32::new(5);
    let unit = Bounds {
        min: [-1.0; 3],
        max: [1.0; 3],
    };
    let mut assembly = Assembly::default();
    let object = assembly.add_object(vec![triangle(&mut rng)]).unwrap();
    let identity = assembly.place(object, Transform::IDENTITY).unwrap();
    let map = BoxMap::new(&identity);
    assert_eq!((map.world_box(&unit), map.growth()), (unit, 0.0));
    for _ in 0..200 {
        let to_world = transform(&mut rng);
        let Ok(instance) = assembly.place(object, to_world) else {
            continue;
        };
        let (linear, offset) = to_world.parts();
        let world_box = BoxMap::new(&instance).world_box(&unit);
        let reach = linear.transpose();
        let half = DVec3::new(
            reach.x_axis.abs().element_sum(),
            reach.y_axis.abs().element_sum(),
            reach.z_axis.abs().element_sum(),
        );
        let slack = 1e-5 * to_world.condition() * (half.max_element() + offset.abs().max_element());
        for axis in 0..3 {
            let [low, high] = [world_box.min[axis], world_box.max[axis]].map(f64::from);
            let (exact_low, exact_high) = (offset[axis] - half[axis], offset[axis] + half[axis]);
            assert!(low < exact_low && exact_low - low < slack);
            assert!(high > exact_high && high - exact_high < slack);
        }
    }
}
