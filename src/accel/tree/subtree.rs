//! Laying out trees whose nodes are known, in depth-first order.

use super::reference::Box3;
use super::{NodeKind, TreeNode};

/// A leaf over a range of the order.
pub(super) fn leaf(bounds: Box3, first: u32, count: usize) -> TreeNode {
    TreeNode {
        bounds: bounds.into(),
        kind: NodeKind::Leaf {
            first,
            count: count as u32,
        },
    }
}

/// Turns the node at `here`, whose first subtree is complete, into an inner one: in depth-first
/// order its second child comes next.
pub(super) fn make_inner(nodes: &mut [TreeNode], here: usize) {
    nodes[here].kind = NodeKind::Inner {
        left: here as u32 + 1,
        right: nodes.len() as u32,
    };
}

/// Lays out a tree in depth-first order: `visit` appends what it is given, and returns the children of an
/// inner node.
pub(super) fn depth_first<T>(
    root: T,
    nodes: &mut Vec<TreeNode>,
    mut visit: impl FnMut(T, &mut Vec<TreeNode>) -> Option<[T; 2]>,
) {
    // What is to be visited, with the parent whose second child it is.
    let mut stack = vec![(root, None)];
    while let Some((at, second_of)) = stack.pop() {
        if let Some(parent) = second_of {
            make_inner(nodes, parent);
        }
        let here = nodes.len();
        if let Some([left, right]) = visit(at, nodes) {
            stack.push((right, Some(here)));
            stack.push((left, None));
        }
    }
}
