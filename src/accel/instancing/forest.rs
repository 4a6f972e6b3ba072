//! The BVHs of all objects in one array of nodes and one of triangles.

use super::super::bounds::Bounds;
use super::super::bvh::check_leaves;
use super::super::intersection::Intersection;
use super::super::leaf::{FIRST_MASK, LEAF, leaf_range, leaf_reference};
use super::super::tree::{Coverage, NodeKind, Tree};
use super::super::triangle::TriangleRecord;
use super::super::{AccelError, BuildLog, TriangleSoup};
use super::instance::NOTHING;
use crate::accel::StructureStats;
use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;
use std::ops::Range;

/// Boxes of both children with what they refer to: four `vec4<u32>`, as in the plain BVH.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(super) struct Node {
    left_min: [f32; 3],
    left: u32,
    left_max: [f32; 3],
    unused_left: u32,
    right_min: [f32; 3],
    right: u32,
    right_max: [f32; 3],
    unused_right: u32,
}

impl Node {
    /// A node of these children: reference and box.
    pub(super) fn new(children: [(u32, Bounds); 2]) -> Self {
        let [(left, left_box), (right, right_box)] = children;
        Self {
            left_min: left_box.min,
            left,
            left_max: left_box.max,
            unused_left: 0,
            right_min: right_box.min,
            right,
            right_max: right_box.max,
            unused_right: 0,
        }
    }

    /// What stands for a missing child: a box of no extent with nothing in it.
    pub(super) const MISSING: (u32, Bounds) = (
        NOTHING,
        Bounds {
            min: [0.0; 3],
            max: [0.0; 3],
        },
    );

    /// References and boxes of both children.
    pub(super) fn children(&self) -> [(u32, Bounds); 2] {
        let bounds = |min, max| Bounds { min, max };
        [
            (self.left, bounds(self.left_min, self.left_max)),
            (self.right, bounds(self.right_min, self.right_max)),
        ]
    }

    /// Box around both children.
    pub(super) fn bounds(&self) -> Bounds {
        let present = self.children().into_iter().filter(|(r, _)| *r != NOTHING);
        present.fold(Bounds::EMPTY, |all, (_, bounds)| all.union(&bounds))
    }
}

/// Where the BVH of one object lies.
#[derive(Debug, Clone)]
pub(super) struct Root {
    /// Its nodes, the root first.
    pub nodes: Range<u32>,
    /// Its triangles, leaf by leaf; one that spatial splits cut stands there more than once.
    pub triangles: Range<u32>,
    /// Triangles of the object.
    pub object_size: usize,
    /// Box around it, object space.
    pub bounds: Bounds,
    /// Deepest leaf.
    pub depth: u32,
}

/// All objects.
#[derive(Debug, Clone, Default)]
pub(super) struct Forest {
    pub nodes: Vec<Node>,
    /// Records in object space, leaf by leaf, with ids of the object.
    pub triangles: Vec<TriangleRecord>,
    pub roots: Vec<Root>,
    /// How rays meet the triangles.
    pub intersection: Intersection,
    /// Sums over all objects.
    pub stats: StructureStats,
}

impl Forest {
    /// Builds every object's tree.
    ///
    /// # Errors
    /// More triangles than a leaf reference can address.
    pub(super) fn build(
        objects: &[&TriangleSoup],
        parameters: &TreeParameters,
        log: &mut BuildLog,
    ) -> Result<Self, AccelError> {
        let trees: Result<Vec<Tree>, AccelError> = log.phase("objects", || {
            let build = |object: &&TriangleSoup| {
                let tree = Tree::build(object, parameters, &mut BuildLog::default())?;
                check_leaves(&tree).map(|()| tree)
            };
            objects.par_iter().map(build).collect()
        });
        let trees = trees?;
        let needed: u64 = trees.iter().map(|tree| tree.order.len() as u64).sum();
        AccelError::check_limit("triangles in the leaves of all objects", needed, FIRST_MASK)?;
        Ok(log.phase("layout", || {
            let mut forest = Self {
                intersection: objects
                    .first()
                    .map_or_else(Default::default, |o| o.intersection),
                ..Self::default()
            };
            for (tree, object) in trees.iter().zip(objects) {
                forest.append(tree, object);
            }
            forest
        }))
    }

