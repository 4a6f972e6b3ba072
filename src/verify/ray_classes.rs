//! Whether recorded rays are what their class promises. All structures answer the same rays, so that rays of another
//! distribution, order or length would change every figure and fail no comparison.

use crate::path_oracle::Lens;
use crate::rays::{RaySet, surface_points};
use glam::{DVec3, Vec3};
use raystone_accel::{Ray, TriangleSoup};
use raystone_config::Gate;
use raystone_core::geometry::Camera;
use raystone_record::RayClass;
use raystone_scene::SceneData;

/// Standard errors that a mean may be off: chance exceeds them once in 10⁹ cases.
const MOST_ERRORS: f64 = 6.0;
/// Rays below which means say nothing.
const FEWEST: usize = 256;
/// Relative error of lengths and directions in f32.
const ROUNDING: f64 = 1e-4;
/// Steps of f32 in a range whose points are judged, at least: rounding to them adds 1/STEPS² to the variance, less than chance.
const STEPS: f64 = 32.0;
/// Edge of the tiles of primary rays, pixels.
const TILE: u32 = 8;

/// What is wrong with these sets; `None` if nothing is.
pub fn fault(
    scene: &SceneData,
    soup: &TriangleSoup,
    camera: Camera,
    settings: &Gate,
    sets: &[RaySet],
) -> Option<String> {
    let of = |class| sets.iter().find(|set| set.class == class);
    let primary = of(RayClass::Primary)?;
    let found = of_primary(primary, camera).or_else(|| of_hits(sets, soup));
    let corners = || scene.triangles.iter().flat_map(|t| t.vertices);
    let low = corners().fold(Vec3::INFINITY, Vec3::min).as_dvec3();
    let high = corners().fold(Vec3::NEG_INFINITY, Vec3::max).as_dvec3();
    let diagonal = (high - low).length();
    let normals: Vec<DVec3> = (surface_points(primary, soup).iter())
        .map(|(_, normal)| normal.as_dvec3())
        .collect();
    let set = f64::from(settings.ao_length);
    let length = if set > 0.0 { set } else { 0.1 * diagonal };
    let about = |class: RayClass, fault: Option<&str>| {
        fault.map(|fault| format!("{} rays {fault}", class.name()))
    };
    let of_class = |set: &RaySet| {
        let fault = match set.class {
            RayClass::Ao => of_cosine(set, &normals).or_else(|| of_ends(set, length)),
            RayClass::Bounce => of_cosine(set, &normals),
            RayClass::Shadow => of_lights(set, scene),
            RayClass::Chord => of_chords(set, [low, high]),
            _ => None,
        };
        about(set.class, fault)
    };
    found.or_else(|| sets.iter().find_map(of_class))
}

fn wide(v: [f32; 3]) -> DVec3 {
    DVec3::from_array(v.map(f64::from))
}

/// True if the mean of enough values is not this one, by more than chance and rounding.
fn is_off(values: impl Iterator<Item = f64>, expected: f64) -> bool {
    let (mut n, mut sum, mut squares) = (0.0, 0.0, 0.0);
    for value in values.map(|value| value - expected) {
        n += 1.0;
        sum += value;
        squares += value * value;
    }
    let (mean, square) = (sum / n, squares / n);
    let chance = MOST_ERRORS * (square / n).sqrt();
    n >= FEWEST as f64 && mean.abs() > chance + ROUNDING * expected.abs()
}

/// Through the centres of pixels, tile by tile: eight rows of eight pixels each.
fn of_primary(set: &RaySet, camera: Camera) -> Option<String> {
    let side = (set.rays.len() as f64).sqrt().round() as u32;
    let lens = Lens::new(&camera, [side, side]);
    let per_tile = TILE * TILE;
    let is_right = |(place, ray): (u32, &Ray)| {
        let (tile, within) = (place / per_tile, place % per_tile);
        let tiles = side / TILE;
        let x = TILE * (tile % tiles) + within % TILE;
        let y = TILE * (tile / tiles) + within / TILE;
        let direction = lens.direction([x, y], [0.5, 0.5]);
        wide(ray.direction).distance(direction) < ROUNDING && Vec3::from(ray.origin) == camera.eye
    };
    let is_square = side.is_multiple_of(TILE) && set.rays.len() == (side * side) as usize;
    let all = || (0..).zip(&set.rays).all(is_right);
    (!(is_square && all())).then(|| {
        format!("primary rays do not go through the pixels of {side} × {side}, tile by tile")
    })
}

/// The share of rays that hit something, from the triangles that they name.
fn of_hits(sets: &[RaySet], soup: &TriangleSoup) -> Option<String> {
    let wrong = sets.iter().find(|set| {
        let named = |hit: &&raystone_accel::Hit| (hit.triangle as usize) < soup.records.len();
        let share = set.truth.iter().filter(named).count() as f64 / set.rays.len().max(1) as f64;
        (share - set.hit_fraction()).abs() > 1e-12
    });
    wrong.map(|set| format!("the share of {} rays that hit is wrong", set.class.name()))
}

/// By the cosine to the normal of the surface that they leave: ⟨cos⟩ = 2/3, ⟨cos²⟩ = 1/2, and no side is preferred.
fn of_cosine(set: &RaySet, normals: &[DVec3]) -> Option<&'static str> {
    let pairs = || set.rays.iter().zip(normals.iter().cycle());
    let cosine = |(ray, normal): (&Ray, &DVec3)| wide(ray.direction).dot(*normal);
    let beside = |(ray, normal): (&Ray, &DVec3)| {
        let (x, y) = normal.any_orthonormal_pair();
        wide(ray.direction).dot(x + y)
    };
    let is_unit = |ray: &Ray| (wide(ray.direction).length() - 1.0).abs() < ROUNDING;
    let is_wrong = is_off(pairs().map(cosine), 2.0 / 3.0)
        || is_off(pairs().map(|pair| cosine(pair).powi(2)), 0.5)
        || is_off(pairs().map(beside), 0.0)
        || !set.rays.iter().all(is_unit);
    is_wrong.then_some("are not distributed by the cosine to their surface")
}

