//! Exact star discrepancy in three and more dimensions: decomposition of the space of orthants.
//!
//! A box at the origin is identified with its upper corner, and a point with the orthant of the
//! corners whose boxes contain it. Dobkin, Eppstein & Mitchell (1996, "Computing the discrepancy
//! with applications to supersampling patterns") split the space of corners into cells so small
//! that inside a cell every orthant is bounded in one dimension only; there the count is a sum over
//! dimensions, and the largest difference is found by dynamic programming ([`super::leaf`]).
//!
//! Here the cells are made by halving, and each is bounded first. In a cell, a point that varies in
//! several dimensions counts at most if one of them allows it, and at least not at all; the volume
//! lies between two sums of functions of one coordinate. So the bound is a sum of independent
//! maxima, with an error of second order in the size of the cell: nearly all cells are dropped
//! before they are small enough for dynamic programming.

use super::leaf::{self, Work};
use super::{Budget, PointSet};

pub(super) const MAX_DIM: usize = 24;

/// Cells with at most this many varying points are solved at once, if each varies in one dimension.
const LEAF_POINTS: usize = 64;

/// Raises `lower`, a lower bound of the star discrepancy, until the true value is at most
/// `tolerance` above it; `None` if the budget is spent first or there are too many dimensions.
pub(super) fn search(
    points: &PointSet,
    lower: &mut f64,
    tolerance: f64,
    budget: &Budget,
) -> Option<()> {
    match points.dim() {
        ..=3 => run::<3>(points, lower, tolerance, budget),
        4 => run::<4>(points, lower, tolerance, budget),
        5 => run::<5>(points, lower, tolerance, budget),
        6 => run::<6>(points, lower, tolerance, budget),
        7..=10 => run::<10>(points, lower, tolerance, budget),
        11..=MAX_DIM => run::<MAX_DIM>(points, lower, tolerance, budget),
        _ => None,
    }
}

fn run<const D: usize>(
    points: &PointSet,
    lower: &mut f64,
    tolerance: f64,
    budget: &Budget,
) -> Option<()> {
    let n = points.len();
    let mut search = Search::<D> {
        n: n as f64,
        varying: vec![(1 << points.dim()) - 1; n],
        lists: std::array::from_fn(|_| Vec::new()),
        best: *lower * n as f64,
        tolerance: tolerance * n as f64,
        budget: *budget,
        cells: 0,
        work: Work::default(),
        values: vec![Vec::new(); D],
    };
    let root = search.root(points);
    let done = search.explore(root);
    *lower = lower.max(search.best / n as f64);
    done
}

/// A point in the list of a dimension in which it varies.
#[derive(Clone, Copy)]
struct Entry {
    value: f64,
    id: u32,
}

/// Corners from `low` to just below `high` in each dimension.
#[derive(Clone, Copy)]
struct Orthant<const D: usize> {
    low: [f64; D],
    high: [f64; D],
    /// Ranges of the search's lists: points that vary in a dimension, sorted by that coordinate.
    lists: [[usize; 2]; D],
    /// Points in the box of every corner of the cell.
    inside: f64,
    /// True if a box with too many points, or one with too few, can still be the worst.
    many: bool,
    few: bool,
}

/// Upper bounds for a cell, times N.
struct Bound {
    many: f64,
    few: f64,
    /// True if each point varies in one dimension.
    apart: bool,
}

struct Search<const D: usize> {
    n: f64,
    /// Mask of each point's varying dimensions in the current cell; [`OUT`] if in no box of it.
    varying: Vec<u32>,
    /// Sorted points by dimension; cells on the search path are consecutive.
    lists: [Vec<Entry>; D],
    best: f64,
    tolerance: f64,
    budget: Budget,
    cells: u64,
    work: Work,
    values: Vec<Vec<f64>>,
}

const OUT: u32 = 1 << 31;

