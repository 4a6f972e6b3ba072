//! What the file of a structure begins with: the declaration of its registry entry, and the vocabulary.

use super::tree::Tree;
use super::{AccelError, AccelKind, BuildLog, BuildResult, TriangleSoup};
use raystone_core::params::{ParameterSchema, Parameters, Params, Sources};

/// A registry entry whose name and parameters are known at compile time. Every one is an [`AccelKind`].
pub trait Structure: Sync {
    /// Name as a user types it.
    const NAME: &'static str;
    /// One line: what it is and where it comes from.
    const DESCRIPTION: &'static str;
    /// See [`AccelKind::sources`].
    const SOURCES: Sources = &[];
    /// What it can be set to, declared by [`parameters!`](raystone_core::parameters).
    type Parameters: Parameters;

    /// Builds the structure; phases are timed in `log`.
    ///
    /// # Errors
    /// A limit of the structure is exceeded.
    fn build(soup: &TriangleSoup, options: &Self::Parameters, log: &mut BuildLog) -> BuildResult;

    /// See [`AccelKind::over_tree`].
    fn over_tree() -> Option<&'static dyn OverTree> {
        None
    }
}

/// A structure that is a layout of one binary tree, so that a tree whose boxes were fitted to triangles that moved makes
/// one, too.
pub trait OverTree: Sync {
    /// The tree that is laid out.
    ///
    /// # Errors
    /// Parameters that the structure does not have, or a limit of the builder is exceeded.
    fn tree(
        &self,
        soup: &TriangleSoup,
        params: &Params,
        log: &mut BuildLog,
    ) -> Result<Tree, AccelError>;

    /// Lays out a tree of [`OverTree::tree`], whatever its boxes have become.
    ///
    /// # Errors
    /// The tree exceeds a limit of the layout.
    fn lay_out(
        &self,
        tree: &Tree,
        soup: &TriangleSoup,
        params: &Params,
        log: &mut BuildLog,
    ) -> BuildResult;
}

impl<S: Structure> AccelKind for S {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn description(&self) -> &'static str {
        Self::DESCRIPTION
    }

    fn parameters(&self) -> ParameterSchema {
        S::Parameters::schema()
    }

    fn sources(&self) -> Sources {
        Self::SOURCES
    }

    fn build(&self, soup: &TriangleSoup, params: &Params, log: &mut BuildLog) -> BuildResult {
        S::build(soup, &S::Parameters::from_params(params)?, log)
    }

    fn over_tree(&self) -> Option<&dyn OverTree> {
        S::over_tree()
    }
}

/// What the files of structures name, whatever they build.
pub(super) mod prelude {
    pub(crate) use super::super::bounds::Bounds;
    pub(crate) use super::super::ray::{Hit, Ray};
    pub(crate) use super::super::twin::{CpuTwin, Traverse, Twin, Walk};
    pub(crate) use super::super::{
        AccelError, BuildLog, BuildResult, BuiltAccel, GpuBuffers, NamedWords, StructureStats,
        TriangleSoup, limits,
    };
    pub(crate) use super::{OverTree, Structure};
    pub(crate) use raystone_core::parameters;
    pub(crate) use raystone_core::params::{Parameters as _, Params};
}
