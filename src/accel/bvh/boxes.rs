//! Nodes of 32 bytes with their own box, siblings next to each other. CPU version of
//! `kernels/accel/bvh/boxes.wesl`.
//!
//! The root has index 0 and index 1 is empty, so that every pair begins at an even index. The boxes
//! decide which child comes first in memory: the lower one on the axis along which their centres
//! are farthest apart. A ray in the positive direction of that axis visits it first.

use super::super::bounds::Bounds;
use super::super::leaf::{LEAF, LeafReader, Leaves, leaf_reference};
use super::super::tree::{Coverage, NodeKind, Tree};
use super::super::twin::Walk;
use super::super::watch;
use super::super::{AccelError, Ray, TriangleSoup};
use super::layout::{Inner, Nodes};
use super::options::NodeOrder;
use super::order::InnerNodes;
use super::{NONE, ROOT};
use bytemuck::{Pod, Zeroable};

/// Content of an inner node: axis, first child.
pub(super) const AXIS_SHIFT: u32 = 29;
/// Largest index of a first child.
pub(super) const CHILD_MASK: u32 = 0x1fff_ffff;

/// A node, two `vec4<u32>`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(super) struct BoxNode {
    pub min: [f32; 3],
    /// A leaf's reference, or axis and first child.
    pub content: u32,
    pub max: [f32; 3],
    /// Parent or rope, depending on the traversal.
    pub link: u32,
}

impl BoxNode {
    /// Root of an empty scene, and node 1.
    const NOTHING: BoxNode = BoxNode {
        min: [0.0; 3],
        content: NONE,
        max: [0.0; 3],
        link: NONE,
    };

    pub(super) fn bounds(&self) -> Bounds {
        Bounds {
            min: self.min,
            max: self.max,
        }
    }
}

/// Returns the axis along which two boxes are farthest apart, and `true` if the second is the lower one.
fn split_axis(first: &Bounds, second: &Bounds) -> (u32, bool) {
    let (a, b) = (first.doubled_centre(), second.doubled_centre());
    let apart: [f32; 3] = std::array::from_fn(|axis| b[axis] - a[axis]);
    let farther = |best: usize, axis: usize| {
        if apart[axis].abs() > apart[best].abs() {
            axis
        } else {
            best
        }
    };
    let axis = (1..3).fold(0, farther);
    (axis as u32, apart[axis] < 0.0)
}

/// The child that the ray enters first: 1 if it goes down the axis.
fn near_side(content: u32, ray: &Ray) -> u32 {
    u32::from(ray.direction[(content >> AXIS_SHIFT) as usize] < 0.0)
}

pub(super) struct Boxes(pub Vec<BoxNode>);

impl Boxes {
    /// Lays out a tree; links point to parents.
    pub(super) fn new(tree: &Tree, order: NodeOrder) -> Self {
        let bounds = |node: u32| &tree.nodes[node as usize].bounds;
        let inner = InnerNodes::new(tree, order, |l, r| split_axis(bounds(l), bounds(r)).1);
        // The children of the inner node at index k are at 2k + 2 and 2k + 3.
        let content = |node: u32| match tree.nodes[node as usize].kind {
            NodeKind::Leaf { first, count } => leaf_reference(first, count),
            NodeKind::Inner { left, right } => {
                let (axis, _) = split_axis(bounds(left), bounds(right));
                axis << AXIS_SHIFT | (2 * inner.places[node as usize] + 2)
            }
        };
        let node = |node: u32, link: u32| BoxNode {
            min: bounds(node).min,
            content: content(node),
            max: bounds(node).max,
            link,
        };
        let mut boxes = vec![BoxNode::NOTHING; 2 * inner.nodes.len() + 2];
        if !tree.nodes.is_empty() {
            boxes[0] = node(0, NONE);
        }
        let mut places = vec![ROOT; tree.nodes.len()];
        for (k, &parent) in inner.nodes.iter().enumerate() {
            let children = inner.children(parent).into_iter().flatten();
            for (child, place) in children.zip(2 * k + 2..) {
                boxes[place] = node(child, places[parent as usize]);
                places[child as usize] = place as u32;
            }
        }
        Self(boxes)
    }

    /// Checks reachability, containment, links and depth. `link_of` gives the expected link of a
    /// node from its parent's link, its parent and its index.
    ///
    /// # Errors
    /// The first violated invariant, with the node.
    pub(super) fn validate(
        &self,
        soup: &TriangleSoup,
        leaves: &Leaves,
        max_depth: u32,
        link_of: impl Fn(u32, u32, u32) -> u32,
    ) -> Result<(), AccelError> {
        ensure!(self.0[0].link == NONE, "the root leads somewhere");
        let mut coverage = Coverage::new(soup, self.0.len());
        coverage.node(1)?;
        coverage.descend(max_depth + 1, |coverage, index, around, below| {
            let node = &self.0[index];
            if node.content == NONE {
                return Ok(());
            }
            let bounds = node.bounds();
            ensure!(around.contains(&bounds), "its box leaves its parent's");
            if node.content >= LEAF {
                return leaves.cover(coverage, soup, node.content, &bounds);
            }
            ensure!(node.content >> AXIS_SHIFT <= 2, "there is no axis 3");
            let first = node.content & CHILD_MASK;
            for child in [first, first ^ 1] {
                let link = self.0.get(child as usize).map(|child| child.link);
                let right = link_of(node.link, index as u32, child);
                ensure!(
                    link == Some(right),
                    "child {child} leads to {link:?}, not {right}"
                );
                below.push((child as usize, bounds));
            }
            Ok(())
        })
    }
}

impl Nodes for Boxes {
    fn visit(&self, node: u32, leaves: LeafReader, walk: &mut Walk) -> Inner {
        let node = walk.visit(node as usize, &self.0[node as usize]);
        let mut inner = Inner {
            first: NONE,
            second: NONE,
            side: 0,
        };
        if walk.enter(&node.bounds()).is_some() {
            if node.content >= LEAF {
                leaves.test_leaf(node.content, walk);
            } else {
                inner.side = near_side(node.content, &walk.ray);
                inner.first = (node.content & CHILD_MASK) + inner.side;
                inner.second = inner.first ^ 1;
            }
        }
        inner
    }

    fn second_child(&self, node: u32, from: u32, walk: &mut Walk) -> u32 {
        let content = walk.visit(node as usize, &self.0[node as usize]).content;
        if from & 1 == near_side(content, &walk.ray) {
            from ^ 1
        } else {
            NONE
        }
    }

    fn parent(&self, node: u32) -> u32 {
        *watch::read(&self.0[node as usize].link)
    }

    fn child(&self, node: u32, side: u32, walk: &mut Walk) -> u32 {
        (walk.visit(node as usize, &self.0[node as usize]).content & CHILD_MASK) + side
    }
}
