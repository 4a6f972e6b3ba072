//! The builder of `octree`: level by level, the cells of a level on all cores.

use super::{INNER_SHIFT, LAST, LEAF, Options, RootCell};
use crate::bounds::Bounds;
use crate::spatial::{ABOVE, Margin, missed_octants};
use crate::triangle::TriangleRecord;
use crate::{AccelError, TriangleSoup};
use rayon::prelude::*;

/// Limit on blocks of children: 23-bit indices.
const MAX_BLOCKS: u64 = 1 << (31 - INNER_SHIFT);
/// Limit on references: 31-bit indices, for triangles as well.
const MAX_REFERENCES: u64 = 1 << 31;
/// What to do beyond these.
const SHALLOWER: &str = "set `max_depth` lower or `leaf_size` higher";
/// A level that would exceed this many references per triangle is not started: where many large
/// triangles coincide, cells along their edges would never run out.
const MOST_REFERENCES_PER_TRIANGLE: usize = 16;

/// The bits of each mask of children, side by side.
const BITS: [[u32; 8]; 256] = {
    let mut bits = [[0; 8]; 256];
    let mut at = 0;
    while at < 8 * 256 {
        bits[at / 8][at % 8] = (at / 8) as u32 >> (at % 8) & 1;
        at += 1;
    }
    bits
};

/// Cells and references in their final order.
pub(super) struct Octree {
    /// Block 0 has the root first; each other block holds the children of a cell.
    pub nodes: Vec<u32>,
    pub references: Vec<u32>,
    pub depth: u32,
}

/// A cell whose word is not yet written.
#[derive(Clone)]
struct Open {
    slot: usize,
    position: [u32; 3],
    /// Start of its triangles, which end at the start of the next cell's.
    first: usize,
}

/// Triangles of the eight children of a cell, one after the other.
struct Children {
    ends: [u32; 8],
    triangles: Vec<u32>,
}

/// Builds the tree.
///
/// # Errors
/// More blocks or references than a word can address.
pub(super) fn build(
    soup: &TriangleSoup,
    space: &RootCell,
    options: &Options,
) -> Result<Octree, AccelError> {
    let settings = Settings::new(soup, space, options);
    let mut tree = Octree {
        nodes: vec![0; 8],
        references: Vec::new(),
        depth: 0,
    };
    let mut triangles: Vec<u32> = (0..soup.records.len() as u32).collect();
    let mut cells = vec![Open {
        slot: 0,
        position: [0; 3],
        first: 0,
    }];
    cells.retain(|_| !triangles.is_empty());
    while !cells.is_empty() {
        let divided = settings.divide_all(&cells, &triangles, tree.depth);
        (cells, triangles) = assemble(&cells, &triangles, divided, &mut tree)?;
        tree.depth += u32::from(!cells.is_empty());
    }
    Ok(tree)
}

/// Default depth: the level at which cells along a surface are as many as the triangles, plus two.
pub(crate) fn default_depth(triangles: usize) -> u32 {
    ((triangles.max(1) as f64).log2() / 2.0).ceil() as u32 + 2
}

struct Settings<'a> {
    soup: &'a TriangleSoup,
    space: &'a RootCell,
    options: &'a Options,
    max_depth: u32,
    /// By triangle.
    extents: Vec<Extent>,
}

/// What most cells need of a triangle, side by side in memory: lists of cells read it at random.
#[derive(Clone, Copy)]
#[repr(align(32))]
struct Extent {
    bounds: Bounds,
    /// Scene units; below 0 if triangles are not clipped.
    margin: f64,
}

impl<'a> Settings<'a> {
    fn new(soup: &'a TriangleSoup, space: &'a RootCell, options: &'a Options) -> Self {
        let margin = Margin::new(&soup.bounds());
        let extent = |record: &TriangleRecord| Extent {
            bounds: record.bounds(),
            margin: if options.clip {
                margin.of(record)
            } else {
                -1.0
            },
        };
        Self {
            soup,
            space,
            max_depth: match options.max_depth {
                0 => default_depth(soup.records.len()),
                depth => depth,
            },
            options,
            extents: soup.records.par_iter().map(extent).collect(),
        }
    }

    /// Children of every cell of a level that is split.
    fn divide_all(&self, cells: &[Open], triangles: &[u32], depth: u32) -> Vec<Option<Children>> {
        if depth >= self.max_depth {
            return cells.iter().map(|_| None).collect();
        }
        let list = |i: usize| {
            let end = cells.get(i + 1).map_or(triangles.len(), |next| next.first);
            &triangles[cells[i].first..end]
        };
        let divided: Vec<Option<Children>> = (0..cells.len())
            .into_par_iter()
            .map_init(Vec::new, |octants, i| {
                self.divide(cells[i].position, list(i), depth, octants)
            })
            .collect();
        let made: usize = divided.iter().flatten().map(|c| c.triangles.len()).sum();
        if made > MOST_REFERENCES_PER_TRIANGLE * self.soup.records.len() {
            return cells.iter().map(|_| None).collect();
        }
        divided
    }

