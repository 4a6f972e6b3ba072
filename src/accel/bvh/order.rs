//! Memory order of the inner nodes of a tree. Parents always come before their children.

use super::super::tree::{NodeKind, Tree, TreeNode};
use super::options::NodeOrder;
use crate::bounds::Bounds;
use std::collections::VecDeque;

pub(super) struct InnerNodes {
    /// Tree index of each.
    pub nodes: Vec<u32>,
    /// Index into `nodes` for each node of the tree; undefined for leaves.
    pub places: Vec<u32>,
    /// Children of each node of the tree in layout order.
    children: Vec<Option<[u32; 2]>>,
}

impl InnerNodes {
    /// Orders the inner nodes; `swap` returns true if the right child goes first.
    pub(super) fn new(tree: &Tree, order: NodeOrder, swap: impl Fn(u32, u32) -> bool) -> Self {
        let children: Vec<_> = tree
            .nodes
            .iter()
            .map(|node| match node.kind {
                NodeKind::Leaf { .. } => None,
                NodeKind::Inner { left, right } if swap(left, right) => Some([right, left]),
                NodeKind::Inner { left, right } => Some([left, right]),
            })
            .collect();
        let mut nodes = Vec::new();
        if children.first().is_some_and(Option::is_some) {
            match order {
                NodeOrder::DepthFirst => depth_first(&children, &mut nodes),
                NodeOrder::BreadthFirst => breadth_first(&children, &mut nodes),
                NodeOrder::VanEmdeBoas => {
                    van_emde_boas(&children, 0, tree.depth(), &mut nodes);
                }
            }
        }
        let mut places = vec![u32::MAX; tree.nodes.len()];
        for (place, &node) in nodes.iter().enumerate() {
            places[node as usize] = place as u32;
        }
        Self {
            nodes,
            places,
            children,
        }
    }

    /// Children of an inner node, first one first.
    pub(super) fn children(&self, node: u32) -> Option<[u32; 2]> {
        self.children[node as usize]
    }
}

/// Orders the inner nodes of a full tree of sixteen leaves, whose nodes are numbered level by level.
///
/// # Errors
/// They come otherwise: the order, and both lists.
pub(crate) fn check() -> Result<(), String> {
    const VAN_EMDE_BOAS: [u32; 15] = [0, 1, 2, 3, 7, 8, 4, 9, 10, 5, 11, 12, 6, 13, 14];
    const DEPTH_FIRST: [u32; 15] = [0, 1, 3, 7, 8, 4, 9, 10, 2, 5, 11, 12, 6, 13, 14];
    let node = |k: u32| TreeNode {
        bounds: Bounds::EMPTY,
        kind: match k.checked_sub(15) {
            Some(first) => NodeKind::Leaf { first, count: 1 },
            None => NodeKind::Inner {
                left: 2 * k + 1,
                right: 2 * k + 2,
            },
        },
    };
    let tree = Tree {
        nodes: (0..31).map(node).collect(),
        order: (0..16).collect(),
        epo: None,
    };
    for (order, expected) in [
        (NodeOrder::DepthFirst, DEPTH_FIRST),
        (NodeOrder::BreadthFirst, std::array::from_fn(|k| k as u32)),
        (NodeOrder::VanEmdeBoas, VAN_EMDE_BOAS),
    ] {
        let found = InnerNodes::new(&tree, order, |_, _| false).nodes;
        if found != expected {
            return Err(format!(
                "nodes of a known tree come in the order {found:?}, and should come in {expected:?}: structures are laid out \
                 otherwise than this program says; build it anew, and report what stays wrong"
            ));
        }
    }
    Ok(())
}

type Children = [Option<[u32; 2]>];

fn depth_first(children: &Children, out: &mut Vec<u32>) {
    let mut stack = vec![0];
    while let Some(node) = stack.pop() {
        if let Some([first, second]) = children[node as usize] {
            out.push(node);
            stack.extend([second, first]);
        }
    }
}

fn breadth_first(children: &Children, out: &mut Vec<u32>) {
    let mut queue = VecDeque::from([0]);
    while let Some(node) = queue.pop_front() {
        if let Some(both) = children[node as usize] {
            out.push(node);
            queue.extend(both);
        }
    }
}

/// The top half of the levels, then each subtree below it, both recursively (P. van Emde Boas 1975;
/// Bender et al. 2000). Appends the inner nodes of the upper `levels` levels below `node` and
/// returns the inner nodes under them.
fn van_emde_boas(children: &Children, node: u32, levels: u32, out: &mut Vec<u32>) -> Vec<u32> {
    if levels <= 1 {
        out.push(node);
        let inner = |child: &u32| children[*child as usize].is_some();
        let both = children[node as usize].into_iter().flatten();
        return both.filter(inner).collect();
    }
    let top = levels / 2;
    let middle = van_emde_boas(children, node, top, out);
    let mut below = Vec::new();
    for root in middle {
        below.extend(van_emde_boas(children, root, levels - top, out));
    }
    below
}
