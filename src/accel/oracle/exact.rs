//! The exact mode: tests without any rounding if a ray hits, misses or meets an edge of a triangle,
//! and computes the distance in f64.
//!
//! With a = v₀ − o, b = v₁ − o, c = v₂ − o the three edge functions and the volume are
//!
//! ```text
//! E₀ = det(d, b, c)   E₁ = det(d, c, a)   E₂ = det(d, a, b)   T = det(a, b, c)
//! D = E₀ + E₁ + E₂ = d·(e₁×e₂)            t = T / D
//! ```
//!
//! The line goes through the triangle if no two of E₀, E₁, E₂ differ in sign, through an edge if one
//! of them is zero as well, and does not cross the plane if D is zero.
//!
//! Each is first computed in f64 with an error bound. If that leaves the sign open, the
//! determinants are expanded: they are linear in every row, so det(d, v₁ − o, v₂ − o) is a sum of
//! determinants of rows that are f32 numbers themselves. A product of two of those is exact in f64,
//! and that of three is a sum of two f64 numbers (Dekker 1971). The result is a sum of at most a
//! hundred f64 numbers, whose sign expansions give exactly (Shewchuk 1997, *Adaptive Precision
//! Floating-Point Arithmetic*, GROW-EXPANSION). Products stay between 2⁻⁴⁴⁷ and 2³⁸⁴: nothing
//! underflows or overflows for any finite f32 input.

use super::triangle::{Vector, cross, dot, subtract, widen};
use raystone_core::geometry::{Ray, Triangle};

/// Half an ulp of 1 in f64.
const EPSILON: f64 = f64::EPSILON / 2.0;

/// Roundings in a determinant computed in f64, with a safety margin.
const ROUNDINGS: f64 = 16.0;

/// A quotient of operands with a smaller relative error counts as exact: 2⁻²¹ ulp of f32.
const WELL_KNOWN: f64 = 1.0 / (1u64 << 44) as f64;

/// Position of a ray's line relative to a triangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Through the interior.
    Inside,
    /// Through an edge or a vertex.
    Edge,
    /// Outside.
    Outside,
    /// No intersection: the line is in the plane or parallel to it, or the triangle has no area.
    Parallel,
}

/// The exact relation between a line and a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExactCrossing {
    /// The side on which the line passes.
    pub side: Side,
    /// Distance to the plane in units of the direction, to within 2⁻⁴³ of itself; NaN if parallel.
    pub t: f64,
    /// True if `t_min ≤ t ≤ t_max`, exactly.
    pub in_interval: bool,
}

impl ExactCrossing {
    /// Tests one triangle. All numbers of `ray` and `triangle` except `t_max` must be finite.
    pub fn new(triangle: &Triangle, ray: &Ray) -> Self {
        let pair = Pair::new(triangle, ray);
        let signs = pair.edges().map(|e| e.sign());
        let positive = signs.contains(&1);
        let negative = signs.contains(&-1);
        if !positive && !negative {
            return Self::PARALLEL;
        }
        let determinant = pair.determinant();
        if positive && negative && determinant.sign() == 0 {
            return Self::PARALLEL;
        }
        let volume = pair.volume();
        Self {
            side: match (positive && negative, signs.contains(&0)) {
                (true, _) => Side::Outside,
                (false, true) => Side::Edge,
                (false, false) => Side::Inside,
            },
            t: volume.accurate() / determinant.accurate(),
            in_interval: compare(&volume, &determinant, ray.t_min) >= 0
                && compare(&volume, &determinant, ray.t_max) <= 0,
        }
    }

    const PARALLEL: Self = Self {
        side: Side::Parallel,
        t: f64::NAN,
        in_interval: false,
    };

    /// True if the ray hits the triangle, edges included, within its interval.
    pub(crate) fn is_hit(&self) -> bool {
        self.in_interval && matches!(self.side, Side::Inside | Side::Edge)
    }
}

/// The sign of volume / determinant − t.
fn compare(volume: &Determinant, determinant: &Determinant, t: f32) -> i32 {
    if t.is_infinite() {
        return if t > 0.0 { -1 } else { 1 };
    }
    let t = f64::from(t);
    let sign = determinant.sign();
    let difference = volume.value - t * determinant.value;
    let error = volume.error
        + t.abs() * determinant.error
        + 4.0 * EPSILON * (volume.value.abs() + (t * determinant.value).abs());
    if difference.abs() > error {
        return sign * signum(difference);
    }
    let mut sum = volume.expansion();
    for term in determinant.terms() {
        let (high, low) = two_product(term, -t);
        sum.add(high);
        sum.add(low);
    }
    sign * sum.sign()
}

/// The vectors of a ray and a triangle in f64, and the triangle's corners relative to the origin.
struct Pair {
    o: Vector,
    d: Vector,
    v: [Vector; 3],
    seen: [Vector; 3],
}

