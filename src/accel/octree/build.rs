//! The builder of `octree`: level by level, the cells of a level on all cores.

use super::{INNER_SHIFT, LAST, LEAF, Options, RootCell};
use crate::bounds::Bounds;
use crate::spatial::{Margin, Overlap, corners};
use crate::triangle::TriangleRecord;
use crate::{AccelError, TriangleSoup};
use rayon::prelude::*;

/// Limit on blocks of children: 23-bit indices.
const MAX_BLOCKS: u64 = 1 << (31 - INNER_SHIFT);
/// Limit on references: 31-bit indices, for triangles as well.
const MAX_REFERENCES: u64 = 1 << 31;
/// A level that would exceed this many references per triangle is not started: where many large
/// triangles coincide, cells along their edges would never run out.
const MOST_REFERENCES_PER_TRIANGLE: usize = 16;

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
    ends: [usize; 8],
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
    /// By triangle, scene units; set if they are clipped.
    margins: Option<Vec<f64>>,
    boxes: Vec<Bounds>,
}

impl<'a> Settings<'a> {
    fn new(soup: &'a TriangleSoup, space: &'a RootCell, options: &'a Options) -> Self {
        Self {
            soup,
            space,
            max_depth: match options.max_depth {
                0 => default_depth(soup.records.len()),
                depth => depth,
            },
            options,
            margins: options.clip.then(|| {
                let margin = Margin::new(&soup.bounds());
                soup.records.par_iter().map(|r| margin.of(r)).collect()
            }),
            boxes: soup.records.par_iter().map(|r| r.bounds()).collect(),
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
            .map(|i| self.divide(cells[i].position, list(i), depth))
            .collect();
        let made: usize = divided.iter().flatten().map(|c| c.triangles.len()).sum();
        if made > MOST_REFERENCES_PER_TRIANGLE * self.soup.records.len() {
            return cells.iter().map(|_| None).collect();
        }
        divided
    }

    /// The children of a cell; `None` if it becomes a leaf.
    fn divide(&self, position: [u32; 3], triangles: &[u32], depth: u32) -> Option<Children> {
        if triangles.len() <= self.options.leaf_size {
            return None;
        }
        let cell = Divided::new(self.space, position, depth);
        let octants: Vec<u8> = triangles
            .iter()
            .map(|&id| self.octants(id, &cell))
            .collect();
        let listed: u32 = octants.iter().map(|mask| mask.count_ones()).sum();
        // Every child has a quarter of the area of its parent.
        let cost = self.options.traversal_cost + 0.25 * f64::from(listed);
        if cost >= triangles.len() as f64 {
            return None;
        }
        let mut children = Children {
            ends: [0; 8],
            triangles: Vec::with_capacity(listed as usize),
        };
        for octant in 0..8 {
            let inside = triangles.iter().zip(&octants);
            let inside = inside.filter(|(_, mask)| *mask >> octant & 1 == 1);
            children.triangles.extend(inside.map(|(id, _)| id));
            children.ends[octant] = children.triangles.len();
        }
        Some(children)
    }

    /// The children of a cell that list a triangle, one bit each.
    fn octants(&self, id: u32, cell: &Divided) -> u8 {
        let mask = by_box(&self.boxes[id as usize], cell.middle);
        let Some(margins) = self.margins.as_ref().filter(|_| !mask.is_power_of_two()) else {
            return mask;
        };
        let record = &self.soup.records[id as usize];
        // A child that holds a corner is touched; margins are wider than planes are rounded.
        let open = mask & !cell.with_corner(record);
        if open == 0 {
            return mask;
        }
        let margin = margins[id as usize];
        let overlap = Overlap::new(&corners(record), cell.half.map(|h| h + margin));
        let is_missed =
            |octant: &usize| open >> octant & 1 == 1 && !overlap.touches(cell.centres[*octant]);
        (0..8)
            .filter(is_missed)
            .fold(mask, |mask, octant| mask & !(1 << octant))
    }
}

/// A cell that may be split.
struct Divided {
    bounds: Bounds,
    middle: [f32; 3],
    /// Half extent and centres of its children.
    half: [f64; 3],
    centres: [[f64; 3]; 8],
}

impl Divided {
    fn new(space: &RootCell, position: [u32; 3], depth: u32) -> Self {
        let centre = |octant| space.centre(RootCell::child(position, octant as u32), depth + 1);
        Self {
            bounds: space.cell(position, depth),
            middle: space.middle(position, depth),
            half: space.half(depth + 1),
            centres: std::array::from_fn(centre),
        }
    }

    /// The children in which a triangle has a corner.
    fn with_corner(&self, record: &TriangleRecord) -> u8 {
        record.vertices().iter().fold(0, |mask, corner| {
            let within = |a: usize| (self.bounds.min[a]..=self.bounds.max[a]).contains(&corner[a]);
            let above = |a: usize| u8::from(corner[a] > self.middle[a]) << a;
            let is_here = within(0) && within(1) && within(2);
            mask | u8::from(is_here) << (above(0) | above(1) | above(2))
        })
    }
}

/// The octants around `middle` that a box overlaps; a box that ends in a plane is only below it.
pub(super) fn by_box(bounds: &Bounds, middle: [f32; 3]) -> u8 {
    const ABOVE: [u8; 3] = [0b1010_1010, 0b1100_1100, 0b1111_0000];
    let mut mask = 0xff;
    for axis in 0..3 {
        if bounds.max[axis] <= middle[axis] {
            mask &= !ABOVE[axis];
        } else if bounds.min[axis] >= middle[axis] {
            mask &= ABOVE[axis];
        }
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
            let end = children.ends[octant];
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
    AccelError::check_limit("cells of an octree that have children", blocks, MAX_BLOCKS)?;
    AccelError::check_limit("references of an octree", references, MAX_REFERENCES)?;
    Ok((next_cells, next_triangles))
}
