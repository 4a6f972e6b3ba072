//! Stackless: up to the parent, and from there to the far child. CPU version of
//! `kernels/accel/bvh/parent_pointer.wesl`.
//!
//! Sources: M. Hapala et al., "Efficient stack-less BVH traversal for ray tracing", SCCG 2011;
//! Dufay 2017, Algorithm 4.3, which as printed ends early after a missed first child and forgets
//! hits.

use super::super::leaf::LeafReader;
use super::super::ray::Hit;
use super::super::twin::Walk;
use super::layout::Nodes;
use super::{NONE, ROOT};

pub(super) fn trace(nodes: &impl Nodes, leaves: LeafReader, mut walk: Walk) -> Hit {
    let mut current = ROOT;
    // The child we come from; NONE on the way down.
    let mut from_child = NONE;
    loop {
        let next = if from_child == NONE {
            let inner = nodes.visit(current, leaves, &mut walk);
            if walk.is_answered() {
                return walk.hit;
            }
            inner.first
        } else {
            nodes.second_child(current, from_child, &mut walk)
        };
        if next != NONE {
            current = next;
            from_child = NONE;
        } else {
            from_child = current;
            current = nodes.parent(current);
            if current == NONE {
                return walk.hit;
            }
        }
    }
}
