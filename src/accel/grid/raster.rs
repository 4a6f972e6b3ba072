//! The cells that a triangle overlaps: exact, row by row.
//!
//! The separating-axis test of T. Akenine-Möller ("Fast 3D triangle–box overlap testing", 2001) in
//! the arrangement of M. Schwarz and H.-P. Seidel ("Fast parallel surface and solid voxelization on
//! GPUs", 2010): a triangle overlaps a cell if the cell is in its box, touches its plane, and the
//! three projections of both overlap. Each condition gives an interval of cells in a row, so the
//! cost of a row does not depend on the number of cells listed.

use super::super::spatial::cross;
use super::super::triangle::TriangleRecord;
use super::Grid;

pub(crate) fn extremes(corners: &[[f32; 3]; 3]) -> [[f32; 3]; 2] {
    let pick = |first: fn(f32, f32) -> bool| {
        std::array::from_fn(|a| {
            let [p, q, r] = [corners[0][a], corners[1][a], corners[2][a]];
            let s = if first(p, q) { p } else { q };
            if first(r, s) { r } else { s }
        })
    };
    // Comparisons are one instruction each, unlike f32::min; corners hold no NaN.
    [pick(|a, b| a < b), pick(|a, b| a > b)]
}

/// Finds the cells of triangles; reuses memory between them.
#[derive(Debug, Default)]
pub(crate) struct Raster {
    /// First and last cell in x by y, from the projection along z.
    columns: Vec<[u32; 2]>,
}

impl Raster {
    /// Calls `row(first cell, number of cells)` for every row of cells along x that the triangle
    /// overlaps after cells are grown by the margin, more for needles ([`margin_of`]); without
    /// `exact`, for every row of its box.
    pub(crate) fn rows(
        &mut self,
        grid: &Grid,
        record: &TriangleRecord,
        exact: bool,
        mut row: impl FnMut(u32, u32),
    ) {
        let corners = record.vertices();
        let [low, high] = extremes(&corners);
        let first: [u32; 3] = std::array::from_fn(|a| grid.coordinate(a, low[a] - grid.margin[a]));
        let last: [u32; 3] = std::array::from_fn(|a| grid.coordinate(a, high[a] + grid.margin[a]));
        let wide: [bool; 3] = std::array::from_fn(|a| first[a] != last[a]);
        let wide_axes = wide.iter().filter(|&&w| w).count();
        // A triangle is connected: in a single row it overlaps every cell of its box.
        if !exact || wide_axes < 2 {
            for z in first[2]..=last[2] {
                for y in first[1]..=last[1] {
                    row(grid.index([first[0], y, z]), last[0] - first[0] + 1);
                }
            }
            return;
        }
        let shape = Shape::new(grid, &corners, margin_of(record));
        let plane = (wide_axes == 3).then(|| Plane::new(&shape));
        let whole = |axis: usize| [first[axis], last[axis]];
        let along_z = (wide[0] && wide[1]).then(|| Outline::new(&shape, 1, 0));
        let along_y = (wide[0] && wide[2]).then(|| Outline::new(&shape, 2, 0));
        let along_x = (wide[1] && wide[2]).then(|| Outline::new(&shape, 2, 1));
        self.columns.clear();
        if let Some(outline) = &along_z {
            let rows = first[1]..=last[1];
            self.columns
                .extend(rows.map(|y| outline.cells(y, whole(0))));
        }
        for z in first[2]..=last[2] {
            let [y0, y1] = along_x.as_ref().map_or(whole(1), |o| o.cells(z, whole(1)));
            let in_slice = along_y.as_ref().map_or(whole(0), |o| o.cells(z, whole(0)));
            for y in y0..=y1 {
                let mut x = in_slice;
                if let Some(column) = self.columns.get((y - first[1]) as usize) {
                    x = [x[0].max(column[0]), x[1].min(column[1])];
                }
                if let Some(plane) = &plane {
                    x = plane.cells(y, z, x);
                }
                if x[0] <= x[1] {
                    row(grid.index([x[0], y, z]), x[1] - x[0] + 1);
                }
            }
        }
    }
}

