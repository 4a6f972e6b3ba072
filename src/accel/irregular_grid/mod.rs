//! `irregular-grid`: boxes of voxels of any size, found through a map of voxels. CPU version of
//! `kernels/accel/irregular_grid.wesl`.
//!
//! Source: A. Pérard-Gayot, J. Kalojanov, P. Slusallek, "GPU ray tracing using irregular grids",
//! 2017; parameter defaults are those of the authors' code (hagrid).
//!
//! The build has four phases, one file each: [`cut`] creates voxels where triangles are, [`merge`]
//! joins cells by the surface area heuristic, [`expand`] grows their boxes over neighbours that
//! list nothing more, [`compress`] writes 16 bytes per cell. Voxels have 16-bit coordinates, and a
//! ray keeps its current voxel: on exiting a box it steps across the exit plane in integers, and
//! its other two coordinates may only move forward and within the box.

mod compress;
mod cut;
mod expand;
mod merge;
mod voxels;

use self::voxels::{GridCell, Map};
use super::grid::lists::check_lists;
use super::grid::{COARSER, Grid, check_words, clamped, first_axis, most_words, outside};
use super::structure::prelude::*;
use super::watch;
use raystone_gpu::UniformValues;

/// Bits of an entry for log2 of its block's side; 0: the rest is a cell.
const LOG_BITS: u32 = 2;
/// Number of indices that an entry can address.
const MOST_PLACES: u64 = (1 << (32 - LOG_BITS)) - 1;
const LOG_MASK: u32 = 3;
/// Marks the last reference of a list.
const LAST: u32 = 0x8000_0000;
/// List index of an empty cell.
const EMPTY: u32 = 0xffff_ffff;

parameters! {
    /// How cells are cut, merged and expanded.
    pub struct Options {
        /// top cells per triangle of the scene
        lambda1: f64 = 0.12, in 0.001..=100.0;
        /// voxels of a top cell per triangle in it, rounded up to a power of two an axis
        lambda2: f64 = 2.4, in 0.001..=100.0;
        /// merge on while a round leaves fewer than this part of the cells; 0: not at all
        alpha: f64 = 0.995, in 0.0..=0.9999;
        /// times that boxes grow along each axis
        expansions: u32 = 3, in 0..=16;
        /// levels of the grid: 2 as in the paper; more cut a voxel again where it holds most triangles of
        /// its top cell
        levels: u32 = 3, in 2..=4;
    }
}

pub(crate) struct IrregularGrid;

impl Structure for IrregularGrid {
    const NAME: &'static str = "irregular-grid";
    const DESCRIPTION: &'static str =
        "two-level grid with cells merged by SAH and expanded (Pérard-Gayot et al. 2017)";
    type Parameters = Options;

    fn build(soup: &TriangleSoup, options: &Options, log: &mut BuildLog) -> BuildResult {
        let mut partition = cut::cut(Self::NAME, soup, options, log)?;
        log.phase("merge", || merge::merge(&mut partition, options.alpha));
        log.phase("expand", || {
            expand::expand(&mut partition, options.expansions)
        });
        check_words(
            "cells of an irregular-grid",
            4 * partition.cells.len() as u64,
            log,
        )?;
        let arrays = log.phase("compress", || compress::compress(&partition));
        AccelError::check_limit(
            "map and references of an irregular-grid",
            arrays.words.len() as u64,
            most_words(log).min(MOST_PLACES),
            COARSER,
        )?;
        Ok(Box::new(Built {
            fine: partition.fine,
            shift: partition.map.shift,
            cells: arrays.cells,
            words: arrays.words,
            first_reference: arrays.first_reference,
        }))
    }
}

/// The grid between its phases.
struct Partition {
    fine: Grid,
    map: Map,
    cells: Vec<GridCell>,
    pool: Vec<u32>,
}

struct Built {
    fine: Grid,
    /// A top cell has 2^`shift` voxels along each axis.
    shift: u32,
    /// Four words per cell: coordinates of the lowest voxel and of the one past the highest, 16
    /// bits each, and the index of its list.
    cells: Vec<u32>,
    /// Entries (index << [`LOG_BITS`] | log2), then references, with [`LAST`] at the end of a list.
    words: Vec<u32>,
    first_reference: usize,
}

/// A cell as read by the kernel.
struct Found {
    min: [i32; 3],
    max: [i32; 3],
    list: u32,
}

impl Built {
    /// Top cells along each axis.
    fn top(&self) -> [u32; 3] {
        self.fine.resolution.map(|n| n >> self.shift)
    }

