//! `bvh4`: compressed 4-wide BVH with nodes of 48 bytes, traversed in the order of distances.
//! Twin of `kernels/accel/bvh4.wesl`.
//!
//! Source: H. Dammertz, J. Hanika, A. Keller, "Shallow bounding volume hierarchies for fast SIMD ray
//! tracing of incoherent rays", EGSR 2008, with the quantised boxes of Ylitie, Karras & Laine 2017.

use super::bounds::Bounds;
use super::collapse::{CollapseSettings, WideChild, WideKind, WideTree};
use super::intersection::{Intersection, Reciprocal};
use super::ray::{Hit, NO_HIT, Ray};
use super::tree::Coverage;
use super::triangle::{TriangleRecord, intersect_triangle};
use super::wide::{
    Grid, Planes, enter_four, frame, leave_four, node_limit, wide_arrays, wide_parameters,
    wide_tree,
};
use super::{
    AccelError, AccelKind, BuildLog, BuiltAccel, Counters, CpuTwin, GpuBuffers, TriangleSoup,
};
use crate::accel::StructureStats;
use crate::params::{ParameterSchema, Params};
use bytemuck::{Pod, Zeroable};

const WIDTH: usize = 4;
/// A slot counts its triangles in two bits.
const MAX_LEAF: u32 = 3;
const INDEX_MASK: u32 = 0x00ff_ffff;
const MASK_SHIFT: u32 = 24;
const SLOT_BITS: u32 = 2;
const SLOT_MASK: u32 = 3;
const EMPTY_LIST: u32 = 1;
const ROOT_LIST: u32 = 4;
const DISTANCE_MASK: u32 = 0x7fff_fffc;
const LEAF: u32 = 0x8000_0000;
const MISSED: u32 = 0xffff_ffff;
const STACKED_MASK: u32 = 0xffff_ff00;

/// The registry entry.
pub struct Bvh4;

impl AccelKind for Bvh4 {
    fn name(&self) -> &'static str {
        "bvh4"
    }

    fn description(&self) -> &'static str {
        "compressed 4-wide BVH, 48-byte nodes, nearest first, stack (Dammertz, Hanika & Keller 2008)"
    }

    fn parameters(&self) -> ParameterSchema {
        wide_parameters(MAX_LEAF)
    }

    fn build(
        &self,
        soup: &TriangleSoup,
        params: &Params,
        log: &mut BuildLog,
    ) -> Result<Box<dyn BuiltAccel>, AccelError> {
        let params = &params.completed(&self.parameters())?;
        let tree = wide_tree(soup, params, log)?;
        let settings = CollapseSettings::new(WIDTH, params);
        let wide = log.phase("collapse", || {
            WideTree::collapse(&tree, &settings, |_, _| ())
        });
        node_limit("bvh4", wide.nodes.len(), INDEX_MASK)?;
        Ok(Box::new(log.phase("layout", || {
            Built::new(soup, &wide, params.flag("texels"))
        })))
    }
}

/// A node: three `vec4<u32>`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
struct Node {
    /// First plane on each axis.
    low: [f32; 3],
    /// Biased exponents, and which slots are inner children in the highest byte.
    exponents: u32,
    /// Index, and the triangles of each slot, two bits each, in the highest byte.
    first_child: u32,
    first_triangle: u32,
    /// Planes at the minimum on x, y, z.
    lows: [[u8; WIDTH]; 3],
    /// Planes at the maximum.
    highs: [[u8; WIDTH]; 3],
}

impl Node {
    fn inner_mask(&self) -> u32 {
        self.exponents >> MASK_SHIFT
    }

    /// First inner child with the mask of inner children.
    fn children(&self) -> u32 {
        self.first_child & INDEX_MASK | self.inner_mask() << MASK_SHIFT
    }

    fn counts(&self) -> u32 {
        self.first_child >> MASK_SHIFT
    }

    /// Places of the triangles of the leaf in `slot`; empty if it is none.
    fn leaf(&self, slot: u32) -> std::ops::Range<usize> {
        let before = self.counts() & ((1 << (2 * slot)) - 1);
        let first = self.first_triangle as usize + sum_of_pairs(before) as usize;
        first..first + (self.counts() >> (2 * slot) & 3) as usize
    }

