//! The declaration of a structure's registry entry, and the common imports of structure files.

use super::tree::Tree;
use super::{AccelError, AccelKind, BuildLog, BuildResult, TriangleSoup};
use raystone_core::params::{ParameterSchema, Parameters, Params, Sources};

/// A registry entry with name and parameters known at compile time. Every one is an [`AccelKind`].
pub trait Structure: Sync {
    /// Name used in configurations.
    const NAME: &'static str;
    /// One-line description with source.
    const DESCRIPTION: &'static str;
    /// See [`AccelKind::sources`].
    const SOURCES: Sources = &[];
    /// Its parameters, declared by [`parameters!`](raystone_core::parameters).
    type Parameters: Parameters;

    /// See [`AccelKind::kernels`].
    fn kernels() -> Vec<String> {
        vec![format!("accel/{}", Self::NAME.replace('-', "_"))]
    }

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

/// A layout of one binary tree, which can also be built from a refitted tree.
pub trait OverTree: Sync {
    /// Builds the tree.
    ///
    /// # Errors
    /// Unknown parameters, or a limit of the builder is exceeded.
    fn tree(
        &self,
        soup: &TriangleSoup,
        params: &Params,
        log: &mut BuildLog,
    ) -> Result<Tree, AccelError>;

    /// Lays out a tree of [`OverTree::tree`], whose boxes may have changed since.
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

    fn kernels(&self) -> Vec<String> {
        S::kernels()
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

/// Common imports of structure files.
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
