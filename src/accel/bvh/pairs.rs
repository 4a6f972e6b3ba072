//! Nodes of 64 bytes with the boxes of both children. CPU version of
//! `kernels/accel/bvh/pairs.wesl`.
//!
//! Source: T. Aila, S. Laine, "Understanding the efficiency of ray traversal on GPUs", HPG 2009.

use super::super::AccelError;
use super::super::bounds::{Bounds, enter_box};
use super::super::leaf::{LEAF, LeafReader, leaf_reference};
use super::super::tree::{Coverage, NodeKind, Tree};
use super::super::twin::Walk;
use super::super::watch;
use super::NONE;
use super::layout::{Inner, Nodes};
use super::options::NodeOrder;
use super::order::InnerNodes;
use bytemuck::{Pod, Zeroable};

/// Boxes and references of both children: four `vec4<u32>`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct Pair {
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
    /// A missing child: an empty box without contents.
    pub(crate) const MISSING: (u32, Bounds) = (
        NONE,
        Bounds {
            min: [0.0; 3],
            max: [0.0; 3],
        },
    );

    /// A node of these children, reference and box, without a parent yet.
    pub(crate) fn new([(left, left_box), (right, right_box)]: [(u32, Bounds); 2]) -> Self {
        Self {
            left_min: left_box.min,
            left,
            left_max: left_box.max,
            parent: NONE,
            right_min: right_box.min,
            right,
            right_max: right_box.max,
            unused: 0,
        }
    }

    pub(crate) fn children(&self) -> [(u32, Bounds); 2] {
        let bounds = |min, max| Bounds { min, max };
        [
            (self.left, bounds(self.left_min, self.left_max)),
            (self.right, bounds(self.right_min, self.right_max)),
        ]
    }

    pub(crate) fn bounds(&self) -> Bounds {
        let present = self.children().into_iter().filter(|(r, _)| *r != NONE);
        present.fold(Bounds::EMPTY, |all, (_, bounds)| all.union(&bounds))
    }

    /// The node after its targets moved up by these offsets.
    pub(crate) fn moved_by(self, nodes: u32, triangles: u32) -> Self {
        let moved = |reference| match reference {
            NONE => NONE,
            _ if reference >= LEAF => reference + triangles,
            _ => reference + nodes,
        };
        Self {
            left: moved(self.left),
            right: moved(self.right),
            parent: moved(self.parent),
            ..self
        }
    }
}

/// Inner nodes; leaves are references in them.
pub(crate) struct Pairs(pub Vec<Pair>);

impl Pairs {
    pub(crate) fn depth_first(tree: &Tree) -> Self {
        Self::new(tree, NodeOrder::DepthFirst)
    }

    pub(super) fn new(tree: &Tree, order: NodeOrder) -> Self {
        let inner = InnerNodes::new(tree, order, |_, _| false);
        let child = |index: u32| {
            let node = &tree.nodes[index as usize];
            let reference = match node.kind {
                NodeKind::Inner { .. } => inner.places[index as usize],
                NodeKind::Leaf { first, count } => leaf_reference(first, count),
            };
            (reference, node.bounds)
        };
        let children = inner.nodes.iter().filter_map(|&n| inner.children(n));
        let mut pairs: Vec<Pair> = children.map(|c| Pair::new(c.map(child))).collect();
        if pairs.is_empty() {
            let only = tree.nodes.first().map_or(Pair::MISSING, |_| child(0));
            pairs.push(Pair::new([only, Pair::MISSING]));
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
}

/// Checks reachability, containment, parents and depth of a tree of `nodes`, with references
/// relative to index `first`; `cover` records a leaf, given its reference and its box.
///
/// # Errors
/// The first violated invariant, with the node.
pub(crate) fn validate<'a>(
    (first, nodes): (u32, &[Pair]),
    max_depth: u32,
    coverage: Coverage<'a>,
    cover: impl Fn(&mut Coverage<'a>, u32, &Bounds) -> Result<(), AccelError>,
) -> Result<(), AccelError> {
    let is_root = nodes.first().is_none_or(|root| root.parent == NONE);
    ensure!(is_root, "the root has a parent");
    coverage.descend(max_depth.max(1), |coverage, index, around, below| {
        for (reference, bounds) in nodes[index].children() {
            if reference == NONE {
                continue;
            }
            let inside = around.contains(&bounds);
            ensure!(inside, "a child's box leaves its own");
            if reference >= LEAF {
                cover(coverage, reference, &bounds)?;
                continue;
            }
            let place = reference.wrapping_sub(first) as usize;
            let parent = nodes.get(place).map(|child| child.parent);
            let is_own = parent == Some(index as u32 + first);
            ensure!(is_own, "the parent of node {reference} is {parent:?}");
            below.push((place, bounds));
        }
        Ok(())
    })
}

impl Nodes for Pairs {
    fn visit(&self, node: u32, leaves: LeafReader, walk: &mut Walk) -> Inner {
        let node = walk.visit(node as usize, &self.0[node as usize]);
        let [(left, left_box), (right, right_box)] = node.children();
        let left = (walk.enter(&left_box), left);
        let right = (walk.enter(&right_box), right);
        let swap = right.0.is_some_and(|r| left.0.is_none_or(|l| r < l));
        let (mut near, mut far) = (left, right);
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
                leaves.test_leaf(near.1, walk);
            } else {
                inner.first = near.1;
            }
        }
        // Test the far child again: the near one may have found a nearer hit.
        let entered = far.0.is_some_and(|e| e <= walk.hit.t * walk.inverse.pad);
        if entered && !walk.is_answered() {
            if far.1 >= LEAF {
                leaves.test_leaf(far.1, walk);
            } else if inner.first == NONE {
                inner.first = far.1;
                inner.side ^= 1;
            } else {
                inner.second = far.1;
            }
        }
        inner
    }

    fn second_child(&self, node: u32, from: u32, walk: &mut Walk) -> u32 {
        let node = walk.visit(node as usize, &self.0[node as usize]);
        walk.counters.box_tests += 2;
        let (ray, inverse) = (&walk.ray, walk.inverse);
        let enter = |bounds| enter_box(bounds, ray, *inverse, inverse.pad, ray.t_max);
        let [(left, left_box), (right, right_box)] = node.children();
        let (enter_left, enter_right) = (enter(&left_box), enter(&right_box));
        let swap = enter_right.is_some_and(|r| enter_left.is_none_or(|l| r < l));
        let (near, far, enter) = if swap {
            (right, left, enter_left)
        } else {
            (left, right, enter_right)
        };
        let entered = enter.is_some_and(|e| e <= walk.hit.t * walk.inverse.pad);
        if from == near && far < LEAF && entered {
            far
        } else {
            NONE
        }
    }

    fn parent(&self, node: u32) -> u32 {
        *watch::read(&self.0[node as usize].parent)
    }

    fn child(&self, node: u32, side: u32, walk: &mut Walk) -> u32 {
        let pair = walk.visit(node as usize, &self.0[node as usize]);
        if side == 0 { pair.left } else { pair.right }
    }
}
