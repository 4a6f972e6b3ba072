//! Top-down construction of a binary tree on all cores, shared by the builders.

use super::{NodeKind, Tree, TreeNode};
use crate::bounds::Bounds;

/// Subtrees with at most this many references are built by one thread.
pub(crate) const PARALLEL_GRAIN: usize = 4096;

/// Nodes in depth-first order, and the references of their leaves one after the other.
pub(crate) struct Grown<N> {
    pub nodes: Vec<(N, NodeKind)>,
    pub order: Vec<u32>,
}

/// Subtrees under construction, joined by reference and laid out once at the end: copying them at
/// every level would cost O(n log n).
enum Subtree<N> {
    Whole(Grown<N>),
    Inner(N, Box<[Subtree<N>; 2]>),
}

/// The tree over all of `whole`. `len` counts the references of a part; `split` makes the node
/// above it, given its depth, and splits it in two, or appends a leaf's list.
pub(crate) fn grow<P: Send, N: Send>(
    whole: P,
    len: impl Fn(&P) -> usize + Sync,
    split: impl Fn(P, u32, &mut Vec<u32>) -> (N, Option<[P; 2]>) + Sync,
) -> Grown<N> {
    let mut grown = Grown::with_room(2 * len(&whole));
    subtree(whole, 0, &len, &split).append_to(&mut grown);
    grown
}

/// Lays out a known tree on one thread: `look` gives box and children, or appends a leaf's list.
pub(super) fn lay_out<P>(
    root: P,
    look: impl Fn(P, u32, &mut Vec<u32>) -> (Bounds, Option<[P; 2]>),
) -> Tree {
    let mut grown = Grown::with_room(0);
    grown.append(root, 0, &look);
    grown.into()
}

fn subtree<P: Send, N: Send>(
    part: P,
    depth: u32,
    len: &(impl Fn(&P) -> usize + Sync),
    split: &(impl Fn(P, u32, &mut Vec<u32>) -> (N, Option<[P; 2]>) + Sync),
) -> Subtree<N> {
    let count = len(&part);
    let mut grown = Grown::with_room(count);
    if count <= PARALLEL_GRAIN {
        grown.append(part, depth, split);
        return Subtree::Whole(grown);
    }
    match split(part, depth, &mut grown.order) {
        (node, None) => {
            grown.push_leaf(node, 0);
            Subtree::Whole(grown)
        }
        (node, Some([low, high])) => {
            let below = |part| move || subtree(part, depth + 1, len, split);
            let (low, high) = rayon::join(below(low), below(high));
            Subtree::Inner(node, Box::new([low, high]))
        }
    }
}

impl<N> Grown<N> {
    fn with_room(nodes: usize) -> Self {
        Self {
            nodes: Vec::with_capacity(nodes),
            order: Vec::with_capacity(nodes),
        }
    }

    /// Appends the subtree over `part`, on one thread.
    fn append<P>(
        &mut self,
        part: P,
        depth: u32,
        split: &impl Fn(P, u32, &mut Vec<u32>) -> (N, Option<[P; 2]>),
    ) {
        // Pending parts, with the parent if the part is its second child. No recursion: trees that
        // are only laid out may be of any depth.
        let mut open = vec![(part, depth, None)];
        while let Some((part, depth, second_of)) = open.pop() {
            if let Some(parent) = second_of {
                self.end_first_child(parent);
            }
            let first = self.order.len();
            match split(part, depth, &mut self.order) {
                (node, None) => self.push_leaf(node, first),
                (node, Some([low, high])) => {
                    let here = self.push_inner(node);
                    open.push((high, depth + 1, Some(here)));
                    open.push((low, depth + 1, None));
                }
            }
        }
    }

    /// Appends a leaf that lists everything from `first` on.
    fn push_leaf(&mut self, node: N, first: usize) {
        let (first, end) = (first as u32, self.order.len() as u32);
        let count = end - first;
        self.nodes.push((node, NodeKind::Leaf { first, count }));
    }

    /// Appends an inner node, whose first child comes next.
    fn push_inner(&mut self, node: N) -> usize {
        let here = self.nodes.len();
        let left = here as u32 + 1;
        self.nodes
            .push((node, NodeKind::Inner { left, right: left }));
        here
    }

    /// Sets an inner node's second child to the next node.
    fn end_first_child(&mut self, here: usize) {
        let (left, right) = (here as u32 + 1, self.nodes.len() as u32);
        self.nodes[here].1 = NodeKind::Inner { left, right };
    }
}

impl<N> Subtree<N> {
    fn append_to(self, grown: &mut Grown<N>) {
        match self {
            Subtree::Whole(part) => {
                let (here, entries) = (grown.nodes.len() as u32, grown.order.len() as u32);
                grown.order.extend(part.order);
                let moved = part.nodes.into_iter().map(|(node, mut kind)| {
                    match &mut kind {
                        NodeKind::Inner { left, right } => {
                            (*left, *right) = (*left + here, *right + here)
                        }
                        NodeKind::Leaf { first, .. } => *first += entries,
                    }
                    (node, kind)
                });
                grown.nodes.extend(moved);
            }
            Subtree::Inner(node, children) => {
                let here = grown.push_inner(node);
                let [low, high] = *children;
                low.append_to(grown);
                grown.end_first_child(here);
                high.append_to(grown);
            }
        }
    }
}

impl From<Grown<Bounds>> for Tree {
    fn from(grown: Grown<Bounds>) -> Self {
        let node = |(bounds, kind)| TreeNode { bounds, kind };
        Tree::new(grown.nodes.into_iter().map(node).collect(), grown.order)
    }
}
