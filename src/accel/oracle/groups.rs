//! Triangles in small groups of neighbours, each with a box around it, so that a ray tests only the
//! groups whose widened box its line meets. There is no hierarchy and no order of visits: one flat
//! list of boxes, tested sixteen at a time.
//!
//! Boxes are widened by far more than the effect of f32 rounding on a ray or a triangle, so that a
//! group is skipped only if no test could find a hit in it: planes by [`WIDENED`] of the
//! coordinates involved, and distances along the ray by the same fraction.

use rayon::prelude::*;

pub(crate) const GROUP: usize = 16;

/// Boxes tested at a time.
const LANES: usize = 16;

/// Relative widening of boxes and distances: 512 roundings of f32.
const WIDENED: f32 = 1.0 / 32768.0;

/// Smallest direction component whose reciprocal is used unchanged; it stays finite.
const LEAST_DIRECTION: f32 = 1e-37;

/// Minimum set size for sorting with two threads.
const PARALLEL: usize = 8192;

type Corners = [[f32; 3]; 3];

/// Triangles in groups.
pub struct Groups {
    /// Indices of the triangles; [`GROUP`] consecutive ones are a group.
    order: Vec<u32>,
    blocks: Vec<Block>,
}

/// Minima and maxima of [`LANES`] boxes by axis; unused lanes are empty.
struct Block {
    low: [[f32; LANES]; 3],
    high: [[f32; LANES]; 3],
}

/// The part of a ray for which groups are searched.
#[derive(Debug, Clone, Copy)]
pub struct Line {
    origin: [f32; 3],
    inverse: [f32; 3],
    /// The distance range.
    pub span: [f32; 2],
}

impl Line {
    /// The part `span` of a line, given the reciprocal of its direction, all finite.
    pub fn new(origin: [f32; 3], inverse: [f32; 3], span: [f32; 2]) -> Self {
        Self {
            origin,
            inverse,
            span,
        }
    }

    /// The whole line through `origin`.
    pub fn whole(origin: [f32; 3], direction: [f32; 3]) -> Self {
        let inverse = direction.map(|d| 1.0 / d.abs().max(LEAST_DIRECTION).copysign(d));
        Self::new(origin, inverse, [f32::NEG_INFINITY, f32::INFINITY])
    }
}

impl Groups {
    /// Groups of `count` triangles; `corners` must be finite. Neighbours are grouped (median splits
    /// along the widest axis) only for `many` rays; for a few, triangles stay in their order.
    pub fn new(count: usize, many: bool, corners: impl Fn(usize) -> Corners + Sync) -> Self {
        let mut order: Vec<u32> = (0..count as u32).collect();
        if many {
            let middles: Vec<[f32; 3]> = (0..count)
                .into_par_iter()
                .map(|id| {
                    let [a, b, c] = corners(id);
                    [0, 1, 2].map(|axis| (a[axis] + b[axis] + c[axis]) / 3.0)
                })
                .collect();
            bring_neighbours_together(&mut order, &middles);
        }
        let blocks = (order.par_chunks(GROUP * LANES))
            .map(|ids| Block::new(ids, &corners))
            .collect();
        Self { order, blocks }
    }

    /// The triangles of group `index`.
    pub fn members(&self, index: usize) -> &[u32] {
        let first = (index * GROUP).min(self.order.len());
        &self.order[first..(first + GROUP).min(self.order.len())]
    }

    /// Number of groups.
    pub fn len(&self) -> usize {
        self.order.len().div_ceil(GROUP)
    }

    /// True if there are no groups.
    pub fn is_empty(&self) -> bool {
        self.order.is_empty()
    }

    /// Calls `visit` with every group that the line may meet, in ascending order; `visit` returns
    /// the new end of the search interval.
    pub fn visit(&self, line: &Line, mut visit: impl FnMut(usize) -> f32) {
        let mut line = *line;
        for (place, block) in self.blocks.iter().enumerate() {
            let mut mask = block.met_by(&line);
            while mask != 0 {
                let lane = mask.trailing_zeros() as usize;
                mask &= mask - 1;
                line.span[1] = visit(place * LANES + lane);
            }
        }
    }
}

/// Median splits until a part is one group, so that all groups but the last are full.
fn bring_neighbours_together(ids: &mut [u32], middles: &[[f32; 3]]) {
    if ids.len() <= GROUP {
        return;
    }
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for &id in ids.iter() {
        for (axis, x) in middles[id as usize].into_iter().enumerate() {
            low[axis] = low[axis].min(x);
            high[axis] = high[axis].max(x);
        }
    }
    let extent = |axis: usize| high[axis] - low[axis];
    let widest = (1..3).fold(0, |w, a| if extent(a) > extent(w) { a } else { w });
    let half = (ids.len() / 2).next_multiple_of(GROUP).min(ids.len() - 1);
    let along = |id: &u32| middles[*id as usize][widest];
    ids.select_nth_unstable_by(half, |a, b| along(a).total_cmp(&along(b)));
    let parallel = ids.len() >= PARALLEL;
    let (left, right) = ids.split_at_mut(half);
    if parallel {
        rayon::join(
            || bring_neighbours_together(left, middles),
            || bring_neighbours_together(right, middles),
        );
    } else {
        bring_neighbours_together(left, middles);
        bring_neighbours_together(right, middles);
    }
}

impl Block {
    fn new(ids: &[u32], corners: &impl Fn(usize) -> Corners) -> Self {
        let mut block = Self {
            low: [[f32::INFINITY; LANES]; 3],
            high: [[f32::NEG_INFINITY; LANES]; 3],
        };
        for (place, &id) in ids.iter().enumerate() {
            let lane = place / GROUP;
            for corner in corners(id as usize) {
                for (axis, x) in corner.into_iter().enumerate() {
                    block.low[axis][lane] = block.low[axis][lane].min(x);
                    block.high[axis][lane] = block.high[axis][lane].max(x);
                }
            }
        }
        block
    }

    /// One bit for each box that the line may meet. NaN counts as met.
    fn met_by(&self, line: &Line) -> u32 {
        let met: [u32; LANES] = std::array::from_fn(|lane| {
            let (mut enter, mut exit) = (line.span[0], line.span[1]);
            for axis in 0..3 {
                let (low, high) = (self.low[axis][lane], self.high[axis][lane]);
                let (o, inverse) = (line.origin[axis], line.inverse[axis]);
                let slack = WIDENED * (low.abs().max(high.abs()) + o.abs());
                let first = (low - slack - o) * inverse;
                let second = (high + slack - o) * inverse;
                let near = if first < second { first } else { second };
                let far = if first < second { second } else { first };
                enter = if near > enter { near } else { enter };
                exit = if far < exit { far } else { exit };
            }
            let apart = enter - WIDENED * enter.abs() > exit + WIDENED * exit.abs();
            u32::from(!apart)
        });
        let lanes = met.iter().enumerate();
        lanes.fold(0, |mask, (lane, bit)| mask | bit << lane)
    }
}