    /// The children of a cell; `None` if it becomes a leaf.
    fn divide(
        &self,
        position: [u32; 3],
        triangles: &[u32],
        depth: u32,
        octants: &mut Vec<u8>,
    ) -> Option<Children> {
        if triangles.len() <= self.options.leaf_size {
            return None;
        }
        let cell = Divided::new(self.space, position, depth);
        octants.clear();
        octants.extend(triangles.iter().map(|&id| self.octants(id, &cell)));
        let mut counts = [0; 8];
        for mask in octants.iter() {
            let bits = &BITS[usize::from(*mask)];
            (counts.iter_mut().zip(bits)).for_each(|(count, bit)| *count += bit);
        }
        let listed: u32 = counts.iter().sum();
        // Every child has a quarter of the area of its parent.
        let cost = self.options.traversal_cost + 0.25 * f64::from(listed);
        if cost >= triangles.len() as f64 {
            return None;
        }
        Some(Children::new(triangles, octants, counts))
    }

    /// The children of a cell that list a triangle, one bit each.
    fn octants(&self, id: u32, cell: &Divided) -> u8 {
        let extent = &self.extents[id as usize];
        let mask = by_box(&extent.bounds, cell.middle);
        if mask.is_power_of_two() || extent.margin < 0.0 {
            return mask;
        }
        let vertices = self.soup.records[id as usize].vertices();
        let from_centre =
            vertices.map(|v| std::array::from_fn(|a| f64::from(v[a]) - cell.centre[a]));
        // An octant that holds a corner is touched; margins are wider than planes are rounded.
        let held = from_centre.iter().fold(0, |held, v: &[f64; 3]| {
            let within = (0..3).all(|a| v[a].abs() <= cell.size[a]);
            let above = |a: usize| u8::from(v[a] > 0.0) << a;
            held | u8::from(within) << (above(0) | above(1) | above(2))
        });
        if mask & !held == 0 {
            return mask;
        }
        mask & !missed_octants(&from_centre, cell.size, extent.margin)
    }
}

impl Children {
    /// From how many triangles each child lists.
    fn new(triangles: &[u32], octants: &[u8], counts: [u32; 8]) -> Self {
        let mut end = 0;
        let ends = counts.map(|count| {
            end += count;
            end
        });
        let mut places: [u32; 8] = std::array::from_fn(|child| ends[child] - counts[child]);
        let mut listed = vec![0; end as usize];
        for (id, mask) in triangles.iter().zip(octants) {
            let mut left = *mask;
            while left != 0 {
                let octant = left.trailing_zeros() as usize;
                listed[places[octant] as usize] = *id;
                places[octant] += 1;
                left &= left - 1;
            }
        }
        Self {
            ends,
            triangles: listed,
        }
    }
}

/// A cell that may be split.
struct Divided {
    middle: [f32; 3],
    centre: [f64; 3],
    /// Size of its children.
    size: [f64; 3],
}

impl Divided {
    fn new(space: &RootCell, position: [u32; 3], depth: u32) -> Self {
        Self {
            middle: space.middle(position, depth),
            centre: space.centre(position, depth),
            size: space.half(depth),
        }
    }
}

/// The octants around `middle` that a box overlaps; a box that ends in a plane is only below it.
pub(super) fn by_box(bounds: &Bounds, middle: [f32; 3]) -> u8 {
    let mut mask = 0xff;
    for axis in 0..3 {
        let is_below = bounds.max[axis] <= middle[axis];
        let is_above = bounds.min[axis] >= middle[axis] && !is_below;
        // Without branches, which nobody can predict.
        mask &= !(ABOVE[axis] * u8::from(is_below)) & !(!ABOVE[axis] * u8::from(is_above));
    }
    mask
}

/// Writes the words of a level and lists the cells of the next with their triangles.
fn assemble(
    cells: &[Open],
    triangles: &[u32],
    divided: Vec<Option<Children>>,
    tree: &mut Octree,
) -> Result<(Vec<Open>, Vec<u32>), AccelError> {
    let (mut next_cells, mut next_triangles) = (Vec::new(), Vec::new());
    for (i, (cell, children)) in cells.iter().zip(divided).enumerate() {
        let Some(children) = children else {
            let end = cells.get(i + 1).map_or(triangles.len(), |next| next.first);
            tree.nodes[cell.slot] = LEAF | tree.references.len() as u32;
            tree.references.extend(&triangles[cell.first..end]);
            if let Some(last) = tree.references.last_mut() {
                *last |= LAST;
            }
            continue;
        };
        let block = tree.nodes.len() / 8;
        let (mut filled, mut start) = (0, 0);
        for octant in 0..8 {
            let end = children.ends[octant] as usize;
            if start < end {
                filled |= 1 << octant;
                next_cells.push(Open {
                    slot: 8 * block + octant,
                    position: RootCell::child(cell.position, octant as u32),
                    first: next_triangles.len() + start,
                });
            }
            start = end;
        }
        next_triangles.extend(children.triangles);
        tree.nodes.extend([0; 8]);
        tree.nodes[cell.slot] = (block as u32) << INNER_SHIFT | filled;
    }
    let (blocks, references) = (tree.nodes.len() as u64 / 8, tree.references.len() as u64);
    AccelError::check_limit(
        "cells of an octree that have children",
        blocks,
        MAX_BLOCKS,
        SHALLOWER,
    )?;
    AccelError::check_limit(
        "references of an octree",
        references,
        MAX_REFERENCES,
        SHALLOWER,
    )?;
    Ok((next_cells, next_triangles))
}
