//! Spatial splits: where an object split leaves two boxes that overlap, space is split instead, and
//! a triangle across the plane becomes a reference on either side.
//!
//! Exactness. A reference's box is the triangle's box cut by planes, *not* the box of the triangle
//! cut by planes, as in the paper. The boxes of a triangle's references then cover its box, and that
//! is all that the theorem of `docs/design.md` needs: see [`super::Coverage`]. The tighter boxes would
//! break it, since a ray almost in the triangle's plane may be given a hit, by rounding, anywhere in
//! the triangle's box, and no pad in proportion to the coordinates covers that.
//!
//! Source: M. Stich, H. Friedrich, A. Dietrich, "Spatial splits in bounding volume hierarchies", 2009.

use super::Tree;
use super::binned::{best_bin_split, median_split};
use super::grow::grow;
use super::parameters::{SAH_DEPTH, TreeParameters};
use super::reference::{Box3, Reference, bounds_of};
use crate::accel::bounds::Bounds;

/// The tree. There are at most twice as many references as triangles.
pub(super) fn build(references: Vec<Reference>, settings: &TreeParameters) -> Tree {
    let budget = references.len();
    let side = Side::of(references);
    let spatial = Spatial {
        settings,
        least_overlap: settings.spatial_alpha * side.bounds.half_area(),
    };
    // A side may make so many new references.
    let divide = |(side, budget): (Side, usize), depth, order: &mut Vec<u32>| {
        let Side { references, bounds } = &side;
        let (node, count) = (Bounds::from(*bounds), references.len());
        let areas = references.iter().map(|r| r.bounds().half_area());
        if settings.must_be_leaf(*bounds, areas) {
            order.extend(references.iter().map(|r| r.id));
            return (node, None);
        }
        let [low, high] = spatial.split(side, budget, depth);
        let sum = low.references.len() + high.references.len();
        let left = budget - (sum - count);
        // Each side gets its share of what is left.
        let low_budget = (left as u64 * low.references.len() as u64 / sum as u64) as usize;
        (node, Some([(low, low_budget), (high, left - low_budget)]))
    };
    grow((side, budget), |part| part.0.references.len(), divide).into()
}

struct Spatial<'a> {
    settings: &'a TreeParameters,
    /// Half area of overlap from which on spatial splits are tried.
    least_overlap: f32,
}

/// References of one side of a split.
struct Side {
    references: Vec<Reference>,
    bounds: Box3,
}

impl Side {
    fn of(references: Vec<Reference>) -> Self {
        let bounds = bounds_of(&references);
        Side { references, bounds }
    }
}

impl Spatial<'_> {
    fn split(&self, side: Side, budget: usize, depth: u32) -> [Side; 2] {
        let Side {
            mut references,
            bounds,
        } = side;
        let deep = depth >= SAH_DEPTH;
        let object = (!deep)
            .then(|| best_bin_split(&references, bounds, self.settings.bins))
            .flatten();
        let overlaps =
            |[low, high]: [Box3; 2]| low.intersection(high).half_area() >= self.least_overlap;
        if !deep && object.as_ref().is_none_or(|o| overlaps(o.bounds)) {
            let cost = object.as_ref().map_or(f32::INFINITY, |o| o.cost);
            if let Some(plane) = best_plane(&references, &bounds, self.settings, cost)
                && let Some(sides) = cut(&references, &plane, budget)
            {
                return sides;
            }
        }
        match object {
            Some(object) => {
                let (low, high) = references.into_iter().partition(|r| object.is_low(r));
                [Side::of(low), Side::of(high)]
            }
            None => {
                let longest = bounds.longest_axis();
                let (middle, _) = median_split(&mut references, longest);
                let high = references.split_off(middle);
                [Side::of(references), Side::of(high)]
            }
        }
    }
}

/// A plane with what lies on its sides, as far as bins tell.
struct Plane {
    axis: usize,
    position: f32,
    bounds: [Box3; 2],
    counts: [usize; 2],
}

/// A slice of the node.
#[derive(Clone, Copy)]
struct Bin {
    bounds: Box3,
    /// References that begin here, and that end here.
    enter: u32,
    leave: u32,
}

