//! `two-level-grid`: a coarse grid whose occupied cells are subdivided by grids of their own. CPU
//! version of `kernels/accel/two_level_grid.wesl`.
//!
//! Source: J. Kalojanov, M. Billeter, P. Slusallek, "Two-level grids for ray tracing on GPUs",
//! 2011. Top cells by Cleary's rule with λ₁; a top cell with n triangles is subdivided by the same
//! rule with λ₂. One loop walks both levels: it steps through the parts of a top cell until it
//! exits the cell, and then finds its position in the next one.

use super::grid::lists::{Lists, PartLists, check_lists, check_starts, in_runs};
use super::grid::{
    COARSER, Cut, Grid, GridBox, areas, clamped, finest, first_axis, most_words, outside,
};
use super::structure::prelude::*;
use super::watch;
use rayon::prelude::*;

/// Maximum parts of a top cell along an axis: its resolution takes ten bits per axis.
const MOST_PARTS: u32 = 1023;
/// Bits of a top cell's resolution for each axis.
const PART_BITS: u32 = 10;
const PART_MASK: u32 = 1023;

parameters! {
    /// Resolutions of the two levels.
    pub struct Options {
        /// top cells per triangle of the scene
        lambda1: f64 = 0.12, in 0.001..=1000.0;
        /// parts of a top cell per triangle in it
        lambda2: f64 = 2.4, in 0.001..=1000.0;
    }
}

pub(crate) struct TwoLevelGrid;

impl Structure for TwoLevelGrid {
    const NAME: &'static str = "two-level-grid";
    const DESCRIPTION: &'static str =
        "a coarse grid whose occupied cells are grids of their own (Kalojanov et al. 2011)";
    type Parameters = Options;

    fn build(soup: &TriangleSoup, options: &Options, log: &mut BuildLog) -> BuildResult {
        let grid_box = log.phase("bounds", || GridBox::new(soup));
        let resolution = grid_box.resolution(soup.records.len(), options.lambda1, 4096);
        let grid = Grid::new(&grid_box, resolution);
        let top = Lists::new(Self::NAME, &grid, soup, true, log)?;
        let built = {
            let most = most_words(log);
            log.phase("parts", || cut(grid, soup, &top, options.lambda2, most))?
        };
        Ok(Box::new(built))
    }
}

/// Parts along each axis of a top cell that lists triangles of these areas.
fn parts(grid: &Grid, areas: impl ExactSizeIterator<Item = f32> + Clone, lambda: f64) -> [u32; 3] {
    let side = grid.cell.map(f64::from);
    let Cut { wanted, share } = Cut::new(side, areas, lambda);
    std::array::from_fn(|a| {
        let most = finest(side[a], grid.margin[a]).min(f64::from(MOST_PARTS));
        (wanted[a] * share).round().clamp(1.0, most) as u32
    })
}

/// Subdivided top cells of one task: words of each top cell with indices relative to the run, the
/// list starts of all parts, and the lists.
#[derive(Default)]
struct Run {
    top: Vec<[u32; 2]>,
    starts: Vec<u32>,
    references: Vec<u32>,
}

