//! `uniform-grid`: equal cells with lists of triangles, walked by a 3D-DDA. Twin of
//! `kernels/accel/uniform_grid.wesl`.
//!
//! Sources: J. Cleary et al., "Multiprocessor ray tracing", 1986 (resolution); J. Amanatides,
//! A. Woo, "A fast voxel traversal algorithm", 1987; T. Akenine-Möller, "Fast 3D triangle–box overlap
//! testing", 2001 (insertion).
//!
//! A triangle is listed in every cell that it overlaps once the cell is grown by [`Grid::margin`],
//! which is larger than what rounding can move the walk; a hit beyond the present cell is kept and
//! the walk goes on until the cell's exit lies behind the nearest hit.

use super::bounds::{BOX_PAD, Bounds, slab};
use super::ray::{Hit, NO_HIT, Ray, safe_inverse};
use super::triangle::{TriangleRecord, intersect_triangle};
use super::{
    AccelError, AccelKind, BuildLog, BuiltAccel, Counters, CpuTwin, GpuBuffers, NamedWords,
    TriangleSoup,
};
use crate::config::{ParamRange, ParamValue, Parameter, ParameterSchema, Params};
use crate::gpu::UniformValues;
use crate::measure::record::StructureStats;
use rayon::prelude::*;

/// Cells and references are indexed by u32 and bound as one buffer of 128 MiB.
const MAX_CELLS: u64 = (128 << 20) / 4 - 1;

/// The registry entry.
pub struct UniformGrid;

impl AccelKind for UniformGrid {
    fn name(&self) -> &'static str {
        "uniform-grid"
    }

    fn description(&self) -> &'static str {
        "equal cells by Cleary's rule, exact triangle–box insertion, 3D-DDA (Amanatides & Woo 1987)"
    }

    fn parameters(&self) -> ParameterSchema {
        vec![Parameter {
            name: "lambda",
            description: "cells per triangle: resolution = extent · cbrt(λ · triangles / volume)",
            default: ParamValue::Number(5.0),
            range: ParamRange::Number {
                min: 0.01,
                max: 1000.0,
            },
        }]
    }

    fn build(
        &self,
        soup: &TriangleSoup,
        params: &Params,
        log: &mut BuildLog,
    ) -> Result<Box<dyn BuiltAccel>, AccelError> {
        let grid = Grid::new(soup, params.number("lambda"))?;
        let pairs = log.phase("insert", || insert(&grid, soup));
        let references: u64 = pairs.iter().map(|chunk| chunk.len() as u64).sum();
        if references > MAX_CELLS {
            return Err(AccelError::Limit {
                what: "references of a uniform-grid".into(),
                needed: references,
                limit: MAX_CELLS,
            });
        }
        let (starts, references) = log.phase("sort", || sort_by_cell(&grid, &pairs));
        Ok(Box::new(Built {
            grid,
            starts,
            references,
        }))
    }
}

/// Geometry of the grid.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Grid {
    bounds: Bounds,
    resolution: [u32; 3],
    cell: [f32; 3],
    inverse_cell: [f32; 3],
    /// By how much cells are grown on insertion, scene units.
    margin: f32,
}

impl Grid {
    fn new(soup: &TriangleSoup, lambda: f64) -> Result<Self, AccelError> {
        let mut bounds = soup.bounds();
        if soup.records.is_empty() {
            bounds = Bounds {
                min: [0.0; 3],
                max: [1.0; 3],
            };
        }
        let extent = bounds.extent();
        let diagonal = extent.iter().map(|e| e * e).sum::<f32>().sqrt();
        let far = (0..3)
            .map(|a| bounds.min[a].abs().max(bounds.max[a].abs()))
            .fold(0.0, f32::max);
        // Positions along a ray that starts within 16 diagonals are wrong by less than this.
        let margin = ((diagonal + far) * 2.0_f32.powi(-18)).max(1e-18);
        for axis in 0..3 {
            bounds.min[axis] -= margin;
            bounds.max[axis] += margin;
        }
        // A flat scene still needs a volume for Cleary's rule.
        let side = bounds
            .extent()
            .map(|e| f64::from(e.max(1e-3 * diagonal).max(margin)));
        let density =
            (lambda * soup.records.len().max(1) as f64 / side.iter().product::<f64>()).cbrt();
        let resolution = side.map(|e| (e * density).round().clamp(1.0, 4096.0) as u32);
        let cells = resolution.iter().map(|&r| u64::from(r)).product::<u64>();
        if cells > MAX_CELLS {
            return Err(AccelError::Limit {
                what: "cells of a uniform-grid".into(),
                needed: cells,
                limit: MAX_CELLS,
            });
        }
        let extent = bounds.extent();
        let cell = std::array::from_fn(|a| extent[a] / resolution[a] as f32);
        Ok(Self {
            bounds,
            resolution,
            cell,
            inverse_cell: cell.map(|c| 1.0 / c),
            margin,
        })
    }

    fn cells(&self) -> usize {
        self.resolution.iter().map(|&r| r as usize).product()
    }

