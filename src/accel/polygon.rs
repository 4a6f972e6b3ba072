//! Triangles clipped by boxes.

use super::bounds::Bounds;
use super::triangle::TriangleRecord;
use glam::DVec3;

/// A convex polygon: a triangle cut by up to six planes has at most nine corners.
#[derive(Clone, Copy)]
pub(super) struct Polygon {
    corners: [[f64; 3]; 9],
    count: usize,
}

impl Polygon {
    const NONE: Self = Self {
        corners: [[0.0; 3]; 9],
        count: 0,
    };

    pub(crate) fn new(triangle: &TriangleRecord) -> Self {
        let mut polygon = Self::NONE;
        for (corner, vertex) in polygon.corners.iter_mut().zip(triangle.vertices()) {
            *corner = vertex.map(f64::from);
        }
        polygon.count = 3;
        polygon
    }

    /// Its corners; none if nothing is left.
    pub(crate) fn corners(&self) -> &[[f64; 3]] {
        &self.corners[..self.count]
    }

    pub(crate) fn area(&self) -> f64 {
        let [origin, rest @ ..] = self.corners() else {
            return 0.0;
        };
        let from_origin = |corner: [f64; 3]| DVec3::from(corner) - DVec3::from(*origin);
        let fan = rest.windows(2);
        let sum: DVec3 = fan
            .map(|p| from_origin(p[0]).cross(from_origin(p[1])))
            .sum();
        0.5 * sum.length()
    }

    /// The part inside a grown box (I. Sutherland, G. Hodgman, "Reentrant polygon clipping", 1974).
    pub(crate) fn clipped(&self, bounds: &Bounds, margin: f64) -> Polygon {
        let (mut whole, mut cut) = (*self, Self::NONE);
        let (mut polygon, mut part) = (&mut whole, &mut cut);
        for axis in 0..3 {
            for (border, sign) in [
                (f64::from(bounds.min[axis]) - margin, 1.0),
                (f64::from(bounds.max[axis]) + margin, -1.0),
            ] {
                let is_inside = |corner: &[f64; 3]| (corner[axis] - border) * sign >= 0.0;
                if !polygon.corners().iter().all(is_inside) {
                    polygon.cut_into(part, axis, border, sign);
                    std::mem::swap(&mut polygon, &mut part);
                }
            }
        }
        *polygon
    }

    /// The part where `sign · (x − border)` is not negative.
    pub(crate) fn cut(&self, axis: usize, border: f64, sign: f64) -> Polygon {
        let mut part = Self::NONE;
        self.cut_into(&mut part, axis, border, sign);
        part
    }

    fn cut_into(&self, part: &mut Polygon, axis: usize, border: f64, sign: f64) {
        part.count = 0;
        let mut push = |corner| {
            // Rounding may make a sliver cross a plane once more than geometry allows.
            if let Some(place) = part.corners.get_mut(part.count) {
                *place = corner;
                part.count += 1;
            }
        };
        let corners = self.corners();
        let Some(mut b) = corners.first() else { return };
        let mut to = sign * (b[axis] - border);
        for next in corners.iter().skip(1).chain(corners.first()) {
            let (a, from) = (b, to);
            (b, to) = (next, sign * (next[axis] - border));
            if from >= 0.0 {
                push(*a);
            }
            if (from < 0.0) != (to < 0.0) {
                let along = from / (from - to);
                // Between both ends despite rounding: earlier cuts stay valid.
                let mut crossing: [f64; 3] =
                    std::array::from_fn(|i| between(a[i] + (b[i] - a[i]) * along, a[i], b[i]));
                crossing[axis] = border;
                push(crossing);
            }
        }
    }

    /// Its box, grown by `margin` and rounded outwards; `None` if nothing is left.
    pub(crate) fn bounds(&self, margin: f64) -> Option<Bounds> {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for corner in self.corners() {
            for axis in 0..3 {
                let x = corner[axis];
                low[axis] = if x < low[axis] { x } else { low[axis] };
                high[axis] = if x > high[axis] { x } else { high[axis] };
            }
        }
        // Rounding is monotone: the least is rounded once for all.
        (self.count > 0).then(|| Bounds {
            min: low.map(|x| rounded_down(x - margin)),
            max: high.map(|x| -rounded_down(-x - margin)),
        })
    }
}

/// The largest f32 that is at most `x`.
pub(crate) fn rounded_down(x: f64) -> f32 {
    let nearest = x as f32;
    if f64::from(nearest) > x {
        nearest.next_down()
    } else {
        nearest
    }
}

/// `x`, or the end that it lies beyond. Comparisons are one instruction each, unlike f64::min; there is no NaN.
fn between(x: f64, a: f64, b: f64) -> f64 {
    let [low, high] = if a < b { [a, b] } else { [b, a] };
    let x = if x > low { x } else { low };
    if x < high { x } else { high }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::record;

    const UNIT: Bounds = Bounds {
        min: [0.0; 3],
        max: [1.0; 3],
    };

    #[test]
    fn a_clipped_triangle_has_the_area_that_geometry_gives() {
        let area = |vertices| {
            Polygon::new(&record(0, vertices))
                .clipped(&UNIT, 0.0)
                .area()
        };
        let inside = [[0.0, 0.0, 0.5], [1.0, 0.0, 0.5], [0.0, 1.0, 0.5]];
        assert_eq!(area(inside), 0.5);
        // Twice the size: the corner square of side 1.
        let larger = [[0.0, 0.0, 0.5], [2.0, 0.0, 0.5], [0.0, 2.0, 0.5]];
        assert_eq!(area(larger), 1.0);
        // The plane x + y + z = 3/2 cuts a cube in a regular hexagon of side √½.
        let third = [[-9.0, 5.25, 5.25], [5.25, -9.0, 5.25], [5.25, 5.25, -9.0]];
        let hexagon = 1.5 * 3.0_f64.sqrt() * 0.5;
        assert!((area(third) - hexagon).abs() < 1e-12, "{}", area(third));
        assert_eq!(area(inside.map(|[x, y, z]| [x + 3.0, y, z])), 0.0);
    }
}