/// A determinant: its f64 value with an error bound, and the f32 rows it is made of.
struct Determinant {
    value: f64,
    error: f64,
    /// Rows of the determinants that sum to it, with their signs.
    parts: Vec<(f64, [Vector; 3])>,
}

impl Pair {
    fn new(triangle: &Triangle, ray: &Ray) -> Self {
        let v = triangle.vertices.map(|v| widen(v.to_array()));
        let o = widen(ray.origin);
        Self {
            o,
            d: widen(ray.direction),
            v,
            seen: v.map(|v| subtract(v, o)),
        }
    }

    /// E₀, E₁, E₂.
    fn edges(&self) -> [Determinant; 3] {
        let (o, d) = (self.o, self.d);
        [(1, 2), (2, 0), (0, 1)].map(|(i, k)| {
            let [from, to] = [self.v[i], self.v[k]];
            Determinant::new(
                [d, self.seen[i], self.seen[k]],
                vec![
                    (1.0, [d, from, to]),
                    (-1.0, [d, o, to]),
                    (-1.0, [d, from, o]),
                ],
            )
        })
    }

    /// D.
    fn determinant(&self) -> Determinant {
        let [v0, v1, v2] = self.v;
        let d = self.d;
        Determinant::new(
            [d, subtract(v1, v0), subtract(v2, v0)],
            vec![(1.0, [d, v0, v1]), (1.0, [d, v1, v2]), (1.0, [d, v2, v0])],
        )
    }

    /// T.
    fn volume(&self) -> Determinant {
        let [v0, v1, v2] = self.v;
        let o = self.o;
        Determinant::new(
            self.seen,
            vec![
                (1.0, [v0, v1, v2]),
                (-1.0, [o, v1, v2]),
                (-1.0, [v0, o, v2]),
                (-1.0, [v0, v1, o]),
            ],
        )
    }
}

impl Determinant {
    fn new(rows: [Vector; 3], parts: Vec<(f64, [Vector; 3])>) -> Self {
        let [a, b, c] = rows;
        let magnitude = |v: Vector| v.map(f64::abs);
        let (b_abs, c_abs) = (magnitude(b), magnitude(c));
        let minors =
            [(1, 2), (2, 0), (0, 1)].map(|(j, k)| b_abs[j] * c_abs[k] + b_abs[k] * c_abs[j]);
        Self {
            value: dot(a, cross(b, c)),
            error: ROUNDINGS * EPSILON * dot(magnitude(a), minors),
            parts,
        }
    }

    /// −1, 0 or 1.
    fn sign(&self) -> i32 {
        if self.value.abs() > self.error {
            signum(self.value)
        } else {
            self.expansion().sign()
        }
    }

    /// The value to within 2⁻⁴⁴ of itself.
    fn accurate(&self) -> f64 {
        if self.value.abs() * WELL_KNOWN > self.error {
            self.value
        } else {
            self.expansion().value()
        }
    }

    /// Numbers that sum to it.
    fn terms(&self) -> impl Iterator<Item = f64> + '_ {
        self.parts.iter().flat_map(|(sign, [a, b, c])| {
            let permutations = [(0, 1, 2), (1, 2, 0), (2, 0, 1)];
            permutations.into_iter().flat_map(move |(i, j, k)| {
                let even = two_product(a[i] * b[j], sign * c[k]);
                let odd = two_product(a[i] * b[k], -sign * c[j]);
                [even.0, even.1, odd.0, odd.1]
            })
        })
    }

    fn expansion(&self) -> Expansion {
        let mut sum = Expansion::default();
        self.terms().for_each(|term| sum.add(term));
        sum
    }
}

fn signum(x: f64) -> i32 {
    i32::from(x > 0.0) - i32::from(x < 0.0)
}

/// A number as an unevaluated sum of non-overlapping f64 numbers, by growing magnitude.
#[derive(Default)]
struct Expansion(Vec<f64>);

impl Expansion {
    /// GROW-EXPANSION with zero elimination.
    fn add(&mut self, term: f64) {
        let mut carry = term;
        let mut kept = 0;
        for i in 0..self.0.len() {
            let (sum, rest) = two_sum(carry, self.0[i]);
            carry = sum;
            if rest != 0.0 {
                self.0[kept] = rest;
                kept += 1;
            }
        }
        self.0.truncate(kept);
        if carry != 0.0 {
            self.0.push(carry);
        }
    }

    /// The last component outweighs all others together.
    fn sign(&self) -> i32 {
        self.0.last().map_or(0, |last| signum(*last))
    }

    fn value(&self) -> f64 {
        self.0.iter().sum()
    }
}

/// a + b as its rounded value and the rounding error (Knuth).
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let b_part = sum - a;
    (sum, (a - (sum - b_part)) + (b - b_part))
}