fn cut(
    grid: Grid,
    soup: &TriangleSoup,
    top: &Lists,
    lambda: f64,
    most: u64,
) -> Result<Built, AccelError> {
    let tops = grid.cells() as usize;
    let areas = areas(&grid, soup);
    let resolutions = |cell: usize| {
        let ids = top.of(cell).iter();
        parts(&grid, ids.map(|&id| areas[id as usize]), lambda)
    };
    let all_parts = |cell: usize| resolutions(cell).map(u64::from).iter().product::<u64>();
    let occupied = |cell: &usize| !top.of(*cell).is_empty();
    let all = (0..tops).into_par_iter().filter(occupied);
    let needed: u64 = all.map(all_parts).sum();
    AccelError::check_limit(
        "cells of a two-level-grid",
        2 * tops as u64 + needed + 1,
        most,
        COARSER,
    )?;

    let cut_run = |cells: std::ops::Range<usize>| {
        let mut run = Run::default();
        let mut lists = PartLists::default();
        for cell in cells {
            let ids = top.of(cell);
            if ids.is_empty() {
                run.top.push([run.starts.len() as u32, 0]);
                continue;
            }
            let [x, y, z] = resolutions(cell);
            let part = grid.part(grid.coordinates(cell as u32), [1; 3], [x, y, z]);
            lists.fill(&part, soup, ids);
            let packed = x | y << PART_BITS | z << (2 * PART_BITS);
            run.top.push([run.starts.len() as u32, packed]);
            let begin = run.references.len() as u32;
            let Lists { starts, references } = &lists.lists;
            let (_, starts) = starts.split_last().unwrap_or((&0, &[]));
            run.starts.extend(starts.iter().map(|s| begin + s));
            run.references.extend_from_slice(references);
        }
        run
    };
    let runs = in_runs(tops, cut_run);
    let references: u64 = runs.iter().map(|r| r.references.len() as u64).sum();
    AccelError::check_limit("references of a two-level-grid", references, most, COARSER)?;
    Ok(Built::join(
        grid,
        &runs,
        needed as usize,
        references as usize,
    ))
}

struct Built {
    grid: Grid,
    /// Two words per top cell: the index of its first part, and its resolution (0: empty). Then a
    /// word per part: the start of its list; the next word is its end.
    cells: Vec<u32>,
    references: Vec<u32>,
}

impl Built {
    fn join(grid: Grid, runs: &[Run], parts: usize, references: usize) -> Self {
        let first_part = 2 * grid.cells() as usize;
        let mut cells = Vec::with_capacity(first_part + parts + 1);
        let mut place = first_part as u32;
        for run in runs {
            cells.extend(
                run.top
                    .iter()
                    .flat_map(|[first, packed]| [place + first, *packed]),
            );
            place += run.starts.len() as u32;
        }
        let mut all = Vec::with_capacity(references);
        for run in runs {
            let begin = all.len() as u32;
            cells.extend(run.starts.iter().map(|start| begin + start));
            all.extend_from_slice(&run.references);
        }
        cells.push(references as u32);
        Self {
            grid,
            cells,
            references: all,
        }
    }

    fn first_part(&self) -> usize {
        2 * self.grid.cells() as usize
    }

    /// Index of the first part of a top cell, and its resolution: 0 if it is empty.
    fn top(&self, cell: [u32; 3]) -> (u32, [u32; 3]) {
        let index = 2 * self.grid.index(cell) as usize;
        let words = watch::read(&self.cells[index..index + 2]);
        let packed = words[1];
        let resolution = [0, PART_BITS, 2 * PART_BITS].map(|shift| packed >> shift & PART_MASK);
        (words[0], resolution)
    }

    fn list(&self, place: usize) -> &[u32] {
        &self.references[self.cells[place] as usize..self.cells[place + 1] as usize]
    }

    /// List starts of all parts, and the end of the last.
    fn starts(&self) -> &[u32] {
        &self.cells[self.first_part()..]
    }

    fn check_order(&self) -> Result<(), AccelError> {
        let mut place = self.first_part() as u32;
        for cell in 0..self.grid.cells() as u32 {
            let (first, resolution) = self.top(self.grid.coordinates(cell));
            ensure!(
                first == place,
                "top cell {cell}: its parts are those of another"
            );
            place += resolution.iter().product::<u32>();
        }
        let (parts, starts) = (place as usize - self.first_part(), self.starts());
        let starts = starts.iter().map(|start| *start as usize);
        check_starts(starts, parts, self.references.len())
    }
}

impl BuiltAccel for Built {
    fn validate(&self, soup: &TriangleSoup) -> Result<(), AccelError> {
        self.check_order()?;
        let is_listed = |position: [f32; 3], id: u32| {
            let cell = std::array::from_fn(|a| self.grid.coordinate(a, position[a]));
            let (first, resolution) = self.top(cell);
            if resolution[0] == 0 {
                return false;
            }
            let part = self.grid.part(cell, [1; 3], resolution);
            let at = std::array::from_fn(|a| part.coordinate(a, position[a]));
            let list = self.list((first + part.index(at)) as usize);
            list.binary_search(&id).is_ok()
        };
        check_lists(&self.grid, soup, self.references.iter().copied(), is_listed)
    }

