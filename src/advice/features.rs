//! What is cheap to know of a scene.

use glam::Vec3;
use serde::{Deserialize, Serialize};

/// Most triangles that are looked at; of more, every k-th.
const MOST: usize = 1 << 19;
/// Cells on each axis of the grid in which occupied cells are counted.
const CELLS: usize = 32;
/// Smallest share of the scene's extent that an edge or area counts as: flat and empty boxes have logarithms, too.
const LEAST: f64 = 1e-12;

/// Names of the terms of [`SceneFeatures::terms`], in order.
pub const FEATURES: [&str; 7] = [
    "one",
    "log2 triangles",
    "size spread",
    "log2 boxes crossed",
    "log2 surfaces crossed",
    "log2 share of occupied cells",
    "log2 copies",
];

/// Features of a scene's triangles, from one look at each (at most half a million of them).
///
/// By Cauchy's formula a random line that meets a convex body of surface S crosses each convex body of surface s inside it
/// with probability s / S, so sums of areas over that of the scene's box are mean numbers of crossings.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct SceneFeatures {
    /// Number of triangles.
    pub triangles: u64,
    /// Number of instances; 1 if the scene does not consist of them.
    pub copies: u64,
    /// Standard deviation of the binary logarithm of the surfaces of triangles' boxes.
    pub size_spread: f64,
    /// Boxes of triangles that a random line through the scene's box crosses.
    pub boxes_crossed: f64,
    /// Triangles that a random line through the scene's box crosses.
    pub surfaces_crossed: f64,
    /// Share of 32³ equal cells that hold the middle of a triangle's box.
    pub occupied: f64,
}

impl SceneFeatures {
    /// The features of triangles, given by their corners, in a scene of so many instances (1 if it is not made of them).
    pub fn of(triangles: impl ExactSizeIterator<Item = [Vec3; 3]> + Clone, copies: usize) -> Self {
        let count = triangles.len();
        let stride = count.div_ceil(MOST).max(1);
        let looked_at = || triangles.clone().step_by(stride);
        let mut least = Vec3::INFINITY;
        let mut most = Vec3::NEG_INFINITY;
        for vertex in looked_at().flatten() {
            least = least.min(vertex);
            most = most.max(vertex);
        }
        if count == 0 || !(most - least).is_finite() {
            return Self {
                copies: 1,
                ..Self::default()
            };
        }
        let mut sums = Sums::new(least, most);
        looked_at().for_each(|vertices| sums.add(vertices));
        sums.features(count, copies.max(1), stride)
    }

    /// The terms of a prediction, as named by [`FEATURES`].
    pub fn terms(&self) -> [f64; FEATURES.len()] {
        let log = |x: f64| x.max(LEAST).log2();
        [
            1.0,
            log(self.triangles as f64),
            self.size_spread,
            log(self.boxes_crossed),
            log(self.surfaces_crossed),
            log(self.occupied),
            log(self.copies as f64),
        ]
    }
}

struct Sums {
    least: Vec3,
    extent: Vec3,
    /// Half of the surface of the scene's box.
    whole: f64,
    count: f64,
    log: f64,
    log_squared: f64,
    boxes: f64,
    areas: f64,
    occupied: Vec<bool>,
}

impl Sums {
    fn new(least: Vec3, most: Vec3) -> Self {
        let extent = most - least;
        Self {
            least,
            extent,
            whole: half_surface(extent),
            count: 0.0,
            log: 0.0,
            log_squared: 0.0,
            boxes: 0.0,
            areas: 0.0,
            occupied: vec![false; CELLS.pow(3)],
        }
    }

    fn add(&mut self, [a, b, c]: [Vec3; 3]) {
        let (least, most) = (a.min(b).min(c), a.max(b).max(c));
        // Of the scene's own, so that no scale of units shows.
        let share = (half_surface(most - least) / self.whole.max(f64::MIN_POSITIVE)).max(LEAST);
        let [ab, ac] = [b - a, c - a].map(|edge| edge.as_dvec3());
        self.count += 1.0;
        self.log += share.log2();
        self.log_squared += share.log2().powi(2);
        self.boxes += share;
        // Both sides of a triangle, as of a flat box: s / S is area over half of the box's surface.
        self.areas += 0.5 * ab.cross(ac).length() / self.whole.max(f64::MIN_POSITIVE);
        let middle = 0.5 * (least + most) - self.least;
        let cell = [0, 1, 2].map(|axis| {
            let place = middle[axis] / self.extent[axis].max(f32::MIN_POSITIVE);
            ((place * CELLS as f32) as usize).min(CELLS - 1)
        });
        self.occupied[(cell[2] * CELLS + cell[1]) * CELLS + cell[0]] = true;
    }

