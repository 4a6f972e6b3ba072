//! `uniform-grid`: equal cells with lists of triangles, walked by a 3D-DDA. Twin of
//! `kernels/accel/uniform_grid.wesl`.
//!
//! Sources: J. Cleary et al., "Multiprocessor ray tracing", 1986 (resolution); J. Amanatides,
//! A. Woo, "A fast voxel traversal algorithm", 1987; K. Zuiderveld et al., "Acceleration of ray
//! casting using 3D distance transforms", 1992 (skipping empty space).
//!
//! A hit beyond the present cell is kept and the walk goes on until the cell's exit lies behind the
//! nearest hit. With `skip = chebyshev` an empty cell knows how far the nearest list is, and the walk
//! leaves the whole empty cube around it at once.

use super::bounds::enter_box;
use super::grid::lists::{Lists, check_lists};
use super::grid::{Frame, Grid, check_words, clamped, distance, first_axis, outside};
use super::ray::{Hit, NO_HIT, Ray};
use super::triangle::intersect_triangle;
use super::{
    AccelError, AccelKind, BuildLog, BuiltAccel, Counters, CpuTwin, GpuBuffers, NamedWords,
    TriangleSoup,
};
use crate::accel::StructureStats;
use crate::params::{ParamRange, ParamValue, Parameter, ParameterSchema, Params};
use rayon::prelude::*;

/// Bits of a cell's word that hold the begin of its list; the others hold the distance.
const START_BITS: u32 = 25;
const START_MASK: u32 = 0x01ff_ffff;

/// The registry entry.
pub struct UniformGrid;

impl AccelKind for UniformGrid {
    fn name(&self) -> &'static str {
        "uniform-grid"
    }

    fn description(&self) -> &'static str {
        "equal cells by Cleary's rule, 3D-DDA (Amanatides & Woo 1987), empty cubes skipped on demand"
    }

    fn parameters(&self) -> ParameterSchema {
        vec![
            Parameter {
                name: "lambda",
                description: "cells per triangle: resolution = extent · cbrt(λ · triangles / volume)",
                default: ParamValue::Number(5.0),
                range: ParamRange::Number {
                    min: 0.01,
                    max: 1000.0,
                },
            },
            Parameter {
                name: "skip",
                description: "how empty space is left: cell by cell, or by the Chebyshev distance to \
                              the nearest list",
                default: ParamValue::Name("none".into()),
                range: ParamRange::Choice(&["none", "chebyshev"]),
            },
            Parameter {
                name: "exact_overlap",
                description: "list a triangle only where it overlaps the cell, not where its box does",
                default: ParamValue::Flag(true),
                range: ParamRange::Flag,
            },
        ]
    }

    fn build(
        &self,
        soup: &TriangleSoup,
        params: &Params,
        log: &mut BuildLog,
    ) -> Result<Box<dyn BuiltAccel>, AccelError> {
        let params = &params.completed(&self.parameters())?;
        let frame = log.phase("bounds", || Frame::new(soup));
        let resolution = frame.resolution(soup.records.len(), params.number("lambda"), 4096);
        let grid = Grid::new(&frame, resolution);
        let exact = params.flag("exact_overlap");
        let Lists { starts, references } = Lists::new(self.name(), &grid, soup, exact, log)?;
        check_words("cells of a uniform-grid", starts.len() as u64)?;
        let mut built = Built {
            grid,
            cells: starts,
            references,
            skip: params.name("skip") == "chebyshev",
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
        (self.cells[cell] & START_MASK) as usize
    }

    /// Steps to the nearest list where distances are kept, at least 1.
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
        let wrong = |text: String| Err(AccelError::Invalid(text));
        let cells = self.grid.cells() as usize;
        if self.cells.len() != cells + 1 || self.start(cells) != self.references.len() {
            return wrong("the cells do not cover the references".to_owned());
        }
        for cell in 0..cells {
            if self.start(cell) > self.start(cell + 1) {
                return wrong(format!("cell {cell}: its list runs backwards"));
            }
            if self.skip && self.list(cell).is_empty() == (self.cells[cell] >> START_BITS == 0) {
                return wrong(format!("cell {cell}: its distance contradicts its list"));
            }
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
                NamedWords {
                    name: "cells",
                    words: self.cells.as_slice().into(),
                    element_bytes: 4,
                },
                NamedWords {
                    name: "references",
                    words: self.references.as_slice().into(),
                    element_bytes: 4,
                },
            ],
            uniforms: vec![
                self.grid.uniform(),
                super::limits(steps as usize, self.references.len()),
            ],
            constants: Vec::new(),
        }
    }

    fn stats(&self) -> StructureStats {
        let cells = self.grid.cells() as usize;
        let lengths = || (0..cells).map(|cell| self.list(cell).len());
        StructureStats {
            nodes: cells as u64,
            leaves: lengths().filter(|&l| l > 0).count() as u64,
            references: self.references.len() as u64,
            leaf_histogram: super::leaf_histogram(lengths()),
            bytes: self.buffers().bytes(),
            ..Default::default()
        }
    }

    fn cpu_twin<'a>(&'a self, soup: &'a TriangleSoup) -> Option<Box<dyn CpuTwin + 'a>> {
        Some(Box::new(Twin { built: self, soup }))
    }
}

