//! Least costs of representing the subtree of each binary node by 1, 2, … children of a wide node, and which nodes are
//! the children of one. Twin of `kernels/accel/wide/costs.wesl`.
//!
//! Source: H. Ylitie, T. Karras, S. Laine, "Efficient incoherent ray traversal on GPUs through
//! compressed wide BVHs", HPG 2017, section 3.2.

use super::WideKind;
use crate::accel::tree::{NodeKind, Tree, TreeParameters};

/// Most children of a node; its table has one entry less.
const MAX_WIDTH: usize = 8;
/// Words of the largest table.
pub const WORDS: u64 = MAX_WIDTH as u64 - 1;
/// Larger than the cost of any tree.
const NEVER: f32 = 3.4e38;

/// C(n, i) of the paper for all nodes n and i below the width, and how many triangles each node holds.
pub struct Costs<'a> {
    tree: &'a Tree,
    width: usize,
    settings: &'a TreeParameters,
    costs: Vec<[f32; MAX_WIDTH - 1]>,
    triangles: Vec<u32>,
}

/// The least cost of two subtrees, and how many of the children the first one gets.
struct Share {
    cost: f32,
    first: usize,
}

impl<'a> Costs<'a> {
    /// Of nodes with so many children at most, 2 to 8.
    pub fn new(tree: &'a Tree, width: usize, settings: &'a TreeParameters) -> Self {
        let mut costs = Self {
            tree,
            width,
            settings,
            costs: vec![[NEVER; MAX_WIDTH - 1]; tree.nodes.len()],
            triangles: vec![0; tree.nodes.len()],
        };
        // Children come after their parents.
        for node in (0..tree.nodes.len() as u32).rev() {
            costs.fill(node);
        }
        costs
    }

    /// The children of an inner node.
    fn links(&self, node: u32) -> Option<[u32; 2]> {
        match self.tree.nodes[node as usize].kind {
            NodeKind::Inner { left, right } => Some([left, right]),
            NodeKind::Leaf { .. } => None,
        }
    }

    fn half_area(&self, node: u32) -> f32 {
        self.tree.nodes[node as usize].bounds.half_area()
    }

    fn cost_of(&self, node: u32, children: usize) -> f32 {
        self.costs[node as usize][children - 1]
    }

    fn leaf_cost(&self, node: u32) -> f32 {
        let count = self.triangles[node as usize];
        if count as usize > self.settings.leaf_size {
            return NEVER;
        }
        self.half_area(node) * count as f32 * self.settings.intersection_cost
    }

    fn inner_cost(&self, node: u32, pair: [u32; 2]) -> f32 {
        self.half_area(node) * self.settings.traversal_cost + self.share(pair, self.width).cost
    }

    fn share(&self, [left, right]: [u32; 2], children: usize) -> Share {
        let mut best = Share {
            cost: NEVER,
            first: 1,
        };
        for first in 1..children {
            let cost = self.cost_of(left, first) + self.cost_of(right, children - first);
            if cost < best.cost {
                best = Share { cost, first };
            }
        }
        best
    }

    /// Costs of a node whose children have theirs.
    fn fill(&mut self, node: u32) {
        let index = node as usize;
        let pair = match self.tree.nodes[index].kind {
            NodeKind::Leaf { count, .. } => {
                self.triangles[index] = count;
                self.costs[index] = [self.leaf_cost(node); MAX_WIDTH - 1];
                return;
            }
            NodeKind::Inner { left, right } => [left, right],
        };
        let [left, right] = pair.map(|child| self.triangles[child as usize]);
        self.triangles[index] = left.saturating_add(right);
        let mut least = self.leaf_cost(node).min(self.inner_cost(node, pair));
        for children in 1..self.width {
            if children > 1 {
                least = least.min(self.share(pair, children).cost);
            }
            self.costs[index][children - 1] = least;
        }
    }

    /// Whether a node whose costs are known is a leaf, if it is one child.
    fn is_leaf(&self, node: u32) -> bool {
        let Some(pair) = self.links(node) else {
            return true;
        };
        self.triangles[node as usize] as usize <= self.settings.leaf_size
            && self.leaf_cost(node) <= self.inner_cost(node, pair)
    }

    /// What a subtree that is one child is: a leaf has its binary root in place of the first triangle.
    pub fn kind(&self, root: u32) -> WideKind {
        match self.is_leaf(root) {
            false => WideKind::Node(root),
            true => WideKind::Leaf {
                first: root,
                count: self.triangles[root as usize],
            },
        }
    }

    /// How many of so many children pay.
    fn used(&self, node: u32, children: usize) -> usize {
        let mut most = children;
        while most > 1 && self.cost_of(node, most) == self.cost_of(node, most - 1) {
            most -= 1;
        }
        most
    }

    /// Binary roots of the children of the wide node in the place of `node`.
    pub fn children(&self, node: u32) -> Vec<u32> {
        let mut roots = Vec::with_capacity(self.width);
        // Subtrees with the children they get, the first last. The node itself is opened whatever it costs.
        let mut open = vec![(node, self.width)];
        while let Some((subtree, mut most)) = open.pop() {
            if subtree != node {
                most = self.used(subtree, most);
            }
            match self.links(subtree) {
                Some(pair) if most > 1 => {
                    let first = self.share(pair, most).first;
                    open.extend([(pair[1], most - first), (pair[0], first)]);
                }
                _ => roots.push(subtree),
            }
        }
        roots
    }
}
