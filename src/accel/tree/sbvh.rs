//! Spatial splits: where an object split leaves two overlapping boxes, space is split instead, and
//! a triangle across the plane becomes a reference on either side, with the box of its part there.
//!
//! Exactness. The part is the triangle cut by planes, as in the paper, with the [`Margin`] of the
//! kd-tree around it: the boxes of a triangle's references then contain every point of its box that
//! is no farther from it than the margin, and so every hit of a ray that meets its plane at a
//! cosine of 1/32 or more. Rounding may give a ray almost in the plane a hit anywhere in the
//! triangle's box, and no pad proportional to the coordinates covers that. Without `spatial_clip` a
//! reference's box is the triangle's *box* cut by planes. The boxes of a triangle's references then
//! cover its box, which is all that the theorem of `docs/design.md` needs, for any ray: see
//! [`super::Coverage`].
//!
//! Source: M. Stich, H. Friedrich, A. Dietrich, "Spatial splits in bounding volume hierarchies",
//! 2009.

use super::Tree;
use super::binned::{best_bin_split, median_split};
use super::depth::SAH_DEPTH;
use super::grow::grow;
use super::parameters::TreeParameters;
use super::reference::{Box3, Reference, bounds_of};
use crate::TriangleSoup;
use crate::bounds::Bounds;
use crate::polygon::Polygon;
use crate::spatial::{Margin, clip};
use glam::Vec3A;

/// The tree. There are at most twice as many references as triangles.
pub(super) fn build(
    references: Vec<Reference>,
    soup: &TriangleSoup,
    settings: &TreeParameters,
) -> Tree {
    let budget = references.len();
    let side = Side::of(references);
    let spatial = Spatial {
        settings,
        least_overlap: settings.spatial_alpha * side.bounds.half_area(),
        soup,
        margin: settings
            .spatial_clip
            .then(|| Margin::new(&side.bounds.into())),
    };
    // Budget of new references for a side.
    let divide = |(side, budget): (Side, usize), depth, order: &mut Vec<u32>| {
        let Side { references, bounds } = &side;
        let (node, count) = (Bounds::from(*bounds), references.len());
        if spatial.must_be_leaf(&side, budget) {
            order.extend(references.iter().map(|r| r.id));
            return (node, None);
        }
        let [low, high] = spatial.split(side, budget, depth);
        let sum = low.references.len() + high.references.len();
        let left = budget - (sum - count);
        // Each side gets its share of the rest.
        let low_budget = (left as u64 * low.references.len() as u64 / sum as u64) as usize;
        (node, Some([(low, low_budget), (high, left - low_budget)]))
    };
    grow((side, budget), |part| part.0.references.len(), divide).into()
}

struct Spatial<'a> {
    settings: &'a TreeParameters,
    /// Half area of overlap from which spatial splits are tried.
    least_overlap: f32,
    soup: &'a TriangleSoup,
    /// Set if triangles are clipped, rather than their boxes.
    margin: Option<Margin>,
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
    /// True if no subtree can be cheaper than a leaf. The parts of a clipped triangle may be
    /// smaller than its box by any amount.
    fn must_be_leaf(&self, side: &Side, budget: usize) -> bool {
        let may_clip =
            self.margin.is_some() && budget > 0 && side.bounds.half_area() >= self.least_overlap;
        let least = |r: &Reference| {
            if may_clip {
                0.0
            } else {
                r.bounds().half_area()
            }
        };
        let areas = side.references.iter().map(least);
        self.settings.must_be_leaf(side.bounds, areas)
    }

    /// Box of a triangle's part within `cell`, a part of its box; `None` if clearly missed.
    fn part(&self, id: u32, cell: Box3) -> Option<Box3> {
        let Some(margin) = &self.margin else {
            return Some(cell);
        };
        let record = &self.soup.records[id as usize];
        let part = clip(record, &cell.into(), margin.of(record))?;
        let part = cell.intersection(part.into());
        part.min.cmple(part.max).all().then_some(part)
    }

    /// Boxes of the parts of a reference below and above a plane across it.
    fn parts(&self, reference: &Reference, axis: usize, position: f32) -> [Option<Box3>; 2] {
        let mut halves = [reference.bounds(); 2];
        halves[0].max[axis] = position;
        halves[1].min[axis] = position;
        let parts = halves.map(|half| self.part(reference.id, half));
        // NaN coordinates: nothing is known about the parts.
        if parts == [None; 2] {
            return halves.map(Some);
        }
        parts
    }

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
            if let Some(plane) = self.best_plane(&references, &bounds, cost)
                && let Some(sides) = self.cut(&references, &plane, budget)
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

/// A plane with estimates of its sides from the bins.
struct Plane {
    axis: usize,
    position: f32,
    bounds: [Box3; 2],
    counts: [usize; 2],
}

#[derive(Clone, Copy)]
struct Bin {
    bounds: Box3,
    /// References that begin here, and that end here.
    enter: u32,
    leave: u32,
}

/// Slices of equal width across an axis.
struct Slices {
    axis: usize,
    start: f32,
    width: f32,
    count: usize,
}

impl Slices {
    /// Start of a slice.
    fn border(&self, bin: usize) -> f32 {
        self.start + self.width * bin as f32
    }

    /// The slice of a coordinate.
    fn of(&self, x: f32) -> usize {
        (((x - self.start) / self.width) as usize).min(self.count - 1)
    }

