//! A bound on the depth of trees whose builder has none.

use super::grow::lay_out;
use super::{NodeKind, Tree, TreeNode};

/// Depth limit of SAH splits; below it the median is used, which bounds the depth by `SAH_DEPTH +
/// log2(references) + 1` for any input.
pub(super) const SAH_DEPTH: u32 = 48;

/// Maximum leaf depth of a tree with this many references.
pub(super) fn depth_limit(references: usize) -> u32 {
    SAH_DEPTH + references.max(1).ilog2() + 1
}

/// `tree`, with balanced subtrees over the same leaves below [`SAH_DEPTH`] if it is too deep.
pub(super) fn limit_depth(tree: Tree) -> Tree {
    if tree.depth() <= depth_limit(tree.order.len()) {
        return tree;
    }
    lay_out(Part::Below(0), |part, depth, order| {
        let mut leaves = match part {
            Part::Below(index) => match tree.nodes[index as usize].kind {
                NodeKind::Inner { left, right } if depth < SAH_DEPTH => {
                    let bounds = tree.nodes[index as usize].bounds;
                    return (bounds, Some([left, right].map(Part::Below)));
                }
                _ => leaves_below(&tree, index),
            },
            Part::Balanced(leaves) => leaves,
        };
        let boxes = leaves.iter().map(|leaf| leaf.bounds);
        let bounds = boxes.fold(leaves[0].bounds, |all, bounds| all.union(&bounds));
        if let [
            TreeNode {
                kind: NodeKind::Leaf { first, count },
                ..
            },
        ] = leaves[..]
        {
            order.extend_from_slice(&tree.order[first as usize..(first + count) as usize]);
            return (bounds, None);
        }
        let high = leaves.split_off(leaves.len() / 2);
        (bounds, Some([leaves, high].map(Part::Balanced)))
    })
}

enum Part {
    Below(u32),
    /// A balanced tree over these leaves, at least one.
    Balanced(Vec<TreeNode>),
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bounds::Bounds;

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
