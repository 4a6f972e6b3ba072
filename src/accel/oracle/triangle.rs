//! One ray against one triangle in f64, with bounds on the errors of an f32 test.
//!
//! With edges e₁ = v₁ − v₀, e₂ = v₂ − v₀ and c = v₀ − o, Cramer's rule gives four triple products:
//!
//! ```text
//! det = d·(e₁×e₂)   U = e₂·(c×d)   V = −e₁·(c×d)   W = det − U − V   T = c·(e₁×e₂)
//! u = U/det   v = V/det   w = W/det   t = T/det
//! ```
//!
//! # Errors in f32
//!
//! Let ε = 2⁻²⁴. The vertices, the origin and the direction are f32 and so exact. In whatever way a
//! Möller–Trumbore-type test groups a triple product, each of its six terms passes at most eight
//! roundings: up to three differences (edges and c), the product of two factors, the subtraction
//! inside the cross product, the product with the third factor, two additions. So the error is at
//! most about 8 ε times the sum of the absolute values of the six terms, the *permanent*; fused
//! multiply-adds only omit roundings. A quotient may add 2.5 ulp (WGSL), one more rounding if it
//! uses a reciprocal, and w = 1 − u − v two more: 8 ε of the terms again. [`ROUNDINGS`] = 10 leaves
//! room for the products of errors. f64 arithmetic itself errs 2²⁹ times less.
//!
//! Everything is compared in the multiplied form (U against 0, T against t·det), which stays
//! meaningful where the ray grazes the plane and det is smaller than its own error.
//!
//! # Errors of a shear
//!
//! A test like that of Woop, Benthin and Wald moves the vertices into a frame in which the ray is
//! the axis of its longest direction component, say z: with c = v − o, x′ = c.x − (d.x/d.z) c.z and
//! y′ alike. Then U/d.z = x′₀·y′₂ − y′₀·x′₂ and so on, in terms of vertices instead of edges. With
//! X = |c.x| + |d.x/d.z|·|c.z|, x′ errs by at most 9 ε X: a difference, a quotient of 2.5 ulp, two
//! products, a difference. A product of two errs by 19 ε, their difference by 20 ε of its terms:
//! [`SHEARED`] = 22 leaves room. The distance is the average of those of the vertices, Σ Uᵢ·tᵢ / Σ
//! Uᵢ, so an error of Uᵢ is scaled by the difference of tᵢ from it; [`AVERAGED`] = 16 roundings are
//! its own.
//!
//! # Rays along a plane
//!
//! Components of a direction near 0 are raised, so that their reciprocals are finite. A ray that is so nearly in the plane of a
//! triangle that raising alone may make it meet that plane counts as a miss of every test: no such hit is demanded.
//!
//! The bounds here are the wider of both kinds. A test that moves vertices into the triangle's own
//! frame (Baldwin and Weber) has still wider ones, and is wrong by these.

use super::holes::Weight;
use crate::ray::{SMALLEST_COMPONENT, SMALLEST_SLOPE};
use raystone_core::geometry::{Ray, Triangle};

/// Half an ulp of 1 in f32.
const EPSILON: f64 = 1.0 / (1u32 << 24) as f64;

/// Roundings of f32 allowed in any quantity.
pub(super) const ROUNDINGS: f64 = 10.0;

/// Roundings of an edge function of sheared vertices.
const SHEARED: f64 = 22.0;
const AVERAGED: f64 = 16.0;

/// Allowance for products that f32 flushes to zero, if there are products.
const FLUSHED: f64 = f64::from_bits((1023 - 110) << 52);

pub(super) type Vector = [f64; 3];

/// A number with an error bound for its f32 counterpart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bounded {
    pub value: f64,
    /// Largest difference of the f32 result.
    pub error: f64,
}

/// The triple products of a ray and a triangle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Crossing {
    /// For the first kind of test.
    det: Bounded,
    /// For either kind.
    barycentrics: [Bounded; 3],
    t: Bounded,
    sheared: Sheared,
    /// True if the ray may meet the plane for its raised direction alone.
    is_along: bool,
}

/// The additional errors of a test with sheared vertices.
#[derive(Debug, Clone, Copy)]
struct Sheared {
    /// Errors of the barycentrics, which are weights of the vertices.
    errors: [f64; 3],
    /// Distances of the vertices along the ray.
    distances: [f64; 3],
}

