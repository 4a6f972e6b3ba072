//! Lower bounds of the star discrepancy: threshold accepting.
//!
//! After Gnewuch, Wahlström & Winzen (2012, "A new randomized algorithm to approximate the star
//! discrepancy based on threshold accepting"): a walk over the grid of coordinates that accepts a
//! loss up to a threshold, which rises to 0. Boxes with too many and too few points are searched
//! separately, and each visited corner is snapped to one that is no worse: shrunk onto the points
//! inside for too many, grown up to the points outside for too few.

use super::{Budget, PointSet};
use crate::random::SplitMix64;

/// Maximum work of one search, in coordinates examined.
const WORK: usize = 20_000_000;
/// Maximum steps of a search, per coordinate of the set.
const STEPS: usize = 20;
/// Walks that share the steps of a search.
const WALKS: usize = 10;

/// The best of repeated searches with consecutive seeds until the budget is spent; as [`ascend`].
pub(super) fn ascend_on(
    points: &PointSet,
    seeds: impl Iterator<Item = u64>,
    budget: &Budget,
) -> f64 {
    let seeds = seeds.take_while(|_| !budget.is_spent());
    seeds
        .map(|seed| ascend(points, seed, budget))
        .fold(0.0, f64::max)
}

/// The difference of an actual box: a lower bound of the star discrepancy, at least 0.
pub(super) fn ascend(points: &PointSet, seed: u64, budget: &Budget) -> f64 {
    let grid = Lattice::new(points);
    let size = points.len() * points.dim();
    let steps = (WORK / size).min(STEPS * size).max(4 * WALKS);
    let mut best = 0.0f64;
    for walk in 0..WALKS {
        for side in [Side::Many, Side::Few] {
            let mut walker = Walker {
                grid: &grid,
                side,
                random: SplitMix64(seed ^ ((walk as u64) << 32)),
                outside: vec![0; points.len()],
            };
            best = best.max(walker.walk(steps / WALKS / 2, budget));
        }
    }
    best
}

#[derive(Clone, Copy, PartialEq)]
enum Side {
    Many,
    Few,
}

/// The points as ranks among the distinct coordinates of each dimension.
struct Lattice {
    n: usize,
    /// By dimension: 0, the distinct coordinates in order, 1.
    coordinates: Vec<Vec<f64>>,
    /// By dimension and point: index into `coordinates`, from 1.
    ranks: Vec<Vec<u32>>,
}

impl Lattice {
    fn new(points: &PointSet) -> Self {
        let mut coordinates = Vec::new();
        let mut ranks = Vec::new();
        for column in (0..points.dim()).map(|d| points.column(d)) {
            let mut distinct = column.clone();
            distinct.sort_unstable_by(f64::total_cmp);
            distinct.dedup();
            let rank = |c: &f64| distinct.partition_point(|other| other < c) as u32 + 1;
            ranks.push(column.iter().map(rank).collect());
            distinct.insert(0, 0.0);
            distinct.push(1.0);
            coordinates.push(distinct);
        }
        Self {
            n: points.len(),
            coordinates,
            ranks,
        }
    }

    /// Index of the last corner of a dimension: boxes up to it contain all points.
    fn last(&self, dim: usize) -> usize {
        self.coordinates[dim].len() - 2
    }

    /// Volume of the closed box of a corner, or of the open box that ends at the next coordinates;
    /// both contain the points whose ranks are at most those of the corner.
    fn volume(&self, corner: &[u32], side: Side) -> f64 {
        let next = usize::from(side == Side::Few);
        let sides = self.coordinates.iter().zip(corner);
        sides.map(|(c, &i)| c[i as usize + next]).product()
    }
}

struct Walker<'a> {
    grid: &'a Lattice,
    side: Side,
    random: SplitMix64,
    /// Per point: number of dimensions in which it is outside the current box.
    outside: Vec<u32>,
}

