//! Shared parts of the wide structures `bvh4` and `cwbvh`: a collapsed binary tree; nodes of
//! quantised boxes; build, validation, buffers and statistics.

mod bvh4;
mod collapse;
mod costs;
mod cwbvh;
mod device;
mod octants;
mod quantise;

pub use bvh4::Bvh4;
pub(crate) use collapse::{WideChild, WideKind};
pub use cwbvh::Cwbvh;
pub(crate) use quantise::{Quantisation, enter_four, frame, leave_four};

use super::structure::prelude::*;
use super::tracer::RefillParameters;
use super::tree::{Coverage, NodeKind, Tree, TreeParameters};
use super::triangle::TriangleRecord;
use bytemuck::Pod;
use collapse::{Shape, WideTree};
pub(crate) use octants::check as check_octants;
pub(crate) use quantise::check as check_planes;
use std::marker::PhantomData;
use std::ops::Range;

/// Maximum triangles that a slot of either structure can count, in bits or in unary.
const MAX_LEAF: usize = 3;

parameters! {
    /// The tree of a wide structure, and how its rays are handed out.
    pub struct WideParameters {
        /// The binary tree that is collapsed.
        tree: TreeParameters { leaf_size = MAX_LEAF, in 1..=MAX_LEAF; };
        /// How the batch kernel hands out rays.
        refill: RefillParameters;
    }
}

/// The binary tree to collapse, with single-triangle leaves: the collapse decides about leaves.
fn wide_tree(
    soup: &TriangleSoup,
    parameters: &TreeParameters,
    log: &mut BuildLog,
) -> Result<Tree, AccelError> {
    let tree = Tree::build(soup, &parameters.with_single_leaves(), log)?;
    let largest = tree.nodes.iter().map(|node| match node.kind {
        NodeKind::Leaf { count, .. } => count,
        NodeKind::Inner { .. } => 0,
    });
    let largest = largest.max().unwrap_or(0);
    AccelError::check_limit(
        "triangles of a leaf before the collapse",
        largest,
        1_u64,
        crate::FEWER,
    )?;
    Ok(tree)
}

/// The interface of a wide structure's nodes.
pub(crate) trait WideNode: Pod + Send + Sync {
    const STRUCTURE: &'static str;
    const KERNEL: &'static str;
    const WIDTH: usize;
    const MOST_NODES: u64;
    /// True if children get slots by octant.
    const BY_OCTANT: bool;

    /// The node with these children in its slots.
    fn pack(slots: &[WideChild]) -> Self;
    /// Box of a slot, as decoded by kernels.
    fn bounds(&self, slot: usize) -> Bounds;
    /// Node and triangles in a slot; at most one of them, if the structure is valid.
    fn content(&self, slot: usize) -> (Option<usize>, Option<Range<usize>>);
    fn trace(built: &Wide<Self>, walk: Walk) -> Hit;
}

pub(crate) struct Wide<N> {
    pub nodes: Vec<N>,
    /// Triangle records, leaf by leaf.
    pub leaf_triangles: Vec<TriangleRecord>,
    stats: StructureStats,
    refill: RefillParameters,
}

impl<N: WideNode> Wide<N> {
    /// Builds the binary tree and collapses it.
    ///
    /// # Errors
    /// The tree cannot be built, or there are more nodes than an index can address.
    pub(crate) fn build(
        soup: &TriangleSoup,
        parameters: &WideParameters,
        log: &mut BuildLog,
    ) -> BuildResult
    where
        N: 'static,
    {
        let tree = wide_tree(soup, &parameters.tree, log)?;
        Ok(Box::new(Self::of_tree(&tree, soup, parameters, log)?))
    }