/// Margins by which cells inside a triangle's box are grown for it. The distance to the plane of a
/// needle loses accuracy by its length over its width, so hits land beside it; they stay in its
/// box.
pub(super) fn margin_of(record: &TriangleRecord) -> f64 {
    let [e, f] = record.edges();
    let square = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>();
    let third = std::array::from_fn(|a| f[a] - e[a]);
    let longest = square(e).max(square(f)).max(square(third));
    let ratio = longest / square(cross(e, f)).sqrt();
    // A point has no width either: 0 / 0.
    if ratio > 1.0 { ratio.min(1e6) } else { 1.0 }
}

/// A triangle in cell units, and the growth of cells.
struct Shape {
    corners: [[f64; 3]; 3],
    grow: [f64; 3],
}

impl Shape {
    fn new(grid: &Grid, corners: &[[f32; 3]; 3], margins: f64) -> Self {
        let low = grid.bounds.min.map(f64::from);
        let scale = grid.inverse_cell.map(f64::from);
        Self {
            corners: corners
                .map(|c| std::array::from_fn(|a| (f64::from(c[a]) - low[a]) * scale[a])),
            grow: std::array::from_fn(|a| f64::from(grid.margin[a]) * margins * scale[a]),
        }
    }
}

/// Cells of `within` that lie in the interval; an empty range if there are none.
fn cells_between(low: f64, high: f64, within: [u32; 2]) -> [u32; 2] {
    let [first, last] = within;
    let [f, l] = within.map(f64::from);
    if low > l + 1.0 || high < f {
        return [1, 0];
    }
    // Casts truncate, which is the floor for non-negative values.
    let low = if low > f { low as u32 } else { first };
    let high = if high < l { high as u32 } else { last };
    [low, high]
}

/// A triangle projected to two axes: its extent along `value` over slabs of cells along `slab`.
struct Outline {
    /// Both ends of each edge as (slab, value), lower end first, and the slope between them.
    edges: [([f64; 2], [f64; 2], f64); 3],
    grow_slab: f64,
    grow_value: f64,
}

impl Outline {
    fn new(shape: &Shape, slab: usize, value: usize) -> Self {
        let points = shape.corners.map(|c| [c[slab], c[value]]);
        let edge = |i: usize| {
            let [p, q] = [points[i], points[(i + 1) % 3]];
            let [p, q] = if p[0] <= q[0] { [p, q] } else { [q, p] };
            let rise = q[0] - p[0];
            // Only edges that exit a slab are cut, and those are not level.
            let slope = if rise > 0.0 {
                (q[1] - p[1]) / rise
            } else {
                0.0
            };
            (p, q, slope)
        };
        Self {
            edges: [edge(0), edge(1), edge(2)],
            grow_slab: shape.grow[slab],
            grow_value: shape.grow[value],
        }
    }

    fn cells(&self, slab: u32, within: [u32; 2]) -> [u32; 2] {
        let below = f64::from(slab) - self.grow_slab;
        let above = f64::from(slab) + 1.0 + self.grow_slab;
        let [mut low, mut high] = [f64::INFINITY, f64::NEG_INFINITY];
        for (p, q, slope) in &self.edges {
            if q[0] < below || p[0] > above {
                continue;
            }
            let at = |s: f64| p[1] + (s - p[0]) * slope;
            let start = if p[0] < below { at(below) } else { p[1] };
            let end = if q[0] > above { at(above) } else { q[1] };
            let [near, far] = if start < end {
                [start, end]
            } else {
                [end, start]
            };
            low = if near < low { near } else { low };
            high = if far > high { far } else { high };
        }
        cells_between(low - self.grow_value, high + self.grow_value, within)
    }
}

/// The plane of a triangle with the extent of a grown cell.
struct Plane {
    normal: [f64; 3],
    offset: f64,
    reach: f64,
    inverse_x: f64,
}

impl Plane {
    fn new(shape: &Shape) -> Self {
        let [p, q, r] = shape.corners;
        let e: [f64; 3] = std::array::from_fn(|a| q[a] - p[a]);
        let f: [f64; 3] = std::array::from_fn(|a| r[a] - p[a]);
        let normal = cross(e, f);
        let reach = (0..3).map(|a| normal[a].abs() * (0.5 + shape.grow[a]));
        let size = |v: [f64; 3]| v.iter().map(|x| x.abs()).sum::<f64>();
        // The effect of rounding on the plane of a needle.
        let slack = size(e) * size(f) * (size(e) + size(f) + size(p)) * 2.0_f64.powi(-48);
        Self {
            normal,
            offset: (0..3).map(|a| normal[a] * p[a]).sum(),
            reach: reach.sum::<f64>() + slack,
            inverse_x: 1.0 / normal[0],
        }
    }

