//! Subtrees under construction, joined by reference and laid out once in the end: copying them at
//! every level would cost O(n log n).

use super::reference::Box3;
use super::{NodeKind, TreeNode};

/// Subtrees of fewer references are built by one thread.
pub(super) const PARALLEL_GRAIN: usize = 4096;

/// A subtree.
pub(super) enum Subtree {
    /// Nodes in depth-first order, children relative to the first.
    Whole(Vec<TreeNode>),
    /// Two subtrees below a node.
    Inner(Box3, Box<(Subtree, Subtree)>),
}

impl Subtree {
    pub fn leaf(bounds: Box3, first: u32, count: usize) -> Self {
        Subtree::Whole(vec![leaf(bounds, first, count)])
    }

    pub fn inner(bounds: Box3, low: Subtree, high: Subtree) -> Self {
        Subtree::Inner(bounds, Box::new((low, high)))
    }

    /// All nodes in depth-first order.
    pub fn lay_out(self) -> Vec<TreeNode> {
        let mut nodes = Vec::with_capacity(self.len());
        self.append_to(&mut nodes);
        nodes
    }

    fn len(&self) -> usize {
        match self {
            Subtree::Whole(part) => part.len(),
            Subtree::Inner(_, children) => 1 + children.0.len() + children.1.len(),
        }
    }

    fn append_to(self, nodes: &mut Vec<TreeNode>) {
        let here = nodes.len() as u32;
        match self {
            Subtree::Whole(part) => nodes.extend(part.into_iter().map(|mut node| {
                if let NodeKind::Inner { left, right } = &mut node.kind {
                    *left += here;
                    *right += here;
                }
                node
            })),
            Subtree::Inner(bounds, children) => {
                nodes.push(leaf(bounds, 0, 0));
                let (low, high) = *children;
                low.append_to(nodes);
                make_inner(nodes, here as usize);
                high.append_to(nodes);
            }
        }
    }
}

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
