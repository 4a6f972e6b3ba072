//! Merging of subtrees that cost more than one leaf over their triangles.
//!
//! Greedy builders decide on a leaf before they know what a split would lead to. Here the subtree
//! exists already, so the decision is exact: for the given splits no other choice of leaves is
//! cheaper.

use super::parameters::Settings;
use super::{NodeKind, Tree};

/// What is known of a subtree once all below it is decided.
#[derive(Clone, Copy, Default)]
struct Below {
    /// Cost with the best choice of leaves, in areas of no particular node.
    cost: f32,
    /// First entry of the order.
    first: u32,
    /// Entries of the order.
    count: u32,
    /// Whether all of it is one leaf.
    is_leaf: bool,
    /// The node behind the subtree in depth-first order.
    end: u32,
}

/// Chooses the leaves of `tree`, whose leaves are consecutive runs of the order.
pub(super) fn choose_leaves(tree: Tree, settings: &Settings) -> Tree {
    let mut below = vec![Below::default(); tree.nodes.len()];
    for (index, node) in tree.nodes.iter().enumerate().rev() {
        let area = node.bounds.half_area();
        let as_leaf = |count: u32| settings.intersection_cost * area * count as f32;
        below[index] = match node.kind {
            NodeKind::Leaf { first, count } => Below {
                cost: as_leaf(count),
                first,
                count,
                is_leaf: true,
                end: index as u32 + 1,
            },
            NodeKind::Inner { left, right } => {
                let (l, r) = (below[left as usize], below[right as usize]);
                let count = l.count + r.count;
                let cost = settings.traversal_cost * area + l.cost + r.cost;
                let is_leaf = count as usize <= settings.leaf_size
                    && (as_leaf(count) <= cost || count as usize <= settings.min_leaf_size);
                Below {
                    cost: if is_leaf { as_leaf(count) } else { cost },
                    first: l.first,
                    count,
                    is_leaf,
                    end: r.end,
                }
            }
        };
    }
    copy_kept(tree, &below)
}

/// The nodes above and at the chosen leaves, still in depth-first order.
fn copy_kept(tree: Tree, below: &[Below]) -> Tree {
    let mut nodes = Vec::with_capacity(tree.nodes.len());
    let mut new_index = vec![0_u32; tree.nodes.len()];
    let mut index = 0;
    while let Some(node) = tree.nodes.get(index) {
        new_index[index] = nodes.len() as u32;
        let Below {
            first,
            count,
            is_leaf,
            end,
            ..
        } = below[index];
        let mut kept = *node;
        if is_leaf {
            kept.kind = NodeKind::Leaf { first, count };
        }
        nodes.push(kept);
        index = if is_leaf { end as usize } else { index + 1 };
    }
    for node in &mut nodes {
        if let NodeKind::Inner { left, right } = &mut node.kind {
            *left = new_index[*left as usize];
            *right = new_index[*right as usize];
        }
    }
    nodes.shrink_to_fit();
    Tree {
        nodes,
        order: tree.order,
    }
}
