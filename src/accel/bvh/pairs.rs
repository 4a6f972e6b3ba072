//! Nodes of 64 bytes with the boxes of both children. Twin of `kernels/accel/bvh/pairs.wesl`.
//!
//! Source: T. Aila, S. Laine, "Understanding the efficiency of ray traversal on GPUs", HPG 2009.

use super::super::bounds::{Bounds, enter_box};
use super::super::leaf::{LEAF, LeafReader, Leaves, leaf_reference};
use super::super::tree::{Coverage, NodeKind, Tree};
use super::super::twin::Query;
use super::super::{AccelError, TriangleSoup};
use super::layout::{Inner, Nodes};
use super::options::NodeOrder;
use super::order::InnerNodes;
use super::{NONE, ROOT};
use bytemuck::{Pod, Zeroable};

/// Boxes of both children with what they refer to: four `vec4<u32>`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(super) struct Pair {
    left_min: [f32; 3],
    left: u32,
    left_max: [f32; 3],
    parent: u32,
    right_min: [f32; 3],
    right: u32,
    right_max: [f32; 3],
    unused: u32,
}

impl Pair {
    /// Root of an empty scene.
    const NOTHING: Pair = Pair {
        left_min: [0.0; 3],
        left: NONE,
        left_max: [0.0; 3],
        parent: NONE,
        right_min: [0.0; 3],
        right: NONE,
        right_max: [0.0; 3],
        unused: 0,
    };

    fn left_bounds(&self) -> Bounds {
        Bounds {
            min: self.left_min,
            max: self.left_max,
        }
    }

    fn right_bounds(&self) -> Bounds {
        Bounds {
            min: self.right_min,
            max: self.right_max,
        }
    }
}

/// Inner nodes; leaves are references in them.
pub(super) struct Pairs(pub Vec<Pair>);

impl Pairs {
    pub fn new(tree: &Tree, order: NodeOrder) -> Self {
        let inner = InnerNodes::new(tree, order, |_, _| false);
        let reference = |index: u32| match tree.nodes[index as usize].kind {
            NodeKind::Inner { .. } => inner.places[index as usize],
            NodeKind::Leaf { first, count } => leaf_reference(first, count),
        };
        let pair = |[left, right]: [u32; 2]| {
            let (l, r) = (
                &tree.nodes[left as usize].bounds,
                &tree.nodes[right as usize].bounds,
            );
            Pair {
                left_min: l.min,
                left: reference(left),
                left_max: l.max,
                right_min: r.min,
                right: reference(right),
                right_max: r.max,
                ..Pair::NOTHING
            }
        };
        let children = inner.nodes.iter().filter_map(|&n| inner.children(n));
        let mut pairs: Vec<Pair> = children.map(pair).collect();
        if pairs.is_empty() {
            let mut root = Pair::NOTHING;
            if let Some(only) = tree.nodes.first() {
                (root.left_min, root.left_max, root.left) =
                    (only.bounds.min, only.bounds.max, reference(0));
            }
            pairs.push(root);
        }
        for index in 0..pairs.len() {
            for child in [pairs[index].left, pairs[index].right] {
                if child < LEAF {
                    pairs[child as usize].parent = index as u32;
                }
            }
        }
        Self(pairs)
    }

    /// Checks reachability, containment, parents and depth.
    ///
    /// # Errors
    /// The first violated invariant, with the node.
    pub fn validate(
        &self,
        soup: &TriangleSoup,
        leaves: &Leaves,
        max_depth: u32,
    ) -> Result<(), AccelError> {
        let invalid =
            |index: u32, what: &str| Err(AccelError::Invalid(format!("node {index}: {what}")));
        let mut coverage = Coverage::new(soup, self.0.len());
        coverage.node(ROOT as usize)?;
        let mut stack = vec![(ROOT, NONE, Bounds::EVERYTHING, 1)];
        while let Some((index, parent, around, depth)) = stack.pop() {
            let node = &self.0[index as usize];
            if depth > max_depth.max(1) {
                return invalid(index, &format!("deeper than {max_depth} levels"));
            }
            if node.parent != parent {
                return invalid(index, "its parent is another node");
            }
            for (reference, bounds) in [
                (node.left, node.left_bounds()),
                (node.right, node.right_bounds()),
            ] {
                if reference == NONE {
                    continue;
                }
                if !around.contains(&bounds) {
                    return invalid(index, "a child's box leaves its own");
                }
                if reference < LEAF {
                    coverage.node(reference as usize)?;
                    stack.push((reference, index, bounds, depth + 1));
                } else {
                    leaves.cover(&mut coverage, soup, reference, &bounds)?;
                }
            }
        }
        coverage.is_complete()
    }
}

impl Nodes for Pairs {
    fn visit(&self, node: u32, leaves: LeafReader, query: &mut Query) -> Inner {
        query.visit(node as usize);
        let pair = &self.0[node as usize];
        let left = query.enter(&pair.left_bounds());
        let right = query.enter(&pair.right_bounds());
        let swap = right.is_some_and(|r| left.is_none_or(|l| r < l));
        let (mut near, mut far) = ((left, pair.left), (right, pair.right));
        if swap {
            std::mem::swap(&mut near, &mut far);
        }
        let mut inner = Inner {
            first: NONE,
            second: NONE,
            side: u32::from(swap),
        };
        if near.0.is_some() {
            if near.1 >= LEAF {
                leaves.test_leaf(near.1, query);
            } else {
                inner.first = near.1;
            }
        }
        // The far child is looked at again: the near one may have brought a nearer hit.
        let entered = far.0.is_some_and(|e| e <= query.hit.t * query.inverse.pad);
        if entered && !query.is_answered() {
            if far.1 >= LEAF {
                leaves.test_leaf(far.1, query);
            } else if inner.first == NONE {
                inner.first = far.1;
                inner.side ^= 1;
            } else {
                inner.second = far.1;
            }
        }
        inner
    }

    fn second_child(&self, node: u32, from: u32, query: &mut Query) -> u32 {
        query.visit(node as usize);
        query.counters.box_tests += 2;
        let pair = &self.0[node as usize];
        let (ray, inverse) = (&query.ray, query.inverse);
        let left = enter_box(&pair.left_bounds(), ray, inverse, ray.t_max);
        let right = enter_box(&pair.right_bounds(), ray, inverse, ray.t_max);
        let swap = right.is_some_and(|r| left.is_none_or(|l| r < l));
        let (near, far, enter) = if swap {
            (pair.right, pair.left, left)
        } else {
            (pair.left, pair.right, right)
        };
        let entered = enter.is_some_and(|e| e <= query.hit.t * query.inverse.pad);
        if from == near && far < LEAF && entered {
            far
        } else {
            NONE
        }
    }

    fn parent(&self, node: u32) -> u32 {
        self.0[node as usize].parent
    }

    fn child(&self, node: u32, side: u32, query: &mut Query) -> u32 {
        query.visit(node as usize);
        let pair = &self.0[node as usize];
        if side == 0 { pair.left } else { pair.right }
    }
}