fn of_ends(set: &RaySet, length: f64) -> Option<&'static str> {
    let is_long = |ray: &Ray| (f64::from(ray.t_max) - length).abs() < ROUNDING * length;
    (!set.rays.iter().all(is_long)).then_some("have another length than they should")
}

/// To points that are even on each of the triangles that emit, which are chosen evenly.
fn of_lights(set: &RaySet, scene: &SceneData) -> Option<&'static str> {
    let emits = |(triangle, material): (&raystone_core::geometry::Triangle, &u32)| {
        let light = scene.materials[*material as usize].emission.max_element() > 0.0;
        (light && !triangle.has_zero_area()).then(|| triangle.vertices.map(Vec3::as_dvec3))
    };
    let pairs = scene.triangles.iter().zip(&scene.material_ids);
    let lamps: Vec<[DVec3; 3]> = pairs.filter_map(emits).collect();
    if lamps.is_empty() {
        return None;
    }
    let middle = lamps
        .iter()
        .map(|[a, b, c]| (a + b + c) / 3.0)
        .sum::<DVec3>()
        / lamps.len() as f64;
    let ends = || (set.rays.iter()).map(|ray| wide(ray.origin) + wide(ray.direction) - middle);
    let size = lamps
        .iter()
        .flatten()
        .map(|v| v.distance(middle))
        .fold(0.0, f64::max);
    let is_wrong = (0..3).any(|axis| is_off(ends().map(|end| (end[axis] / size) + 1.0), 1.0));
    is_wrong.then_some("do not go to all points of all lights alike")
}

/// Whether f32 has so many numbers in a range that points of it can be even: a scene may be far away or tiny.
fn is_divided([low, high]: [f64; 2]) -> bool {
    let largest = low.abs().max(high.abs()) as f32;
    high - low > STEPS * f64::from(largest.next_up() - largest)
}

/// From points that are even in the box of the scene.
fn of_chords(set: &RaySet, [low, high]: [DVec3; 2]) -> Option<&'static str> {
    let is_wrong = (0..3)
        .filter(|&axis| is_divided([low[axis], high[axis]]))
        .any(|axis| {
            let place =
                |ray: &Ray| (f64::from(ray.origin[axis]) - low[axis]) / (high[axis] - low[axis]);
            is_off(set.rays.iter().map(place), 0.5)
                || is_off(
                    set.rays.iter().map(|ray| (place(ray) - 0.5).powi(2)),
                    1.0 / 12.0,
                )
                || is_off(
                    set.rays.iter().map(|ray| f64::from(ray.direction[axis])),
                    0.0,
                )
        });
    is_wrong.then_some("do not begin at all points of the box alike")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rays::record_rays;
    use raystone_accel::{BuildLog, BuiltBvh, BvhParameters};

    /// A change of one class.
    type Change = (RayClass, fn(&mut RaySet));

    #[test]
    fn points_of_far_and_tiny_scenes_are_not_even() {
        assert!(is_divided([-1.0, 1.0]) && is_divided([-1e-40, 1e-40]));
        for few in [[1e7 - 1.0, 1e7 + 1.0], [-1.4e-45, 1.4e-45], [2.0, 2.0]] {
            assert!(!is_divided(few), "{few:?}");
        }
    }

    #[test]
    fn rays_of_another_distribution_order_or_length_are_told() {
        let scene = raystone_scene::named("cornell-box").expect("a built-in scene");
        let soup = TriangleSoup::new(&scene);
        let tree = BuiltBvh::build(&soup, &BvhParameters::default(), &mut BuildLog::default());
        let tree = tree.expect("a tree");
        let settings = Gate {
            rays: 4096,
            ..Gate::default()
        };
        let camera = scene.view(1.0);
        let sets = record_rays(&scene, &soup, camera, &tree.twin(&soup), &settings, 1);
        let said = |sets: &[RaySet]| fault(&scene, &soup, camera, &settings, sets);
        assert_eq!(said(&sets), None);
        let changes: [Change; 8] = [
            (RayClass::Primary, |set| set.rays.swap(7, 8)),
            (RayClass::Primary, |set| set.rays.truncate(4032)),
            (RayClass::Ao, |set| set.rays[9].t_max *= 2.0),
            (RayClass::Ao, |set| {
                set.rays.iter_mut().for_each(|ray| {
                    let steep = wide(ray.direction).map(|x| x * x.abs()).normalize();
                    ray.direction = steep.as_vec3().to_array();
                })
            }),
            (RayClass::Bounce, |set| {
                set.rays
                    .iter_mut()
                    .for_each(|ray| ray.direction[1] = ray.direction[1].abs())
            }),
            (RayClass::Bounce, |set| set.rays.rotate_left(1)),
            (RayClass::Shadow, |set| {
                set.rays
                    .iter_mut()
                    .for_each(|ray| ray.direction = ray.direction.map(|x| 1.2 * x))
            }),
            (RayClass::Chord, |set| {
                set.rays.iter_mut().for_each(|ray| ray.origin[2] *= 0.8)
            }),
        ];
        for (class, change) in changes {
            let mut sets = sets.clone();
            let set = sets.iter_mut().find(|set| set.class == class);
            change(set.expect("a class"));
            let fault = said(&sets).unwrap_or_default();
            assert!(fault.contains(class.name()), "{class:?}: {fault}");
        }
    }
}