impl<const D: usize> Search<D> {
    fn root(&mut self, points: &PointSet) -> Orthant<D> {
        let dim = points.dim();
        for d in 0..dim {
            let entry = |(id, value)| Entry {
                value,
                id: id as u32,
            };
            let column = points.column(d).into_iter();
            self.lists[d] = column.enumerate().map(entry).collect();
            self.lists[d].sort_unstable_by(|a, b| a.value.total_cmp(&b.value));
        }
        Orthant {
            // Dimensions that the points do not have are fixed at 1.
            low: std::array::from_fn(|d| if d < dim { 0.0 } else { 1.0 }),
            high: [1.0; D],
            lists: std::array::from_fn(|d| [0, self.lists[d].len()]),
            inside: 0.0,
            many: true,
            few: true,
        }
    }

    /// Searches a cell for worse boxes; `None` if the time is spent.
    fn explore(&mut self, mut cell: Orthant<D>) -> Option<()> {
        self.cells += 1;
        if self.cells.is_multiple_of(256) && self.budget.is_spent() {
            return None;
        }
        let bound = self.bound(&cell);
        // Bounds are sums of rounded terms, with errors of a few units in the last place.
        let limit = self.best + self.tolerance + self.n * 4.0 * f64::EPSILON;
        cell.many &= bound.many > limit;
        cell.few &= bound.few > limit;
        if !cell.many && !cell.few {
            return Some(());
        }
        let varying: usize = cell.lists.iter().map(|[begin, end]| end - begin).sum();
        if bound.apart && varying <= LEAF_POINTS {
            self.solve(&cell);
            return Some(());
        }
        self.halve(&cell)
    }

    /// Explores the two halves of a cell that has a varying point.
    fn halve(&mut self, cell: &Orthant<D>) -> Option<()> {
        let size = |d: &usize| cell.lists[*d][1] - cell.lists[*d][0];
        let dim = (0..D).max_by_key(size)?;
        let [begin, end] = cell.lists[dim];
        let list = &self.lists[dim];
        let at = list[(begin + end) / 2].value;
        let first = begin + list[begin..end].partition_point(|e| e.value < at);
        let after = begin + list[begin..end].partition_point(|e| e.value <= at);
        self.upper_half(cell, dim, at, [first, after])?;
        self.lower_half(cell, dim, at, first)
    }

    /// Corners at or above `at`: points up to there no longer vary in this dimension.
    fn upper_half(
        &mut self,
        cell: &Orthant<D>,
        dim: usize,
        at: f64,
        tied: [usize; 2],
    ) -> Option<()> {
        let [begin, end] = cell.lists[dim];
        let after = tied[1];
        let mut upper = *cell;
        upper.low[dim] = at;
        upper.lists[dim] = [after, end];
        for entry in &self.lists[dim][begin..after] {
            let varying = &mut self.varying[entry.id as usize];
            *varying ^= 1 << dim;
            upper.inside += f64::from(u8::from(*varying == 0));
        }
        let done = self.explore(upper);
        for entry in &self.lists[dim][begin..after] {
            self.varying[entry.id as usize] ^= 1 << dim;
        }
        done
    }

    /// Corners below `at`: points from there on are in no box.
    fn lower_half(&mut self, cell: &Orthant<D>, dim: usize, at: f64, first: usize) -> Option<()> {
        let [begin, end] = cell.lists[dim];
        let mut lower = *cell;
        lower.high[dim] = at;
        lower.lists[dim] = [begin, first];
        for entry in &self.lists[dim][first..end] {
            self.varying[entry.id as usize] |= OUT;
        }
        for other in (0..D).filter(|&other| other != dim) {
            let [begin, end] = cell.lists[other];
            let list = &mut self.lists[other];
            let kept = list.len();
            for i in begin..end {
                let entry = list[i];
                if self.varying[entry.id as usize] & OUT == 0 {
                    list.push(entry);
                }
            }
            lower.lists[other] = [kept, list.len()];
        }
        let done = self.explore(lower);
        for other in (0..D).filter(|&other| other != dim) {
            self.lists[other].truncate(lower.lists[other][0]);
        }
        for entry in &self.lists[dim][first..end] {
            self.varying[entry.id as usize] &= !OUT;
        }
        done
    }

