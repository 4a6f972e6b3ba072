//! Near child first, the far one on a stack. Twin of `kernels/accel/bvh/stack.wesl`.

use super::super::leaf::LeafReader;
use super::super::ray::Hit;
use super::super::twin::Query;
use super::layout::Nodes;
use super::{NONE, ROOT};

pub(super) fn trace(nodes: &impl Nodes, leaves: LeafReader, mut query: Query) -> Hit {
    let mut stack = Vec::new();
    let mut current = ROOT;
    loop {
        let inner = nodes.visit(current, leaves, &mut query);
        if query.is_answered() {
            return query.hit;
        }
        if inner.second != NONE {
            stack.push(inner.second);
            query.count_stack(stack.len());
        }
        current = inner.first;
        if current == NONE {
            match stack.pop() {
                Some(node) => current = node,
                None => return query.hit,
            }
        }
    }
}
