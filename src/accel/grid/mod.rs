//! Shared parts of the grids: the subdivided box, the cell of a position, the insertion of
//! triangles. CPU version of `kernels/accel/grid.wesl`.
//!
//! A triangle is listed in every cell that it overlaps after the cell is grown by
//! [`GridBox::margin`], which exceeds the largest effect of rounding on the walk. The planes of a
//! grid are the same f32 expression everywhere, and the distance to a plane is monotone in the
//! plane even after rounding, so a walk passes planes in order; the margin covers the rounding of
//! positions, from which cells are found on entry and after a jump.

pub(crate) mod distance;
pub(crate) mod lists;
pub(crate) mod raster;

use super::bounds::Bounds;
use super::ray::Ray;
use super::spatial::cross;
use super::triangle::TriangleRecord;
use super::{AccelError, BuildLog, TriangleSoup};
use rayon::prelude::*;
use raystone_gpu::UniformValues;

/// Maximum words of a grid array on the adapter of `log`, without the sentinel.
pub(crate) fn most_words(log: &BuildLog) -> u64 {
    log.most_words() - 1
}

/// What to do about a grid of too many words.
pub(crate) const COARSER: &str = "set `lambda` (or `lambda1`, `lambda2`) lower";

/// Checks `needed` words against [`most_words`].
///
/// # Errors
/// [`AccelError::Limit`] with both numbers.
pub(crate) fn check_words(what: &str, needed: u64, log: &BuildLog) -> Result<(), AccelError> {
    AccelError::check_limit(what, needed, most_words(log), COARSER)
}

/// The box that a grid fills, and the accuracy of positions in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct GridBox {
    /// Around all triangles, grown by the margin.
    pub bounds: Bounds,
    /// Growth of cells along each axis when triangles are listed, scene units. Positions along a
    /// ray that starts within 16 diagonals of the scene have a smaller error.
    ///
    /// 2⁻¹⁸ diagonals for errors relative to the length of the ray, and 2⁻²² of the largest
    /// coordinate along the axis: half an ulp each for the position, the plane that bounds its
    /// cell, and the box of a triangle once it is grown; differences of positions are exact to
    /// their own half ulp.
    pub margin: [f32; 3],
    diagonal: f32,
}

impl GridBox {
    /// The grid box of a scene; a unit box if it is empty.
    pub(crate) fn new(soup: &TriangleSoup) -> Self {
        let mut bounds = bounds_of(&soup.records);
        if soup.records.is_empty() {
            bounds = Bounds {
                min: [0.0; 3],
                max: [1.0; 3],
            };
        }
        let diagonal = bounds.extent().iter().map(|e| e * e).sum::<f32>().sqrt();
        let margin = std::array::from_fn(|a| {
            let far = bounds.min[a].abs().max(bounds.max[a].abs());
            (diagonal * 2.0_f32.powi(-18) + far * 2.0_f32.powi(-22)).max(1e-18)
        });
        for (axis, margin) in margin.iter().enumerate() {
            bounds.min[axis] -= margin;
            bounds.max[axis] += margin;
        }
        Self {
            bounds,
            margin,
            diagonal,
        }
    }

    /// Cells along each axis for `lambda` cells per triangle, from 1 to `most`.
    pub(crate) fn resolution(&self, triangles: usize, lambda: f64, most: u32) -> [u32; 3] {
        // A flat scene still needs a volume for Cleary's rule.
        let extent = self.bounds.extent();
        let side = std::array::from_fn(|a| {
            f64::from(extent[a])
                .max(1e-3 * f64::from(self.diagonal))
                .max(f64::from(self.margin[a]))
        });
        let cells = cleary(side, triangles, lambda);
        std::array::from_fn(|a| {
            let most = finest(side[a], self.margin[a]).min(f64::from(most));
            cells[a].round().clamp(1.0, most) as u32
        })
    }
}

/// Most cells along a side: smaller ones would be all margin.
pub(crate) fn finest(side: f64, margin: f32) -> f64 {
    (side / (4.0 * f64::from(margin))).max(1.0)
}