    fn cells(&self, y: u32, z: u32, within: [u32; 2]) -> [u32; 2] {
        let [_, ny, nz] = self.normal;
        let rest = self.offset - ny * (f64::from(y) + 0.5) - nz * (f64::from(z) + 0.5);
        if self.normal[0] == 0.0 {
            return if rest.abs() <= self.reach {
                within
            } else {
                [1, 0]
            };
        }
        // Centres of cells that touch the plane lie between these; the cell adds half a cell.
        let centre = rest * self.inverse_x;
        let radius = self.reach * self.inverse_x.abs();
        let [low, high] = cells_between(centre - radius - 0.5, centre + radius - 0.5, within);
        let above = f64::from(low) < centre - radius - 0.5;
        [low + u32::from(above), high]
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Grid, GridBox};
    use super::*;
    use crate::fixtures::{random_triangle, soup};
    use crate::spatial::dot;
    use raystone_core::random::Pcg32;
    use std::collections::BTreeSet;

    /// The separating-axis test with all 13 axes, for one cell grown by `grow` cells.
    fn overlaps(corners: &[[f64; 3]; 3], cell: [u32; 3], grow: [f64; 3]) -> bool {
        let edge = |i: usize| -> [f64; 3] {
            std::array::from_fn(|a| corners[(i + 1) % 3][a] - corners[i][a])
        };
        let unit = |i: usize| -> [f64; 3] { std::array::from_fn(|a| f64::from(u8::from(a == i))) };
        let mut axes = vec![cross(edge(0), edge(1))];
        axes.extend((0..3).map(unit));
        axes.extend((0..9).map(|i| cross(edge(i / 3), unit(i % 3))));
        let centre = cell.map(|c| f64::from(c) + 0.5);
        axes.iter().all(|&axis| {
            let reach = (0..3).map(|a| (0.5 + grow[a]) * axis[a].abs()).sum::<f64>();
            let along = corners.map(|c| dot(c, axis) - dot(centre, axis));
            let low = along.iter().copied().fold(f64::INFINITY, f64::min);
            let high = along.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            low <= reach && high >= -reach
        })
    }

    #[test]
    fn rows_hold_the_cells_of_the_separating_axis_test_and_no_others() {
        let mut random = Pcg32::new(7);
        let mut fewer_than_box = 0;
        for case in 0..400 {
            let size = [0.05, 0.3, 1.0][case % 3];
            let far = [[0.0; 3], [2.0; 3], [2.0, 0.0, 1.0]];
            let soup = soup([random_triangle(&mut random, 1.0, size), far]);
            let record = soup.records[0];
            let grid = Grid::new(&GridBox::new(&soup), [9, 7, 8]);
            let listed = |exact: bool| {
                let mut cells = BTreeSet::new();
                Raster::default().rows(&grid, &record, exact, |first, count| {
                    cells.extend(first..first + count);
                });
                cells
            };
            let sat = |margins: f64| -> BTreeSet<u32> {
                let shape = Shape::new(&grid, &record.vertices(), margins);
                let all = (0..grid.cells() as u32)
                    .filter(|&cell| overlaps(&shape.corners, grid.coordinates(cell), shape.grow));
                all.collect()
            };
            let (exact, boxed) = (listed(true), listed(false));
            let margins = margin_of(&record);
            // The box is grown by one margin only, even for a needle.
            assert!(
                boxed.is_superset(&sat(0.99)),
                "case {case}: a cell of the box is missing"
            );
            let within: BTreeSet<u32> = &sat(0.99 * margins) & &boxed;
            assert!(exact.is_superset(&within), "case {case}: a cell is missing");
            let wide = sat(1.01 * margins);
            assert!(exact.is_subset(&wide), "case {case}: a cell too many");
            fewer_than_box += usize::from(exact.len() < boxed.len());
        }
        assert!(
            fewer_than_box > 100,
            "only {fewer_than_box} triangles leave out cells"
        );
    }
}
