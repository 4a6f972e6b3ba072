//! The binary tree of `bvh`, `roped-bvh` and related structures: one type, several builders, the
//! same tree for any number of threads.
//!
//! A builder makes a tree down to (nearly) single triangles; rounds of reinsertion may improve it;
//! then leaves are chosen. Each step has its own file.

mod binned;
mod coverage;
mod depth;
pub(super) mod grow;
mod leaves;
pub mod parallel;
mod parameters;
mod ploc;
mod quality;
mod reference;
mod reinsertion;
mod sbvh;
mod sweep;

pub use coverage::Coverage;
pub(super) use leaves::distinct;
pub use parameters::{Builder, TreeParameters};
pub(crate) use ploc::LARGEST_COORDINATE as LARGEST_OF_PLOC;
pub(crate) use quality::check_spread;

use super::bounds::Bounds;
use super::{AccelError, BuildLog, TriangleSoup, auto};
use parallel::Method;
use raystone_core::params::Choice as _;
use sweep::Axes;

/// A node; children of an inner node are at `left` and `right`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TreeNode {
    /// Box around everything below.
    pub bounds: Bounds,
    /// The contents.
    pub kind: NodeKind,
}

/// The contents of a node.
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

/// Limit on boxes visited for a record's end-point overlap: some tenths of a second.
const EPO_VISITS: u64 = 4_000_000;

/// A binary tree over triangles; node 0 is the root, nodes are in depth-first order.
#[derive(Debug, Clone, Default)]
pub struct Tree {
    /// Nodes; empty for an empty scene.
    pub nodes: Vec<TreeNode>,
    /// Triangle indices, leaf by leaf in node order. After spatial splits a triangle may be in
    /// several leaves, whose boxes cover it only together.
    pub order: Vec<u32>,
    /// End-point overlap, if [`Tree::note_epo`] computed it.
    pub epo: Option<f64>,
}

impl Tree {
    /// Builds the tree with the builder in `settings`; phases are timed in `log`.
    ///
    /// # Errors
    /// A limit of the builder is exceeded.
    pub fn build(
        soup: &TriangleSoup,
        settings: &TreeParameters,
        log: &mut BuildLog,
    ) -> Result<Tree, AccelError> {
        if soup.records.is_empty() {
            return Ok(Tree::default());
        }
        let settings = &*auto::with_builder(settings, soup, log)?;
        let mut tree = Tree::grow(soup, settings, log)?;
        if settings.reinsertion > 0 {
            tree = log.phase("reinsertion", || reinsertion::optimise(tree, settings));
        }
        let has_duplicates = tree.has_duplicates(soup);
        Ok(log.phase("leaves", || {
            leaves::choose_leaves(tree, has_duplicates, settings)
        }))
    }

    /// Computes the end-point overlap ([`Tree::epo`]) for the record, over all triangles if fast
    /// enough, otherwise over a subset. Not part of a build, and not timed.
    pub fn note_epo(&mut self, soup: &TriangleSoup) {
        self.epo = Some(self.epo(soup, EPO_VISITS));
    }

    /// The builder's tree, before later steps.
    fn grow(
        soup: &TriangleSoup,
        settings: &TreeParameters,
        log: &mut BuildLog,
    ) -> Result<Tree, AccelError> {
        if let Some(parallel) = settings.on_device() {
            let linked = parallel::device::build(soup, &parallel, log)?;
            return Ok(log.phase("order", || linked.into()));
        }
        let references = log.phase("boxes", || reference::references(soup));
        log.phase(settings.builder.name(), || {
            Ok(match settings.builder {
                Builder::Binned => binned::build(references, settings),
                Builder::Sweep => sweep::build(&references, Axes::All, settings),
                Builder::LongestAxisSweep => sweep::build(&references, Axes::Longest, settings),
                Builder::Sbvh => sbvh::build(references, soup, settings),
                Builder::Ploc => ploc::build(&references, settings, false)?,
                Builder::PlocReinsertion => ploc::build(&references, settings, true)?,
                // Only the host variant of each pair is built here.
                Builder::HostLbvh | Builder::DeviceLbvh => {
                    parallel::build(soup, &settings.parallel(Method::Lbvh))?.into()
                }
                Builder::HostPloc | Builder::DevicePloc => {
                    parallel::build(soup, &settings.parallel(settings.clustering()))?.into()
                }
                // Another one before a tree is grown.
                Builder::Auto => binned::build(references, settings),
            })
        })
    }

    fn new(nodes: Vec<TreeNode>, order: Vec<u32>) -> Self {
        Tree {
            nodes,
            order,
            epo: None,
        }
    }

    /// True if some triangle is listed more than once, in leaves that only together cover it.
    pub fn has_duplicates(&self, soup: &TriangleSoup) -> bool {
        self.order.len() > soup.records.len()
    }
}