/// Cells along each axis: side · cbrt(λ · triangles / volume) (J. Cleary et al., 1986).
pub(crate) fn cleary(side: [f64; 3], triangles: usize, lambda: f64) -> [f64; 3] {
    let volume = side.iter().product::<f64>();
    let density = (lambda * triangles.max(1) as f64 / volume).cbrt();
    side.map(|s| s * density)
}

/// Average number of references that cutting a cell may make of one.
const MOST_COPIES: f64 = 8.0;

/// Unrounded number of parts along each axis for a cell to be cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Cut {
    /// By Cleary's rule.
    pub wanted: [f64; 3],
    /// At most 1: beyond this fraction of the wanted parts, triangles that cross the whole cell
    /// would be listed too often for any reduction of triangles per cell to pay off.
    pub share: f64,
}

impl Cut {
    /// A cell with these sides that lists triangles of these areas, see [`areas`].
    pub(crate) fn new(
        side: [f64; 3],
        areas: impl ExactSizeIterator<Item = f32> + Clone,
        lambda: f64,
    ) -> Self {
        // A flat cell is no reason for ever smaller parts.
        let longest = side.iter().copied().fold(0.0, f64::max);
        let side = side.map(|s| s.max(longest / 16.0));
        let count = areas.len();
        let wanted = cleary(side, count, lambda);
        // Parts that all list most triangles only lengthen the walk.
        if 2 * areas.clone().filter(|area| area.is_infinite()).count() > count {
            return Self { wanted, share: 0.0 };
        }
        let volume = side.iter().product::<f64>();
        let section = (volume / side.iter().copied().fold(longest, f64::min)) as f32;
        let area = areas.map(|a| f64::from(a.min(section))).sum::<f64>();
        // A surface crosses about one and a half times its area in faces of parts.
        let face = (volume / wanted.iter().product::<f64>()).powf(2.0 / 3.0);
        let copies = 1.5 * area / face / count as f64;
        Self {
            wanted,
            share: ((MOST_COPIES - 1.0) / copies).sqrt().min(1.0),
        }
    }
}

/// Areas of all triangles; infinite for a needle so thin that every part of a cell of `grid` lists it.
pub(crate) fn areas(grid: &Grid, soup: &TriangleSoup) -> Vec<f32> {
    let area = |record: &TriangleRecord| {
        let margins = raster::margin_of(record) as f32;
        // Its box bounds what lists it, however much its cells are grown.
        let (extent, margin) = (record.bounds().extent(), grid.margin);
        let reach = |a: usize| (margin[a] * margins).min(2.0 * (extent[a] + 2.0 * margin[a]));
        if (0..3).all(|a| reach(a) >= grid.cell[a]) {
            return f32::INFINITY;
        }
        let [e, f] = record.edges();
        0.5 * cross(e, f).iter().map(|n| n * n).sum::<f64>().sqrt() as f32
    };
    soup.records.par_iter().map(area).collect()
}

