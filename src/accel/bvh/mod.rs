//! `bvh` and `roped-bvh`: one binary tree with several traversals over several layouts of its nodes
//! and leaves. `roped-bvh` is the same with skip pointers by default.
//!
//! Each traversal has a file here and one in `kernels/accel/bvh/`; the node layouts are in `pairs`
//! (64 bytes, both children's boxes) and `boxes` (32 bytes, own box).

mod boxes;
mod layout;
mod octant_roped;
mod options;
mod order;
pub(super) mod pairs;
mod parent_pointer;
mod roped;
mod short_stack;
mod stack;

use super::leaf::{COUNT_MASK, LeafReader, Leaves};
use super::structure::prelude::*;
use super::tracer::RefillParameters;
use super::tree::{Coverage, NodeKind, Tree};
use boxes::Boxes;
use octant_roped::Octants;
pub use options::BvhParameters;
use options::{LeafTriangles, RopedParameters, Traversal};
pub(crate) use order::check as check_orders;
use pairs::Pairs;
use raystone_core::params::Parameters;
use std::marker::PhantomData;

const ROOT: u32 = 0;
/// No node; also a leaf without triangles.
const NONE: u32 = 0x8000_0000;

/// The registry entry `bvh`.
pub struct Bvh;

impl Structure for Bvh {
    const NAME: &'static str = "bvh";
    const DESCRIPTION: &'static str = "binary BVH with a choice of traversal and layout, by default a stack, near child first (Aila & Laine 2009)";
    type Parameters = BvhParameters;

    fn build(soup: &TriangleSoup, params: &BvhParameters, log: &mut BuildLog) -> BuildResult {
        Ok(Box::new(BuiltBvh::build(soup, params, log)?))
    }

    fn over_tree() -> Option<&'static dyn OverTree> {
        Some(&Laid::<BvhParameters>(PhantomData))
    }
}

/// The registry entry `roped-bvh`.
pub struct RopedBvh;

impl Structure for RopedBvh {
    const NAME: &'static str = "roped-bvh";
    const DESCRIPTION: &'static str = "the tree of `bvh` with skip pointers: no stack, fixed order (Smits 1998, Dufay 2017 Alg. 4.4)";
    type Parameters = RopedParameters;

    fn build(soup: &TriangleSoup, params: &RopedParameters, log: &mut BuildLog) -> BuildResult {
        let params = params.clone().into();
        Ok(Box::new(BuiltBvh::build(soup, &params, log)?))
    }

    fn over_tree() -> Option<&'static dyn OverTree> {
        Some(&Laid::<RopedParameters>(PhantomData))
    }
}

/// The layout of a tree with parameters of this type.
struct Laid<P>(PhantomData<fn() -> P>);

impl<P: Parameters + Into<BvhParameters>> OverTree for Laid<P> {
    fn tree(
        &self,
        soup: &TriangleSoup,
        params: &Params,
        log: &mut BuildLog,
    ) -> Result<Tree, AccelError> {
        let params: BvhParameters = P::from_params(params)?.into();
        Tree::build(soup, &params.tree, log)
    }

    fn lay_out(
        &self,
        tree: &Tree,
        soup: &TriangleSoup,
        params: &Params,
        log: &mut BuildLog,
    ) -> BuildResult {
        let params: BvhParameters = P::from_params(params)?.into();
        params.check()?;
        Ok(Box::new(BuiltBvh::of_tree(tree, soup, &params, log)?))
    }
}

/// Nodes in the layout that the traversal reads.
enum NodeArray {
    Pairs(Pairs),
    Boxes(Boxes),
    Octants(Octants),
}

/// A built BVH.
pub struct BuiltBvh {
    params: BvhParameters,
    stats: StructureStats,
    nodes: NodeArray,
    leaves: Leaves,
    depth: u32,
}

impl BuiltBvh {
    /// Builds tree and layout with the parameters of [`Bvh`] or [`RopedBvh`].
    ///
    /// # Errors
    /// Parameters that contradict each other, or a tree that exceeds a limit of the layout.
    pub fn build(
        soup: &TriangleSoup,
        params: &BvhParameters,
        log: &mut BuildLog,
    ) -> Result<Self, AccelError> {
        params.check()?;
        let mut tree = Tree::build(soup, &params.tree, log)?;
        if log.notes_quality {
            tree.note_epo(soup);
        }
        Self::of_tree(&tree, soup, params, log)
    }

    fn of_tree(
        tree: &Tree,
        soup: &TriangleSoup,
        params: &BvhParameters,
        log: &mut BuildLog,
    ) -> Result<Self, AccelError> {
        let depth = tree.depth();
        params.check_depth(depth)?;
        check_leaves(tree)?;
        let (nodes, leaves) = log.phase("layout", || {
            let order = params.layout.node_order;
            let boxes = || Boxes::new(tree, order);
            let nodes = match params.traversal {
                Traversal::Roped => NodeArray::Boxes(roped::rope(boxes())),
                Traversal::OctantRoped => NodeArray::Octants(Octants::new(&boxes())),
                _ if params.has_boxes() => NodeArray::Boxes(boxes()),
                _ => NodeArray::Pairs(Pairs::new(tree, order)),
            };
            let indexed = params.layout.triangles == LeafTriangles::Indexed;
            (nodes, Leaves::new(soup, &tree.order, indexed))
        });
        let mut built = Self {
            params: params.clone(),
            stats: tree.stats(),
            nodes,
            leaves: leaves?,
            depth,
        };
        built.stats.bytes = (built.node_words().words.len() * 4 + built.leaves.bytes()) as u64;
        Ok(built)
    }

