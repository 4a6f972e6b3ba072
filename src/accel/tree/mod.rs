//! The binary tree under `bvh`, `roped-bvh` and their kin: one type, several builders, the same tree
//! for any number of threads.
//!
//! A builder makes a tree down to (nearly) single triangles; rounds of reinsertion may improve it;
//! then leaves are chosen. Each step has a file of its own.

mod binned;
mod coverage;
mod leaves;
mod parameters;
mod reference;
mod subtree;

pub use coverage::Coverage;
pub use parameters::tree_parameters;

use super::bounds::Bounds;
use super::{AccelError, BuildLog, TriangleSoup};
use crate::config::Params;
use crate::measure::record::StructureStats;
use parameters::{Builder, Settings};
use reference::Reference;

/// A node; children of an inner node lie at `left` and `right`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TreeNode {
    /// Box around everything below.
    pub bounds: Bounds,
    /// What is below.
    pub kind: NodeKind,
}

/// What a node holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NodeKind {
    /// Two children, by node index.
    Inner {
        /// First child.
        left: u32,
        /// Second child.
        right: u32,
    },
    /// A range of [`Tree::order`].
    Leaf {
        /// First entry.
        first: u32,
        /// Number of entries.
        count: u32,
    },
}

/// A binary tree over triangles; node 0 is the root, nodes are in depth-first order.
#[derive(Debug, Clone, Default)]
pub struct Tree {
    /// Nodes; empty for an empty scene.
    pub nodes: Vec<TreeNode>,
    /// Triangle indices, leaf by leaf.
    pub order: Vec<u32>,
}

impl Tree {
    /// Builds the tree with the builder that `params` name; phases are timed in `log`.
    ///
    /// # Errors
    /// A limit of the builder is exceeded.
    pub fn build(
        soup: &TriangleSoup,
        params: &Params,
        log: &mut BuildLog,
    ) -> Result<Tree, AccelError> {
        let settings = Settings::new(params);
        if soup.records.is_empty() {
            return Ok(Tree::default());
        }
        let references = log.phase("boxes", || reference::references(soup));
        let tree = match settings.builder {
            _ => log.phase("binned", || Tree::in_place(references, &settings, binned::build)),
        };
        Ok(log.phase("leaves", || leaves::choose_leaves(tree, &settings)))
    }

    /// The tree of a builder that brings the references into the order of the leaves.
    fn in_place(
        mut references: Vec<Reference>,
        settings: &Settings,
        build: impl Fn(&mut [Reference], &Settings) -> subtree::Subtree,
    ) -> Tree {
        let subtree = build(&mut references, settings);
        let order = references.iter().map(|r| r.id).collect();
        drop(references);
        Tree {
            nodes: subtree.lay_out(),
            order,
        }
    }

    /// Deepest leaf; the root has depth 0.
    pub fn depth(&self) -> u32 {
        let mut depths = vec![0u32; self.nodes.len()];
        let mut deepest = 0;
        for (index, node) in self.nodes.iter().enumerate() {
            deepest = deepest.max(depths[index]);
            if let NodeKind::Inner { left, right } = node.kind {
                depths[left as usize] = depths[index] + 1;
                depths[right as usize] = depths[index] + 1;
            }
        }
        deepest
    }

    /// Figures of the tree; `bytes` is left 0. SAH with both constants 1: sum over inner nodes of
    /// A(node) / A(root) plus sum over leaves of A(leaf) · triangles / A(root).
    pub fn stats(&self) -> StructureStats {
        let mut stats = StructureStats {
            nodes: self.nodes.len() as u64,
            references: self.order.len() as u64,
            ..Default::default()
        };
        let Some(root) = self.nodes.first() else {
            return stats;
        };
        let leaves = self.nodes.iter().filter_map(|node| match node.kind {
            NodeKind::Inner { .. } => None,
            NodeKind::Leaf { count, .. } => Some(count as usize),
        });
        stats.leaf_histogram = super::leaf_histogram(leaves);
        let mut cost = 0.0_f64;
        for node in &self.nodes {
            let weight = match node.kind {
                NodeKind::Inner { .. } => 1,
                NodeKind::Leaf { count, .. } => {
                    stats.leaves += 1;
                    count
                }
            };
            cost += f64::from(node.bounds.half_area()) * f64::from(weight);
        }
        let root_area = f64::from(root.bounds.half_area());
        stats.sah_cost = (root_area > 0.0).then(|| cost / root_area);
        stats.depth = Some(self.depth());
        stats
    }
}
