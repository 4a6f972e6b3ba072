//! `bvh4`: compressed 4-wide BVH with nodes of 48 bytes, traversed in order of distance. CPU
//! version of `kernels/accel/bvh4.wesl`.
//!
//! Source: H. Dammertz, J. Hanika, A. Keller, "Shallow bounding volume hierarchies for fast SIMD
//! ray tracing of incoherent rays", EGSR 2008, with the quantised boxes of Ylitie, Karras & Laine
//! 2017.

use super::{
    OfNodes, Quantisation, Wide, WideChild, WideKind, WideNode, WideParameters, enter_four, frame,
    leave_four,
};
use crate::structure::prelude::*;
use bytemuck::{Pod, Zeroable};
use std::marker::PhantomData;
use std::ops::Range;

const WIDTH: usize = 4;
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

impl Structure for Bvh4 {
    const NAME: &'static str = "bvh4";
    const DESCRIPTION: &'static str = "compressed 4-wide BVH, 48-byte nodes, nearest first, stack (Dammertz, Hanika & Keller 2008)";
    type Parameters = WideParameters;

    fn build(soup: &TriangleSoup, options: &WideParameters, log: &mut BuildLog) -> BuildResult {
        Wide::<Node>::build(soup, options, log)
    }

    fn over_tree() -> Option<&'static dyn OverTree> {
        Some(&OfNodes::<Node>(PhantomData))
    }
}

/// A node: three `vec4<u32>`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
struct Node {
    /// First plane on each axis.
    low: [f32; 3],
    /// Biased exponents, and a mask of slots with inner children in the highest byte.
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

    /// Indices of the triangles of the leaf in `slot`; empty if it is none.
    fn leaf(&self, slot: u32) -> Range<usize> {
        let before = self.counts() & ((1 << (2 * slot)) - 1);
        let first = self.first_triangle as usize + sum_of_pairs(before) as usize;
        first..first + (self.counts() >> (2 * slot) & 3) as usize
    }
}

/// Index of the child in `slot` of a group's children.
fn child(children: u32, slot: u32) -> u32 {
    let before = children >> MASK_SHIFT & ((1 << slot) - 1);
    (children & INDEX_MASK) + before.count_ones()
}

impl WideNode for Node {
    const STRUCTURE: &'static str = "bvh4";
    const KERNEL: &'static str = "accel/bvh4";
    const WIDTH: usize = WIDTH;
    const MOST_NODES: u64 = INDEX_MASK as u64;
    const BY_OCTANT: bool = false;

    fn pack(children: &[WideChild]) -> Self {
        let (quantisation, [lows, highs]) = Quantisation::of_children(children);
        let mut node = Node {
            low: quantisation.low,
            lows,
            highs,
            ..Node::zeroed()
        };
        let (mut inner_mask, mut counts) = (0_u8, 0);
        for (slot, child) in children.iter().enumerate() {
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
        node.exponents = quantisation.exponent_word(inner_mask);
        node
    }

    fn bounds(&self, slot: usize) -> Bounds {
        Quantisation::slot_bounds(self.low, self.exponents, [&self.lows, &self.highs], slot)
    }

    fn content(&self, slot: usize) -> (Option<usize>, Option<Range<usize>>) {
        let is_inner = self.inner_mask() >> slot & 1 == 1;
        let leaf = self.leaf(slot as u32);
        (
            is_inner.then(|| child(self.children(), slot as u32) as usize),
            (!leaf.is_empty()).then_some(leaf),
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
    children: u32,
    list: u32,
    next_nearest: u32,
    stack: Vec<(u32, u32)>,
}

fn begin(walk: Walk) -> Traversal {
    Traversal {
        walk,
        children: 0,
        list: ROOT_LIST,
        next_nearest: 0,
        stack: Vec::new(),
    }
}

/// Visits a node and tests the triangles of its leaves; returns true if the ray continues.
fn advance(built: &Wide<Node>, at: &mut Traversal) -> bool {
    let walk = &mut at.walk;
    let place = child(at.children, at.list & SLOT_MASK) as usize;
    let node = walk.visit(place, &built.nodes[place]);
    walk.counters.box_tests += WIDTH as u32;
    let rest = at.list >> SLOT_BITS;
    if rest != EMPTY_LIST {
        let waiting = (at.children, at.next_nearest & STACKED_MASK | rest);
        at.stack.push(waiting);
        walk.count_stack(at.stack.len());
    }
    let keys = sorted_keys(node, walk);
    let slots = list_of(keys);
    let node_bits = list_bits(keys, LEAF);
    let all_bits = list_bits(keys, MISSED);
    at.children = node.children();
    at.list = slots & ((1 << node_bits) - 1) | 1 << node_bits;
    let mut nearest = keys[0] & DISTANCE_MASK;
    at.next_nearest = keys[1] & DISTANCE_MASK;
    for place in (node_bits..all_bits).step_by(SLOT_BITS as usize) {
        for triangle in &built.leaf_triangles[node.leaf(slots >> place & SLOT_MASK)] {
            walk.test(triangle);
            if walk.is_answered() {
                return false;
            }
        }
    }
    while at.list == EMPTY_LIST || f32::from_bits(nearest) > walk.hit.t * walk.inverse.pad {
        let Some(below) = at.stack.pop() else {
            return false;
        };
        at.children = below.0;
        at.list = below.1 & !STACKED_MASK;
        nearest = below.1 & STACKED_MASK;
        at.next_nearest = nearest;
    }
    true
}

/// Keys of the entered children, in ascending order, then `MISSED`.
fn sorted_keys(node: &Node, walk: &Walk) -> [u32; 4] {
    let (ray, inverse) = (&walk.ray, walk.inverse);
    let planes = frame(node.low, node.exponents, ray.origin, inverse);
    let words = |far: bool| -> [u32; 3] {
        std::array::from_fn(|axis| {
            let high = (inverse[axis] < 0.0) != far;
            u32::from_le_bytes(if high { node.highs } else { node.lows }[axis])
        })
    };
    let enter = enter_four(words(false), &planes, ray.t_min);
    let leave = leave_four(words(true), &planes, walk.hit.t);
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

fn list_of(keys: [u32; 4]) -> u32 {
    (0..4).fold(0, |list, i| {
        list | (keys[i] & SLOT_MASK) << (SLOT_BITS * i as u32)
    })
}

/// Number of list bits for keys below `bound`.
fn list_bits(keys: [u32; 4], bound: u32) -> u32 {
    SLOT_BITS * keys.iter().filter(|&&key| key < bound).count() as u32
}

/// Sum of the two-bit numbers.
fn sum_of_pairs(pairs: u32) -> u32 {
    (0..4).map(|i| pairs >> (2 * i) & 3).sum()
}
