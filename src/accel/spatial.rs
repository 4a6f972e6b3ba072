//! Shared parts of the structures that divide space (`octree`, `kd-tree`): the cells that list a
//! triangle.
//!
//! A triangle may be listed *by its box* or *clipped*. By its box: it goes to every side of a plane
//! that its box overlaps, to one side only if the box ends in the plane. Then the theorem of
//! [`super::triangle`] holds for cells as it does for boxes of a BVH. Proof: `N` and `F` are the
//! computed slab distances of the triangle's box, `t` its clamped hit, `s` the computed distance of
//! a split plane. Going down from the root, if the box lies on one side, follow it: `s ≥ F` on the
//! near side and `s ≤ N` on the far one, because computed distances are monotone in the plane. If
//! it is listed on both, follow the near side if `t ≤ s`, else the far one. So the interval `[n,
//! f]` of every cell on the way satisfies `n ≤ max(N, t)` and `f ≥ min(F, t)`, which is all that
//! the four inequalities of that proof use: each cell passes `max(n, t_min) ≤ min(f, t_best) ·
//! BOX_PAD`, and the leaf at the end lists the triangle. ∎
//!
//! Clipped: a cell that the triangle itself misses by more than its [`Margin`] does not list it,
//! although its box may overlap the cell. Lists become shorter, but this assumes that the computed
//! hit lies within the margin of the triangle. It does unless the ray grazes the triangle's plane
//! at a cosine below [`LEAST_COSINE`]; and then only a hit, or an end of the ray, between the
//! computed distance and the exact one can make a difference.

use super::bounds::Bounds;
use super::polygon::Polygon;
use super::triangle::{DISTANCE_PAD, TriangleRecord};

/// Cosine between ray and normal down to which margins cover the error of a hit, 2⁻⁵.
const LEAST_COSINE: f64 = 0.03125;

/// Growth of cells before a clipped triangle counts as missing them.
///
/// The distance of a hit errs by less than [`DISTANCE_PAD`] times the terms that it is made of,
/// over the determinant (see [`super::triangle`]). With edges `e1` and `e2`, normal `n`, `m` the
/// sum of the magnitudes of both products in each component of `n`, and a ray no longer than the
/// scene, that is `2 · DISTANCE_PAD · diagonal · |m| / (|n| · cosine)`, a point along the ray.
pub(super) struct Margin {
    /// The margin of a triangle with |m| = |n|, scene units.
    least: f64,
}

impl Margin {
    /// Margins in a scene with this box.
    pub(crate) fn new(bounds: &Bounds) -> Self {
        let extent = bounds.extent().map(f64::from);
        let diagonal = extent.iter().map(|e| e * e).sum::<f64>().sqrt();
        let far = (0..3)
            .map(|a| bounds.min[a].abs().max(bounds.max[a].abs()))
            .fold(0.0, f32::max);
        let length = diagonal + f64::from(far) * LEAST_COSINE;
        let least = 2.0 * f64::from(DISTANCE_PAD) * length / LEAST_COSINE;
        Self {
            least: least.max(1e-18),
        }
    }

    /// The margin of one triangle, scene units; effectively infinite if it has no area.
    pub(crate) fn of(&self, record: &TriangleRecord) -> f64 {
        let [e1, e2] = record.edges();
        let (mut products, mut normal) = (0.0, 0.0);
        for a in 0..3 {
            let (b, c) = ((a + 1) % 3, (a + 2) % 3);
            products += ((e1[b] * e2[c]).abs() + (e1[c] * e2[b]).abs()).powi(2);
            normal += (e1[b] * e2[c] - e1[c] * e2[b]).powi(2);
        }
        // Finite, so that its product with zero is not NaN.
        let beyond = f64::from(f32::MAX);
        if normal > 0.0 {
            (self.least * (products / normal).sqrt()).min(beyond)
        } else {
            beyond
        }
    }
}

pub(super) type Corners = [[f64; 3]; 3];

pub(super) fn corners(record: &TriangleRecord) -> Corners {
    record.vertices().map(|v| v.map(f64::from))
}

