//! Binned SAH, in place and on all cores.
//!
//! Bins divide the box of a node rather than that of its centres. The cost of a split assumes that
//! both sides are leaves, which overrates large sides, so among many borders the cheapest often
//! cuts a few large triangles off an end. Borders spread evenly over the box rarely do that:
//! Sponza's SAH is 70 to 72 over the box and 74 to 81 over the centres, for 8 to 32 bins.
//!
//! Source: I. Wald, "On fast construction of SAH-based bounding volume hierarchies", 2007.

use super::Tree;
use super::depth::SAH_DEPTH;
use super::grow::grow;
use super::parameters::{MAX_BINS, TreeParameters};
use super::reference::{Box3, Reference, bounds_of};
use crate::bounds::Bounds;
use glam::Vec3A;
use rayon::prelude::*;

/// Up to this many references, every partition is tried.
const EXHAUSTIVE: usize = 4;
/// Nodes with more references are binned by several threads.
const PARALLEL_BINNING: usize = 1 << 16;

pub(super) fn build(mut references: Vec<Reference>, settings: &TreeParameters) -> Tree {
    let bounds = bounds_of(&references);
    let whole = (&mut references[..], bounds);
    let tree = grow(
        whole,
        |part| part.0.len(),
        |(part, bounds), depth, order| {
            let node = Bounds::from(bounds);
            let Some((middle, boxes)) = split(part, bounds, settings, depth) else {
                order.extend(part.iter().map(|r| r.id));
                return (node, None);
            };
            let (low, high) = part.split_at_mut(middle);
            (node, Some([(low, boxes[0]), (high, boxes[1])]))
        },
    );
    tree.into()
}

/// Partitions `references`; returns the start of the second half and both boxes. `None`: a leaf.
fn split(
    references: &mut [Reference],
    bounds: Box3,
    settings: &TreeParameters,
    depth: u32,
) -> Option<(usize, [Box3; 2])> {
    let areas = references.iter().map(|r| r.bounds().half_area());
    if settings.must_be_leaf(bounds, areas) {
        return None;
    }
    if references.len() <= EXHAUSTIVE {
        return Some(exhaustive_split(references));
    }
    let plan = (depth < SAH_DEPTH)
        .then(|| best_bin_split(references, bounds, settings.bins))
        .flatten();
    Some(match plan {
        Some(plan) => (partition(references, |r| plan.is_low(r)), plan.bounds),
        None => median_split(references, bounds.longest_axis()),
    })
}

/// Halves in an order given by the input alone: for equal centres, or below the SAH depth.
pub(super) fn median_split(references: &mut [Reference], axis: usize) -> (usize, [Box3; 2]) {
    let middle = references.len() / 2;
    references.sort_unstable_by(|a, b| a.compare(b, axis));
    let (low, high) = references.split_at(middle);
    (middle, [bounds_of(low), bounds_of(high)])
}

/// The cheapest of all partitions of 2 to 4 references.
fn exhaustive_split(references: &mut [Reference]) -> (usize, [Box3; 2]) {
    let count = references.len();
    let all = (1_usize << count) - 1;
    // Boxes and costs of all subsets, each built from a smaller one.
    let mut subsets = [Box3::EMPTY; 1 << EXHAUSTIVE];
    let mut costs = [0.0_f32; 1 << EXHAUSTIVE];
    for subset in 1..=all {
        let smaller = subset & (subset - 1);
        let lowest = references[subset.trailing_zeros() as usize].bounds();
        subsets[subset] = subsets[smaller].union(lowest);
        costs[subset] = subsets[subset].half_area() * subset.count_ones() as f32;
    }
    // The last reference stays in the second half, so each partition occurs once.
    let mut chosen = 1;
    for subset in 2..=all / 2 {
        if costs[subset] + costs[all - subset] < costs[chosen] + costs[all - chosen] {
            chosen = subset;
        }
    }
    let mut middle = 0;
    for place in 0..count {
        if chosen & (1 << place) != 0 {
            references.swap(middle, place);
            middle += 1;
        }
    }
    (middle, [subsets[chosen], subsets[all - chosen]])
}

pub(super) struct BinSplit {
    axis: usize,
    grid: BinGrid,
    bin: usize,
    /// Sum over both sides of half area times count.
    pub cost: f32,
    /// Boxes of both sides.
    pub bounds: [Box3; 2],
}

impl BinSplit {
    /// True if a reference belongs to the first side.
    pub(super) fn is_low(&self, reference: &Reference) -> bool {
        let (min, max) = (reference.min[self.axis], reference.max[self.axis]);
        let (origin, scale) = (self.grid.origin[self.axis], self.grid.scale[self.axis]);
        bin_of((min + max - origin) * scale) < self.bin
    }
}

/// A grid of bins: the same number on each axis.
#[derive(Clone, Copy)]
struct BinGrid {
    origin: Vec3A,
    scale: Vec3A,
}

impl BinGrid {
    /// Bins over a box; those at the ends have half the width. `None` if the box is a point.
    fn new(over: Box3, bins: usize) -> Option<Self> {
        let extent = over.max - over.min;
        let scale = Vec3A::splat(bins as f32 - 1.0) / extent;
        // An axis with zero or infinite extent puts everything into bin 0.
        let usable = extent.cmpgt(Vec3A::ZERO) & scale.cmplt(Vec3A::INFINITY);
        usable.any().then(|| Self {
            origin: over.min,
            scale: Vec3A::select(usable, scale, Vec3A::ZERO),
        })
    }

