//! Wide trees from binary ones: the least SAH cost over all ways to pull up grandchildren and merge
//! leaves.
//!
//! Source: H. Ylitie, T. Karras, S. Laine, "Efficient incoherent ray traversal on GPUs through
//! compressed wide BVHs", HPG 2017, section 3.2.

use super::costs::Costs;
use super::octants::arrange;
use crate::bounds::Bounds;
use crate::tree::{NodeKind, Tree, TreeParameters, distinct};
use crate::triangle::TriangleRecord;
use crate::{StructureStats, TriangleSoup};

/// The node format of a wide tree.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Shape {
    /// Maximum children, 2 to 8.
    pub width: usize,
    /// True if children get slots by position ([`arrange`]), of which there are 8.
    pub by_octant: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum WideKind {
    /// A node, by index.
    Node(u32),
    /// A range of [`WideTree::order`].
    Leaf { first: u32, count: u32 },
}

/// A child of a wide node with its box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct WideChild {
    /// Box around everything below.
    pub bounds: Bounds,
    /// The contents.
    pub kind: WideKind,
}

impl WideChild {
    pub(crate) const NOTHING: WideChild = WideChild {
        bounds: Bounds::EMPTY,
        kind: WideKind::Leaf { first: 0, count: 0 },
    };

    pub(crate) fn is_nothing(&self) -> bool {
        matches!(self.kind, WideKind::Leaf { count: 0, .. })
    }
}

/// A tree of nodes with up to `width` children each. Node 0 is the root; node children of one node
/// are consecutive, in the order of the children.
#[derive(Debug, Clone, Default)]
pub(super) struct WideTree {
    /// Children of every node; one node without children for an empty scene.
    pub nodes: Vec<Vec<WideChild>>,
    /// Triangle indices, leaf by leaf in the order of the nodes' children.
    pub order: Vec<u32>,
    /// Nodes on the longest path from the root.
    pub depth: u32,
}

impl WideTree {
    /// Statistics of the tree; `bytes` is left 0. SAH with both constants 1, as for binary trees.
    pub(super) fn stats(&self) -> StructureStats {
        let children = || self.nodes.iter().flatten().filter(|c| !c.is_nothing());
        let leaves = children().filter_map(|child| match child.kind {
            WideKind::Node(_) => None,
            WideKind::Leaf { count, .. } => Some(count as usize),
        });
        let weighted = children().map(|child| {
            let weight = match child.kind {
                WideKind::Node(_) => 1,
                WideKind::Leaf { count, .. } => count,
            };
            f64::from(child.bounds.half_area()) * f64::from(weight)
        });
        let root = self.nodes[0]
            .iter()
            .fold(Bounds::EMPTY, |b, child| b.union(&child.bounds));
        let root_area = f64::from(root.half_area());
        StructureStats {
            nodes: self.nodes.len() as u64,
            depth: Some(self.depth),
            sah_cost: (root_area > 0.0).then(|| 1.0 + weighted.sum::<f64>() / root_area),
            ..StructureStats::of_leaves(leaves)
        }
    }

    pub(super) fn records(&self, soup: &TriangleSoup) -> Vec<TriangleRecord> {
        self.order
            .iter()
            .map(|&id| soup.records[id as usize])
            .collect()
    }

    /// Collapses `tree`, whose leaves must hold at most `leaf_size` triangles.
    pub(super) fn collapse(tree: &Tree, shape: Shape, settings: &TreeParameters) -> WideTree {
        let mut out = WideTree {
            nodes: vec![Vec::new()],
            order: Vec::with_capacity(tree.order.len()),
            depth: 1,
        };
        if tree.nodes.is_empty() {
            return out;
        }
        let costs = Costs::new(tree, shape.width, settings);
        // Wide nodes whose children are not yet found, as (index, binary node, depth).
        let mut open = vec![(0_u32, 0_u32, 1_u32)];
        let (mut roots, mut listed) = (Vec::new(), Vec::new());
        while let Some((place, binary, depth)) = open.pop() {
            out.depth = out.depth.max(depth);
            costs.children(binary, &mut roots);
            let mut children: Vec<WideChild> = (roots.iter())
                .map(|&root| WideChild {
                    bounds: tree.nodes[root as usize].bounds,
                    kind: costs.kind(root),
                })
                .collect();
            if shape.by_octant {
                children = arrange(&tree.nodes[binary as usize].bounds, &children);
            }
            let first_open = open.len();
            for child in &mut children {
                child.kind = match child.kind {
                    WideKind::Node(root) => {
                        let here = out.nodes.len() as u32;
                        out.nodes.push(Vec::new());
                        open.push((here, root, depth + 1));
                        WideKind::Node(here)
                    }
                    WideKind::Leaf { count: 0, .. } => continue,
                    WideKind::Leaf { first: root, .. } => {
                        let first = out.order.len() as u32;
                        listed.clear();
                        append_triangles(tree, root, &mut listed);
                        // Spatial splits may list a triangle twice.
                        out.order.extend(distinct(&listed));
                        let count = out.order.len() as u32 - first;
                        WideKind::Leaf { first, count }
                    }
                };
            }
            // Depth-first, first child first.
            open[first_open..].reverse();
            out.nodes[place as usize] = children;
        }
        out
    }
}