    /// Bounds of both differences over the cell, as sums over dimensions.
    fn bound(&self, cell: &Orthant<D>) -> Bound {
        let list = |d: usize| &self.lists[d][cell.lists[d][0]..cell.lists[d][1]];
        // Closed boxes end at points at most, open ones begin to matter at points.
        let last = std::array::from_fn(|d| list(d).last().map_or(cell.low[d], |e| e.value));
        let first: [f64; D] =
            std::array::from_fn(|d| list(d).first().map_or(cell.high[d], |e| e.value));
        let least = Plane::below(&cell.low, &last, self.n);
        let greatest = Plane::above(&first, &cell.high, self.n);
        let mut bound = Bound {
            many: cell.inside - least.base,
            few: greatest.base - cell.inside,
            apart: true,
        };
        for (d, &from) in first.iter().enumerate() {
            let only = 1 << d;
            let low = cell.low[d];
            let (mut most, mut fewest) = (0.0, 0.0);
            let (mut worst_many, mut worst_few) = (0.0f64, f64::MIN);
            for entry in list(d) {
                let varying = self.varying[entry.id as usize];
                let rise = (entry.value - from) * greatest.slope[d] - fewest;
                worst_few = if rise > worst_few { rise } else { worst_few };
                let alone = varying == only;
                bound.apart &= alone;
                fewest += f64::from(u8::from(alone));
                most += f64::from(u8::from(varying & varying.wrapping_neg() == only));
                let rise = most - (entry.value - low) * least.slope[d];
                worst_many = if rise > worst_many { rise } else { worst_many };
            }
            let rise = (cell.high[d] - from) * greatest.slope[d] - fewest;
            bound.few += if rise > worst_few { rise } else { worst_few };
            bound.many += worst_many;
        }
        bound
    }

    /// Exact differences in a cell where each point varies in one dimension.
    fn solve(&mut self, cell: &Orthant<D>) {
        for (values, (list, part)) in self
            .values
            .iter_mut()
            .zip(self.lists.iter().zip(&cell.lists))
        {
            values.clear();
            values.extend(list[part[0]..part[1]].iter().map(|e| e.value));
        }
        if cell.many {
            let found = leaf::most_points(&cell.low, &self.values, self.n, &mut self.work);
            self.best = self.best.max(cell.inside + found);
        }
        if cell.few {
            let found = leaf::fewest_points(&cell.high, &self.values, self.n, &mut self.work);
            self.best = self.best.max(found - cell.inside);
        }
    }
}

/// A bound `base + Σ slope_d (y_d - low_d)` of the scaled volume `Π y_d` over a box of corners.
struct Plane<const D: usize> {
    base: f64,
    slope: [f64; D],
}

impl<const D: usize> Plane<D> {
    /// A plane below the volume: the mean of the tangents at both corners, which are below it.
    fn below(low: &[f64; D], high: &[f64; D], scale: f64) -> Self {
        let (at_low, to_low) = tangent(low);
        let (at_high, to_high) = tangent(high);
        let mut base = at_low + at_high;
        let slope = std::array::from_fn(|d| {
            base -= to_high[d] * (high[d] - low[d]);
            0.5 * scale * (to_low[d] + to_high[d])
        });
        Self {
            base: 0.5 * scale * base,
            slope,
        }
    }

    /// A plane above the volume: the mean of two planes through both corners, one for the path
    /// along the edges in the order of dimensions and one for the opposite order. The volume is
    /// supermodular, so every such plane is above it (Lovász 1983).
    fn above(low: &[f64; D], high: &[f64; D], scale: f64) -> Self {
        let (low_before, low_after) = partial_products(low);
        let (high_before, high_after) = partial_products(high);
        let slope = std::array::from_fn(|d| {
            0.5 * scale * (high_before[d] * low_after[d] + low_before[d] * high_after[d])
        });
        Self {
            base: scale * low.iter().product::<f64>(),
            slope,
        }
    }
}

fn tangent<const D: usize>(at: &[f64; D]) -> (f64, [f64; D]) {
    let (before, after) = partial_products(at);
    (
        at.iter().product(),
        std::array::from_fn(|d| before[d] * after[d]),
    )
}

/// Products of the factors before and after each factor.
fn partial_products<const D: usize>(factors: &[f64; D]) -> ([f64; D], [f64; D]) {
    let (mut before, mut after) = ([1.0; D], [1.0; D]);
    for d in 1..D {
        before[d] = before[d - 1] * factors[d - 1];
        after[D - 1 - d] = after[D - d] * factors[D - d];
    }
    (before, after)
}
