//! `kd-tree`: space halved by planes placed by the SAH, leaves with references, traversed near side
//! first with a stack. CPU version of `kernels/accel/kd_tree.wesl`.
//!
//! Sources: I. Wald, V. Havran, "On building fast kd-trees for ray tracing, and on doing that in
//! O(N log N)", 2006 (builder); V. Havran, "Heuristic ray shooting algorithms", 2000, algorithm
//! `TA_rec_B` (traversal with the interval of the ray in each cell); M. Pharr et al., "Physically
//! based rendering", 2004 (8-byte nodes). Why hits are bit-identical to brute force:
//! [`super::spatial`].

mod build;
mod validate;

pub(crate) use build::default_depth;

use super::bounds::{Bounds, slab};
use super::structure::prelude::*;
use bytemuck::{Pod, Zeroable};
use raystone_gpu::UniformValues;

/// Low bits of [`Node::link`]: the axis of the plane, or [`LEAF`].
const KIND_MASK: u32 = 3;
const LEAF: u32 = 3;
/// The other bits: first of two children, or number of references.
const LINK_SHIFT: u32 = 2;
/// A cell that begins beyond the hit by this factor ends the traversal: all others on the stack begin no more than
/// `BOX_PAD` before it. More than its square.
const END_PAD: f32 = 1.000_004;

parameters! {
    /// Which cells are divided, and what they list.
    pub struct Options {
        /// deepest leaf; 0 stands for 8 + 1.3 log2 of the number of triangles
        max_depth: u32 = 0, in 0..=64;
        /// SAH cost of visiting an inner node
        traversal_cost: f32 = 1.0, in 0.01..=100.0;
        /// SAH cost of testing a triangle
        intersection_cost: f32 = 1.0, in 0.01..=100.0;
        /// fraction of its cost that a split saves which cuts off empty space
        empty_bonus: f32 = 0.2, in 0.0..=0.9;
        /// perfect splits: cells that a triangle's box reaches but the triangle does not are spared it
        clip: bool = true;
    }
}

pub(crate) struct KdTree;

impl Structure for KdTree {
    const NAME: &'static str = "kd-tree";
    const DESCRIPTION: &'static str = "kd-tree, SAH over all box faces in O(N log N) (Wald & Havran 2006), leaf references, stack";
    type Parameters = Options;

    fn build(soup: &TriangleSoup, options: &Options, log: &mut BuildLog) -> BuildResult {
        let bounds = if soup.records.is_empty() {
            Bounds {
                min: [0.0; 3],
                max: [1.0; 3],
            }
        } else {
            soup.bounds()
        };
        let tree = build::build(soup, bounds, options, log)?;
        let mut built = Built {
            bounds,
            clipped: options.clip,
            nodes: tree.nodes,
            references: tree.references,
            stats: StructureStats::default(),
        };
        built.stats = log.phase("stats", || built.measure());
        Ok(Box::new(built))
    }
}

/// A plane or a leaf, 8 bytes.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
struct Node {
    /// Bits of the plane's position, or the leaf's first index into the references.
    word: u32,
    /// Kind in the low bits; above them the first of two children, below and above the plane, or
    /// the leaf's number of references.
    link: u32,
}

#[derive(Clone, Copy)]
enum Content {
    Inner {
        axis: usize,
        position: f32,
        children: usize,
    },
    Leaf {
        first: usize,
        count: usize,
    },
}

impl Node {
    const EMPTY: Node = Node {
        word: 0,
        link: LEAF,
    };

    fn inner(axis: usize, position: f32, children: usize) -> Self {
        Self {
            word: position.to_bits(),
            link: (children as u32) << LINK_SHIFT | axis as u32,
        }
    }

    fn leaf(first: usize, count: usize) -> Self {
        Self {
            word: first as u32,
            link: (count as u32) << LINK_SHIFT | LEAF,
        }
    }

    fn content(self) -> Content {
        let link = (self.link >> LINK_SHIFT) as usize;
        match self.link & KIND_MASK {
            LEAF => Content::Leaf {
                first: self.word as usize,
                count: link,
            },
            axis => Content::Inner {
                axis: axis as usize,
                position: f32::from_bits(self.word),
                children: link,
            },
        }
    }
}

fn halves(cell: &Bounds, axis: usize, position: f32) -> [Bounds; 2] {
    let mut halves = [*cell; 2];
    halves[0].max[axis] = position;
    halves[1].min[axis] = position;
    halves
}