    /// The cell of a voxel; CPU version of the kernel's `find_cell`.
    fn find_cell(&self, voxel: [u32; 3]) -> u32 {
        let mut shift = self.shift;
        let [nx, ny, _] = self.top();
        let [x, y, z] = voxel.map(|v| v >> shift);
        let mut entry = *watch::read(&self.words[((z * ny + y) * nx + x) as usize]);
        loop {
            let log = entry & LOG_MASK;
            if log == 0 {
                return entry >> LOG_BITS;
            }
            shift -= log;
            let [x, y, z] = voxel.map(|v| (v >> shift) & ((1 << log) - 1));
            let place = (entry >> LOG_BITS) + (((z << log) + y) << log) + x;
            entry = *watch::read(&self.words[place as usize]);
        }
    }

    fn cell_words(&self, cell: u32) -> &[u32] {
        &self.cells[4 * cell as usize..4 * cell as usize + 4]
    }

    fn load_cell(&self, cell: u32) -> Found {
        let words = self.cell_words(cell);
        let low = |word: u32| (word & 0xffff) as i32;
        let high = |word: u32| (word >> 16) as i32;
        Found {
            min: [low(words[0]), high(words[0]), low(words[1])],
            max: [high(words[1]), low(words[2]), high(words[2])],
            list: words[3],
        }
    }

    /// References of a list, without the mark.
    fn list(&self, place: u32) -> impl Iterator<Item = u32> {
        let begin = if place == EMPTY {
            self.words.len()
        } else {
            self.first_reference + place as usize
        };
        let mut ended = false;
        self.words[begin..].iter().map_while(move |word| {
            let id = (!ended).then(|| watch::read(word) & !LAST);
            ended = word & LAST != 0;
            id
        })
    }

    fn count(&self) -> usize {
        self.cells.len() / 4
    }

    /// Checks that lists are complete, and that a box lists the same as the cells at its corners.
    fn check_cells(&self) -> Result<(), AccelError> {
        let references = self.words.len() - self.first_reference;
        for number in 0..self.count() as u32 {
            let cell = self.load_cell(number);
            let exists = cell.list == EMPTY || (cell.list as usize) < references;
            ensure!(exists, "cell {number}: its list does not exist");
            let own: Vec<u32> = self.list(cell.list).collect();
            for corner in 0..8 {
                let voxel = std::array::from_fn(|a| {
                    if corner >> a & 1 == 0 {
                        cell.min[a]
                    } else {
                        cell.max[a] - 1
                    }
                });
                let voxel = voxel.map(|v| v as u32);
                let inside = !outside(voxel, self.fine.resolution);
                ensure!(inside, "cell {number} lies outside the grid");
                let other = self.load_cell(self.find_cell(voxel));
                let mut others = self.list(other.list);
                ensure!(
                    others.all(|id| own.binary_search(&id).is_ok()),
                    "cell {number}: voxel {voxel:?} in its box lists more"
                );
            }
        }
        Ok(())
    }
}

impl BuiltAccel for Built {
    fn validate(&self, soup: &TriangleSoup) -> Result<(), AccelError> {
        let last = self.words[self.first_reference..].last();
        let ends = last.is_none_or(|last| last & LAST != 0);
        ensure!(ends, "the last list has no end");
        self.check_cells()?;
        let is_listed = |position: [f32; 3], id: u32| {
            let voxel = std::array::from_fn(|a| self.fine.coordinate(a, position[a]));
            let cell = self.load_cell(self.find_cell(voxel));
            let inside = (0..3).all(|a| {
                let v = voxel[a] as i32;
                cell.min[a] <= v && v < cell.max[a]
            });
            inside && self.list(cell.list).any(|other| other == id)
        };
        let references = self.words[self.first_reference..].iter().map(|w| w & !LAST);
        check_lists(&self.fine, soup, references, is_listed)
    }

    fn buffers(&self) -> GpuBuffers<'_> {
        let voxels = UniformValues::new()
            .u32("shift", self.shift)
            .u32("first_reference", self.first_reference as u32);
        let steps = self.fine.resolution.iter().sum::<u32>() + 1;
        GpuBuffers {
            kernel: "accel/irregular_grid",
            features: Vec::new(),
            arrays: vec![
                NamedWords::new("cells", bytemuck::cast_slice::<u32, [u32; 4]>(&self.cells)),
                NamedWords::new("words", &self.words),
            ],
            uniforms: vec![
                self.fine.uniform(),
                ("voxels", voxels),
                limits(steps as usize, self.count()),
            ],
            constants: Vec::new(),
        }
    }

    fn stats(&self) -> StructureStats {
        let lists = self.cells.chunks_exact(4).map(|words| words[3]);
        StructureStats {
            nodes: self.count() as u64,
            bytes: self.buffers().bytes(),
            ..StructureStats::of_leaves(lists.map(|list| self.list(list).count()))
        }
    }

    fn cpu_twin<'a>(&'a self, soup: &'a TriangleSoup) -> Option<Box<dyn CpuTwin + 'a>> {
        Some(Box::new(Twin(self, soup)))
    }
}

