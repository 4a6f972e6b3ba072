//! Triangulation of polygons.

use glam::{DVec2, DVec3, Vec3};
use std::collections::HashMap;
use std::f64::consts::TAU;

/// Reversed triangles smaller than this fraction of the largest count as flat (rounding).
const FLAT: f64 = 1e-6;
/// Slits to holes go through a place a few times; so often no polygon with an inside does.
const MOST_VISITS: usize = 64;
/// Rounding of a sum of angles, radians.
const ANGLE: f64 = 1e-6;

/// Triangulates a polygon, keeping its orientation, and passes on corner indices: the fan around
/// the first corner if that covers the polygon, as for every convex one, otherwise ears. Returns
/// true if the polygon intersects itself; it is then drawn as the fan, as its inside is undefined.
pub(super) fn triangulate(corners: &[Vec3], mut triangle: impl FnMut([usize; 3])) -> bool {
    let fan = (2..corners.len()).map(|k| [0, k - 1, k]);
    if corners.len() <= 3 || !corners.iter().all(|c| c.is_finite()) {
        fan.for_each(triangle);
        return false;
    }
    let Some(normal) = normal(corners) else {
        fan.for_each(triangle);
        return false;
    };
    if fan_covers(corners, normal) {
        fan.for_each(triangle);
        return false;
    }
    let across = normal.any_orthonormal_vector();
    let up = normal.cross(across);
    let first = corners[0].as_dvec3();
    let flat = |c: DVec3| DVec2::new((c - first).dot(across), (c - first).dot(up));
    let flat: Vec<DVec2> = corners.iter().map(|c| flat(c.as_dvec3())).collect();
    // What goes through a place again and again has no inside, and takes cubic time to cut into ears.
    let crosses = most_at_a_place(corners) > MOST_VISITS || crosses(&flat);
    let ears = if crosses { Vec::new() } else { ears(&flat) };
    if ears.is_empty() {
        fan.for_each(&mut triangle)
    } else {
        ears.into_iter().for_each(&mut triangle)
    }
    crosses
}

/// How often the place is a corner that is one most often.
fn most_at_a_place(corners: &[Vec3]) -> usize {
    if corners.len() <= MOST_VISITS {
        return 1;
    }
    let mut visits: HashMap<[u32; 3], usize> = HashMap::new();
    for corner in corners {
        // The zero that is added makes one of both zeros.
        let place = corner.to_array().map(|c| (c + 0.0).to_bits());
        *visits.entry(place).or_default() += 1;
    }
    visits.into_values().max().unwrap_or(0)
}

/// Unit normal of the side from which the corners turn counter-clockwise (M. Newell). If both sides
/// weigh the same, that of the fan's largest triangle; `None` if all triangles are flat.
fn normal(corners: &[Vec3]) -> Option<DVec3> {
    let (sum, largest) =
        fan_areas(corners).fold((DVec3::ZERO, DVec3::ZERO), |(sum, largest), area| {
            let is_larger = area.length_squared() > largest.length_squared();
            (sum + area, if is_larger { area } else { largest })
        });
    let is_clear = sum.length() > FLAT * largest.length();
    let normal = if is_clear { sum } else { largest };
    normal.try_normalize()
}

/// The two edges from the first corner of each fan triangle.
fn fan_sides(corners: &[Vec3]) -> impl Iterator<Item = [DVec3; 2]> + '_ {
    let first = corners[0].as_dvec3();
    let pairs = corners[1..].windows(2);
    pairs.map(move |pair| [pair[0], pair[1]].map(|c| c.as_dvec3() - first))
}

/// Twice the area vector of each fan triangle.
fn fan_areas(corners: &[Vec3]) -> impl Iterator<Item = DVec3> + '_ {
    fan_sides(corners).map(|[a, b]| a.cross(b))
}

/// True if no fan triangle is reversed and all are sectors of one turn, so they do not overlap.
fn fan_covers(corners: &[Vec3], normal: DVec3) -> bool {
    let areas = || fan_areas(corners).map(|area| area.dot(normal));
    let largest = areas().fold(0.0, f64::max);
    if areas().any(|area| area < -FLAT * largest) {
        return false;
    }
    let angle = |[a, b]: [DVec3; 2]| a.cross(b).dot(normal).max(0.0).atan2(a.dot(b));
    fan_sides(corners).map(angle).sum::<f64>() < TAU - ANGLE
}