    fn bins(&self, centre: Vec3A) -> [usize; 3] {
        ((centre - self.origin) * self.scale).to_array().map(bin_of)
    }
}

/// The bin of a position in bin units. Adding 2²³ rounds to the nearest integer in the low bits;
/// the bin exists for any input.
fn bin_of(place: f32) -> usize {
    (place + 8_388_608.0).to_bits() as usize & (MAX_BINS - 1)
}

/// Boxes and counts of the bins of three axes.
struct Bins<const N: usize> {
    boxes: [[Box3; N]; 3],
    counts: [[u32; N]; 3],
}

impl<const N: usize> Bins<N> {
    const EMPTY: Self = Bins {
        boxes: [[Box3::EMPTY; N]; 3],
        counts: [[0; N]; 3],
    };

    fn add(&mut self, references: &[Reference], grid: BinGrid) {
        for reference in references {
            let bounds = reference.bounds();
            let index = grid.bins(reference.centre());
            for axis in 0..3 {
                let index = index[axis] % N;
                let bin = &mut self.boxes[axis][index];
                *bin = bin.union(bounds);
                self.counts[axis][index] += 1;
            }
        }
    }

    /// Boxes and counts add up without rounding, so the sum does not depend on the order.
    fn merge(&mut self, other: &Self) {
        for axis in 0..3 {
            for bin in 0..N {
                let sum = &mut self.boxes[axis][bin];
                *sum = sum.union(other.boxes[axis][bin]);
                self.counts[axis][bin] += other.counts[axis][bin];
            }
        }
    }

    fn fill(&mut self, references: &[Reference], grid: BinGrid) {
        if references.len() < PARALLEL_BINNING {
            return self.add(references, grid);
        }
        let parts = references.par_chunks(PARALLEL_BINNING / 4).map(|part| {
            let mut bins = Self::EMPTY;
            bins.add(part, grid);
            bins
        });
        for part in parts.collect::<Vec<_>>() {
            self.merge(&part);
        }
    }
}

/// The best border between bins of all axes; `None` if all centres coincide.
///
/// Bins divide the box of the node, not that of the centres: see the module's text. If all centres
/// fall into a single bin on each axis, their own box is divided.
pub(super) fn best_bin_split(
    references: &[Reference],
    bounds: Box3,
    bins: usize,
) -> Option<BinSplit> {
    let bins = bins.min(references.len().max(4));
    let over = |grid_box: Box3| {
        let grid = BinGrid::new(grid_box, bins)?;
        // Most nodes are small, and for them bins cost more than references.
        match bins {
            0..=8 => best_border::<8>(references, grid, bins),
            9..=16 => best_border::<16>(references, grid, bins),
            _ => best_border::<MAX_BINS>(references, grid, bins),
        }
    };
    let doubled = Box3 {
        min: bounds.min * 2.0,
        max: bounds.max * 2.0,
    };
    over(doubled).or_else(|| {
        let centres = references.iter().map(Reference::centre);
        over(centres.fold(Box3::EMPTY, Box3::with_point))
    })
}

/// The best border between the bins of a grid; `None` if on every axis one bin holds everything.
fn best_border<const N: usize>(
    references: &[Reference],
    grid: BinGrid,
    bins: usize,
) -> Option<BinSplit> {
    let mut filled = Bins::<N>::EMPTY;
    filled.fill(references, grid);
    let (mut best_cost, mut best) = (f32::INFINITY, None);
    for axis in 0..3 {
        let (boxes, counts) = (&filled.boxes[axis], &filled.counts[axis]);
        // Cost of all bins from this one on.
        let mut high = [0.0; N];
        let (mut bounds, mut count) = (Box3::EMPTY, 0);
        for bin in (1..bins).rev() {
            bounds = bounds.union(boxes[bin]);
            count += counts[bin];
            high[bin] = bounds.half_area() * count as f32;
        }
        let total = count + counts[0];
        let (mut bounds, mut count) = (Box3::EMPTY, 0);
        for bin in 1..bins {
            bounds = bounds.union(boxes[bin - 1]);
            count += counts[bin - 1];
            let cost = bounds.half_area() * count as f32 + high[bin];
            if cost < best_cost && count > 0 && count < total {
                (best_cost, best) = (cost, Some((axis, bin)));
            }
        }
    }
    let (axis, bin) = best?;
    let side = |bins: &[Box3]| bins.iter().copied().fold(Box3::EMPTY, Box3::union);
    let boxes = &filled.boxes[axis][..bins];
    Some(BinSplit {
        axis,
        grid,
        bin,
        cost: best_cost,
        bounds: [side(&boxes[..bin]), side(&boxes[bin..])],
    })
}

/// Moves the references of the first side to the front; returns their number. Every one is swapped,
/// since a branch would be mispredicted half the time.
fn partition(references: &mut [Reference], is_low: impl Fn(&Reference) -> bool) -> usize {
    let mut middle = 0;
    for place in 0..references.len() {
        let low = is_low(&references[place]);
        references.swap(middle, place);
        middle += usize::from(low);
    }
    middle
}