impl Traverse for Built {
    fn trace(&self, soup: &TriangleSoup, mut walk: Walk) -> Hit {
        let grid = &self.fine;
        let Some(enter) = walk.enter(&grid.bounds) else {
            return walk.hit;
        };
        let ray = walk.ray;
        let inverse = walk.inverse;
        let forward = inverse.map(|i| i >= 0.0);
        let entry = grid.in_cells(&ray, enter);
        let mut voxel: [u32; 3] = std::array::from_fn(|a| clamped(entry[a], grid.resolution[a]));
        loop {
            let place = self.find_cell(voxel);
            walk.visit(place as usize, self.cell_words(place));
            let cell = self.load_cell(place);
            for id in self.list(cell.list) {
                walk.test(&soup.records[id as usize]);
            }
            if walk.is_answered() {
                return walk.hit;
            }
            let planes = std::array::from_fn(|a| {
                (if forward[a] { cell.max[a] } else { cell.min[a] }) as f32
            });
            let next = grid.distances(&ray, *inverse, planes);
            let leave = next[0].min(next[1]).min(next[2]);
            // The exit must lie clearly beyond the hit: the next cell may hold an equally near one.
            if walk.hit.t * inverse.pad < leave {
                return walk.hit;
            }
            let axis = first_axis(next, leave);
            let place = grid.in_cells(&ray, leave);
            voxel = std::array::from_fn(|a| {
                if a == axis {
                    return (if forward[a] {
                        cell.max[a]
                    } else {
                        cell.min[a] - 1
                    }) as u32;
                }
                // Forward only, and within the box.
                let here = voxel[a] as i32;
                let low = if forward[a] { here } else { cell.min[a] };
                let high = if forward[a] { cell.max[a] - 1 } else { here };
                place[a].max(low as f32).min(high as f32) as u32
            });
            if outside(voxel, grid.resolution) {
                return walk.hit;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::{random_triangle, soup};
    use raystone_core::random::Pcg32;

    /// Triangles of all sizes, clustered in one corner.
    fn bunched() -> TriangleSoup {
        let mut random = Pcg32::new(3);
        soup((0..400).map(|id| {
            let spread = if id % 2 == 0 { 0.1 } else { 4.0 };
            random_triangle(&mut random, spread, [0.02, 0.2, 3.0][id % 3])
        }))
    }

    fn cut_soup() -> Partition {
        let log = &mut BuildLog::default();
        cut::cut("irregular-grid", &bunched(), &Options::default(), log)
            .unwrap_or_else(|e| panic!("{e}"))
    }

    fn volume(cells: &[GridCell]) -> u64 {
        let side = |c: &GridCell, a: usize| u64::from(c.max[a] - c.min[a]);
        cells
            .iter()
            .map(|c| side(c, 0) * side(c, 1) * side(c, 2))
            .sum()
    }

    #[test]
    fn boxes_grow_only_over_cells_that_list_nothing_more() {
        let mut partition = cut_soup();
        merge::merge(&mut partition, 0.995);
        let tiles = partition.cells.clone();
        let before = volume(&tiles);
        expand::expand(&mut partition, 3);
        assert!(volume(&partition.cells) > before);
        let overlap =
            |a: &GridCell, b: &GridCell| (0..3).all(|i| a.min[i] < b.max[i] && b.min[i] < a.max[i]);
        let mut foreign = 0;
        for grown in &partition.cells {
            for tile in &tiles {
                let lists = [tile, grown].map(|c| c.list(&partition.pool));
                if overlap(grown, tile) {
                    assert!(
                        voxels::is_subset(lists[0], lists[1]),
                        "{grown:?} over {tile:?}"
                    );
                } else {
                    foreign += usize::from(!voxels::is_subset(lists[0], lists[1]));
                }
            }
        }
        assert!(
            foreign > 0,
            "every list is a part of every other: the test is blunt"
        );
    }
}