    /// The part of a box in one of the slices `first` to `last` that it overlaps.
    fn cell(&self, mut bounds: Box3, bin: usize, [first, last]: [usize; 2]) -> Box3 {
        if bin > first {
            bounds.min[self.axis] = self.border(bin);
        }
        if bin < last {
            bounds.max[self.axis] = self.border(bin + 1);
        }
        bounds
    }

    /// Extends the boxes of `parts` by the parts of a convex polygon in their slices: its corners,
    /// and the points where its edges cross a border.
    fn chop(&self, polygon: &Polygon, parts: &mut [Box3], [first, last]: [usize; 2]) {
        let corners = polygon.corners();
        let slice = |corner: &[f64; 3]| self.of(corner[self.axis] as f32).clamp(first, last);
        let point = |[x, y, z]: [f64; 3]| Vec3A::new(x as f32, y as f32, z as f32);
        for (a, b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
            let (from, to) = (slice(a), slice(b));
            parts[from] = parts[from].with_point(point(*a));
            for bin in from.min(to)..from.max(to) {
                let border = f64::from(self.border(bin + 1));
                let along = (border - a[self.axis]) / (b[self.axis] - a[self.axis]);
                let crossing =
                    point([0, 1, 2].map(|i| a[i] + (b[i] - a[i]) * along.clamp(0.0, 1.0)));
                for part in &mut parts[bin..=bin + 1] {
                    *part = part.with_point(crossing);
                }
            }
        }
    }
}

impl Spatial<'_> {
    /// The best plane between bins of all axes that costs less than `limit`.
    fn best_plane(&self, references: &[Reference], bounds: &Box3, limit: f32) -> Option<Plane> {
        let count = self.settings.spatial_bins;
        let mut best: Option<Plane> = None;
        let mut best_cost = limit;
        for axis in 0..3 {
            let (start, end) = (bounds.min[axis], bounds.max[axis]);
            let width = (end - start) / count as f32;
            // An axis with zero or non-finite extent cannot be cut.
            if !(width > 0.0 && width < f32::INFINITY) {
                continue;
            }
            let slices = Slices {
                axis,
                start,
                width,
                count,
            };
            let bins = self.fill_bins(references, &slices);
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
                        position: slices.border(bin),
                        bounds: [sum, high_bounds],
                        counts: [inside, above],
                    });
                }
            }
        }
        best
    }

    fn fill_bins(&self, references: &[Reference], slices: &Slices) -> Vec<Bin> {
        let empty = Bin {
            bounds: Box3::EMPTY,
            enter: 0,
            leave: 0,
        };
        let mut bins = vec![empty; slices.count];
        let mut parts = vec![Box3::EMPTY; slices.count];
        for reference in references {
            let bounds = reference.bounds();
            let [first, last] = [bounds.min, bounds.max].map(|v| slices.of(v[slices.axis]));
            bins[first].enter += 1;
            bins[last].leave += 1;
            if first == last {
                bins[first].bounds = bins[first].bounds.union(bounds);
                continue;
            }
            let mut reach = 0.0;
            match &self.margin {
                Some(margin) => {
                    let record = &self.soup.records[reference.id as usize];
                    let margin = margin.of(record);
                    let polygon = Polygon::new(record).clipped(&bounds.into(), margin);
                    parts[first..=last].fill(Box3::EMPTY);
                    slices.chop(&polygon, &mut parts, [first, last]);
                    reach = margin as f32;
                }
                None => parts[first..=last].fill(bounds),
            }
            for bin in first..=last {
                let grown = Box3 {
                    min: parts[bin].min - reach,
                    max: parts[bin].max + reach,
                };
                let part = slices.cell(bounds, bin, [first, last]).intersection(grown);
                if part.min.cmple(part.max).all() {
                    bins[bin].bounds = bins[bin].bounds.union(part);
                }
            }
        }
        bins
    }

    /// Splits references at a plane; one across it goes to both sides, or whole to one if that is
    /// cheaper (the paper's unsplitting). `None` without an improvement or beyond the budget.
    fn cut(&self, references: &[Reference], plane: &Plane, budget: usize) -> Option<[Side; 2]> {
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
            let parts = self.parts(&reference, axis, position);
            let with = bounds.map(|side| side.union(whole));
            let [low, high] = bounds.map(Box3::half_area);
            let both = low * counts[0] + high * counts[1];
            let only_low = with[0].half_area() * counts[0] + high * (counts[1] - 1.0);
            let only_high = low * (counts[0] - 1.0) + with[1].half_area() * counts[1];
            let (side, bounds_there) = match parts {
                [Some(low), Some(high)] if both < only_low && both < only_high => {
                    sides[0].push(Reference::new(low, reference.id));
                    sides[1].push(Reference::new(high, reference.id));
                    continue;
                }
                [Some(low), None] => (0, low),
                [None, Some(high)] => (1, high),
                _ => (usize::from(only_high < only_low), whole),
            };
            sides[side].push(Reference::new(bounds_there, reference.id));
            bounds[side] = bounds[side].union(bounds_there);
            counts[1 - side] -= 1.0;
        }
        let new = sides[0].len() + sides[1].len() - references.len();
        // If one side has everything, the budget was spent on references of the other one.
        let progress = sides.iter().all(|side| !side.is_empty());
        (progress && new <= budget).then(|| sides.map(Side::of))
    }
}