/// True if two sides cross, as opposed to touching or overlapping, which polygons with holes use.
fn crosses(corners: &[DVec2]) -> bool {
    let count = corners.len();
    let side = |k: usize| [corners[k], corners[(k + 1) % count]];
    let low = |k: usize| side(k)[0].x.min(side(k)[1].x);
    let high = |k: usize| side(k)[0].x.max(side(k)[1].x);
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|a, b| low(*a).total_cmp(&low(*b)));
    let turn = |[a, b]: [DVec2; 2], c: DVec2| {
        let area = (b - a).perp_dot(c - a);
        // Points not clear of the line touch it.
        let scale = (b - a).length() * (c - a).length().max((c - b).length());
        if area.abs() <= FLAT * scale {
            0.0
        } else {
            area
        }
    };
    let is_crossing = |a: usize, b: usize| {
        let (p, q) = (side(a), side(b));
        turn(p, q[0]) * turn(p, q[1]) < 0.0 && turn(q, p[0]) * turn(q, p[1]) < 0.0
    };
    (0..count).any(|at| {
        let a = order[at];
        let beside = order[at + 1..].iter().take_while(|b| low(**b) <= high(a));
        beside.copied().any(|b| is_crossing(a, b))
    })
}

/// Ear-clips a simple counter-clockwise polygon, keeping its orientation; empty if it has no area.
fn ears(corners: &[DVec2]) -> Vec<[usize; 3]> {
    let mut indices: Vec<u32> = Vec::new();
    let plain: Vec<[f64; 2]> = corners.iter().map(|c| c.to_array()).collect();
    earcut::Earcut::new().earcut_slice(&plain, &[], &mut indices);
    let turned = |ear: &[u32; 3]| {
        let [a, b, c] = ear.map(|k| k as usize);
        let area = (corners[b] - corners[a]).perp_dot(corners[c] - corners[a]);
        if area < 0.0 { [a, c, b] } else { [a, b, c] }
    };
    indices.as_chunks::<3>().0.iter().map(turned).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangulates a polygon in the plane z = x / 2; also whether it intersects itself.
    fn cut(corners: &[[f32; 2]]) -> (Vec<[usize; 3]>, bool) {
        let corners: Vec<Vec3> = corners.iter().map(|[x, y]| slanted(*x, *y)).collect();
        let mut found = Vec::new();
        let crosses = triangulate(&corners, |t| found.push(t));
        (found, crosses)
    }

    #[test]
    fn a_polygon_that_goes_round_and_round_is_a_fan_at_once() {
        let round: Vec<[f32; 2]> = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].repeat(20_000);
        let (triangles, crosses) = cut(&round);
        assert!(crosses && triangles.len() == 59_998);
    }

    fn slanted(x: f32, y: f32) -> Vec3 {
        Vec3::new(x, y, 0.5 * x)
    }

    /// Signed number of triangles that contain a point of the plane.
    fn covered(corners: &[[f32; 2]], triangles: &[[usize; 3]], [x, y]: [f32; 2]) -> i32 {
        let inside = |t: &[usize; 3]| {
            let [a, b, c] = t.map(|k| corners[k]);
            let turn = |[ax, ay]: [f32; 2], [bx, by]: [f32; 2]| {
                (bx - ax) * (y - ay) - (by - ay) * (x - ax)
            };
            let turns = [turn(a, b), turn(b, c), turn(c, a)];
            i32::from(turns.iter().all(|t| *t > 0.0)) - i32::from(turns.iter().all(|t| *t < 0.0))
        };
        triangles.iter().map(inside).sum()
    }

    /// Even-odd rule, for simple polygons.
    fn is_inside(corners: &[[f32; 2]], [x, y]: [f32; 2]) -> bool {
        let sides = (0..corners.len()).map(|k| (corners[k], corners[(k + 1) % corners.len()]));
        let crossed = sides.filter(|([ax, ay], [bx, by])| {
            (*ay > y) != (*by > y) && x < (bx - ax) * (y - ay) / (by - ay) + ax
        });
        crossed.count() % 2 == 1
    }

    #[test]
    fn convex_polygons_stay_fans() {
        let circle: Vec<[f32; 2]> = (0..40)
            .map(|k| (0.157_079_63 * k as f32).sin_cos())
            .map(|(sin, cos)| [cos, sin])
            .collect();
        let midway = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]];
        for corners in [&circle[..], &midway, &circle[..4]] {
            let fan: Vec<_> = (2..corners.len()).map(|k| [0, k - 1, k]).collect();
            assert_eq!(cut(corners), (fan.clone(), false));
            let backwards: Vec<_> = corners.iter().rev().copied().collect();
            assert_eq!(cut(&backwards), (fan, false));
        }
    }

    #[test]
    fn every_simple_polygon_is_covered_once_and_nothing_else() {
        let dart = vec![[0.0, 0.0], [2.0, 1.0], [0.0, 2.0], [0.7, 1.0]];
        let letter = vec![
            [0.0, 0.0],
            [3.0, 0.0],
            [3.0, 3.0],
            [2.0, 3.0],
            [2.0, 1.0],
            [1.0, 1.0],
            [1.0, 3.0],
            [0.0, 3.0],
        ];
        let comb: Vec<[f32; 2]> = (0..21)
            .map(|k| [0.15 * k as f32, if k % 2 == 0 { 0.1 } else { 2.9 }])
            .chain([[3.0, -0.2], [0.0, -0.2]])
            .collect();
        for corners in [dart, letter, comb] {
            for first in 0..corners.len() {
                let mut corners = corners.clone();
                corners.rotate_left(first);
                for _ in 0..2 {
                    corners.reverse();
                    let (triangles, crosses) = cut(&corners);
                    assert!(!crosses, "{corners:?}");
                    let area = |[x, y]: [f32; 2], [z, w]: [f32; 2]| x * w - y * z;
                    let turns: f32 = (0..corners.len())
                        .map(|k| area(corners[k], corners[(k + 1) % corners.len()]))
                        .sum();
                    let sense = if turns > 0.0 { 1 } else { -1 };
                    for k in 0..900_u16 {
                        let at = [
                            0.101 * f32::from(k % 30) + 0.0059,
                            0.101 * f32::from(k / 30) - 0.0137,
                        ];
                        let expected = sense * i32::from(is_inside(&corners, at));
                        let found = covered(&corners, &triangles, at);
                        assert_eq!(found, expected, "{corners:?} {triangles:?} {at:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn polygons_that_cross_themselves_are_told_from_those_with_a_hole() {
        let bow = [[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]];
        let star: Vec<[f32; 2]> = (0..5)
            .map(|k| (2.513_274_1 * k as f32).sin_cos())
            .map(|(sin, cos)| [cos, sin])
            .collect();
        for corners in [&bow[..], &star] {
            let (triangles, crosses) = cut(corners);
            assert!(
                crosses && triangles.len() == corners.len() - 2,
                "{corners:?}"
            );
        }
        // A square with a square hole, through a slit.
        let ring = [
            [0.0, 0.0],
            [3.0, 0.0],
            [3.0, 3.0],
            [0.0, 3.0],
            [0.0, 0.0],
            [1.0, 1.0],
            [1.0, 2.0],
            [2.0, 2.0],
            [2.0, 1.0],
            [1.0, 1.0],
        ];
        let (triangles, crosses) = cut(&ring);
        assert!(!crosses);
        assert_eq!(covered(&ring, &triangles, [1.51, 1.47]), 0);
        for at in [[0.5, 1.41], [1.53, 0.5], [2.51, 1.48], [1.52, 2.53]] {
            assert_eq!(covered(&ring, &triangles, at), 1, "{at:?} {triangles:?}");
        }
    }

    #[test]
    fn what_has_no_area_or_no_place_is_a_fan() {
        let line = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [0.5, 0.0]];
        assert_eq!(cut(&line), (vec![[0, 1, 2], [0, 2, 3]], false));
        let nowhere = [[0.0, 0.0], [1.0, 0.0], [f32::NAN, 1.0], [0.1, 0.1]];
        assert_eq!(cut(&nowhere), (vec![[0, 1, 2], [0, 2, 3]], false));
        assert_eq!(cut(&[[0.0, 0.0], [1.0, 0.0]]), (vec![], false));
    }
}