    /// The scalar CPU version over the triangles it was built from; with default parameters this is
    /// the reference tracer of the correctness check.
    pub fn twin<'a>(&'a self, soup: &'a TriangleSoup) -> Twin<'a, Self> {
        Twin(self, soup)
    }

    fn node_words(&self) -> NamedWords<'_> {
        match &self.nodes {
            NodeArray::Pairs(pairs) => NamedWords::new("nodes", &pairs.0),
            NodeArray::Boxes(boxes) => NamedWords::new("nodes", &boxes.0),
            NodeArray::Octants(octants) => NamedWords::new("nodes", &octants.0),
        }
    }
}

/// Checks that every leaf fits into a reference.
pub(super) fn check_leaves(tree: &Tree) -> Result<(), AccelError> {
    let count = |kind: &NodeKind| match kind {
        NodeKind::Inner { .. } => 0,
        NodeKind::Leaf { count, .. } => *count,
    };
    let fullest = tree.nodes.iter().map(|n| count(&n.kind)).max().unwrap_or(0);
    AccelError::check_limit(
        "triangles in one leaf of a bvh",
        fullest,
        COUNT_MASK,
        "set `leaf_size` lower",
    )
}

impl BuiltAccel for BuiltBvh {
    fn validate(&self, soup: &TriangleSoup) -> Result<(), AccelError> {
        let (leaves, depth) = (&self.leaves, self.depth);
        match &self.nodes {
            NodeArray::Pairs(pairs) => {
                let coverage = Coverage::new(soup, pairs.0.len());
                pairs::validate(
                    (ROOT, &pairs.0),
                    depth,
                    coverage,
                    |coverage, leaf, bounds| leaves.cover(coverage, soup, leaf, bounds),
                )
            }
            NodeArray::Octants(octants) => octants.validate(soup, leaves, depth),
            NodeArray::Boxes(boxes) if self.params.traversal == Traversal::Roped => {
                let rope = |link, _, child| roped::rope_of(link, child);
                boxes.validate(soup, leaves, depth, rope)
            }
            NodeArray::Boxes(boxes) => boxes.validate(soup, leaves, depth, |_, parent, _| parent),
        }
    }

    fn buffers(&self) -> GpuBuffers<'_> {
        let params = &self.params;
        let mut features = params.features();
        features.extend(self.leaves.features());
        let stack_entries = params.stack_entries(self.depth);
        let nodes = self.node_words();
        let count = 4 * nodes.words.len() / nodes.element_bytes as usize;
        GpuBuffers {
            kernel: params.kernel(),
            features,
            arrays: vec![nodes, self.leaves.words()],
            uniforms: vec![limits(params.step_fuse(count, self.depth), count)],
            constants: (stack_entries > 0)
                .then_some(("STACK_ENTRIES", stack_entries))
                .into_iter()
                .collect(),
        }
    }

    fn divisible(&self) -> &'static [&'static str] {
        &["nodes", "leaf_triangles"]
    }

    fn refill(&self) -> RefillParameters {
        self.params.refill()
    }

    fn stats(&self) -> StructureStats {
        self.stats.clone()
    }

    fn cpu_twin<'a>(&'a self, soup: &'a TriangleSoup) -> Option<Box<dyn CpuTwin + 'a>> {
        Some(Box::new(self.twin(soup)))
    }
}

impl Traverse for BuiltBvh {
    fn trace(&self, soup: &TriangleSoup, walk: Walk) -> Hit {
        let leaves = LeafReader {
            leaves: &self.leaves,
            soup,
        };
        let entries = self.params.stack_entries(self.depth) as usize;
        match (&self.nodes, self.params.traversal) {
            (NodeArray::Octants(octants), _) => octant_roped::trace(octants, leaves, walk),
            (NodeArray::Boxes(boxes), Traversal::Roped) => roped::trace(boxes, leaves, walk),
            (NodeArray::Boxes(boxes), Traversal::ParentPointer) => {
                parent_pointer::trace(boxes, leaves, walk)
            }
            (NodeArray::Boxes(boxes), Traversal::ShortStack) => {
                short_stack::trace(boxes, entries, leaves, walk)
            }
            (NodeArray::Boxes(boxes), _) => stack::trace(boxes, leaves, walk),
            (NodeArray::Pairs(pairs), Traversal::ParentPointer) => {
                parent_pointer::trace(pairs, leaves, walk)
            }
            (NodeArray::Pairs(pairs), Traversal::ShortStack) => {
                short_stack::trace(pairs, entries, leaves, walk)
            }
            (NodeArray::Pairs(pairs), _) => stack::trace(pairs, leaves, walk),
        }
    }
}