struct Built {
    bounds: Bounds,
    clipped: bool,
    /// Root first; children of a node are adjacent.
    nodes: Vec<Node>,
    /// Triangle indices, leaf by leaf, ascending in each.
    references: Vec<u32>,
    stats: StructureStats,
}

impl Built {
    fn measure(&self) -> StructureStats {
        let mut counts = Vec::new();
        let (mut cost, mut deepest) = (0.0, 0);
        let mut stack = vec![(0, self.bounds, 0)];
        while let Some((index, cell, depth)) = stack.pop() {
            let node: Node = self.nodes[index];
            let weight = match node.content() {
                Content::Leaf { count, .. } => {
                    counts.push(count);
                    deepest = deepest.max(depth);
                    count as f64
                }
                Content::Inner {
                    axis,
                    position,
                    children,
                } => {
                    let [below, above] = halves(&cell, axis, position);
                    stack.push((children, below, depth + 1));
                    stack.push((children + 1, above, depth + 1));
                    1.0
                }
            };
            cost += weight * f64::from(cell.half_area());
        }
        let root_area = f64::from(self.bounds.half_area());
        StructureStats {
            nodes: self.nodes.len() as u64,
            leaves: counts.len() as u64,
            depth: Some(deepest),
            sah_cost: (root_area > 0.0).then(|| cost / root_area),
            bytes: self.buffers().bytes(),
            ..StructureStats::of_leaves(counts.into_iter())
        }
    }
}

impl BuiltAccel for Built {
    fn validate(&self, soup: &TriangleSoup) -> Result<(), AccelError> {
        validate::validate(self, soup)
    }

    fn buffers(&self) -> GpuBuffers<'_> {
        let tree = UniformValues::new()
            .vec("low", &self.bounds.min)
            .vec("high", &self.bounds.max);
        let depth = self.stats.depth.unwrap_or(0);
        GpuBuffers {
            kernel: "accel/kd_tree",
            features: Vec::new(),
            arrays: vec![
                NamedWords::new("nodes", &self.nodes),
                NamedWords::new("references", &self.references),
            ],
            uniforms: vec![
                ("tree", tree),
                limits(self.nodes.len() + 1, self.nodes.len()),
            ],
            // At most one entry per level; rounded, so that scenes of similar depth share a kernel.
            constants: vec![("STACK_ENTRIES", depth.max(1).next_multiple_of(16))],
        }
    }

    fn stats(&self) -> StructureStats {
        self.stats.clone()
    }

    fn cpu_twin<'a>(&'a self, soup: &'a TriangleSoup) -> Option<Box<dyn CpuTwin + 'a>> {
        Some(Box::new(Twin(self, soup)))
    }
}

impl Traverse for Built {
    fn trace(&self, soup: &TriangleSoup, mut walk: Walk) -> Hit {
        let ray = walk.ray;
        let inverse = walk.inverse;
        walk.counters.box_tests += 1;
        let (enter, end) = slab(&self.bounds, &ray, *inverse);
        let mut enter = enter.max(ray.t_min);
        let mut exit = end.min(walk.hit.t);
        if enter > exit * inverse.pad {
            return walk.hit;
        }
        // Pending far sides, with the ray's entry distance.
        let mut stack: Vec<(usize, f32)> = Vec::new();
        let mut current = 0;
        loop {
            match walk.visit(current, &self.nodes[current]).content() {
                Content::Inner {
                    axis,
                    position,
                    children,
                } => {
                    let plane = (position - ray.origin[axis]) * inverse[axis];
                    let side = usize::from(inverse[axis] < 0.0);
                    let (near, far) = (children + side, children + 1 - side);
                    if plane > exit * inverse.pad {
                        current = near;
                    } else if enter > plane * inverse.pad {
                        current = far;
                    } else {
                        stack.push((far, enter.max(plane)));
                        walk.count_stack(stack.len());
                        exit = exit.min(plane);
                        current = near;
                    }
                }
                Content::Leaf { first, count } => {
                    walk.test_list(soup, &self.references[first..first + count]);
                    if walk.is_answered() {
                        return walk.hit;
                    }
                    match stack.pop() {
                        Some((far, distance)) if distance <= walk.hit.t * END_PAD => {
                            (current, enter) = (far, distance);
                        }
                        _ => return walk.hit,
                    }
                    // A cell ends where the next one on the stack begins.
                    exit = stack.last().map_or(end, |(_, next)| *next).min(walk.hit.t);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