    fn bounds(&self, slot: usize) -> Bounds {
        let [x, y, z, _] = self.exponents.to_le_bytes();
        let grid = Grid {
            low: self.low,
            exponents: [x, y, z],
        };
        grid.bounds(&Planes {
            low: self.lows.map(|q| q[slot]),
            high: self.highs.map(|q| q[slot]),
        })
    }
}

/// Index of the child in `slot` of a group's children.
fn child(children: u32, slot: u32) -> u32 {
    let before = children >> MASK_SHIFT & ((1 << slot) - 1);
    (children & INDEX_MASK) + before.count_ones()
}

struct Built {
    stats: StructureStats,
    nodes: Vec<Node>,
    leaf_triangles: Vec<TriangleRecord>,
    stack_entries: u32,
    texels: bool,
}

impl Built {
    fn new(soup: &TriangleSoup, wide: &WideTree, texels: bool) -> Self {
        let nodes: Vec<Node> = wide.nodes.iter().map(|slots| pack(slots)).collect();
        let leaf_triangles = wide.records(soup);
        let bytes = size_of_val(&nodes[..]) + size_of_val(&leaf_triangles[..]);
        Self {
            stats: StructureStats {
                bytes: bytes as u64,
                ..wide.stats()
            },
            nodes,
            leaf_triangles,
            // A level leaves one group behind at most.
            stack_entries: wide.depth,
            texels,
        }
    }

    fn trace(&self, ray: &Ray, inverse: Reciprocal, any: bool, counters: &mut Counters) -> Hit {
        let mut hit = Hit::miss(ray);
        let mut stack: Vec<(u32, u32)> = Vec::with_capacity(self.stack_entries as usize);
        let (mut children, mut list) = (0, ROOT_LIST);
        let mut next_nearest = 0;
        loop {
            let place = child(children, list & SLOT_MASK) as usize;
            counters.visit(place);
            counters.box_tests += WIDTH as u32;
            let node = &self.nodes[place];
            let rest = list >> SLOT_BITS;
            if rest != EMPTY_LIST {
                stack.push((children, next_nearest & STACKED_MASK | rest));
                counters.stack_high_water = counters.stack_high_water.max(stack.len() as u32);
            }
            let keys = sorted_keys(node, ray, inverse, hit.t);
            let slots = list_of(keys);
            let node_bits = list_bits(keys, LEAF);
            let all_bits = list_bits(keys, MISSED);
            children = node.children();
            list = slots & ((1 << node_bits) - 1) | 1 << node_bits;
            let mut nearest = keys[0] & DISTANCE_MASK;
            next_nearest = keys[1] & DISTANCE_MASK;
            for place in (node_bits..all_bits).step_by(SLOT_BITS as usize) {
                for triangle in &self.leaf_triangles[node.leaf(slots >> place & SLOT_MASK)] {
                    counters.triangle_tests += 1;
                    intersect_triangle(triangle, ray, inverse, &mut hit);
                    if any && hit.triangle != NO_HIT {
                        return hit;
                    }
                }
            }
            while list == EMPTY_LIST || f32::from_bits(nearest) > hit.t * inverse.pad {
                let Some(below) = stack.pop() else {
                    return hit;
                };
                children = below.0;
                list = below.1 & !STACKED_MASK;
                nearest = below.1 & STACKED_MASK;
                next_nearest = nearest;
            }
        }
    }
}

/// Keys of the children that are entered, in ascending order, then `MISSED`.
fn sorted_keys(node: &Node, ray: &Ray, inverse: Reciprocal, t_best: f32) -> [u32; 4] {
    let planes = frame(node.low, node.exponents, ray.origin, inverse);
    let words = |far: bool| -> [u32; 3] {
        std::array::from_fn(|axis| {
            let high = (inverse[axis] < 0.0) != far;
            u32::from_le_bytes(if high { node.highs } else { node.lows }[axis])
        })
    };
    let enter = enter_four(words(false), &planes, ray.t_min);
    let leave = leave_four(words(true), &planes, t_best);
    let mut keys = [0, 1, 2, 3].map(|slot: u32| {
        let i = slot as usize;
        let distance = enter[i].to_bits() & DISTANCE_MASK | slot;
        if enter[i] > leave[i] {
            MISSED
        } else if node.inner_mask() >> slot & 1 == 1 {
            distance
        } else if node.counts() >> (2 * slot) & 3 != 0 {
            distance | LEAF
        } else {
            MISSED
        }
    });
    keys.sort_unstable();
    keys
}