impl Crossing {
    pub(super) fn new(triangle: &Triangle, ray: &Ray) -> Self {
        let [v0, v1, v2] = triangle.vertices.map(|v| widen(v.to_array()));
        let d = widen(ray.direction);
        let (e1, e2) = (subtract(v1, v0), subtract(v2, v0));
        let origin = widen(ray.origin);
        let c = subtract(v0, origin);
        let det = triple(d, e1, e2);
        let u = triple(e2, c, d);
        let v = triple(e1, d, c);
        let terms = det.value.abs() + u.value.abs() + v.value.abs();
        let w = Bounded {
            value: det.value - u.value - v.value,
            error: det.error + u.error + v.error + ROUNDINGS * EPSILON * terms,
        };
        let sheared = Sheared::new([v1, v2, v0].map(|v| subtract(v, origin)), d);
        let mut barycentrics = [u, v, w];
        for (barycentric, error) in barycentrics.iter_mut().zip(sheared.errors) {
            barycentric.error = larger(barycentric.error, error);
        }
        Self {
            det,
            barycentrics,
            t: triple(c, e1, e2),
            sheared,
            is_along: is_along(d, e1, e2, det.value),
        }
    }

    /// Error bound of the determinant for either kind of test.
    fn det_error(&self) -> f64 {
        larger(self.det.error, self.sheared.errors.iter().sum())
    }

    /// True if an f32 test may find a hit in the ray's interval.
    pub(super) fn is_possible(&self, ray: &Ray) -> bool {
        let facing = |sign: f64| {
            sign * self.det.value + self.det_error() > 0.0
                && (self.barycentrics.iter()).all(|b| sign * b.value + b.error >= 0.0)
        };
        let in_reach = |t: Bounded| {
            t.value + t.error >= f64::from(ray.t_min) && t.value - t.error <= f64::from(ray.t_max)
        };
        (facing(1.0) || facing(-1.0)) && self.distance().is_none_or(in_reach)
    }

    /// True if every f32 test must find a hit in the ray's interval.
    pub(super) fn is_definite(&self, ray: &Ray) -> bool {
        let sign = self.det.value.signum();
        let inside = (self.barycentrics.iter()).all(|b| sign * b.value > b.error);
        let in_reach = |t: Bounded| {
            t.value - t.error > f64::from(ray.t_min) && t.value + t.error < f64::from(ray.t_max)
        };
        inside && !self.is_along && self.distance().is_some_and(in_reach)
    }

    /// Distance along the ray in units of its direction; `None` if the sign of det is uncertain.
    pub(super) fn distance(&self) -> Option<Bounded> {
        let least_det = self.det.value.abs() - self.det_error();
        let value = self.t.value / self.det.value;
        let products = self.t.error + value.abs() * self.det.error;
        let error = larger(products, self.average_error(value)) / least_det;
        (least_det > 0.0).then(|| Bounded {
            value,
            error: error + ROUNDINGS * EPSILON * value.abs(),
        })
    }

    /// Weights of the second and third corners, with the error of an f32 test; `None` as for
    /// [`Crossing::distance`].
    pub(super) fn weights(&self) -> Option<[Weight; 2]> {
        let least_det = self.det.value.abs() - self.det_error();
        let weight = |b: Bounded| {
            let value = b.value / self.det.value;
            let error = (b.error + value.abs() * self.det_error()) / least_det;
            let error = error + ROUNDINGS * EPSILON * value.abs();
            Weight { value, error }
        };
        let [u, v, _] = self.barycentrics;
        (least_det > 0.0).then(|| [u, v].map(weight))
    }

    /// True if an f32 test may return the distance `t`.
    pub(super) fn accepts(&self, t: f32) -> bool {
        let t = f64::from(t);
        let rounding = ROUNDINGS * EPSILON * (self.det.value.abs() + self.det.error);
        let products = self.t.error + t.abs() * (self.det.error + rounding);
        (self.t.value - t * self.det.value).abs() <= larger(products, self.average_error(t))
    }

    /// Error of the average distance of the vertices times det, near the distance `t`.
    fn average_error(&self, t: f64) -> f64 {
        let weights = self.barycentrics.map(|b| b.value.abs());
        let terms = self.sheared.errors.iter().zip(&self.sheared.distances);
        let terms = terms.zip(weights).map(|((error, distance), weight)| {
            error * (distance - t).abs() + AVERAGED * EPSILON * (weight + error) * distance.abs()
        });
        terms.sum()
    }
}

