//! Skip pointers: one order for all rays, no stack. CPU version of `kernels/accel/bvh/roped.wesl`.
//!
//! Sources: B. Smits, "Efficiency issues for ray tracing", 1998; Dufay 2017, Algorithm 4.4.

use super::super::leaf::{LEAF, LeafReader};
use super::super::ray::Hit;
use super::super::twin::Walk;
use super::boxes::{Boxes, CHILD_MASK};
use super::{NONE, ROOT};

/// The rope of a node: the first child points to the second, the second to the parent's target.
pub(super) fn rope_of(parent_rope: u32, child: u32) -> u32 {
    if child & 1 == 0 {
        child + 1
    } else {
        parent_rope
    }
}

/// Replaces links to parents by ropes.
pub(super) fn rope(mut boxes: Boxes) -> Boxes {
    for index in 0..boxes.0.len() {
        let node = boxes.0[index];
        if node.content < LEAF {
            let first = node.content & CHILD_MASK;
            for child in [first, first + 1] {
                boxes.0[child as usize].link = rope_of(node.link, child);
            }
        }
    }
    boxes
}

pub(super) fn trace(boxes: &Boxes, leaves: LeafReader, mut walk: Walk) -> Hit {
    let mut current = ROOT;
    loop {
        if current == NONE || walk.is_answered() {
            return walk.hit;
        }
        let node = walk.visit(current as usize, &boxes.0[current as usize]);
        if walk.enter(&node.bounds()).is_none() {
            current = node.link;
        } else if node.content >= LEAF {
            leaves.test_leaf(node.content, &mut walk);
            current = node.link;
        } else {
            current = node.content & CHILD_MASK;
        }
    }
}
