//! A structure whose scene moves, and the ways in which it takes a frame over.

use raystone_accel::tree::Tree;
use raystone_accel::{AccelError, AccelKind, BuildLog, BuiltAccel, OverTree, TriangleSoup};
use raystone_config::Motion;
use raystone_core::params::Params;
use raystone_gpu::Gpu;

/// How a structure takes over the triangles of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// The first frame's tree with new boxes, fitted on the device.
    Device,
    /// The same, fitted on the host.
    Host,
    /// New transforms under what was built over the objects: [`BuiltAccel::update`].
    Update,
    /// Built anew.
    Rebuild,
}

/// A structure as it was built over the first frame.
pub struct Actor<'a> {
    kind: &'a dyn AccelKind,
    params: &'a Params,
    first: First<'a>,
}

/// What is kept from frame to frame.
enum First<'a> {
    /// A tree, and what lays it out.
    Tree(&'a dyn OverTree, Tree),
    /// Objects that do not change: a structure that takes over transforms.
    Objects,
}

/// What a way led to: where a tree is laid out, only the tree is timed, since all ways have the layout in common.
pub enum Taken {
    /// A tree.
    Tree(Tree),
    /// All of it.
    Built(Box<dyn BuiltAccel>),
}

impl<'a> Actor<'a> {
    /// Builds over the first frame.
    ///
    /// # Errors
    /// It cannot be built, or has no way to take a frame over but building it anew.
    pub fn new(
        kind: &'a dyn AccelKind,
        params: &'a Params,
        motion: Motion,
        (soup, gpu): (&TriangleSoup, &Gpu),
    ) -> Result<Self, String> {
        let mut log = BuildLog::with_gpu(gpu);
        let first = match (kind.over_tree(), motion) {
            (Some(over), _) => {
                let tree = over.tree(soup, params, &mut log);
                First::Tree(over, tree.map_err(|e| e.to_string())?)
            }
            (None, Motion::Instances) => {
                let built = kind.build(soup, params, &mut log);
                let updated = built.map_err(|e| e.to_string())?.update(soup);
                updated
                    .ok_or("it takes over no transforms")?
                    .map_err(|e| e.to_string())?;
                First::Objects
            }
            (None, Motion::Deform) => {
                return Err("it is no layout of one binary tree that could be refitted".to_owned());
            }
        };
        Ok(Self {
            kind,
            params,
            first,
        })
    }

    /// The ways that lead from frame to frame: first that of less work, last building anew.
    pub fn ways(&self) -> &'static [Way] {
        match self.first {
            First::Tree(..) => &[Way::Device, Way::Host, Way::Rebuild],
            First::Objects => &[Way::Update, Way::Rebuild],
        }
    }

    /// What a way starts from, made before it is timed.
    ///
    /// # Errors
    /// It cannot be built.
    pub fn start(&self, way: Way, first: &TriangleSoup) -> Result<Option<Taken>, AccelError> {
        Ok(match (&self.first, way) {
            (_, Way::Rebuild) => None,
            (First::Tree(_, tree), _) => Some(Taken::Tree(tree.clone())),
            (First::Objects, _) => {
                let mut log = BuildLog::default();
                Some(Taken::Built(self.kind.build(
                    first,
                    self.params,
                    &mut log,
                )?))
            }
        })
    }

    /// Takes over the triangles of a frame.
    ///
    /// # Errors
    /// As the building, refitting or updating that it is.
    pub fn take(
        &self,
        way: Way,
        from: Option<Taken>,
        soup: &TriangleSoup,
        log: &mut BuildLog,
    ) -> Result<Taken, AccelError> {
        match (from, &self.first) {
            (Some(Taken::Tree(mut tree)), _) => {
                match way {
                    Way::Host => tree.refit(soup)?,
                    _ => tree.refit_on_device(soup, log)?,
                }
                Ok(Taken::Tree(tree))
            }
            (Some(Taken::Built(mut built)), _) => {
                built.update(soup).transpose()?;
                Ok(Taken::Built(built))
            }
            (None, First::Tree(over, _)) => over.tree(soup, self.params, log).map(Taken::Tree),
            (None, First::Objects) => self.kind.build(soup, self.params, log).map(Taken::Built),
        }
    }

    /// The structure that was led to.
    ///
    /// # Errors
    /// A tree exceeds a limit of the layout.
    pub fn built(
        &self,
        taken: Taken,
        soup: &TriangleSoup,
    ) -> Result<Box<dyn BuiltAccel>, AccelError> {
        match (taken, &self.first) {
            (Taken::Tree(tree), First::Tree(over, _)) => {
                over.lay_out(&tree, soup, self.params, &mut BuildLog::default())
            }
            (Taken::Tree(_), First::Objects) => Err(AccelError::Invalid(
                "a structure over objects has no tree of its own to lay out".to_owned(),
            )),
            (Taken::Built(built), _) => Ok(built),
        }
    }
}
