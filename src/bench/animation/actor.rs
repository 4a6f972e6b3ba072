//! A structure over a moving scene, and its ways to follow it from frame to frame.

use raystone_accel::tree::Tree;
use raystone_accel::{AccelError, AccelKind, BuildLog, BuiltAccel, OverTree, TriangleSoup};
use raystone_config::Motion;
use raystone_core::params::Params;
use raystone_gpu::Gpu;

/// How a structure follows a new frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// Refits the first frame's tree on the device.
    Device,
    /// Refits the first frame's tree on the host.
    Host,
    /// New transforms over the structures of the objects: [`BuiltAccel::update`].
    Update,
    /// Rebuilds from scratch.
    Rebuild,
}

/// A structure built over the first frame.
pub struct Actor<'a> {
    kind: &'a dyn AccelKind,
    params: Params,
    first: First<'a>,
}

/// State reused in every frame.
enum First<'a> {
    Tree(&'a dyn OverTree, Tree),
    /// Unchanged objects of a structure that updates transforms.
    Objects,
}

/// Result of a way. If trees have a common layout step, only the tree is timed.
pub enum Taken {
    /// A tree.
    Tree(Tree),
    /// The complete structure.
    Built(Box<dyn BuiltAccel>),
}

impl<'a> Actor<'a> {
    /// Builds over the first frame.
    ///
    /// # Errors
    /// It cannot be built, or can only be rebuilt from frame to frame.
    pub fn new(
        kind: &'a dyn AccelKind,
        params: &Params,
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
            params: params.clone(),
            first,
        })
    }

    /// The available ways: the cheapest first, rebuilding last.
    pub fn ways(&self) -> &'static [Way] {
        match self.first {
            First::Tree(..) => &[Way::Device, Way::Host, Way::Rebuild],
            First::Objects => &[Way::Update, Way::Rebuild],
        }
    }

    /// Prepares the input of a way, before timing.
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
                    &self.params,
                    &mut log,
                )?))
            }
        })
    }

    /// Follows the triangles of a frame.
    ///
    /// # Errors
    /// Those of building, refitting or updating.
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
            (None, First::Tree(over, _)) => over.tree(soup, &self.params, log).map(Taken::Tree),
            (None, First::Objects) => self.kind.build(soup, &self.params, log).map(Taken::Built),
        }
    }

    /// The resulting structure.
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
                over.lay_out(&tree, soup, &self.params, &mut BuildLog::default())
            }
            (Taken::Tree(_), First::Objects) => Err(AccelError::Invalid(
                "a structure over objects has no tree of its own to lay out".to_owned(),
            )),
            (Taken::Built(built), _) => Ok(built),
        }
    }
}