    fn index(&self, [x, y, z]: [u32; 3]) -> u32 {
        (z * self.resolution[1] + y) * self.resolution[0] + x
    }

    /// Cell coordinate of a position along one axis, clamped to the grid.
    fn coordinate(&self, axis: usize, position: f32) -> u32 {
        let last = (self.resolution[axis] - 1) as f32;
        ((position - self.bounds.min[axis]) * self.inverse_cell[axis]).clamp(0.0, last) as u32
    }

    /// The plane below cell `coordinate`.
    fn plane(&self, axis: usize, coordinate: u32) -> f32 {
        self.bounds.min[axis] + coordinate as f32 * self.cell[axis]
    }
}

/// Pairs (cell, triangle) of each chunk of triangles, in the order of the triangles.
fn insert(grid: &Grid, soup: &TriangleSoup) -> Vec<Vec<(u32, u32)>> {
    soup.records
        .par_chunks(8192)
        .map(|chunk| {
            let mut pairs = Vec::with_capacity(2 * chunk.len());
            for triangle in chunk {
                insert_triangle(grid, triangle, &mut pairs);
            }
            pairs
        })
        .collect()
}

fn insert_triangle(grid: &Grid, triangle: &TriangleRecord, pairs: &mut Vec<(u32, u32)>) {
    let bounds = triangle.bounds();
    let first: [u32; 3] = std::array::from_fn(|a| grid.coordinate(a, bounds.min[a] - grid.margin));
    let last: [u32; 3] = std::array::from_fn(|a| grid.coordinate(a, bounds.max[a] + grid.margin));
    if first == last {
        pairs.push((grid.index(first), triangle.id));
        return;
    }
    let overlap = OverlapTest::new(grid, triangle);
    for z in first[2]..=last[2] {
        for y in first[1]..=last[1] {
            for x in first[0]..=last[0] {
                if overlap.with_cell(grid, [x, y, z]) {
                    pairs.push((grid.index([x, y, z]), triangle.id));
                }
            }
        }
    }
}

/// Separating-axis test of one triangle against many grown cells, in f64.
struct OverlapTest {
    /// Axis, and the interval of the triangle on it grown by the cell's half extent.
    axes: Vec<([f64; 3], f64, f64)>,
}

impl OverlapTest {
    fn new(grid: &Grid, triangle: &TriangleRecord) -> Self {
        let v0 = triangle.v0.map(f64::from);
        let v1: [f64; 3] = std::array::from_fn(|a| v0[a] - f64::from(triangle.e1[a]));
        let v2: [f64; 3] = std::array::from_fn(|a| v0[a] + f64::from(triangle.e2[a]));
        let vertices = [v0, v1, v2];
        let edge = |i: usize| -> [f64; 3] {
            std::array::from_fn(|a| vertices[(i + 1) % 3][a] - vertices[i][a])
        };
        let unit =
            |axis: usize| -> [f64; 3] { std::array::from_fn(|a| f64::from(u8::from(a == axis))) };
        let half: [f64; 3] = std::array::from_fn(|a| {
            0.5 * f64::from(grid.cell[a]) * (1.0 + 1e-4) + f64::from(grid.margin)
        });
        let mut axes = Vec::with_capacity(13);
        let mut add = |axis: [f64; 3]| {
            let on_axis = vertices.map(|v| dot(v, axis));
            let reach = (0..3).map(|a| half[a] * axis[a].abs()).sum::<f64>();
            let low = on_axis.iter().copied().fold(f64::INFINITY, f64::min) - reach;
            let high = on_axis.iter().copied().fold(f64::NEG_INFINITY, f64::max) + reach;
            axes.push((axis, low, high));
        };
        add(cross(edge(0), edge(1)));
        (0..3).for_each(|a| add(unit(a)));
        for i in 0..3 {
            (0..3).for_each(|a| add(cross(edge(i), unit(a))));
        }
        Self { axes }
    }

