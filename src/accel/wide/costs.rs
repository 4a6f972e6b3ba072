//! Least costs of representing the subtree of each binary node by 1, 2, … children of a wide node,
//! and the resulting children. CPU version of `kernels/accel/wide/costs.wesl`.
//!
//! Source: H. Ylitie, T. Karras, S. Laine, "Efficient incoherent ray traversal on GPUs through
//! compressed wide BVHs", HPG 2017, section 3.2.

use super::WideKind;
use crate::tree::{NodeKind, Tree, TreeParameters};

/// Maximum children of a node; its table has one entry less.
const MAX_WIDTH: usize = 8;
/// Words of the largest table.
pub(super) const WORDS: u64 = MAX_WIDTH as u64 - 1;
/// Larger than the cost of any tree.
const NEVER: f32 = 3.4e38;
/// Set if a wide node is cheaper than a leaf.
const IS_NODE: u32 = 0x8000_0000;
const BITS: u32 = 3;
/// Smallest number of children that needs a choice.
const FEWEST: u32 = 2;

/// C(n, i) of the paper for all nodes n and i below the width, and the triangles per node.
pub(super) struct Costs<'a> {
    tree: &'a Tree,
    width: u32,
    settings: &'a TreeParameters,
    costs: Vec<[f32; MAX_WIDTH - 1]>,
    triangles: Vec<u32>,
    /// For 2, 3, … children three bits each: the number that go to the first child's subtree; 0 if
    /// that many do not pay off. Plus [`IS_NODE`].
    choices: Vec<u32>,
}

/// The least cost of two subtrees, and the number of children of the first one.
struct Share {
    cost: f32,
    first: u32,
}

impl<'a> Costs<'a> {
    /// For nodes with at most `width` children, 2 to 8.
    pub(super) fn new(tree: &'a Tree, width: usize, settings: &'a TreeParameters) -> Self {
        let mut costs = Self {
            tree,
            width: width as u32,
            settings,
            costs: vec![[NEVER; MAX_WIDTH - 1]; tree.nodes.len()],
            triangles: vec![0; tree.nodes.len()],
            choices: vec![0; tree.nodes.len()],
        };
        // Children come after their parents.
        for node in (0..tree.nodes.len() as u32).rev() {
            costs.fill(node);
        }
        costs
    }

    fn links(&self, node: u32) -> Option<[u32; 2]> {
        match self.tree.nodes[node as usize].kind {
            NodeKind::Inner { left, right } => Some([left, right]),
            NodeKind::Leaf { .. } => None,
        }
    }

    fn half_area(&self, node: u32) -> f32 {
        self.tree.nodes[node as usize].bounds.half_area()
    }

    fn cost_of(&self, node: u32, children: u32) -> f32 {
        self.costs[node as usize][children as usize - 1]
    }

    fn leaf_cost(&self, node: u32) -> f32 {
        let count = self.triangles[node as usize];
        if count as usize > self.settings.leaf_size {
            return NEVER;
        }
        self.half_area(node) * count as f32 * self.settings.intersection_cost
    }

    fn inner_cost(&self, node: u32, whole: &Share) -> f32 {
        self.half_area(node) * self.settings.traversal_cost + whole.cost
    }

    fn share(&self, [left, right]: [u32; 2], children: u32) -> Share {
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

    /// Computes the costs of a node from those of its children.
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
        let whole = self.share(pair, self.width);
        let as_node = self.inner_cost(node, &whole);
        let mut choices = whole.first << (BITS * (self.width - FEWEST));
        let mut least = self.leaf_cost(node);
        if self.triangles[index] as usize > self.settings.leaf_size || as_node < least {
            least = as_node;
            choices |= IS_NODE;
        }
        self.costs[index][0] = least;
        for children in FEWEST..self.width {
            let found = self.share(pair, children);
            if found.cost < least {
                least = found.cost;
                choices |= found.first << (BITS * (children - FEWEST));
            }
            self.costs[index][children as usize - 1] = least;
        }
        self.choices[index] = choices;
    }

    /// True if a node with known costs is a leaf when represented by one child.
    fn is_leaf(&self, node: u32) -> bool {
        self.choices[node as usize] & IS_NODE == 0
    }

    /// The kind of a subtree represented by one child; a leaf's `first` is its binary root.
    pub(super) fn kind(&self, root: u32) -> WideKind {
        if self.is_leaf(root) {
            WideKind::Leaf {
                first: root,
                count: self.triangles[root as usize],
            }
        } else {
            WideKind::Node(root)
        }
    }

    /// Binary roots of the children of the wide node that replaces `node`, in place of those of another.
    pub(super) fn children(&self, node: u32, roots: &mut Vec<u32>) {
        roots.clear();
        // Subtrees with their numbers of children, the first last: each has a child at least.
        let mut open = [(node, self.width); MAX_WIDTH];
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let (subtree, children) = open[count];
            let choices = self.choices[subtree as usize];
            let most = used(choices, children);
            match self.links(subtree) {
                Some([left, right]) if most > 1 => {
                    let first = choices >> (BITS * (most - FEWEST)) & 7;
                    open[count] = (right, most - first);
                    open[count + 1] = (left, first);
                    count += 2;
                }
                _ => roots.push(subtree),
            }
        }
    }
}

/// The number of `children` that pay off, by the choices of a node. The maximum always does.
fn used(choices: u32, children: u32) -> u32 {
    let paying = choices & ((1 << (BITS * (children - 1))) - 1);
    paying.checked_ilog2().map_or(1, |bit| bit / BITS + FEWEST)
}