/// The octants of a box whose `corners` are given from its centre that the triangle misses by more than `margin`, one
/// bit each, bit `a` of an octant its half along axis `a`; `size` is that of an octant. Of octants outside of the
/// triangle's box it says nothing.
///
/// Separating axes (T. Akenine-Möller, "Fast 3D triangle–box overlap testing", 2001); in a projection only the outer
/// side of each edge can separate (M. Schwarz, H.-P. Seidel, "Fast parallel surface and solid voxelization on GPUs",
/// 2010). All eight octants share the centre, so that one value and the size of an octant tell them apart.
pub(super) fn missed_octants(corners: &Corners, size: [f64; 3], margin: f64) -> u8 {
    let edges = edges(corners);
    let normal = cross(edges[0], edges[1]);
    let mut missed = beside_plane(dot(corners[0], normal), normal, size, margin);
    for (axis, height) in normal.iter().enumerate() {
        let [b, c] = others(axis);
        // Seen along this axis, the corners turn left or right.
        let sign = 1.0_f64.copysign(*height);
        for (corner, edge) in corners.iter().zip(&edges) {
            // Outwards, and how far the centre lies outside.
            let out = [sign * edge[c], -sign * edge[b]];
            let growth = margin * (out[0].abs() + out[1].abs());
            let far = -(out[0] * corner[b] + out[1] * corner[c]) - growth;
            if far > 0.0 {
                missed |= beside_edge(far, out, [b, c], size);
            }
        }
    }
    missed
}

/// Octants on each axis's upper side.
pub(super) const ABOVE: [u8; 3] = [0b1010_1010, 0b1100_1100, 0b1111_0000];

/// The octants outside of a projected edge with this normal, from whose line the centre is `far`.
fn beside_edge(far: f64, out: [f64; 2], [b, c]: [usize; 2], size: [f64; 3]) -> u8 {
    let across = [size[b] * out[0].abs(), size[c] * out[1].abs()];
    let outer = |axis: usize, out: f64| if out > 0.0 { ABOVE[axis] } else { !ABOVE[axis] };
    let (at_b, at_c) = (outer(b, out[0]), outer(c, out[1]));
    let mut missed = at_b & at_c;
    missed |= if far > across[0] { !at_b & at_c } else { 0 };
    missed |= if far > across[1] { at_b & !at_c } else { 0 };
    missed |= if far > across[0] + across[1] {
        !at_b & !at_c
    } else {
        0
    };
    missed
}

/// The octants that a plane at `height` along its normal misses.
fn beside_plane(height: f64, normal: [f64; 3], size: [f64; 3], margin: f64) -> u8 {
    let far = height.abs() - margin * (normal[0].abs() + normal[1].abs() + normal[2].abs());
    let towards: [usize; 3] =
        std::array::from_fn(|a| usize::from((normal[a] > 0.0) == (height > 0.0)));
    let reach: [f64; 3] = std::array::from_fn(|a| size[a] * normal[a].abs());
    (0..8).fold(0, |missed, octant: usize| {
        let reaches = |a: usize| {
            if octant >> a & 1 == towards[a] {
                reach[a]
            } else {
                0.0
            }
        };
        missed | u8::from(reaches(0) + reaches(1) + reaches(2) < far) << octant
    })
}

fn edges(corners: &Corners) -> Corners {
    std::array::from_fn(|i| std::array::from_fn(|a| corners[(i + 1) % 3][a] - corners[i][a]))
}

fn others(axis: usize) -> [usize; 2] {
    [(axis + 1) % 3, (axis + 2) % 3]
}

/// True if the triangle touches the closed box: all separating axes, from both sides.
pub(super) fn touches(corners: &Corners, cell: &Bounds) -> bool {
    let side = |a: usize| (f64::from(cell.min[a]), f64::from(cell.max[a]));
    let half: [f64; 3] = std::array::from_fn(|a| 0.5 * (side(a).1 - side(a).0));
    let centre: [f64; 3] = std::array::from_fn(|a| 0.5 * (side(a).1 + side(a).0));
    let unit = |a: usize| std::array::from_fn(|b| f64::from(u8::from(a == b)));
    let edges = edges(corners);
    let products = (0..9).map(|k| cross(edges[k / 3], unit(k % 3)));
    let axes = (0..3)
        .map(unit)
        .chain([cross(edges[0], edges[1])])
        .chain(products);
    axes.into_iter().all(|axis| {
        let reach: f64 = (0..3).map(|a| half[a] * axis[a].abs()).sum();
        let along = corners.map(|corner| dot(corner, axis) - dot(centre, axis));
        along.iter().any(|x| *x <= reach) && along.iter().any(|x| *x >= -reach)
    })
}

pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// Box of the part of a triangle within `cell` grown by `margin`, itself grown by `margin` and
/// rounded outwards; `None` if there is no such part.
pub(super) fn clip(record: &TriangleRecord, cell: &Bounds, margin: f64) -> Option<Bounds> {
    Polygon::new(record).clipped(cell, margin).bounds(margin)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::record;
    use crate::polygon::rounded_down;

    const CORNER: Corners = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];

    fn cell(min: [f32; 3], max: [f32; 3]) -> Bounds {
        Bounds { min, max }
    }

    #[test]
    fn a_triangle_touches_boxes_at_its_hypotenuse_but_not_beyond() {
        let at = |x: f32, y: f32| touches(&CORNER, &cell([x, y, -1.0], [x + 1.0, y + 1.0, 1.0]));
        assert!(at(1.0, 1.0) && at(2.0, 2.0) && at(3.0, 1.0));
        assert!(!at(2.001, 2.0) && !at(3.0, 3.0) && !at(-1.001, 1.0));
        assert!(touches(&CORNER, &cell([0.0, 0.0, 0.0], [1.0, 1.0, 0.0])));
        assert!(!touches(&CORNER, &cell([0.0, 0.0, 0.001], [1.0, 1.0, 1.0])));
    }

    #[test]
    fn octants_are_missed_by_what_does_not_touch_them_grown() {
        // In quarters, so that nothing is rounded.
        let mut random = raystone_core::random::Pcg32::new(5);
        let mut at = |range: usize| (random.below(2 * range + 1) as f64 - range as f64) * 0.25;
        let (mut missed, mut flat) = (0, 0);
        for case in 0..20_000 {
            let reach = [6, 20, 60][case % 3];
            let mut corners = [0; 3].map(|_| [0; 3].map(|_| at(reach)));
            if case % 7 == 0 {
                // A line, or edge on in a projection.
                corners[2] = std::array::from_fn(|a| 2.0 * corners[1][a] - corners[0][a]);
                corners[2][case % 3] += [0.0, 1.0][case % 2];
            }
            let (size, margin) = ([2.0, 4.0, 3.0], [0.0, 0.25, 1.0][case % 4 % 3]);
            let found = missed_octants(&corners, size, margin);
            for octant in 0..8 {
                let end = |a: usize| {
                    if octant >> a & 1 == 1 {
                        size[a]
                    } else {
                        -size[a]
                    }
                };
                let grown = Bounds {
                    min: std::array::from_fn(|a| (end(a).min(0.0) - margin) as f32),
                    max: std::array::from_fn(|a| (end(a).max(0.0) + margin) as f32),
                };
                let in_box = (0..3).all(|a| {
                    let along = corners.map(|c| c[a] as f32);
                    along.iter().any(|x| *x >= grown.min[a])
                        && along.iter().any(|x| *x <= grown.max[a])
                });
                if in_box {
                    let is_missed = found >> octant & 1 == 1;
                    assert_eq!(
                        is_missed,
                        !touches(&corners, &grown),
                        "octant {octant} of {corners:?}"
                    );
                    missed += usize::from(is_missed);
                    flat += usize::from(is_missed && case % 7 == 0);
                }
            }
        }
        assert!(missed > 5000 && flat > 500, "{missed} {flat}");
    }

    #[test]
    fn clipping_gives_the_box_of_the_part_inside() {
        let corner = &record(0, CORNER.map(|v| v.map(|x| x as f32)));
        let inside = clip(corner, &cell([1.0, 1.0, -1.0], [2.5, 9.0, 1.0]), 0.0);
        assert_eq!(inside, Some(cell([1.0, 1.0, 0.0], [2.5, 3.0, 0.0])));
        assert_eq!(
            clip(corner, &cell([2.125, 2.0, -1.0], [3.0, 3.0, 1.0]), 0.0),
            None
        );
        // In eighths, so that nothing is rounded.
        let grown = clip(corner, &cell([2.125, 2.0, -1.0], [3.0, 3.0, 1.0]), 0.5);
        assert_eq!(grown, Some(cell([1.125, 1.0, -0.5], [3.0, 2.875, 0.5])));
    }

    /// A fraction with a positive denominator.
    #[derive(Clone, Copy)]
    struct Ratio(i128, i128);

    impl Ratio {
        fn new(above: i128, below: i128) -> Self {
            Self(above * below.signum(), below.abs())
        }

        fn is_above(self, other: f64) -> bool {
            // No fraction of this test lies between a number and the multiple of 2⁻⁸⁰ below it.
            self.0 << 80 > (other * 2.0_f64.powi(80)).floor() as i128 * self.1
        }
    }

    /// Extreme coordinates on `axis` of the intersection of a triangle and a box, exactly: those of
    /// the corners of the triangle in the box, of its edges in faces of the box, and of edges of
    /// the box in the triangle.
    fn shared(corners: [[i128; 3]; 3], cell: [[i128; 3]; 2], axis: usize) -> Vec<Ratio> {
        let mut found = Vec::new();
        // Points over a common denominator.
        let mut push = |point: [i128; 3], below: i128| {
            let (sign, below) = (below.signum(), below.abs());
            let inside = (0..3)
                .all(|a| (cell[0][a] * below..=cell[1][a] * below).contains(&(sign * point[a])));
            if inside {
                found.push(Ratio::new(sign * point[axis], below));
            }
        };
        corners.iter().for_each(|c| push(*c, 1));
        for i in 0..3 {
            let (p, q) = (corners[i], corners[(i + 1) % 3]);
            for (a, face) in (0..3).flat_map(|a| [(a, cell[0][a]), (a, cell[1][a])]) {
                let (along, below) = (face - p[a], q[a] - p[a]);
                if below != 0 && (0..=below.abs()).contains(&(along * below.signum())) {
                    push(
                        [0, 1, 2].map(|b| p[b] * below + (q[b] - p[b]) * along),
                        below,
                    );
                }
            }
        }
        let [p, q, r] = corners;
        for a in 0..3 {
            let (b, c) = ((a + 1) % 3, (a + 2) % 3);
            for (y, z) in [0, 1, 2, 3].map(|k| (cell[k & 1][b], cell[k >> 1][c])) {
                // Weights of the corners where the edge meets the plane, seen along the edge.
                let twice =
                    |s: [i128; 3], t: [i128; 3]| (s[b] - y) * (t[c] - z) - (s[c] - z) * (t[b] - y);
                let weights = [twice(q, r), twice(r, p), twice(p, q)];
                let below: i128 = weights.iter().sum();
                if below != 0 && weights.iter().all(|w| w * below.signum() >= 0) {
                    let mut point = [0; 3];
                    (point[b], point[c]) = (y * below, z * below);
                    point[a] = weights[0] * p[a] + weights[1] * q[a] + weights[2] * r[a];
                    push(point, below);
                }
            }
        }
        found
    }

    #[test]
    fn clipped_bounds_are_those_of_exact_arithmetic_rounded_outwards() {
        let mut random = raystone_core::random::Pcg32::new(3);
        let mut at = |range: usize| random.below(range) as i128 - 40;
        let (mut cut, mut missed, mut touches) = (0, 0, 0);
        for _ in 0..4000 {
            let corners = [0; 3].map(|_| [0; 3].map(|_| at(81)));
            let ends = [0; 3].map(|_| [at(81), at(81)]);
            let side = |k: usize| ends.map(|[s, t]| [s.min(t), s.max(t)][k]);
            let cell = [side(0), side(1)];
            let as_f32 = |v: [i128; 3]| v.map(|x| x as f32);
            let triangle = record(0, corners.map(as_f32));
            let exact = Bounds {
                min: as_f32(cell[0]),
                max: as_f32(cell[1]),
            };
            let found = clip(&triangle, &exact, 0.0);
            let points = [0, 1, 2].map(|axis| shared(corners, cell, axis));
            let wide = clip(&triangle, &exact, 1e-6);
            assert_eq!(
                wide.is_some(),
                !points[0].is_empty(),
                "{corners:?} in {cell:?}"
            );
            let (Some(found), Some(wide)) = (found, wide) else {
                missed += 1;
                touches += usize::from(wide.is_some());
                continue;
            };
            cut += usize::from(found != triangle.bounds());
            for (axis, points) in points.iter().enumerate() {
                // No exact point is outside beyond f64 rounding, and one is within the next f32.
                let within =
                    |[low, high]: [f64; 2]| move |p: &Ratio| p.is_above(low) && !p.is_above(high);
                let around = |x: f32| {
                    [
                        f64::from(x.next_down()) - 1e-13,
                        f64::from(x.next_up()) + 1e-13,
                    ]
                };
                let (low, high) = (found.min[axis], found.max[axis]);
                let ends = [f64::from(low) - 1e-13, f64::from(high) + 1e-13];
                assert!(points.iter().all(within(ends)), "{corners:?} in {cell:?}");
                assert!(
                    points.iter().any(within(around(low)))
                        && points.iter().any(within(around(high)))
                );
                // With a margin, strictly none.
                let ends = [wide.min[axis], wide.max[axis]].map(f64::from);
                assert!(points.iter().all(within(ends)), "{corners:?} in {cell:?}");
            }
        }
        assert!(
            cut > 1000 && missed > 500 && touches < 20,
            "{cut} {missed} {touches}"
        );
    }

    #[test]
    fn bounds_are_rounded_outwards() {
        // A third and two thirds of 1, which are not f32 numbers.
        let thin = record(0, [[0.0, 0.0, 0.0], [3.0, 1.0, 0.0], [3.0, 1.0, 1.0]]);
        let part = clip(&thin, &cell([1.0, 0.0, 0.0], [2.0, 1.0, 1.0]), 0.0).expect("a part");
        for (found, exact, is_min) in [
            (part.min[1], 1.0 / 3.0, true),
            (part.max[1], 2.0 / 3.0, false),
            (part.max[2], 2.0 / 3.0, false),
        ] {
            let (found, exact): (f64, f64) = (f64::from(found), exact);
            let outside = if is_min { exact - found } else { found - exact };
            assert!((0.0..6e-8).contains(&outside), "{found} for {exact}");
        }
        assert_eq!(
            (rounded_down(0.1), rounded_down(0.25)),
            (0.1_f32.next_down(), 0.25)
        );
    }
}