/// True if raising may have tilted a direction against a plane as much as it is tilted; det is that of direction and edges.
fn is_along(d: Vector, e1: Vector, e2: Vector, det: f64) -> bool {
    // Each component by no more than twice what it is raised to, and a test in f32 may err by some roundings.
    let longest = d.iter().fold(0.0, |longest: f64, x| longest.max(x.abs()));
    let raised = (longest * f64::from(SMALLEST_SLOPE)).max(f64::from(SMALLEST_COMPONENT));
    let normal = cross(e1, e2);
    let sum: f64 = normal.iter().map(|x| x.abs()).sum();
    det.abs() <= 2.0 * raised * sum * (1.0 + 2.0 * ROUNDINGS * EPSILON)
}

impl Sheared {
    /// For vertices relative to the origin, in the order of their weights.
    fn new(vertices: [Vector; 3], d: Vector) -> Self {
        let z = (0..3).fold(0, |z, a| if d[a].abs() > d[z].abs() { a } else { z });
        let (x, y) = ((z + 1) % 3, (z + 2) % 3);
        let slope = |axis: usize| (d[axis] / d[z]).abs();
        let terms = |axis: usize| {
            vertices.map(|v| {
                v[axis].abs()
                    + if d[z] == 0.0 {
                        0.0
                    } else {
                        slope(axis) * v[z].abs()
                    }
            })
        };
        let (xs, ys) = (terms(x), terms(y));
        let error = |i: usize| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            SHEARED * EPSILON * d[z].abs() * (xs[j] * ys[k] + ys[j] * xs[k])
        };
        Self {
            errors: [error(0), error(1), error(2)],
            distances: vertices.map(|v| if d[z] == 0.0 { 0.0 } else { v[z] / d[z] }),
        }
    }
}

/// a·(b×c) with the error bound of its f32 counterpart. If every term has a zero factor, the
/// product is zero in f32 as well.
fn triple(a: Vector, b: Vector, c: Vector) -> Bounded {
    let magnitude = |v: Vector| v.map(f64::abs);
    let (b_abs, c_abs) = (magnitude(b), magnitude(c));
    let minors = [(1, 2), (2, 0), (0, 1)].map(|(j, k)| b_abs[j] * c_abs[k] + b_abs[k] * c_abs[j]);
    let permanent = dot(magnitude(a), minors);
    Bounded {
        value: dot(a, cross(b, c)),
        error: if permanent > 0.0 {
            ROUNDINGS * EPSILON * permanent + FLUSHED
        } else {
            0.0
        },
    }
}

#[inline(always)]
pub(super) fn widen(v: [f32; 3]) -> Vector {
    v.map(f64::from)
}

#[inline(always)]
pub(super) fn subtract(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub(super) fn cross(a: Vector, b: Vector) -> Vector {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[inline(always)]
pub(super) fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// One instruction, unlike `f64::max`; the order of NaN does not matter here.
#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::super::{Fault, Verdict, judge};
    use super::*;

    /// A floor of which corners are some 10⁻¹⁴ too low, as rounding of a motion leaves them, and a ray along it.
    #[test]
    fn no_hit_is_demanded_of_a_plane_that_raising_may_have_tilted_the_ray_to() {
        let [x, y] = [-5.882_838_2e-15, -2.399_931_3e-14];
        let corners = [
            [552.8, x, -1.599_954_3e-14],
            [x, y, 559.2],
            [549.6, y, 559.2],
        ];
        let floor = [Triangle {
            vertices: corners.map(Into::into),
        }];
        // It begins so much below that it meets the floor ten units on.
        let along = |times: f32| {
            let direction = [
                -9.198_513_5e-11,
                times * SMALLEST_COMPONENT,
                -3.922_672_3e-11,
            ];
            Ray::new([556.0, y - times * 5.333_2e-15, 559.2], direction)
        };
        let raised = along(1.0);
        assert_eq!(judge(&floor[..], raised, None), Verdict::Ambiguous);
        let crossed = Crossing::new(&floor[0], &raised);
        assert!(crossed.is_along && crossed.is_possible(&raised));
        // A ray that climbs as much by itself meets the floor.
        let steep = along(4.0);
        let verdict = judge(&floor[..], steep, None);
        assert!(
            matches!(verdict, Verdict::Wrong(Fault::FalseMiss { .. })),
            "{verdict:?}"
        );
    }
}
