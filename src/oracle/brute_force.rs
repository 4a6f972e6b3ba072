//! Which triangles a ray may hit at all: every triangle is looked at, in vectorised f64.

use super::OracleRay;
use super::triangle::{Vector, coarse_slack, cross, may_cross, norm_1, subtract, widen};
use crate::scene::Triangle;
use rayon::prelude::*;

/// Triangles converted at a time: their f64 form stays in the first-level cache for all rays.
const TILE: usize = 128;

/// Triangles tested side by side.
const LANES: usize = 8;

/// Three coordinates of [`LANES`] vectors.
type Lanes = [[f64; LANES]; 3];

/// [`LANES`] triangles in f64, by coordinate.
struct Block {
    v0: Lanes,
    e1: Lanes,
    e2: Lanes,
    normal: Lanes,
    reach: [f64; LANES],
}

/// A ray as the coarse test needs it.
struct Line {
    origin: Vector,
    direction: Vector,
    slack: f64,
}

/// For each ray the triangles that it may hit, increasing; all triangles that an f32 test could hit
/// are among them, wherever on the ray's line.
pub(super) fn candidates(triangles: &[Triangle], rays: &[OracleRay]) -> Vec<Vec<u32>> {
    let lines: Vec<Line> = rays.iter().map(Line::new).collect();
    let tiles: Vec<Vec<(u32, u32)>> = triangles
        .par_chunks(TILE)
        .enumerate()
        .map(|(tile, triangles)| pairs_of_tile(triangles, (tile * TILE) as u32, &lines))
        .collect();
    let mut candidates = vec![Vec::new(); rays.len()];
    for (ray, triangle) in tiles.into_iter().flatten() {
        candidates[ray as usize].push(triangle);
    }
    candidates
}

/// Pairs (ray, triangle) that may cross; `first` is the index of the tile's first triangle.
fn pairs_of_tile(triangles: &[Triangle], first: u32, lines: &[Line]) -> Vec<(u32, u32)> {
    let blocks: Vec<Block> = triangles.chunks(LANES).map(Block::new).collect();
    let mut pairs = Vec::new();
    for (ray, line) in lines.iter().enumerate() {
        for (b, block) in blocks.iter().enumerate() {
            let crossed = block.crossed_by(line);
            if !crossed.contains(&true) {
                continue;
            }
            let start = b * LANES;
            let present = triangles.len().min(start + LANES) - start;
            let lanes = (0..present).filter(|&i| crossed[i]);
            pairs.extend(lanes.map(|i| (ray as u32, first + (start + i) as u32)));
        }
    }
    pairs
}

impl Block {
    /// Up to [`LANES`] triangles; the lanes left over hold zeros.
    fn new(triangles: &[Triangle]) -> Self {
        let mut block = Self {
            v0: [[0.0; LANES]; 3],
            e1: [[0.0; LANES]; 3],
            e2: [[0.0; LANES]; 3],
            normal: [[0.0; LANES]; 3],
            reach: [0.0; LANES],
        };
        for (i, triangle) in triangles.iter().enumerate() {
            let [v0, v1, v2] = triangle.vertices.map(|v| widen(v.to_array()));
            let (e1, e2) = (subtract(v1, v0), subtract(v2, v0));
            let normal = cross(e1, e2);
            for axis in 0..3 {
                block.v0[axis][i] = v0[axis];
                block.e1[axis][i] = e1[axis];
                block.e2[axis][i] = e2[axis];
                block.normal[axis][i] = normal[axis];
            }
            block.reach[i] = norm_1(e1) + norm_1(e2);
        }
        block
    }

    #[inline(always)]
    fn crossed_by(&self, line: &Line) -> [bool; LANES] {
        let lane = |lanes: &Lanes, i: usize| [lanes[0][i], lanes[1][i], lanes[2][i]];
        std::array::from_fn(|i| {
            let c = subtract(lane(&self.v0, i), line.origin);
            let edges = [lane(&self.e1, i), lane(&self.e2, i), lane(&self.normal, i)];
            let [e1, e2, normal] = edges;
            may_cross(
                [c, e1, e2, normal],
                self.reach[i],
                line.direction,
                line.slack,
            )
        })
    }
}

impl Line {
    fn new(ray: &OracleRay) -> Self {
        let direction = widen(ray.direction);
        Self {
            origin: widen(ray.origin),
            direction,
            slack: coarse_slack(direction),
        }
    }
}
