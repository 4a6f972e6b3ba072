//! Rays to the triangles that lists begin and end with: a loop that ends one short loses the last triangle of all, or of those in
//! the order of places, and of thousands random rays rarely meet just that one.

use glam::Vec3;
use raystone_accel::{Ray, TriangleSoup};

/// Their number: to both ends of each of six orders.
pub(crate) const END_RAYS: usize = 2 * ORDERS;
const ORDERS: usize = 6;
/// Bits of a coordinate of a Morton number.
const BITS: u32 = 21;
/// Distance from a triangle, in its longest edges and in its farthest coordinates: little enough that nothing lies between.
const BESIDE: [f32; 2] = [1e-3, 1e-5];

/// Rays from just above the triangles; the last ray goes to the last of all.
pub(crate) fn end_rays(soup: &TriangleSoup) -> Vec<Ray> {
    ends(soup)
        .into_iter()
        .map(|place| towards(soup, place))
        .collect()
}

/// The first and the last triangle along each axis, of a Morton curve, of halves of halves, and of the scene.
fn ends(soup: &TriangleSoup) -> Vec<usize> {
    let centres: Vec<Vec3> = (soup.records.iter())
        .map(|record| record.triangle().vertices.iter().sum::<Vec3>() / 3.0)
        .collect();
    // What has no area is hit by nothing.
    let solid: Vec<usize> = (0..centres.len())
        .filter(|place| normal(soup, *place).is_some())
        .collect();
    let by = |key: &dyn Fn(usize) -> u64| {
        let keyed = || solid.iter().map(|place| (key(*place), *place));
        [keyed().min(), keyed().max()].map(|end| end.map_or(0, |(_, place)| place))
    };
    let low = centres.iter().copied().fold(Vec3::INFINITY, Vec3::min);
    let high = centres.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
    let longest = (high - low).max_element().max(f32::MIN_POSITIVE);
    let cell = |place: usize| {
        let most = ((1_u64 << BITS) - 1) as f64;
        ((centres[place] - low).as_dvec3() / f64::from(longest) * most).to_array()
    };
    let of_axis = |axis: usize| by(&|place| cell(place)[axis] as u64);
    let mut all = [0, 1, 2].map(of_axis).to_vec();
    all.push(by(&|place| morton(cell(place).map(|x| x as u64))));
    let halves = [false, true].map(|upper| halved(&centres, upper));
    all.push(halves);
    all.push(by(&|place| place as u64));
    all.concat()
}

/// Bits of x, y and z in turn.
fn morton([x, y, z]: [u64; 3]) -> u64 {
    (0..BITS).fold(0, |code, bit| {
        let of = |x: u64| x >> bit & 1;
        code | (of(x) << 2 | of(y) << 1 | of(z)) << (3 * bit)
    })
}

/// The triangle that is left where the lower or upper half is taken again and again, along the longest axis.
fn halved(centres: &[Vec3], upper: bool) -> usize {
    let mut left: Vec<usize> = (0..centres.len()).collect();
    loop {
        let of = || left.iter().map(|place| centres[*place]);
        let low = of().fold(Vec3::INFINITY, Vec3::min);
        let high = of().fold(Vec3::NEG_INFINITY, Vec3::max);
        let size = (high - low).to_array();
        let axis = (1..3).fold(0, |axis, other| {
            if size[other] > size[axis] {
                other
            } else {
                axis
            }
        });
        let middle = 0.5 * low[axis] + 0.5 * high[axis];
        let is_kept = |place: &usize| (centres[*place][axis] > middle) == upper;
        let kept: Vec<usize> = left.iter().copied().filter(is_kept).collect();
        if kept.is_empty() || kept.len() == left.len() {
            let end = if upper { left.last() } else { left.first() };
            return end.copied().unwrap_or(0);
        }
        left = kept;
    }
}

fn normal(soup: &TriangleSoup, place: usize) -> Option<Vec3> {
    let [a, b, c] = soup.records[place].triangle().vertices;
    let long = (b - a).abs().max((c - a).abs()).max_element();
    // Scaled, so that squares of small edges are not 0.
    ((b - a) / long).cross((c - a) / long).try_normalize()
}

fn towards(soup: &TriangleSoup, place: usize) -> Ray {
    let corners = soup.records[place].triangle().vertices;
    let [a, b, c] = corners;
    let normal = normal(soup, place).unwrap_or(Vec3::Y);
    let farthest = corners
        .iter()
        .map(|v| v.abs().max_element())
        .fold(0.0, f32::max);
    let edge = (b - a).abs().max((c - a).abs()).max_element();
    let beside = (BESIDE[0] * edge).max(BESIDE[1] * farthest);
    let flushed = |v: Vec3| v.map(|x| if x.is_subnormal() { 0.0 } else { x });
    let origin = flushed((a + b + c) / 3.0 + normal * beside);
    Ray::new(origin, flushed(-normal))
}

#[cfg(test)]
mod tests {
    use super::*;
    use raystone_accel::brute_force_hits;

    #[test]
    fn they_meet_the_ends_of_every_order() {
        let scene = raystone_scene::named("displaced-sphere").expect("a scene");
        let soup = TriangleSoup::new(&scene);
        let rays = end_rays(&soup);
        assert_eq!(rays.len(), END_RAYS);
        let hits = brute_force_hits(&soup, &rays);
        let met: Vec<usize> = hits.iter().map(|hit| hit.triangle as usize).collect();
        assert_eq!(met, ends(&soup));
        assert_eq!(met[END_RAYS - 2..], [0, soup.records.len() - 1]);
    }

    #[test]
    fn scenes_without_area_and_of_one_triangle_have_such_rays() {
        for name in ["single-triangle", "far-corners", "cornell-box"] {
            let scene = raystone_scene::named(name).expect("a scene");
            let soup = TriangleSoup::new(&scene);
            let rays = end_rays(&soup);
            let is_sound = |ray: &Ray| ray.is_ray() && !ray.origin.iter().any(|x| x.is_subnormal());
            assert!(rays.iter().all(is_sound), "{name}");
            let hits = brute_force_hits(&soup, &rays);
            let met = hits
                .iter()
                .filter(|hit| hit.triangle != raystone_accel::NO_HIT);
            assert!(met.count() > END_RAYS / 2, "{name}");
        }
    }
}
