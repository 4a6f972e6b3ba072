//! `octree`: cells halved along all axes at once, leaves with references, traversed by the
//! distances of their middle planes. CPU version of `kernels/accel/octree.wesl`.
//!
//! Sources: J. Revelles, C. Ureña, M. Lastra, "An efficient parametric algorithm for octree
//! traversal", 2000 (middle planes, octants mirrored by the direction); S. Laine, T. Karras,
//! "Efficient sparse voxel octrees", 2010 (cells by integer position, masks of children); T.
//! Akenine-Möller, "Fast 3D triangle–box overlap testing", 2001. Why hits are bit-identical to
//! brute force: [`super::spatial`]; a level is three splits, one along each axis.

mod build;
mod validate;

pub(crate) use build::default_depth;

use super::structure::prelude::*;
use raystone_gpu::UniformValues;

/// Marks a leaf's word; the other bits are its first index into the references.
const LEAF: u32 = 0x8000_0000;
/// Other words: the block of the children, and below this bit a mask of the non-empty ones.
const INNER_SHIFT: u32 = 8;
const FILLED_MASK: u32 = 255;
/// Marks the last reference of a leaf.
const LAST: u32 = 0x8000_0000;
/// A cell that begins beyond the hit by this factor ends the traversal: all unvisited cells begin no more than
/// `BOX_PAD` before it. More than its square.
const END_PAD: f32 = 1.000_004;
/// Maximum depth at which a float holds the integer cell positions exactly.
const DEEPEST: u32 = 20;

parameters! {
    /// Which cells are divided, and what they list.
    pub struct Options {
        /// deepest leaf; 0 stands for 2 + log4 of the number of triangles
        max_depth: u32 = 0, in 0..=DEEPEST;
        /// cells of no more triangles are not divided
        leaf_size: usize = 8, in 1..=1024;
        /// SAH cost of visiting a cell in triangle tests; cells that would not gain are not divided
        traversal_cost: f64 = 1.0, in 0.01..=100.0;
        /// list a triangle by itself, not by its box
        clip: bool = true;
    }
}

pub(crate) struct Octree;

impl Structure for Octree {
    const NAME: &'static str = "octree";
    const DESCRIPTION: &'static str =
        "octree by exact triangle–box overlap, parametric descent (Revelles, Ureña & Lastra 2000)";
    type Parameters = Options;

    fn build(soup: &TriangleSoup, options: &Options, log: &mut BuildLog) -> BuildResult {
        let space = RootCell::around(soup);
        let tree = log.phase("levels", || build::build(soup, &space, options))?;
        Ok(Box::new(Built {
            space,
            clipped: options.clip,
            nodes: tree.nodes,
            references: tree.references,
            depth: tree.depth,
        }))
    }
}

/// The cell grid: at depth `d` the planes of an axis are `low + k · extent · 2⁻ᵈ`.
#[derive(Debug, Clone, Copy, PartialEq)]
struct RootCell {
    low: [f32; 3],
    extent: [f32; 3],
}

impl RootCell {
    fn around(soup: &TriangleSoup) -> Self {
        if soup.records.is_empty() {
            return Self {
                low: [0.0; 3],
                extent: [1.0; 3],
            };
        }
        let bounds = soup.bounds();
        let mut extent = bounds.extent();
        for (axis, side) in extent.iter_mut().enumerate() {
            // The difference is rounded.
            while bounds.min[axis] + *side < bounds.max[axis] {
                *side = side.next_up();
            }
        }
        Self {
            low: bounds.min,
            extent,
        }
    }

    fn size(&self, depth: u32) -> [f32; 3] {
        self.extent.map(|e| e * 0.5_f32.powi(depth as i32))
    }

    fn plane(&self, axis: usize, k: u32, size: f32) -> f32 {
        self.low[axis] + k as f32 * size
    }

    /// The intersection of the three middle planes of a cell.
    fn middle(&self, position: [u32; 3], depth: u32) -> [f32; 3] {
        let size = self.size(depth + 1);
        std::array::from_fn(|a| self.plane(a, 2 * position[a] + 1, size[a]))
    }

    fn cell(&self, position: [u32; 3], depth: u32) -> Bounds {
        let size = self.size(depth);
        Bounds {
            min: std::array::from_fn(|a| self.plane(a, position[a], size[a])),
            max: std::array::from_fn(|a| self.plane(a, position[a] + 1, size[a])),
        }
    }

