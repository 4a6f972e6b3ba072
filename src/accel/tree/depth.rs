//! A bound on the depth of trees whose builder knows none.

use super::parameters::SAH_DEPTH;
use super::subtree::{depth_first, make_inner};
use super::{NodeKind, Tree, TreeNode};

/// Deepest leaf that a tree of so many references may have.
pub(super) fn depth_limit(references: usize) -> u32 {
    SAH_DEPTH + references.max(1).ilog2() + 1
}

/// `tree`, if it is not too deep; else with everything below [`SAH_DEPTH`] in balanced subtrees over
/// the same leaves.
pub(super) fn limit_depth(tree: Tree) -> Tree {
    if tree.depth() <= depth_limit(tree.order.len()) {
        return tree;
    }
    let mut nodes = Vec::with_capacity(tree.nodes.len());
    depth_first((0, 0), &mut nodes, |(index, depth), nodes| {
        let node = tree.nodes[index as usize];
        match node.kind {
            NodeKind::Inner { .. } if depth == SAH_DEPTH => {
                balance(&leaves_below(&tree, index), nodes);
                None
            }
            NodeKind::Inner { left, right } => {
                nodes.push(node);
                Some([(left, depth + 1), (right, depth + 1)])
            }
            NodeKind::Leaf { .. } => {
                nodes.push(node);
                None
            }
        }
    });
    Tree::new(nodes, tree.order)
}

fn leaves_below(tree: &Tree, root: u32) -> Vec<TreeNode> {
    let mut leaves = Vec::new();
    let mut stack = vec![root];
    while let Some(index) = stack.pop() {
        let node = tree.nodes[index as usize];
        match node.kind {
            NodeKind::Inner { left, right } => stack.extend([right, left]),
            NodeKind::Leaf { .. } => leaves.push(node),
        }
    }
    leaves
}

/// Appends a balanced subtree over `leaves`, at least one.
fn balance(leaves: &[TreeNode], nodes: &mut Vec<TreeNode>) {
    let here = nodes.len();
    nodes.push(leaves[0]);
    if leaves.len() > 1 {
        nodes[here].bounds = leaves
            .iter()
            .fold(leaves[0].bounds, |bounds, leaf| bounds.union(&leaf.bounds));
        let (low, high) = leaves.split_at(leaves.len() / 2);
        balance(low, nodes);
        make_inner(nodes, here);
        balance(high, nodes);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::bounds::Bounds;

    /// A chain of so many leaves.
    fn chain(leaves: u32) -> Tree {
        let mut nodes = Vec::new();
        let bounds = |from: u32| Bounds {
            min: [from as f32, 0.0, 0.0],
            max: [leaves as f32, 1.0, 1.0],
        };
        for first in 0..leaves {
            let kind = NodeKind::Leaf { first, count: 1 };
            if first + 1 < leaves {
                nodes.push(TreeNode {
                    bounds: bounds(first),
                    kind: NodeKind::Inner {
                        left: 2 * first + 1,
                        right: 2 * first + 2,
                    },
                });
            }
            nodes.push(TreeNode {
                bounds: bounds(first),
                kind,
            });
        }
        Tree::new(nodes, (0..leaves).collect())
    }

    #[test]
    fn a_chain_is_balanced_from_the_greatest_depth_of_splits_on() {
        let tree = chain(1000);
        assert_eq!(tree.depth(), 999);
        let bounded = limit_depth(tree);
        assert!(bounded.depth() <= depth_limit(1000), "{}", bounded.depth());
        assert_eq!(bounded.nodes.len(), 1999);
        let leaves = bounded.nodes.iter().filter_map(|node| match node.kind {
            NodeKind::Leaf { first, .. } => Some(first),
            NodeKind::Inner { .. } => None,
        });
        assert!(leaves.eq(0..1000));
        for node in &bounded.nodes {
            if let NodeKind::Inner { left, right } = node.kind {
                for child in [left, right] {
                    assert!(node.bounds.contains(&bounded.nodes[child as usize].bounds));
                }
            }
        }
    }

    #[test]
    fn a_shallow_tree_is_left_alone() {
        let tree = chain(20);
        assert_eq!(limit_depth(tree.clone()).nodes, tree.nodes);
    }
}