    fn buffers(&self) -> GpuBuffers<'_> {
        // Along an axis a ray passes every part of a column once, and locates its part again
        // whenever it enters another top cell.
        let column = |a: usize| {
            let tops = 0..self.grid.cells() as u32;
            let parts = tops.map(|cell| self.top(self.grid.coordinates(cell)).1[a].max(1));
            self.grid.resolution[a] as usize * (parts.max().unwrap_or(1) as usize + 2)
        };
        let steps = 2 * (0..3).map(column).sum::<usize>();
        GpuBuffers {
            kernel: "accel/two_level_grid",
            features: Vec::new(),
            arrays: vec![
                NamedWords::new("cells", &self.cells),
                NamedWords::new("references", &self.references),
            ],
            uniforms: vec![self.grid.uniform(), limits(steps, self.references.len())],
            constants: Vec::new(),
        }
    }

    fn stats(&self) -> StructureStats {
        let lengths = self.starts().windows(2).map(|w| (w[1] - w[0]) as usize);
        StructureStats {
            nodes: self.grid.cells() + lengths.len() as u64,
            depth: Some(1),
            bytes: self.buffers().bytes(),
            ..StructureStats::of_leaves(lengths)
        }
    }

    fn cpu_twin<'a>(&'a self, soup: &'a TriangleSoup) -> Option<Box<dyn CpuTwin + 'a>> {
        Some(Box::new(Twin(self, soup)))
    }
}

fn find_part(place: [f32; 3], top: [u32; 3], parts: [u32; 3]) -> [u32; 3] {
    std::array::from_fn(|a| clamped((place[a] - top[a] as f32) * parts[a] as f32, parts[a]))
}

impl Traverse for Built {
    fn trace(&self, soup: &TriangleSoup, mut walk: Walk) -> Hit {
        let grid = &self.grid;
        let Some(enter) = walk.enter(&grid.bounds) else {
            return walk.hit;
        };
        let ray = walk.ray;
        let inverse = walk.inverse;
        let forward = inverse.map(|i| i >= 0.0);
        let entry = grid.in_cells(&ray, enter);
        let mut top: [u32; 3] = std::array::from_fn(|a| clamped(entry[a], grid.resolution[a]));
        let (mut first, mut resolution) = self.top(top);
        let mut parts = resolution.map(|r| r.max(1));
        let mut part = find_part(entry, top, parts);
        loop {
            // Index relative to the cell's first part.
            let place = (first + (part[2] * parts[1] + part[1]) * parts[0] + part[0]) as usize;
            let is_occupied = resolution[0] != 0;
            let ends = if is_occupied { place..place + 2 } else { 0..0 };
            walk.visit(first as usize, &self.cells[ends]);
            if is_occupied {
                walk.test_list(soup, self.list(place));
            }
            if walk.is_answered() {
                return walk.hit;
            }
            let planes = std::array::from_fn(|a| {
                top[a] as f32 + (part[a] + u32::from(forward[a])) as f32 / parts[a] as f32
            });
            let next = grid.distances(&ray, *inverse, planes);
            let leave = next[0].min(next[1]).min(next[2]);
            // The exit must lie clearly beyond the hit: the next cell may hold an equally near one.
            if walk.hit.t * inverse.pad < leave {
                return walk.hit;
            }
            let axis = first_axis(next, leave);
            let step = if forward[axis] { 1 } else { -1 };
            part[axis] = part[axis].wrapping_add_signed(step);
            if part[axis] < parts[axis] {
                continue;
            }
            top[axis] = top[axis].wrapping_add_signed(step);
            if outside(top, grid.resolution) {
                return walk.hit;
            }
            (first, resolution) = self.top(top);
            parts = resolution.map(|r| r.max(1));
            part = find_part(grid.in_cells(&ray, leave), top, parts);
            part[axis] = if forward[axis] { 0 } else { parts[axis] - 1 };
        }
    }
}