/// a · b as its rounded value and the rounding error.
fn two_product(a: f64, b: f64) -> (f64, f64) {
    let product = a * b;
    (product, a.mul_add(b, -product))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use raystone_core::random::Pcg32;

    /// The same with integers: exact as long as coordinates are small.
    fn by_integers(
        triangle: [[i64; 3]; 3],
        origin: [i64; 3],
        direction: [i64; 3],
    ) -> (Side, [i128; 2]) {
        let from_origin = |v: [i64; 3]| [0, 1, 2].map(|k| i128::from(v[k] - origin[k]));
        let d = direction.map(i128::from);
        let [a, b, c] = triangle.map(from_origin);
        let det = |x: [i128; 3], y: [i128; 3], z: [i128; 3]| {
            x[0] * (y[1] * z[2] - y[2] * z[1])
                + x[1] * (y[2] * z[0] - y[0] * z[2])
                + x[2] * (y[0] * z[1] - y[1] * z[0])
        };
        let edges = [det(d, b, c), det(d, c, a), det(d, a, b)];
        let whole: i128 = edges.iter().sum();
        let of_both_signs = edges.iter().any(|e| *e > 0) && edges.iter().any(|e| *e < 0);
        let side = match (whole == 0, of_both_signs, edges.contains(&0)) {
            (true, ..) => Side::Parallel,
            (_, true, _) => Side::Outside,
            (_, _, true) => Side::Edge,
            _ => Side::Inside,
        };
        (side, [det(a, b, c), whole])
    }

    fn point(random: &mut Pcg32, extent: i64) -> [i64; 3] {
        [0; 3].map(|_| random.below(2 * extent as usize + 1) as i64 - extent)
    }

    fn f32s(v: [i64; 3], unit: f32) -> [f32; 3] {
        v.map(|x| x as f32 * unit)
    }

    #[test]
    fn sides_and_distances_equal_integer_arithmetic_at_every_scale() {
        let mut random = Pcg32::new(3);
        let mut seen = [0; 4];
        for round in 0..40_000 {
            let extent = [1, 3, 1000, 8_000_000][round % 4];
            // Powers of two only change exponents.
            let unit = [1.0, f32::MIN_POSITIVE, 2f32.powi(90)][round % 3];
            let corners = [0; 3].map(|_| point(&mut random, extent));
            let origin = point(&mut random, extent);
            // Half of the rays are aimed exactly at a corner.
            let target = match round % 2 {
                0 => corners[0],
                _ => point(&mut random, extent),
            };
            let direction = [0, 1, 2].map(|k| target[k] - origin[k]);
            let (side, [volume, whole]) = by_integers(corners, origin, direction);
            let triangle = corners.map(|v| Vec3::from(f32s(v, unit))).into();
            let ray = Ray::new(f32s(origin, unit), f32s(direction, unit));
            let found = ExactCrossing::new(&triangle, &ray);
            assert_eq!(found.side, side, "{corners:?} {origin:?} {direction:?}");
            seen[side as usize] += 1;
            if side != Side::Parallel {
                let t = volume as f64 / whole as f64;
                assert!((found.t - t).abs() <= 1e-12 * t.abs(), "{} {t}", found.t);
                assert_eq!(found.in_interval, t >= 0.0);
            }
        }
        assert!(seen.iter().all(|n| *n > 100), "{seen:?}");
    }

    #[test]
    fn the_last_bit_of_a_vertex_decides() {
        // A ray at the corner where a huge triangle begins: it meets the plane only there.
        let far = 3.0e7_f32;
        let side = |y: f32| {
            let corner = Vec3::new(1.0, y, 0.0);
            let vertices = [corner, Vec3::new(far, far, 1.0), Vec3::new(far, -far, 1.0)];
            ExactCrossing::new(&vertices.into(), &Ray::new([0.0; 3], [1.0, 1.0, 0.0])).side
        };
        assert_eq!(side(1.0), Side::Edge);
        assert_eq!(side(1.0_f32.next_up()), Side::Outside);
        assert_eq!(side(1.0_f32.next_down()), Side::Outside);
    }

    #[test]
    fn ends_of_the_interval_count_and_one_ulp_beyond_does_not() {
        let third = 1.0_f32 / 3.0;
        let vertices = [
            Vec3::new(-1.0, -1.0, third),
            Vec3::new(2.0, -1.0, third),
            Vec3::new(-1.0, 2.0, third),
        ];
        let hit = |t_min: f32, t_max: f32| {
            let ray = Ray::new([0.0; 3], Vec3::Z).between(t_min, t_max);
            ExactCrossing::new(&vertices.into(), &ray).is_hit()
        };
        assert!(hit(third, third) && hit(0.0, third) && hit(third, f32::INFINITY));
        assert!(!hit(0.0, third.next_down()) && !hit(third.next_up(), 1.0));
    }

    #[test]
    fn an_expansion_keeps_what_f64_sums_lose() {
        let mut sum = Expansion::default();
        for term in [1.0, 1e-30, -1.0, 2f64.powi(-400), -1e-30] {
            sum.add(term);
        }
        assert_eq!((sum.sign(), sum.value()), (1, 2f64.powi(-400)));
        sum.add(-(2f64.powi(-400)));
        assert_eq!(sum.sign(), 0);
    }
}