impl Walker<'_> {
    /// The worst difference found on a walk.
    fn walk(&mut self, steps: usize, budget: &Budget) -> f64 {
        let mut corner = self.anywhere();
        let mut value = self.snap(&mut corner);
        let mut best = value;
        // Thresholds are losses of actual random steps, largest first.
        let trials = (steps as f64).sqrt().ceil() as usize;
        let mut thresholds = Vec::with_capacity(trials);
        for _ in 0..trials {
            let mut other = self.anywhere();
            let start = self.snap(&mut other);
            let moved = self.neighbour(&other, 0.0).1;
            best = best.max(start).max(moved);
            thresholds.push(-(moved - start).abs());
        }
        thresholds.sort_unstable_by(f64::total_cmp);
        for step in 0..steps {
            if budget.is_spent() {
                break;
            }
            let (next, moved) = self.neighbour(&corner, step as f64 / steps as f64);
            if moved - value >= thresholds[step * trials / steps] {
                (corner, value) = (next, moved);
                best = best.max(value);
            }
        }
        best
    }

    /// A random corner, uniform by volume, so that large boxes are found in many dimensions.
    fn anywhere(&mut self) -> Vec<u32> {
        let dims = self.grid.ranks.len();
        let power = 1.0 / dims as f64;
        let corner = (0..dims).map(|d| {
            let side = self.random.uniform().powf(power);
            self.grid.coordinates[d][1..].partition_point(|&c| c <= side) as u32
        });
        let last = |(d, i): (usize, u32)| i.min(self.grid.last(d) as u32);
        corner.enumerate().map(last).collect()
    }

    /// A snapped corner near another, with fewer and smaller changes at higher `progress` (0 to 1).
    fn neighbour(&mut self, corner: &[u32], progress: f64) -> (Vec<u32>, f64) {
        let dims = corner.len();
        let mut next = corner.to_vec();
        let most = 2 + ((dims.saturating_sub(2)) as f64 * (1.0 - progress)) as usize;
        let changes = 1 + self.random.below(most.min(dims));
        for _ in 0..changes {
            let d = self.random.below(dims);
            let last = self.grid.last(d);
            let reach = 1 + (last as f64 / 8.0 * (1.0 - progress)) as usize;
            let from = (next[d] as usize).saturating_sub(reach);
            let to = (next[d] as usize + reach).min(last);
            next[d] = (from + self.random.below(to + 1 - from)) as u32;
        }
        let value = self.snap(&mut next);
        (next, value)
    }

    /// Moves a corner to one that is no worse, and returns its difference.
    fn snap(&mut self, corner: &mut [u32]) -> f64 {
        self.outside.fill(0);
        for (ranks, &i) in self.grid.ranks.iter().zip(corner.iter()) {
            for (outside, &rank) in self.outside.iter_mut().zip(ranks) {
                *outside += u32::from(rank > i);
            }
        }
        match self.side {
            Side::Many => self.shrink(corner),
            Side::Few => self.grow(corner),
        }
        let inside = self.outside.iter().filter(|&&o| o == 0).count();
        let difference = inside as f64 / self.grid.n as f64 - self.grid.volume(corner, self.side);
        if self.side == Side::Many {
            difference
        } else {
            -difference
        }
    }

    /// Down to the largest coordinates of the points inside.
    fn shrink(&mut self, corner: &mut [u32]) {
        for (ranks, i) in self.grid.ranks.iter().zip(corner) {
            let inside = self.outside.iter().zip(ranks).filter(|(o, _)| **o == 0);
            *i = inside.map(|(_, &rank)| rank).max().unwrap_or(0);
        }
    }

    /// Up to the smallest coordinates of the points outside in only one dimension, dimension by
    /// dimension from a random one.
    fn grow(&mut self, corner: &mut [u32]) {
        let dims = corner.len();
        let first = self.random.below(dims);
        for d in (first..dims).chain(0..first) {
            let ranks = &self.grid.ranks[d];
            let stops = self.outside.iter().zip(ranks);
            let stop = stops.filter(|&(&o, &rank)| o == 1 && rank > corner[d]);
            let last = self.grid.last(d) as u32;
            let next = stop.map(|(_, &rank)| rank - 1).min().unwrap_or(last);
            for (outside, &rank) in self.outside.iter_mut().zip(ranks) {
                *outside -= u32::from(rank > corner[d] && rank <= next);
            }
            corner[d] = next;
        }
    }
}