    fn with_cell(&self, grid: &Grid, cell: [u32; 3]) -> bool {
        let centre: [f64; 3] = std::array::from_fn(|a| {
            f64::from(grid.bounds.min[a]) + (f64::from(cell[a]) + 0.5) * f64::from(grid.cell[a])
        });
        self.axes.iter().all(|(axis, low, high)| {
            let c = dot(centre, *axis);
            *low <= c && c <= *high
        })
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// Counting sort: cell `c` owns `references[starts[c]..starts[c + 1]]`, triangles ascending.
fn sort_by_cell(grid: &Grid, pairs: &[Vec<(u32, u32)>]) -> (Vec<u32>, Vec<u32>) {
    let mut starts = vec![0u32; grid.cells() + 1];
    for (cell, _) in pairs.iter().flatten() {
        starts[*cell as usize + 1] += 1;
    }
    for cell in 1..starts.len() {
        starts[cell] += starts[cell - 1];
    }
    let mut next = starts.clone();
    let mut references = vec![0u32; pairs.iter().map(Vec::len).sum()];
    for (cell, triangle) in pairs.iter().flatten() {
        let slot = &mut next[*cell as usize];
        references[*slot as usize] = *triangle;
        *slot += 1;
    }
    (starts, references)
}

struct Built {
    grid: Grid,
    starts: Vec<u32>,
    references: Vec<u32>,
}

impl BuiltAccel for Built {
    fn validate(&self, soup: &TriangleSoup) -> Result<(), AccelError> {
        let wrong = |text: String| Err(AccelError::Invalid(text));
        if self.starts.len() != self.grid.cells() + 1
            || self.starts.last() != Some(&(self.references.len() as u32))
        {
            return wrong("cell starts do not cover the references".to_owned());
        }
        let mut seen = vec![false; soup.records.len()];
        for (cell, range) in self.starts.windows(2).enumerate() {
            if range[0] > range[1] {
                return wrong(format!("cell {cell}: its range runs backwards"));
            }
            for &id in &self.references[range[0] as usize..range[1] as usize] {
                match seen.get_mut(id as usize) {
                    Some(seen) => *seen = true,
                    None => return wrong(format!("cell {cell}: triangle {id} does not exist")),
                }
            }
        }
        if let Some(lost) = seen.iter().position(|s| !s) {
            return wrong(format!("triangle {lost} is in no cell"));
        }
        match soup
            .records
            .iter()
            .find(|r| !self.grid.bounds.contains(&r.bounds()))
        {
            Some(record) => wrong(format!("triangle {} lies outside the grid", record.id)),
            None => Ok(()),
        }
    }

    fn buffers(&self) -> GpuBuffers<'_> {
        let [x, y, z] = self.grid.resolution;
        let grid = UniformValues::new()
            .vec("low", &self.grid.bounds.min)
            .vec("high", &self.grid.bounds.max)
            .vec("cell", &self.grid.cell)
            .vec("inverse_cell", &self.grid.inverse_cell)
            .uvec("resolution", &self.grid.resolution);
        GpuBuffers {
            kernel: "accel/uniform_grid",
            features: Vec::new(),
            arrays: vec![
                NamedWords {
                    name: "cells",
                    words: self.starts.as_slice().into(),
                    element_bytes: 4,
                },
                NamedWords {
                    name: "references",
                    words: self.references.as_slice().into(),
                    element_bytes: 4,
                },
            ],
            uniforms: vec![
                ("grid", grid),
                super::limits((x + y + z + 1) as usize, self.references.len()),
            ],
            constants: Vec::new(),
        }
    }

    fn stats(&self) -> StructureStats {
        StructureStats {
            nodes: self.grid.cells() as u64,
            leaves: self.starts.windows(2).filter(|w| w[0] < w[1]).count() as u64,
            references: self.references.len() as u64,
            bytes: self.buffers().bytes(),
            ..Default::default()
        }
    }

    fn cpu_twin<'a>(&'a self, soup: &'a TriangleSoup) -> Option<Box<dyn CpuTwin + 'a>> {
        Some(Box::new(Twin { built: self, soup }))
    }
}

struct Twin<'a> {
    built: &'a Built,
    soup: &'a TriangleSoup,
}

impl Twin<'_> {
    fn trace(&self, ray: &Ray, any: bool, counters: &mut Counters) -> Hit {
        let grid = &self.built.grid;
        let inverse = safe_inverse(ray.direction);
        let mut hit = Hit::miss(ray);
        counters.box_tests += 1;
        let (enter, exit) = slab(&grid.bounds, ray, inverse);
        let enter = enter.max(ray.t_min);
        if enter > exit.min(ray.t_max) * BOX_PAD {
            return hit;
        }
        let forward = inverse.map(|i| i >= 0.0);
        let mut cell: [u32; 3] =
            std::array::from_fn(|a| grid.coordinate(a, ray.origin[a] + ray.direction[a] * enter));
        loop {
            counters.nodes += 1;
            let index = grid.index(cell) as usize;
            let list = self.built.starts[index] as usize..self.built.starts[index + 1] as usize;
            for &id in &self.built.references[list] {
                counters.triangle_tests += 1;
                intersect_triangle(&self.soup.records[id as usize], ray, inverse, &mut hit);
            }
            if any && hit.triangle != NO_HIT {
                return hit;
            }
            let next: [f32; 3] = std::array::from_fn(|a| {
                (grid.plane(a, cell[a] + u32::from(forward[a])) - ray.origin[a]) * inverse[a]
            });
            let leave = next[0].min(next[1]).min(next[2]);
            // The exit must lie clearly behind the hit: an equally near one may wait next door.
            if hit.t * BOX_PAD < leave {
                return hit;
            }
            let axis = if next[0] == leave {
                0
            } else if next[1] == leave {
                1
            } else {
                2
            };
            cell[axis] = if forward[axis] {
                cell[axis] + 1
            } else {
                cell[axis].wrapping_sub(1)
            };
            if cell[axis] >= grid.resolution[axis] {
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
