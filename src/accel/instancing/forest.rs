//! The BVHs of all objects in one array of nodes and one of triangles.

use super::super::bounds::Bounds;
use super::super::bvh::check_leaves;
use super::super::bvh::pairs::{self, Pair, Pairs};
use super::super::intersection::Intersection;
use super::super::leaf::{FIRST_MASK, leaf_range};
use super::super::tree::{Coverage, Tree, TreeParameters};
use super::super::triangle::TriangleRecord;
use super::super::{AccelError, BuildLog, FEWER, TriangleSoup};
use crate::StructureStats;
use rayon::prelude::*;
use std::ops::Range;

/// The location of one object's BVH.
#[derive(Debug, Clone)]
pub(super) struct Root {
    /// Its nodes, root first.
    pub nodes: Range<u32>,
    /// Its triangles, leaf by leaf; triangles cut by spatial splits appear more than once.
    pub triangles: Range<u32>,
    pub object_size: usize,
    /// Object-space bounds.
    pub bounds: Bounds,
    pub depth: u32,
}

#[derive(Debug, Clone, Default)]
pub(super) struct Forest {
    pub nodes: Vec<Pair>,
    /// Object-space records, leaf by leaf, with object ids.
    pub triangles: Vec<TriangleRecord>,
    pub roots: Vec<Root>,
    /// The tests of rays against triangles and boxes.
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
        let part = log.of_a_part();
        let trees: Result<Vec<Tree>, AccelError> = log.phase("objects", || {
            let build = |object: &&TriangleSoup| {
                let tree = Tree::build(object, parameters, &mut part.clone())?;
                check_leaves(&tree).map(|()| tree)
            };
            objects.par_iter().map(build).collect()
        });
        let trees = trees?;
        let needed: u64 = trees.iter().map(|tree| tree.order.len() as u64).sum();
        AccelError::check_limit(
            "triangles in the leaves of all objects",
            needed,
            FIRST_MASK,
            FEWER,
        )?;
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
        let nodes = Pairs::depth_first(tree).0.into_iter();
        self.nodes
            .extend(nodes.map(|node| node.moved_by(first_node, first_triangle)));
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
        let nodes = root.nodes.start as usize..root.nodes.end as usize;
        let own = root.triangles.start as usize..root.triangles.end as usize;
        let coverage = Coverage::new(object, nodes.len());
        let nodes = (root.nodes.start, &self.nodes[nodes]);
        pairs::validate(nodes, root.depth, coverage, |coverage, leaf, bounds| {
            let (first, count) = leaf_range(leaf);
            let is_own = own.start <= first && first + count <= own.end;
            let triangles = is_own.then(|| &self.triangles[first..first + count]);
            coverage.leaf(triangles, bounds)
        })
    }
}
