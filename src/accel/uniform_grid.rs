//! `uniform-grid`: equal cells with lists of triangles, traversed by a 3D-DDA. CPU version of
//! `kernels/accel/uniform_grid.wesl`.
//!
//! Sources: J. Cleary et al., "Multiprocessor ray tracing", 1986 (resolution); J. Amanatides, A.
//! Woo, "A fast voxel traversal algorithm", 1987; K. Zuiderveld et al., "Acceleration of ray
//! casting using 3D distance transforms", 1992 (skipping empty space).
//!
//! A hit beyond the current cell is stored and the traversal continues until the cell's exit lies beyond the nearest
//! hit. With `skip = chebyshev` an empty cell stores the distance to the nearest list, and the traversal skips the
//! whole empty cube around it at once.

use super::grid::lists::{Lists, check_lists, check_starts};
use super::grid::{Grid, GridBox, check_words, clamped, distance, first_axis, outside};
use super::structure::prelude::*;
use rayon::prelude::*;

/// Bits of a cell's word for the start of its list when the others hold the distance.
const START_BITS: u32 = 25;
const START_MASK: u32 = 0x01ff_ffff;

parameters! {
    /// Resolution, and how empty space is left.
    pub struct Options {
        /// cells per triangle: resolution = extent · cbrt(λ · triangles / volume)
        lambda: f64 = 5.0, in 0.01..=1000.0;
        /// how empty space is left: cell by cell, or by the Chebyshev distance to the nearest list
        skip: Skip = Skip::None;
        /// list a triangle only where it overlaps the cell, not where its box does
        exact_overlap: bool = true;
    }

    /// How empty space is left.
    pub(crate) enum Skip {
        None = "none",
        /// By the Chebyshev distance to the nearest list.
        Chebyshev = "chebyshev",
    }
}

pub(crate) struct UniformGrid;

impl Structure for UniformGrid {
    const NAME: &'static str = "uniform-grid";
    const DESCRIPTION: &'static str = "equal cells by Cleary's rule, 3D-DDA (Amanatides & Woo 1987), empty cubes skipped on demand";
    type Parameters = Options;

    fn build(soup: &TriangleSoup, options: &Options, log: &mut BuildLog) -> BuildResult {
        let grid_box = log.phase("bounds", || GridBox::new(soup));
        let resolution = grid_box.resolution(soup.records.len(), options.lambda, 4096);
        let grid = Grid::new(&grid_box, resolution);
        let exact = options.exact_overlap;
        let Lists { starts, references } = Lists::new(Self::NAME, &grid, soup, exact, log)?;
        check_words("cells of a uniform-grid", starts.len() as u64, log)?;
        let skip = options.skip == Skip::Chebyshev;
        if skip {
            let what =
                "references of a uniform-grid with distances, which leave 25 bits to a place";
            AccelError::check_limit(
                what,
                references.len() as u64,
                START_MASK,
                "set `skip = \"none\"`",
            )?;
        }
        let mut built = Built {
            grid,
            cells: starts,
            references,
            skip,
        };
        if built.skip {
            log.phase("distances", || built.add_distances());
        }
        Ok(Box::new(built))
    }
}

struct Built {
    grid: Grid,
    /// Cell c lists `references[start(c)..start(c + 1)]`; see [`START_BITS`].
    cells: Vec<u32>,
    references: Vec<u32>,
    skip: bool,
}

impl Built {
    fn add_distances(&mut self) {
        let starts = &self.cells;
        let field = distance::chebyshev(self.grid.resolution, |c| starts[c] < starts[c + 1]);
        self.cells
            .par_iter_mut()
            .zip(field.par_iter())
            .for_each(|(cell, distance)| *cell |= u32::from(*distance) << START_BITS);
    }

    fn start(&self, cell: usize) -> usize {
        let mask = if self.skip { START_MASK } else { u32::MAX };
        (self.cells[cell] & mask) as usize
    }

    /// Steps to the nearest list if distances are stored, at least 1.
    fn reach(&self, cell: usize) -> i32 {
        if self.skip {
            (self.cells[cell] >> START_BITS).max(1) as i32
        } else {
            1
        }
    }

