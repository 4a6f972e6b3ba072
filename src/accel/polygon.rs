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
    pub(crate) fn new(triangle: &TriangleRecord) -> Self {
        let mut corners = [[0.0; 3]; 9];
        for (corner, vertex) in corners.iter_mut().zip(triangle.vertices()) {
            *corner = vertex.map(f64::from);
        }
        Self { corners, count: 3 }
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
        let mut polygon = *self;
        for axis in 0..3 {
            for (border, sign) in [
                (f64::from(bounds.min[axis]) - margin, 1.0),
                (f64::from(bounds.max[axis]) + margin, -1.0),
            ] {
                let is_inside = |corner: &[f64; 3]| (corner[axis] - border) * sign >= 0.0;
                if !polygon.corners().iter().all(is_inside) {
                    polygon.cut(axis, border, sign);
                }
            }
        }
        polygon
    }

    /// Keeps the part where `sign · (x − border)` is not negative.
    pub(crate) fn cut(&mut self, axis: usize, border: f64, sign: f64) {
        let before = *self;
        self.count = 0;
        let mut push = |corner| {
            // Rounding may make a sliver cross a plane once more than geometry allows.
            if let Some(place) = self.corners.get_mut(self.count) {
                *place = corner;
                self.count += 1;
            }
        };
        let corners = before.corners();
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
                let mut crossing: [f64; 3] = std::array::from_fn(|i| {
                    let place = a[i] + (b[i] - a[i]) * along;
                    place.max(a[i].min(b[i])).min(a[i].max(b[i]))
                });
                crossing[axis] = border;
                push(crossing);
            }
        }
    }
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
