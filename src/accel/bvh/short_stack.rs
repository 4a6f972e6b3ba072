//! A short stack that drops its oldest entries; a trail of one bit per level leads back to them.
//! CPU version of `kernels/accel/bvh/short_stack.wesl`.
//!
//! Source: S. Laine, "Restart trail for stackless BVH traversal", HPG 2010. Here the trail records
//! which child the path takes, so that a restart tests no box; a second word records where the
//! other child is still pending. Visits are the same as with a full stack.

use super::super::leaf::LeafReader;
use super::super::ray::Hit;
use super::super::twin::Walk;
use super::layout::Nodes;
use super::{NONE, ROOT};
use std::collections::VecDeque;

pub(super) fn trace(nodes: &impl Nodes, entries: usize, leaves: LeafReader, mut walk: Walk) -> Hit {
    let mut stack = VecDeque::with_capacity(entries);
    let push = |stack: &mut VecDeque<u32>, walk: &mut Walk, node| {
        if stack.len() == entries {
            stack.pop_front();
        }
        stack.push_back(node);
        walk.count_stack(stack.len());
    };
    let (mut side, mut pending) = (0_u64, 0_u64);
    let mut current = ROOT;
    let mut level = 0;
    // Levels above this one are re-descended along the trail, without tests.
    let mut restart_end = 0;
    loop {
        if level < restart_end {
            let taken = (side >> level & 1) as u32;
            if pending >> level & 1 == 1 {
                let other = nodes.child(current, taken ^ 1, &mut walk);
                push(&mut stack, &mut walk, other);
            }
            current = nodes.child(current, taken, &mut walk);
            level += 1;
            continue;
        }
        let inner = nodes.visit(current, leaves, &mut walk);
        if walk.is_answered() {
            return walk.hit;
        }
        if inner.first != NONE {
            side = side & !(1 << level) | u64::from(inner.side) << level;
            if inner.second != NONE {
                pending |= 1 << level;
                push(&mut stack, &mut walk, inner.second);
            }
            current = inner.first;
            level += 1;
            continue;
        }
        if pending == 0 {
            return walk.hit;
        }
        level = pending.ilog2();
        pending ^= 1 << level;
        side ^= 1 << level;
        level += 1;
        if let Some(node) = stack.pop_back() {
            current = node;
            restart_end = 0;
        } else {
            restart_end = level;
            current = ROOT;
            level = 0;
        }
    }
}