fn bounds_of(records: &[TriangleRecord]) -> Bounds {
    let around = |chunk: &[TriangleRecord]| {
        chunk.iter().fold(Bounds::EMPTY, |bounds, record| {
            let [min, max] = raster::extremes(&record.vertices());
            bounds.union(&Bounds { min, max })
        })
    };
    let boxes: Vec<Bounds> = records.par_chunks(16_384).map(around).collect();
    boxes.iter().fold(Bounds::EMPTY, |b, c| b.union(c))
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Grid {
    pub bounds: Bounds,
    pub resolution: [u32; 3],
    /// Sides of a cell, scene units.
    pub cell: [f32; 3],
    pub inverse_cell: [f32; 3],
    /// See [`GridBox::margin`].
    pub margin: [f32; 3],
}

impl Grid {
    pub(crate) fn new(grid_box: &GridBox, resolution: [u32; 3]) -> Self {
        let extent = grid_box.bounds.extent();
        Self::with_cells(
            grid_box.bounds.min,
            std::array::from_fn(|a| extent[a] / resolution[a] as f32),
            resolution,
            grid_box.margin,
        )
    }

    /// The cells from `lowest` on, `size` along each axis, subdivided into `resolution` cells.
    pub(crate) fn part(&self, lowest: [u32; 3], size: [u32; 3], resolution: [u32; 3]) -> Self {
        Self::with_cells(
            std::array::from_fn(|a| self.plane(a, lowest[a])),
            std::array::from_fn(|a| self.cell[a] * (size[a] as f32 / resolution[a] as f32)),
            resolution,
            self.margin,
        )
    }

    fn with_cells(low: [f32; 3], cell: [f32; 3], resolution: [u32; 3], margin: [f32; 3]) -> Self {
        let high = std::array::from_fn(|a| low[a] + resolution[a] as f32 * cell[a]);
        Self {
            bounds: Bounds {
                min: low,
                max: high,
            },
            resolution,
            cell,
            inverse_cell: cell.map(|c| 1.0 / c),
            margin,
        }
    }

    pub(crate) fn cells(&self) -> u64 {
        self.resolution.iter().map(|&r| u64::from(r)).product()
    }

    /// Index of a cell; x varies fastest.
    pub(crate) fn index(&self, [x, y, z]: [u32; 3]) -> u32 {
        (z * self.resolution[1] + y) * self.resolution[0] + x
    }

    pub(crate) fn coordinates(&self, index: u32) -> [u32; 3] {
        let [nx, ny, _] = self.resolution;
        [index % nx, index / nx % ny, index / nx / ny]
    }

    /// Cell coordinate of a position along one axis, clamped to the grid.
    pub(crate) fn coordinate(&self, axis: usize, position: f32) -> u32 {
        let cells = (position - self.bounds.min[axis]) * self.inverse_cell[axis];
        clamped(cells, self.resolution[axis])
    }

    pub(crate) fn plane(&self, axis: usize, coordinate: u32) -> f32 {
        self.bounds.min[axis] + coordinate as f32 * self.cell[axis]
    }

    pub(crate) fn uniform(&self) -> (&'static str, UniformValues) {
        (
            "grid",
            UniformValues::new()
                .vec("low", &self.bounds.min)
                .vec("high", &self.bounds.max)
                .vec("cell", &self.cell)
                .vec("inverse_cell", &self.inverse_cell)
                .uvec("resolution", &self.resolution),
        )
    }

    /// Position of the ray at distance `t`, in cells from the low corner.
    pub(crate) fn in_cells(&self, ray: &Ray, t: f32) -> [f32; 3] {
        std::array::from_fn(|a| {
            (ray.origin[a] + ray.direction[a] * t - self.bounds.min[a]) * self.inverse_cell[a]
        })
    }

    /// Distances to the planes `planes` of the three axes, counted in cells from the low corner.
    pub(crate) fn distances(&self, ray: &Ray, inverse: [f32; 3], planes: [f32; 3]) -> [f32; 3] {
        std::array::from_fn(|a| {
            (self.bounds.min[a] + planes[a] * self.cell[a] - ray.origin[a]) * inverse[a]
        })
    }
}

/// The nearest cell of `0..resolution` to a position in cells.
pub(crate) fn clamped(position: f32, resolution: u32) -> u32 {
    let last = (resolution - 1) as f32;
    let position = if position > 0.0 { position } else { 0.0 };
    (if position < last { position } else { last }) as u32
}

/// The axis exited first; the lowest on a tie.
pub(crate) fn first_axis(next: [f32; 3], leave: f32) -> usize {
    if next[0] == leave {
        0
    } else if next[1] == leave {
        1
    } else {
        2
    }
}

pub(crate) fn outside(cell: [u32; 3], resolution: [u32; 3]) -> bool {
    (0..3).any(|a| cell[a] >= resolution[a])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_that_reaches_beyond_a_cell_counts_as_one_across_it() {
        let cut = |area: f32| Cut::new([1.0, 2.0, 4.0], [area].into_iter(), 64.0);
        // The largest section of the cell is 2 · 4.
        assert_eq!(cut(1e6), cut(8.0));
        assert!(cut(8.0).share < cut(4.0).share);
    }

    #[test]
    fn a_cell_of_needles_that_every_part_would_list_stays_whole() {
        let cut = |needles: usize| {
            let areas = [f32::INFINITY; 4].into_iter().take(needles);
            let areas: Vec<f32> = areas.chain([1e-6; 4]).take(4).collect();
            Cut::new([1.0; 3], areas.into_iter(), 64.0).share
        };
        assert_eq!([cut(0), cut(3), cut(4)], [1.0, 0.0, 0.0]);
        assert!(cut(2) > 0.0);
    }
}