/// Where the ray leaves the cube of empty cells around `cell`, which reaches `reach` cells far.
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

struct Twin<'a> {
    built: &'a Built,
    soup: &'a TriangleSoup,
}

impl Twin<'_> {
    fn trace(&self, ray: &Ray, any: bool, counters: &mut Counters) -> Hit {
        let grid = &self.built.grid;
        let ray = &self.soup.intersection.raised(ray);
        let inverse = self.soup.intersection.inverse(ray.direction);
        let mut hit = Hit::miss(ray);
        counters.box_tests += 1;
        let Some(enter) = enter_box(&grid.bounds, ray, inverse, ray.t_max) else {
            return hit;
        };
        let forward = inverse.map(|i| i >= 0.0);
        let entry = grid.in_cells(ray, enter);
        let mut cell: [u32; 3] = std::array::from_fn(|a| clamped(entry[a], grid.resolution[a]));
        loop {
            let index = grid.index(cell) as usize;
            counters.visit(index);
            for &id in self.built.list(index) {
                counters.triangle_tests += 1;
                intersect_triangle(&self.soup.records[id as usize], ray, inverse, &mut hit);
            }
            if any && hit.triangle != NO_HIT {
                return hit;
            }
            // Cells that can be left at once: the cube of empty ones, or this cell alone.
            let reach = self.built.reach(index);
            let planes: [f32; 3] = std::array::from_fn(|a| {
                let plane = if forward[a] { reach } else { 1 - reach };
                (cell[a] as i32 + plane) as f32
            });
            let next = grid.distances(ray, *inverse, planes);
            let leave = next[0].min(next[1]).min(next[2]);
            // The exit must lie clearly behind the hit: an equally near one may wait next door.
            if hit.t * inverse.pad < leave {
                return hit;
            }
            let axis = first_axis(next, leave);
            let step = if forward[axis] { reach } else { -reach };
            let beyond = cell[axis].wrapping_add_signed(step);
            if reach > 1 {
                cell = jump(grid, ray, leave, reach, cell, forward);
            }
            cell[axis] = beyond;
            if outside(cell, grid.resolution) {
                return hit;
            }
        }
    }
}

impl CpuTwin for Twin<'_> {
    fn closest_hit(&self, ray: &Ray, counters: &mut Counters) -> Hit {
        self.trace(ray, false, counters)
    }

    fn any_hit(&self, ray: &Ray, counters: &mut Counters) -> bool {
        self.trace(ray, true, counters).triangle != NO_HIT
    }
}