    fn half(&self, depth: u32) -> [f64; 3] {
        self.size(depth).map(|s| 0.5 * f64::from(s))
    }

    fn centre(&self, position: [u32; 3], depth: u32) -> [f64; 3] {
        let half = self.half(depth);
        std::array::from_fn(|a| {
            f64::from(self.low[a]) + (2.0 * f64::from(position[a]) + 1.0) * half[a]
        })
    }

    /// Position of a child; bit `a` of `octant` is its half along axis `a`.
    fn child(position: [u32; 3], octant: u32) -> [u32; 3] {
        std::array::from_fn(|a| 2 * position[a] + (octant >> a & 1))
    }
}

struct Built {
    space: RootCell,
    clipped: bool,
    /// Block 0 has the root first; each other block holds the children of a cell.
    nodes: Vec<u32>,
    /// Triangle indices, leaf by leaf, ascending in each, the last marked.
    references: Vec<u32>,
    depth: u32,
}

impl Built {
    /// The references of a leaf that begins at `first`; `None` without an end mark.
    fn list(&self, first: u32) -> Option<&[u32]> {
        let from = self.references.get(first as usize..)?;
        let last = from.iter().position(|r| r & LAST != 0)?;
        Some(&from[..=last])
    }

    /// Word, position and depth of every non-empty cell, from the root.
    fn each_cell(&self, mut visit: impl FnMut(u32, [u32; 3], u32)) {
        let mut stack = vec![(self.nodes[0], [0; 3], 0)];
        while let Some((word, position, depth)) = stack.pop() {
            visit(word, position, depth);
            if word & LEAF == 0 {
                let block = (word >> INNER_SHIFT) as usize;
                let filled = (0..8).filter(|octant| word >> octant & 1 == 1);
                stack.extend(filled.map(|octant| {
                    let child = self.nodes[8 * block + octant as usize];
                    (child, RootCell::child(position, octant), depth + 1)
                }));
            }
        }
    }
}

impl BuiltAccel for Built {
    fn validate(&self, soup: &TriangleSoup) -> Result<(), AccelError> {
        validate::validate(self, soup)
    }

    fn buffers(&self) -> GpuBuffers<'_> {
        let space = UniformValues::new()
            .vec("low", &self.space.low)
            .vec("extent", &self.space.extent);
        GpuBuffers {
            kernel: "accel/octree",
            features: Vec::new(),
            arrays: vec![
                NamedWords::new("nodes", &self.nodes),
                NamedWords::new("references", &self.references),
            ],
            uniforms: vec![
                ("space", space),
                limits(self.nodes.len() + 1, self.references.len()),
            ],
            // One entry per level plus the root; rounded, so that similar scenes share a kernel.
            constants: vec![("STACK_ENTRIES", (self.depth + 1).next_multiple_of(8))],
        }
    }

    fn stats(&self) -> StructureStats {
        let mut counts = Vec::new();
        let (mut cost, mut cells, mut filled) = (0.0, 0, 0);
        self.each_cell(|word, _, depth| {
            let weight = if word & LEAF != 0 {
                let count = self.list(word & !LEAF).map_or(0, <[u32]>::len);
                counts.push(count);
                count as f64
            } else {
                cells += 8;
                1.0
            };
            filled += 1;
            cost += weight * 0.25_f64.powi(depth as i32);
        });
        // Empty octants count as leaves.
        let empty = cells + 1 - filled;
        let counts = counts.into_iter().chain((0..empty).map(|_| 0));
        StructureStats {
            nodes: cells as u64 + 1,
            depth: Some(self.depth),
            sah_cost: (!self.references.is_empty()).then_some(cost),
            bytes: self.buffers().bytes(),
            ..StructureStats::of_leaves(counts)
        }
    }

    fn cpu_twin<'a>(&'a self, soup: &'a TriangleSoup) -> Option<Box<dyn CpuTwin + 'a>> {
        Some(Box::new(Twin(self, soup)))
    }
}

/// Bit `i` stands for octant `i ^ flip`, so that lower bits come first along the ray.
fn mirrored(mask: u32, flip: u32) -> u32 {
    let mut out = mask;
    if flip & 1 != 0 {
        out = (out & 0x55) << 1 | out >> 1 & 0x55;
    }
    if flip & 2 != 0 {
        out = (out & 0x33) << 2 | out >> 2 & 0x33;
    }
    if flip & 4 != 0 {
        out = (out & 0x0f) << 4 | out >> 4;
    }
    out
}