    fn features(self, triangles: usize, copies: usize, stride: usize) -> SceneFeatures {
        let mean = self.log / self.count;
        let variance = self.log_squared / self.count - mean * mean;
        let occupied = self.occupied.iter().filter(|o| **o).count();
        SceneFeatures {
            triangles: triangles as u64,
            copies: copies as u64,
            size_spread: variance.max(0.0).sqrt(),
            boxes_crossed: self.boxes * stride as f64,
            surfaces_crossed: self.areas * stride as f64,
            occupied: occupied as f64 / self.occupied.len() as f64,
        }
    }
}

fn half_surface(extent: Vec3) -> f64 {
    let [x, y, z] = extent.as_dvec3().to_array();
    x * y + y * z + z * x
}

/// Features of known triangles: a line through a closed box crosses two walls of two triangles each, which have the wall for a box; and of
/// triangles whose boxes have surfaces s and s / 4 in equal numbers the logarithms are two apart, a deviation of one.
///
/// # Errors
/// One is another: of both, what was found and what it should be.
pub(crate) fn check() -> Result<(), String> {
    let sides = walls(Vec3::splat(5.0), Vec3::new(6.0, 8.0, 9.5));
    let half = |size: f32, at: f32| {
        let corner = at * Vec3::X;
        [corner, corner + Vec3::X * size, corner + Vec3::Y * size]
    };
    let unlike = [0.5, 1.0, 0.5, 1.0].iter().zip([0.0, 1.0, 2.0, 3.0]);
    let unlike: Vec<_> = unlike.map(|(size, at)| half(*size, at)).collect();
    let [sides, unlike] = [sides, unlike].map(|all| SceneFeatures::of(all.into_iter(), 3));
    let found = [
        sides.surfaces_crossed,
        sides.boxes_crossed,
        sides.triangles as f64,
        unlike.size_spread,
        unlike.occupied,
        unlike.copies as f64,
    ];
    let expected = [2.0, 4.0, 12.0, 1.0, 4.0 / 32768.0, 3.0];
    let agrees = |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-5 * b;
    found.iter().zip(&expected).all(agrees).then_some(()).ok_or_else(|| {
        format!(
            "features of known triangles are {found:?}, and should be {expected:?}: this program gives other advice than it says; \
             build it anew, and report what stays wrong"
        )
    })
}

/// A box's walls as triangles, `from` to `to`.
fn walls(from: Vec3, to: Vec3) -> Vec<[Vec3; 3]> {
    let corner = |bits: usize| {
        let axis = |a: usize| if bits >> a & 1 == 1 { to[a] } else { from[a] };
        Vec3::new(axis(0), axis(1), axis(2))
    };
    let quads = [
        [0, 1, 3, 2],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 3, 7, 6],
        [0, 2, 6, 4],
        [1, 3, 7, 5],
    ];
    let halves = quads.map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
    let triangles = halves.into_iter().flatten();
    triangles.map(|t| t.map(corner)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_through_a_closed_box_crosses_two_walls_and_sizes_spread_by_their_logarithms() {
        assert_eq!(check(), Ok(()));
    }

    #[test]
    fn no_scene_has_terms_that_are_not_finite() {
        let point = [Vec3::ONE; 3];
        let far = [Vec3::MAX, Vec3::MIN, Vec3::ZERO];
        for triangles in [vec![], vec![point], vec![point; 3], vec![far]] {
            let terms = SceneFeatures::of(triangles.iter().copied(), 1).terms();
            assert!(terms.iter().all(|t| t.is_finite()), "{terms:?}");
        }
    }

    #[test]
    fn a_part_of_many_triangles_stands_for_all() {
        let one = walls(Vec3::ZERO, Vec3::ONE);
        let many: Vec<_> = one.iter().cycle().take(12 * 100_000).copied().collect();
        let features = SceneFeatures::of(many.iter().copied(), 1);
        let per_triangle = features.surfaces_crossed / many.len() as f64;
        assert!(
            (per_triangle * 12.0 / 2.0 - 1.0).abs() < 0.01,
            "{features:?}"
        );
        // Boxes of both halves of a wall are the wall.
        let boxes = features.boxes_crossed / many.len() as f64;
        assert!((boxes * 12.0 / 4.0 - 1.0).abs() < 0.01, "{features:?}");
    }
}