    fn append(&mut self, tree: &Tree, object: &TriangleSoup) {
        let (first_node, first_triangle) = (self.nodes.len() as u32, self.triangles.len() as u32);
        let order = tree.order.iter().map(|&id| object.records[id as usize]);
        self.triangles.extend(order);
        self.nodes.extend(layout(tree, first_node, first_triangle));
        self.roots.push(Root {
            nodes: first_node..self.nodes.len() as u32,
            triangles: first_triangle..self.triangles.len() as u32,
            object_size: object.records.len(),
            bounds: object.bounds(),
            depth: tree.depth(),
        });
        let (own, all) = (tree.stats(), &mut self.stats);
        all.nodes += own.nodes;
        all.leaves += own.leaves;
        all.references += own.references;
        all.depth = all.depth.max(own.depth);
        let sizes = all.leaf_histogram.len().max(own.leaf_histogram.len());
        all.leaf_histogram.resize(sizes, 0);
        for (sum, leaves) in all.leaf_histogram.iter_mut().zip(own.leaf_histogram) {
            *sum += leaves;
        }
    }

    /// Stack entries that the traversal of any object can need.
    pub(super) fn stack_entries(&self) -> u32 {
        self.roots
            .iter()
            .map(|root| root.depth)
            .max()
            .unwrap_or(0)
            .max(1)
    }

    /// Checks that every object's BVH reaches all of the object once, within its boxes.
    ///
    /// # Errors
    /// The first violated invariant, with object and node.
    pub(super) fn validate(&self, objects: &[&TriangleSoup]) -> Result<(), AccelError> {
        for (index, (root, object)) in self.roots.iter().zip(objects).enumerate() {
            self.validate_object(root, object)
                .map_err(|e| AccelError::Invalid(format!("object {index}: {e}")))?;
        }
        Ok(())
    }

    fn validate_object(&self, root: &Root, object: &TriangleSoup) -> Result<(), AccelError> {
        let count = root.nodes.len();
        let mut coverage = Coverage::new(object, count);
        coverage.node(0)?;
        let mut stack = vec![(root.nodes.start, Bounds::EVERYTHING, 1)];
        while let Some((index, around, depth)) = stack.pop() {
            AccelError::ensure(depth <= root.depth.max(1), || {
                format!("node {index}: deeper than the stack of {}", root.depth)
            })?;
            for (reference, bounds) in self.nodes[index as usize].children() {
                if reference == NOTHING {
                    continue;
                }
                AccelError::ensure(around.contains(&bounds), || {
                    format!("node {index}: a child's box leaves its own")
                })?;
                if reference >= LEAF {
                    let (first, count) = leaf_range(reference);
                    let end = first + count;
                    let own = root.triangles.start as usize..root.triangles.end as usize;
                    let is_own = own.start <= first && end <= own.end;
                    let triangles = is_own.then(|| &self.triangles[first..end]);
                    coverage.leaf(triangles, &bounds)?;
                } else {
                    let own = reference.checked_sub(root.nodes.start);
                    coverage.node(own.map_or(count, |node| node as usize))?;
                    stack.push((reference, bounds, depth + 1));
                }
            }
        }
        coverage.is_complete()
    }
}

/// Nodes with the boxes of their children, in the tree's depth-first order, leaves folded into
/// references; `first_node` and `first_triangle` are where the object begins in the common arrays.
fn layout(tree: &Tree, first_node: u32, first_triangle: u32) -> Vec<Node> {
    let mut place = Vec::with_capacity(tree.nodes.len());
    let mut inner = first_node;
    for node in &tree.nodes {
        place.push(inner);
        inner += u32::from(matches!(node.kind, NodeKind::Inner { .. }));
    }
    let child = |index: u32| {
        let node = &tree.nodes[index as usize];
        let reference = match node.kind {
            NodeKind::Inner { .. } => place[index as usize],
            NodeKind::Leaf { first, count } => leaf_reference(first_triangle + first, count),
        };
        (reference, node.bounds)
    };
    let inner = tree.nodes.iter().filter_map(|node| match node.kind {
        NodeKind::Inner { left, right } => Some(Node::new([child(left), child(right)])),
        NodeKind::Leaf { .. } => None,
    });
    let mut nodes: Vec<Node> = inner.collect();
    if nodes.is_empty() {
        let only = if tree.nodes.is_empty() {
            Node::MISSING
        } else {
            child(0)
        };
        nodes.push(Node::new([only, Node::MISSING]));
    }
    nodes
}