/// The slots of keys as a list.
fn list_of(keys: [u32; 4]) -> u32 {
    (0..4).fold(0, |list, i| {
        list | (keys[i] & SLOT_MASK) << (SLOT_BITS * i as u32)
    })
}

/// How many bits of a list belong to keys below `bound`.
fn list_bits(keys: [u32; 4], bound: u32) -> u32 {
    SLOT_BITS * keys.iter().filter(|&&key| key < bound).count() as u32
}

/// Sum of the two-bit numbers.
fn sum_of_pairs(pairs: u32) -> u32 {
    (0..4).map(|i| pairs >> (2 * i) & 3).sum()
}

/// The node with these children in its slots.
fn pack(children: &[WideChild]) -> Node {
    let mut node = Node::zeroed();
    if children.is_empty() {
        return node;
    }
    let bounds = children
        .iter()
        .fold(Bounds::EMPTY, |b, child| b.union(&child.bounds));
    let grid = Grid::new(&bounds);
    node.low = grid.low;
    let (mut inner_mask, mut counts) = (0_u8, 0);
    for (slot, child) in children.iter().enumerate() {
        let planes = grid.around(&child.bounds);
        for axis in 0..3 {
            node.lows[axis][slot] = planes.low[axis];
            node.highs[axis][slot] = planes.high[axis];
        }
        match child.kind {
            WideKind::Node(index) => {
                if inner_mask == 0 {
                    node.first_child = index;
                }
                inner_mask |= 1 << slot;
            }
            WideKind::Leaf { first, count } => {
                if counts == 0 {
                    node.first_triangle = first;
                }
                counts |= count << (2 * slot);
            }
        }
    }
    node.first_child |= counts << MASK_SHIFT;
    node.exponents = grid.exponent_word(inner_mask);
    node
}

impl BuiltAccel for Built {
    fn validate(&self, soup: &TriangleSoup) -> Result<(), AccelError> {
        let mut coverage = Coverage::new(soup, self.nodes.len());
        let mut open = vec![(0, Bounds::EVERYTHING, 1)];
        while let Some((index, around, depth)) = open.pop() {
            coverage.node(index)?;
            if depth > self.stack_entries {
                return Err(AccelError::Invalid(format!(
                    "node {index}: deeper than the stack of {}",
                    self.stack_entries
                )));
            }
            let node = &self.nodes[index];
            for slot in 0..WIDTH {
                // What is below must lie in every decoded box on the way.
                let bounds = around.intersection(&node.bounds(slot));
                let leaf = node.leaf(slot as u32);
                if node.inner_mask() >> slot & 1 == 1 {
                    if !leaf.is_empty() {
                        return Err(AccelError::Invalid(format!(
                            "node {index}: slot {slot} is a leaf and a node"
                        )));
                    }
                    let child = child(node.children(), slot as u32);
                    open.push((child as usize, bounds, depth + 1));
                } else if !leaf.is_empty() {
                    coverage.leaf(self.leaf_triangles.get(leaf), &bounds)?;
                }
            }
        }
        coverage.is_complete()
    }

    fn buffers(&self) -> GpuBuffers<'_> {
        GpuBuffers {
            kernel: "accel/bvh4",
            uniforms: vec![super::limits(self.nodes.len(), self.nodes.len())],
            // A multiple of 8, so that scenes of like depth share a kernel, and one to spare.
            constants: vec![(
                "STACK_ENTRIES",
                (self.stack_entries + 1).next_multiple_of(8),
            )],
            ..wide_arrays(&self.nodes, &self.leaf_triangles, self.texels)
        }
    }

    fn stats(&self) -> StructureStats {
        self.stats.clone()
    }

    fn cpu_twin<'a>(&'a self, soup: &'a TriangleSoup) -> Option<Box<dyn CpuTwin + 'a>> {
        Some(Box::new(Twin(self, soup.intersection)))
    }
}

struct Twin<'a>(&'a Built, Intersection);

impl CpuTwin for Twin<'_> {
    fn closest_hit(&self, ray: &Ray, counters: &mut Counters) -> Hit {
        let ray = &self.1.raised(ray);
        let inverse = self.1.inverse(ray.direction);
        self.0.trace(ray, inverse, false, counters)
    }

    fn any_hit(&self, ray: &Ray, counters: &mut Counters) -> bool {
        let ray = &self.1.raised(ray);
        let inverse = self.1.inverse(ray.direction);
        let hit = self.0.trace(ray, inverse, true, counters);
        hit.triangle != NO_HIT
    }
}
