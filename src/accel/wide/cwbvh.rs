//! `cwbvh`: compressed 8-wide BVH with nodes of 80 bytes, traversed in the order of the ray's
//! octant. CPU version of `kernels/accel/cwbvh.wesl`.
//!
//! Source: H. Ylitie, T. Karras, S. Laine, "Efficient incoherent ray traversal on GPUs through
//! compressed wide BVHs", HPG 2017.

use super::{
    OfNodes, Quantisation, Wide, WideChild, WideKind, WideNode, WideParameters, enter_four, frame,
    leave_four,
};
use crate::structure::prelude::*;
use bytemuck::{Pod, Zeroable};
use std::marker::PhantomData;
use std::ops::Range;

const WIDTH: usize = 8;
const PLACES_SHIFT: u32 = 8;
const SLOTS_MASK: u32 = 0xff;
const ROOT: u32 = 0x100;
const INDEX_MASK: u32 = 0x00ff_ffff;
const MASK_SHIFT: u32 = 24;
const COUNT_SHIFT: u32 = 5;
const PLACE_MASK: u32 = 31;

/// The registry entry.
pub struct Cwbvh;

impl Structure for Cwbvh {
    const NAME: &'static str = "cwbvh";
    const DESCRIPTION: &'static str =
        "compressed 8-wide BVH, 80-byte nodes, octant order, stack (Ylitie, Karras & Laine 2017)";
    type Parameters = WideParameters;

    fn build(soup: &TriangleSoup, options: &WideParameters, log: &mut BuildLog) -> BuildResult {
        Wide::<Node>::build(soup, options, log)
    }

    fn over_tree() -> Option<&'static dyn OverTree> {
        Some(&OfNodes::<Node>(PhantomData))
    }
}

/// A node: five `vec4<u32>`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
struct Node {
    /// First plane on each axis.
    low: [f32; 3],
    /// Biased exponents, and a mask of slots with inner children in the highest byte.
    exponents: u32,
    /// Index, and a mask of leaf slots in the highest byte.
    first_child: u32,
    first_triangle: u32,
    /// Leaves: number of triangles, shifted by 5, and their offset from the node's first.
    triangles: [u8; WIDTH],
    /// Planes at the minimum on x, y, z.
    lows: [[u8; WIDTH]; 3],
    /// Planes at the maximum.
    highs: [[u8; WIDTH]; 3],
}

impl Node {
    fn inner_mask(&self) -> u32 {
        self.exponents >> MASK_SHIFT
    }

    fn leaf_mask(&self) -> u32 {
        self.first_child >> MASK_SHIFT
    }

    fn child(&self, slot: u32) -> u32 {
        (self.first_child & INDEX_MASK) + (self.inner_mask() & ((1 << slot) - 1)).count_ones()
    }

    fn leaf(&self, slot: usize) -> Range<usize> {
        let triangles = u32::from(self.triangles[slot]);
        let first = self.first_triangle as usize + (triangles & PLACE_MASK) as usize;
        first..first + (triangles >> COUNT_SHIFT) as usize
    }
}

impl WideNode for Node {
    const STRUCTURE: &'static str = "cwbvh";
    const KERNEL: &'static str = "accel/cwbvh";
    const WIDTH: usize = WIDTH;
    const MOST_NODES: u64 = INDEX_MASK as u64;
    const BY_OCTANT: bool = true;

    fn pack(slots: &[WideChild]) -> Self {
        let (quantisation, [lows, highs]) = Quantisation::of_children(slots);
        let mut node = Node {
            low: quantisation.low,
            lows,
            highs,
            ..Node::zeroed()
        };
        let [mut inner_mask, mut leaf_mask] = [0_u8; 2];
        let mut triangles = 0;
        for (slot, child) in slots.iter().enumerate() {
            match child.kind {
                WideKind::Node(index) => {
                    if inner_mask == 0 {
                        node.first_child = index;
                    }
                    inner_mask |= 1 << slot;
                }
                WideKind::Leaf { count: 0, .. } => {}
                WideKind::Leaf { first, count } => {
                    if leaf_mask == 0 {
                        node.first_triangle = first;
                    }
                    leaf_mask |= 1 << slot;
                    node.triangles[slot] = (count << COUNT_SHIFT | triangles) as u8;
                    triangles += count;
                }
            }
        }
        node.first_child |= u32::from(leaf_mask) << MASK_SHIFT;
        node.exponents = quantisation.exponent_word(inner_mask);
        node
    }