/// The best plane between bins of all axes that costs less than `limit`.
fn best_plane(
    references: &[Reference],
    bounds: &Box3,
    settings: &TreeParameters,
    limit: f32,
) -> Option<Plane> {
    let count = settings.spatial_bins;
    let mut best: Option<Plane> = None;
    let mut best_cost = limit;
    for axis in 0..3 {
        let (start, end) = (bounds.min[axis], bounds.max[axis]);
        let width = (end - start) / count as f32;
        // An axis without extent, or one that is not finite, cannot be cut.
        if !(width > 0.0 && width < f32::INFINITY) {
            continue;
        }
        let position = |bin: usize| start + width * bin as f32;
        let bins = fill_bins(references, axis, start, width, count);
        let mut high = vec![(Box3::EMPTY, 0); count];
        let (mut sum, mut inside) = (Box3::EMPTY, 0);
        for bin in (1..count).rev() {
            sum = sum.union(bins[bin].bounds);
            inside += bins[bin].leave as usize;
            high[bin] = (sum, inside);
        }
        let (mut sum, mut inside) = (Box3::EMPTY, 0);
        for bin in 1..count {
            sum = sum.union(bins[bin - 1].bounds);
            inside += bins[bin - 1].enter as usize;
            let (high_bounds, above) = high[bin];
            if inside == 0 || above == 0 {
                continue;
            }
            let cost = sum.half_area() * inside as f32 + high_bounds.half_area() * above as f32;
            if cost < best_cost {
                best_cost = cost;
                best = Some(Plane {
                    axis,
                    position: position(bin),
                    bounds: [sum, high_bounds],
                    counts: [inside, above],
                });
            }
        }
    }
    best
}

/// Cuts all references at the borders of the bins.
fn fill_bins(
    references: &[Reference],
    axis: usize,
    start: f32,
    width: f32,
    count: usize,
) -> Vec<Bin> {
    let empty = Bin {
        bounds: Box3::EMPTY,
        enter: 0,
        leave: 0,
    };
    let mut bins = vec![empty; count];
    let bin_of = |x: f32| (((x - start) / width) as usize).min(count - 1);
    for reference in references {
        let bounds = reference.bounds();
        let (first, last) = (bin_of(bounds.min[axis]), bin_of(bounds.max[axis]));
        bins[first].enter += 1;
        bins[last].leave += 1;
        for (bin, slice) in bins.iter_mut().enumerate().take(last + 1).skip(first) {
            let mut part = bounds;
            if bin > first {
                part.min[axis] = start + width * bin as f32;
            }
            if bin < last {
                part.max[axis] = start + width * (bin + 1) as f32;
            }
            slice.bounds = slice.bounds.union(part);
        }
    }
    bins
}

/// Splits references at a plane; one across it goes to both sides, or whole to one if that is
/// cheaper (the paper's unsplitting). `None` if that brings nothing or exceeds the budget.
fn cut(references: &[Reference], plane: &Plane, budget: usize) -> Option<[Side; 2]> {
    let Plane { axis, position, .. } = *plane;
    let mut sides = [Vec::new(), Vec::new()];
    let mut across = Vec::new();
    for reference in references {
        if reference.max[axis] <= position {
            sides[0].push(*reference);
        } else if reference.min[axis] >= position {
            sides[1].push(*reference);
        } else {
            across.push(*reference);
        }
    }
    let mut bounds = plane.bounds;
    let mut counts = plane.counts.map(|count| count as f32);
    for reference in across {
        let whole = reference.bounds();
        let with = bounds.map(|side| side.union(whole));
        let [low, high] = bounds.map(Box3::half_area);
        let both = low * counts[0] + high * counts[1];
        let only_low = with[0].half_area() * counts[0] + high * (counts[1] - 1.0);
        let only_high = low * (counts[0] - 1.0) + with[1].half_area() * counts[1];
        if both < only_low && both < only_high {
            let mut parts = [whole; 2];
            parts[0].max[axis] = position;
            parts[1].min[axis] = position;
            for side in 0..2 {
                sides[side].push(Reference::new(parts[side], reference.id));
            }
        } else {
            let side = usize::from(only_high < only_low);
            sides[side].push(reference);
            bounds[side] = with[side];
            counts[1 - side] -= 1.0;
        }
    }
    let count = references.len();
    let new = sides[0].len() + sides[1].len() - count;
    let progress = sides.iter().all(|side| (1..count).contains(&side.len()));
    (progress && new <= budget).then(|| sides.map(Side::of))
}