/// The mirrored children visited by the segment from `enter` to `exit`: those whose interval is not
/// empty by more than the pad, given the distances of the middle planes.
fn visited(enter: f32, exit: f32, middle: [f32; 3], pad: f32) -> u32 {
    let [x, y, z] = middle;
    let [px, py, pz] = middle.map(|m| m * pad);
    let end = exit * pad;
    let without = |mask: u32, condition: bool| if condition { 0 } else { mask };
    let mut out = 0xff;
    out &= !without(0xff, enter <= end);
    // Before a plane that lies before the segment, behind one that lies behind it.
    out &= !without(0x55, enter <= px) & !without(0xaa, x <= end);
    out &= !without(0x33, enter <= py) & !without(0xcc, y <= end);
    out &= !without(0x0f, enter <= pz) & !without(0xf0, z <= end);
    // Behind the later of two planes and before the earlier.
    out &= !without(0x22, x <= py) & !without(0x44, y <= px);
    out &= !without(0x0a, x <= pz) & !without(0x50, z <= px);
    out &= !without(0x0c, y <= pz) & !without(0x30, z <= py);
    out & 0xff
}

impl Built {
    fn leaf(&self, first: u32, soup: &TriangleSoup, walk: &mut Walk) {
        for reference in &self.references[first as usize..] {
            walk.read(reference);
            walk.test(&soup.records[(reference & !LAST) as usize]);
            if reference & LAST != 0 {
                return;
            }
        }
    }

    /// Distances of the three planes `k` of cells of this size.
    fn distances(&self, k: [u32; 3], size: [f32; 3], ray: &Ray, inverse: [f32; 3]) -> [f32; 3] {
        let plane = |a| self.space.plane(a, k[a], size[a]);
        std::array::from_fn(|a| (plane(a) - ray.origin[a]) * inverse[a])
    }
}

impl Traverse for Built {
    fn trace(&self, soup: &TriangleSoup, mut walk: Walk) -> Hit {
        let ray = walk.ray;
        let inverse = walk.inverse;
        let mirror = inverse.map(|i| u32::from(i < 0.0));
        let flip = mirror[0] | mirror[1] << 1 | mirror[2] << 2;
        // The cell whose children are being visited: its block and the remaining children. At
        // first, a cell of twice the size whose only child is the root.
        let mut open = 1 << flip;
        let mut position = [0; 3];
        let mut size = self.space.extent.map(|e| 2.0 * e);
        let mut stack = Vec::new();
        loop {
            while open & FILLED_MASK == 0 {
                let Some(parent) = stack.pop() else {
                    return walk.hit;
                };
                open = parent;
                position = position.map(|p| p >> 1);
                size = size.map(|s| 2.0 * s);
            }
            let octant = open.trailing_zeros() ^ flip;
            open &= open - 1;
            let child = RootCell::child(position, octant);
            let half = size.map(|s| 0.5 * s);
            let first: [u32; 3] = std::array::from_fn(|a| child[a] + mirror[a]);
            let near = self.distances(first, half, &ray, *inverse);
            let enter = near[0].max(near[1]).max(near[2]).max(ray.t_min);
            if enter > walk.hit.t * END_PAD {
                return walk.hit;
            }
            let place = ((open >> INNER_SHIFT) * 8 + octant) as usize;
            let word = *walk.visit(place, &self.nodes[place]);
            if word & LEAF != 0 {
                self.leaf(word & !LEAF, soup, &mut walk);
                if walk.is_answered() {
                    return walk.hit;
                }
                continue;
            }
            let last = std::array::from_fn(|a| child[a] + 1 - mirror[a]);
            let far = self.distances(last, half, &ray, *inverse);
            let exit = far[0].min(far[1]).min(far[2]).min(walk.hit.t);
            let middle = self.distances(
                child.map(|c| 2 * c + 1),
                half.map(|h| 0.5 * h),
                &ray,
                *inverse,
            );
            stack.push(open);
            walk.count_stack(stack.len());
            let filled = mirrored(word & FILLED_MASK, flip);
            open = word & !FILLED_MASK | visited(enter, exit, middle, inverse.pad) & filled;
            (position, size) = (child, half);
        }
    }
}

#[cfg(test)]
mod tests;
