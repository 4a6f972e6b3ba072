//! Separate skip pointers for each direction octant's visiting order. CPU version of
//! `kernels/accel/bvh/octant_roped.wesl`.

use super::super::leaf::{LEAF, LeafReader, Leaves};
use super::super::ray::Hit;
use super::super::twin::Walk;
use super::super::{AccelError, TriangleSoup};
use super::boxes::{AXIS_SHIFT, BoxNode, Boxes, CHILD_MASK};
use super::{NONE, ROOT};
use bytemuck::{Pod, Zeroable};

/// Box and content of a [`BoxNode`], without its link, and a rope per octant.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(super) struct OctantNode {
    pub node: BoxNode,
    pub ropes: [u32; 8],
}

pub(super) struct Octants(pub Vec<OctantNode>);

/// Bit `axis` is set if the ray goes down that axis.
fn octant_of(direction: [f32; 3]) -> u32 {
    let bit = |axis: usize| u32::from(direction[axis] < 0.0) << axis;
    bit(0) | bit(1) | bit(2)
}

/// The child of a node with this content that rays of an octant enter first.
fn near_side(content: u32, octant: u32) -> u32 {
    octant >> (content >> AXIS_SHIFT) & 1
}

fn ropes_of(parent: &OctantNode, child: u32) -> [u32; 8] {
    std::array::from_fn(|octant| {
        if child & 1 == near_side(parent.node.content, octant as u32) {
            child ^ 1
        } else {
            parent.ropes[octant]
        }
    })
}

impl Octants {
    /// Adds ropes to boxes.
    pub(super) fn new(boxes: &Boxes) -> Self {
        let unroped = |&node: &BoxNode| OctantNode {
            node: BoxNode { link: NONE, ..node },
            ropes: [NONE; 8],
        };
        let mut nodes: Vec<OctantNode> = boxes.0.iter().map(unroped).collect();
        for index in 0..nodes.len() {
            let parent = nodes[index];
            if parent.node.content < LEAF {
                let first = parent.node.content & CHILD_MASK;
                for child in [first, first + 1] {
                    nodes[child as usize].ropes = ropes_of(&parent, child);
                }
            }
        }
        Self(nodes)
    }

    /// Checks reachability, containment, ropes and depth.
    ///
    /// # Errors
    /// The first violated invariant, with the node.
    pub(super) fn validate(
        &self,
        soup: &TriangleSoup,
        leaves: &Leaves,
        max_depth: u32,
    ) -> Result<(), AccelError> {
        let boxes = Boxes(self.0.iter().map(|n| n.node).collect());
        boxes.validate(soup, leaves, max_depth, |_, _, _| NONE)?;
        let root = self.0[ROOT as usize].ropes;
        ensure!(root == [NONE; 8], "node {ROOT}: a rope leads astray");
        for parent in self.0.iter().filter(|n| n.node.content < LEAF) {
            let first = parent.node.content & CHILD_MASK;
            for child in [first, first + 1] {
                let right = self.0[child as usize].ropes == ropes_of(parent, child);
                ensure!(right, "node {child}: a rope leads astray");
            }
        }
        (0..8).try_for_each(|octant| self.validate_walk(octant))
    }

    /// A ray that enters every box visits every node once.
    fn validate_walk(&self, octant: u32) -> Result<(), AccelError> {
        let mut visited = vec![false; self.0.len()];
        let (mut current, mut count) = (ROOT, 0);
        while current != NONE {
            let is_new = !std::mem::replace(&mut visited[current as usize], true);
            ensure!(
                is_new,
                "node {current}: ropes of octant {octant} return to it"
            );
            count += 1;
            let OctantNode { node, ropes } = self.0[current as usize];
            current = if node.content < LEAF {
                (node.content & CHILD_MASK) + near_side(node.content, octant)
            } else {
                ropes[octant as usize]
            };
        }
        let reachable = self.0.iter().filter(|of| of.node.content < LEAF).count() * 2 + 1;
        ensure!(
            count == reachable,
            "ropes of octant {octant} reach {count} of {reachable} nodes"
        );
        Ok(())
    }
}

pub(super) fn trace(octants: &Octants, leaves: LeafReader, mut walk: Walk) -> Hit {
    let octant = octant_of(walk.ray.direction);
    let mut current = ROOT;
    loop {
        if current == NONE || walk.is_answered() {
            return walk.hit;
        }
        let OctantNode { node, ropes } = walk.visit(current as usize, &octants.0[current as usize]);
        let entered = walk.enter(&node.bounds()).is_some();
        if entered && node.content < LEAF {
            current = (node.content & CHILD_MASK) + near_side(node.content, octant);
        } else {
            if entered {
                leaves.test_leaf(node.content, &mut walk);
            }
            current = ropes[octant as usize];
        }
    }
}
