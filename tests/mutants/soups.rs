//! Integer-grid soups: corners, origins and directions are small integers, so that ties, touching boxes
//! and zeros of both signs are common instead of rare.

use crate::world::plain_scene;
use glam::Vec3;
use raystone::accel::{Hit, NO_HIT, Ray, TriangleSoup, brute_force_hits};
use raystone::geometry::Triangle;
use raystone::measure::gate::ReferenceTracer;
use raystone::measure::rays::RaySet;
use raystone::measure::record::{RayClass, ReferenceCheck};
use raystone::random::Pcg32;
use raystone::scene::SceneData;

const TRIANGLES: usize = 240;
const RAYS: usize = 3072;
/// Corners lie in 0 … this.
const EXTENT: i32 = 6;

/// A scene of triangles between points of the integer lattice: one in eight is a copy, one in two lies
/// in a plane of the lattice.
pub fn lattice_scene(seed: u64) -> SceneData {
    let mut random = Pcg32::new(seed);
    let mut triangles: Vec<Triangle> = Vec::with_capacity(TRIANGLES);
    for _ in 0..TRIANGLES {
        let mut vertices = [0; 3].map(|_| lattice_point(&mut random));
        if !triangles.is_empty() && random.below(8) == 0 {
            vertices = triangles[random.below(triangles.len())].vertices;
            vertices.rotate_left(random.below(3));
        } else if random.below(2) == 0 {
            let (axis, height) = (random.below(3), between(&mut random, 0, EXTENT));
            vertices.iter_mut().for_each(|v| v[axis] = height);
        }
        triangles.push(Triangle { vertices });
    }
    plain_scene(format!("lattice soup {seed}"), triangles)
}

/// Brute force as the reference tracer of rays through a lattice scene.
pub fn lattice_reference(soup: &TriangleSoup, seed: u64) -> ReferenceTracer {
    let mut random = Pcg32::with_stream(seed, 1);
    let lattice = (0..).map(|_| lattice_ray(&mut random));
    let mut rays: Vec<Ray> = lattice.filter(Ray::is_ray).take(RAYS).collect();
    rays.extend((0..RAYS).map(|_| aimed_ray(&mut random, soup)));
    let cut = cut_at_hits(&rays, &brute_force_hits(soup, &rays));
    rays.extend(cut);
    let truth = brute_force_hits(soup, &rays);
    ReferenceTracer {
        sets: vec![RaySet {
            class: RayClass::Chord,
            rays,
            truth,
            shadow: Vec::new(),
        }],
        brute_force: ReferenceCheck::default(),
        oracle: ReferenceCheck::default(),
        instances: None,
    }
}

fn between(random: &mut Pcg32, low: i32, high: i32) -> f32 {
    (low + random.below((high - low + 1) as usize) as i32) as f32
}

fn lattice_point(random: &mut Pcg32) -> Vec3 {
    Vec3::from_array([0; 3].map(|_| between(random, 0, EXTENT)))
}

/// From a half-integer point along an axis (the other components are zeros of either sign) or in a
/// small integer direction; some end or begin at an integer distance.
fn lattice_ray(random: &mut Pcg32) -> Ray {
    let origin = [0; 3].map(|_| 0.5 * between(random, -3, 2 * EXTENT + 3));
    let mut direction = [0; 3].map(|_| if random.below(2) == 0 { 0.0 } else { -0.0_f32 });
    if random.below(2) == 0 {
        direction[random.below(3)] = [1.0, -1.0, 2.0, -0.5][random.below(4)];
    } else {
        for d in &mut direction {
            let step = between(random, -3, 3);
            *d = if step == 0.0 { *d } else { step };
        }
    }
    let [t_min, t_max] = match random.below(4) {
        0 => [0.0, between(random, 0, EXTENT)],
        1 => [0.5 * between(random, 0, EXTENT), Ray::FAR],
        _ => [0.0, Ray::FAR],
    };
    Ray {
        origin,
        t_min,
        direction,
        t_max,
    }
}

/// From anywhere around the scene to a corner, the middle of an edge or the inside of a triangle.
fn aimed_ray(random: &mut Pcg32, soup: &TriangleSoup) -> Ray {
    let record = soup.records[random.below(soup.records.len())];
    let [a, b, c] = record.triangle().vertices;
    let target = match random.below(3) {
        0 => a,
        1 => 0.5 * (b + c),
        _ => (a + b + c) / 3.0,
    };
    let unit = |random: &mut Pcg32| 3.0 * random.uniform() as f32 - 1.0;
    let origin = EXTENT as f32 * Vec3::from_array([0; 3].map(|_| unit(random)));
    Ray::new(origin, target - origin)
}

/// Every fourth ray that hits, ending exactly at its hit (which counts) and just before it.
fn cut_at_hits(rays: &[Ray], hits: &[Hit]) -> Vec<Ray> {
    let pairs = rays.iter().zip(hits);
    let hitting = pairs.filter(|(_, hit)| hit.triangle != NO_HIT && hit.t > 0.0);
    let cut =
        |(ray, hit): (&Ray, &Hit)| [hit.t, hit.t.next_down()].map(|t_max| Ray { t_max, ..*ray });
    hitting.step_by(4).flat_map(cut).collect()
}