    /// Collapses a tree with single-triangle leaves.
    fn of_tree(
        tree: &Tree,
        soup: &TriangleSoup,
        parameters: &WideParameters,
        log: &mut BuildLog,
    ) -> Result<Self, AccelError> {
        let shape = Shape {
            width: N::WIDTH,
            by_octant: N::BY_OCTANT,
        };
        let wide = match log.gpu().cloned() {
            // Bit-identical without a device: a refitted tree may be laid out anywhere.
            Some(gpu) if parameters.tree.on_device().is_some() => {
                device::collapse(&gpu, tree, shape, &parameters.tree, log)?
            }
            _ => log.phase("collapse", || {
                WideTree::collapse(tree, shape, &parameters.tree)
            }),
        };
        let what = format!("nodes of a {}", N::STRUCTURE);
        AccelError::check_limit(what, wide.nodes.len() as u64, N::MOST_NODES, crate::FEWER)?;
        Ok(log.phase("layout", || {
            let nodes: Vec<N> = wide.nodes.iter().map(|slots| N::pack(slots)).collect();
            let leaf_triangles = wide.records(soup);
            let bytes = size_of_val(&nodes[..]) + size_of_val(&leaf_triangles[..]);
            Self {
                stats: StructureStats {
                    bytes: bytes as u64,
                    ..wide.stats()
                },
                nodes,
                leaf_triangles,
                refill: parameters.refill.clone(),
            }
        }))
    }

    /// Maximum groups on the stack: a level leaves one behind.
    fn depth(&self) -> u32 {
        self.stats.depth.unwrap_or(0)
    }
}

/// The layout of a tree as a structure of these nodes.
pub(crate) struct OfNodes<N>(pub PhantomData<fn() -> N>);

impl<N: WideNode + 'static> OverTree for OfNodes<N> {
    fn tree(
        &self,
        soup: &TriangleSoup,
        params: &Params,
        log: &mut BuildLog,
    ) -> Result<Tree, AccelError> {
        wide_tree(soup, &WideParameters::from_params(params)?.tree, log)
    }

    fn lay_out(
        &self,
        tree: &Tree,
        soup: &TriangleSoup,
        params: &Params,
        log: &mut BuildLog,
    ) -> BuildResult {
        let params = WideParameters::from_params(params)?;
        Ok(Box::new(Wide::<N>::of_tree(tree, soup, &params, log)?))
    }
}

impl<N: WideNode> BuiltAccel for Wide<N> {
    fn validate(&self, soup: &TriangleSoup) -> Result<(), AccelError> {
        let coverage = Coverage::new(soup, self.nodes.len());
        coverage.descend(self.depth(), |coverage, index, around, below| {
            let node = &self.nodes[index];
            for slot in 0..N::WIDTH {
                // Descendants must lie in every decoded box on the way.
                let bounds = around.intersection(&node.bounds(slot));
                let (child, leaf) = node.content(slot);
                let is_one = child.is_none() || leaf.is_none();
                ensure!(is_one, "slot {slot} is a leaf and a node");
                below.extend(child.map(|child| (child, bounds)));
                if let Some(leaf) = leaf {
                    coverage.leaf(self.leaf_triangles.get(leaf), &bounds)?;
                }
            }
            Ok(())
        })
    }

    fn buffers(&self) -> GpuBuffers<'_> {
        GpuBuffers {
            kernel: N::KERNEL,
            features: Vec::new(),
            arrays: vec![
                NamedWords::new("nodes", &self.nodes),
                NamedWords::new("leaf_triangles", &self.leaf_triangles),
            ],
            uniforms: vec![limits(self.nodes.len(), self.nodes.len())],
            // A multiple of 8, so that scenes of similar depth share a kernel, and one spare entry.
            constants: vec![("STACK_ENTRIES", (self.depth() + 1).next_multiple_of(8))],
        }
    }

    fn divisible(&self) -> &'static [&'static str] {
        &["nodes", "leaf_triangles"]
    }

    fn refill(&self) -> RefillParameters {
        self.refill.clone()
    }

    fn stats(&self) -> StructureStats {
        self.stats.clone()
    }

    fn cpu_twin<'a>(&'a self, soup: &'a TriangleSoup) -> Option<Box<dyn CpuTwin + 'a>> {
        Some(Box::new(Twin(self, soup)))
    }
}

impl<N: WideNode> Traverse for Wide<N> {
    fn trace(&self, _: &TriangleSoup, walk: Walk) -> Hit {
        N::trace(self, walk)
    }
}
