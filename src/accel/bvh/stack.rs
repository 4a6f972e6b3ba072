//! Near child first, the far one on a stack. CPU version of `kernels/accel/bvh/stack.wesl`.

use super::super::leaf::LeafReader;
use super::super::ray::Hit;
use super::super::twin::Walk;
use super::layout::Nodes;
use super::{NONE, ROOT};

pub(super) fn trace(nodes: &impl Nodes, leaves: LeafReader, mut walk: Walk) -> Hit {
    let mut stack = Vec::new();
    let mut current = ROOT;
    loop {
        let inner = nodes.visit(current, leaves, &mut walk);
        if walk.is_answered() {
            return walk.hit;
        }
        if inner.second != NONE {
            stack.push(inner.second);
            walk.count_stack(stack.len());
        }
        current = inner.first;
        if current == NONE {
            match stack.pop() {
                Some(node) => current = node,
                None => return walk.hit,
            }
        }
    }
}