fn append_triangles(tree: &Tree, root: u32, order: &mut Vec<u32>) {
    match tree.nodes[root as usize].kind {
        NodeKind::Leaf { first, count } => {
            order.extend_from_slice(&tree.order[first as usize..(first + count) as usize]);
        }
        NodeKind::Inner { left, right } => {
            append_triangles(tree, left, order);
            append_triangles(tree, right, order);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tree::TreeNode;
    use raystone_core::random::Pcg32;

    fn around(x: f32, size: f32) -> Bounds {
        Bounds {
            min: [x, 0.0, 0.0],
            max: [x + size, size, size],
        }
    }

    /// A random tree over `count` boxes of one triangle each; returns its index.
    fn grow(nodes: &mut Vec<TreeNode>, first: u32, count: u32, random: &mut Pcg32) -> usize {
        let here = nodes.len();
        let leaf = NodeKind::Leaf { first, count };
        let bounds = around(random.uniform() as f32 * 9.0, 0.2 + random.uniform() as f32);
        nodes.push(TreeNode { bounds, kind: leaf });
        if count > 1 {
            let middle = 1 + random.below(count as usize - 1) as u32;
            let left = grow(nodes, first, middle, random);
            let right = grow(nodes, first + middle, count - middle, random);
            nodes[here] = TreeNode {
                bounds: nodes[left].bounds.union(&nodes[right].bounds),
                kind: NodeKind::Inner {
                    left: left as u32,
                    right: right as u32,
                },
            };
        }
        here
    }

    fn random_tree(count: u32, random: &mut Pcg32) -> Tree {
        let mut tree = Tree {
            order: (0..count).collect(),
            ..Default::default()
        };
        grow(&mut tree.nodes, 0, count, random);
        tree
    }

    fn settings(leaf_size: usize) -> TreeParameters {
        TreeParameters {
            leaf_size,
            intersection_cost: 0.6,
            ..TreeParameters::default()
        }
    }

    /// Least cost of all ways to collapse, by exhaustive search: every set of roots that represents
    /// the subtree of a node is opened root by root.
    fn least_cost(tree: &Tree, node: usize, width: usize, leaf_size: u32) -> f32 {
        let area = tree.nodes[node].bounds.half_area();
        let count = below(tree, node);
        let as_leaf = if count <= leaf_size {
            area * count as f32 * 0.6
        } else {
            f32::INFINITY
        };
        let NodeKind::Inner { left, right } = tree.nodes[node].kind else {
            return as_leaf;
        };
        let mut best = f32::INFINITY;
        let mut sets = vec![vec![left as usize, right as usize]];
        while let Some(set) = sets.pop() {
            let costs = set.iter().map(|&n| least_cost(tree, n, width, leaf_size));
            best = best.min(costs.sum());
            for (place, &member) in set.iter().enumerate() {
                if let NodeKind::Inner { left, right } = tree.nodes[member].kind
                    && set.len() < width
                {
                    let mut opened = set.clone();
                    opened[place] = left as usize;
                    opened.push(right as usize);
                    sets.push(opened);
                }
            }
        }
        as_leaf.min(area + best)
    }

    fn cost_of(wide: &WideTree, node: usize, bounds: &Bounds) -> f32 {
        let child = |child: &WideChild| match child.kind {
            WideKind::Node(index) => cost_of(wide, index as usize, &child.bounds),
            WideKind::Leaf { count, .. } => child.bounds.half_area() * count as f32 * 0.6,
        };
        bounds.half_area() + wide.nodes[node].iter().map(child).sum::<f32>()
    }

    #[test]
    fn no_other_collapse_is_cheaper() {
        let mut random = Pcg32::new(3);
        for round in 0..60 {
            let leaf_size = 1 + round % 3;
            let tree = random_tree(4 + random.below(5) as u32, &mut random);
            for width in [2, 3, 4] {
                let shape = Shape {
                    width,
                    by_octant: false,
                };
                let wide = WideTree::collapse(&tree, shape, &settings(leaf_size));
                let children = wide.nodes.iter().flatten();
                let largest = children.filter_map(|child| match child.kind {
                    WideKind::Leaf { count, .. } => Some(count as usize),
                    WideKind::Node(_) => None,
                });
                assert!(largest.max() <= Some(leaf_size));
                let found = cost_of(&wide, 0, &tree.nodes[0].bounds);
                let least = least_cost(&tree, 0, width, leaf_size as u32);
                assert!(
                    (found - least).abs() <= 1e-4 * least,
                    "{width}, {leaf_size}: {found}, {least}"
                );
            }
        }
    }

    fn below(tree: &Tree, node: usize) -> u32 {
        match tree.nodes[node].kind {
            NodeKind::Leaf { count, .. } => count,
            NodeKind::Inner { left, right } => {
                below(tree, left as usize) + below(tree, right as usize)
            }
        }
    }
}