    fn bounds(&self, slot: usize) -> Bounds {
        Quantisation::slot_bounds(self.low, self.exponents, [&self.lows, &self.highs], slot)
    }

    fn content(&self, slot: usize) -> (Option<usize>, Option<Range<usize>>) {
        let [is_inner, is_leaf] =
            [self.inner_mask(), self.leaf_mask()].map(|mask| mask >> slot & 1 == 1);
        (
            is_inner.then(|| self.child(slot as u32) as usize),
            is_leaf.then(|| self.leaf(slot)),
        )
    }

    fn trace(built: &Wide<Self>, walk: Walk) -> Hit {
        let mut at = begin(walk);
        while advance(built, &mut at) {}
        at.walk.hit
    }
}

/// The state of a ray between two nodes.
struct Traversal<'a> {
    walk: Walk<'a>,
    octant: u32,
    /// Index of the first inner child, and the group.
    group: (u32, u32),
    stack: Vec<(u32, u32)>,
}

fn begin(walk: Walk) -> Traversal {
    let backward = walk.inverse.map(|x| x < 0.0);
    Traversal {
        octant: (0..3).fold(0, |bits, axis| bits | u32::from(backward[axis]) << axis),
        walk,
        group: (0, ROOT),
        stack: Vec::new(),
    }
}

/// Visits a node and tests the triangles of its leaves; returns true if the ray continues.
fn advance(built: &Wide<Node>, at: &mut Traversal) -> bool {
    let (walk, group) = (&mut at.walk, at.group);
    walk.counters.box_tests += WIDTH as u32;
    let places = group.1 >> PLACES_SHIFT;
    let slot = bit_number(places & places.wrapping_neg()) ^ at.octant;
    let index = group.0 + (group.1 & ((1 << slot) - 1)).count_ones();
    let node = walk.visit(index as usize, &built.nodes[index as usize]);
    let left = places & (places - 1);
    if left != 0 {
        let waiting = (group.0, left << PLACES_SHIFT | group.1 & SLOTS_MASK);
        at.stack.push(waiting);
        walk.count_stack(at.stack.len());
    }
    let slots = slot_bits(node, walk);
    let inner = node.inner_mask();
    at.group = (
        node.first_child & INDEX_MASK,
        permute(slots & inner, at.octant) << PLACES_SHIFT | inner,
    );
    let mut leaves = slots & node.leaf_mask();
    while leaves != 0 {
        let leaf = bit_number(leaves & leaves.wrapping_neg());
        leaves &= leaves - 1;
        for triangle in &built.leaf_triangles[node.leaf(leaf as usize)] {
            walk.test(triangle);
            if walk.is_answered() {
                return false;
            }
        }
    }
    if at.group.1 < ROOT {
        match at.stack.pop() {
            Some(below) => at.group = below,
            None => return false,
        }
    }
    true
}

/// The index of a single set bit.
fn bit_number(bit: u32) -> u32 {
    bit.trailing_zeros()
}

/// Mask of a node's slots whose boxes are entered.
fn slot_bits(node: &Node, walk: &Walk) -> u32 {
    let (ray, inverse) = (&walk.ray, walk.inverse);
    let planes = frame(node.low, node.exponents, ray.origin, inverse);
    let mut bits = 0;
    for half in [0, 4] {
        let words = |far: bool| -> [u32; 3] {
            std::array::from_fn(|axis| {
                let high = (inverse[axis] < 0.0) != far;
                let q = if high { &node.highs } else { &node.lows }[axis];
                u32::from_le_bytes([q[half], q[half + 1], q[half + 2], q[half + 3]])
            })
        };
        let enter = enter_four(words(false), &planes, ray.t_min);
        let leave = leave_four(words(true), &planes, walk.hit.t);
        for i in 0..4 {
            bits |= u32::from(enter[i] <= leave[i]) << (half + i);
        }
    }
    bits
}

/// Moves bit i of eight to i ^ octant.
fn permute(bits: u32, octant: u32) -> u32 {
    (0..8).fold(0, |out, i| out | (bits >> i & 1) << (i ^ octant))
}