    fn list(&self, cell: usize) -> &[u32] {
        &self.references[self.start(cell)..self.start(cell + 1)]
    }

    fn check_order(&self) -> Result<(), AccelError> {
        let cells = self.grid.cells() as usize;
        let starts = (0..self.cells.len()).map(|cell| self.start(cell));
        check_starts(starts, cells, self.references.len())?;
        for cell in 0..cells {
            let is_near = self.cells[cell] >> START_BITS == 0;
            let agree = !self.skip || self.list(cell).is_empty() != is_near;
            ensure!(agree, "cell {cell}: its distance contradicts its list");
        }
        Ok(())
    }
}

impl BuiltAccel for Built {
    fn validate(&self, soup: &TriangleSoup) -> Result<(), AccelError> {
        self.check_order()?;
        let is_listed = |position: [f32; 3], id: u32| {
            let cell = std::array::from_fn(|a| self.grid.coordinate(a, position[a]));
            let list = self.list(self.grid.index(cell) as usize);
            list.binary_search(&id).is_ok()
        };
        check_lists(&self.grid, soup, self.references.iter().copied(), is_listed)
    }

    fn buffers(&self) -> GpuBuffers<'_> {
        let steps = self.grid.resolution.iter().sum::<u32>() + 1;
        GpuBuffers {
            kernel: "accel/uniform_grid",
            features: if self.skip { vec!["skip"] } else { Vec::new() },
            arrays: vec![
                NamedWords::new("cells", &self.cells),
                NamedWords::new("references", &self.references),
            ],
            uniforms: vec![
                self.grid.uniform(),
                limits(steps as usize, self.references.len()),
            ],
            constants: Vec::new(),
        }
    }

    fn stats(&self) -> StructureStats {
        let lengths = (0..self.grid.cells() as usize).map(|cell| self.list(cell).len());
        StructureStats {
            nodes: self.grid.cells(),
            bytes: self.buffers().bytes(),
            ..StructureStats::of_leaves(lengths)
        }
    }

    fn cpu_twin<'a>(&'a self, soup: &'a TriangleSoup) -> Option<Box<dyn CpuTwin + 'a>> {
        Some(Box::new(Twin(self, soup)))
    }
}

/// The ray's exit from the cube of empty cells around `cell`, which extends `reach` cells.
fn jump(
    grid: &Grid,
    ray: &Ray,
    leave: f32,
    reach: i32,
    cell: [u32; 3],
    forward: [bool; 3],
) -> [u32; 3] {
    let place = grid.in_cells(ray, leave);
    std::array::from_fn(|a| {
        let here = cell[a] as i32;
        let low = if forward[a] { here } else { here + 1 - reach };
        let high = if forward[a] { here + reach - 1 } else { here };
        place[a].max(low as f32).min(high as f32) as i32 as u32
    })
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
        let mut cell: [u32; 3] = std::array::from_fn(|a| clamped(entry[a], grid.resolution[a]));
        loop {
            let index = grid.index(cell) as usize;
            // A cell ends where the next one begins.
            walk.read(&self.cells[index + 1]);
            walk.visit(index, &self.cells[index]);
            walk.test_list(soup, self.list(index));
            if walk.is_answered() {
                return walk.hit;
            }
            // Cells that can be skipped at once: the cube of empty ones, or this cell alone.
            let reach = self.reach(index);
            let planes: [f32; 3] = std::array::from_fn(|a| {
                let plane = if forward[a] { reach } else { 1 - reach };
                (cell[a] as i32 + plane) as f32
            });
            let next = grid.distances(&ray, *inverse, planes);
            let leave = next[0].min(next[1]).min(next[2]);
            // The exit must lie clearly beyond the hit: the next cell may hold an equally near one.
            if walk.hit.t * inverse.pad < leave {
                return walk.hit;
            }
            let axis = first_axis(next, leave);
            let step = if forward[axis] { reach } else { -reach };
            let beyond = cell[axis].wrapping_add_signed(step);
            if reach > 1 {
                cell = jump(grid, &ray, leave, reach, cell, forward);
            }
            cell[axis] = beyond;
            if outside(cell, grid.resolution) {
                return walk.hit;
            }
        }
    }
}
