//! Two-level structures: a BVH for each object in the object's own space, and above them either a
//! list of the instances (`object-list`) or a BVH over them (`meta-bvh`). A moved instance changes
//! the upper level only.
//!
//! Rays are taken to the object's space, so t, u and v are those of brute force *over the same
//! instances with the same transforms* ([`brute_force_instances`]), to the bit; brute force over the
//! flat triangles rounds otherwise. The direction is transformed and not normalised, which makes the
//! distance of a hit the same number in both spaces.
//!
//! Where a scene has no instances, it is one object that lies where it is. Rays are then not
//! transformed, and all answers equal those of the flat list.

mod forest;
mod instance;
mod judge;
mod meta_bvh;
mod meta_bvh_nested;
mod object_list;
mod placed;
#[cfg(test)]
mod tests;
mod top;
mod world_box;

pub use judge::{InstanceJudge, brute_force_instances};
pub use meta_bvh::MetaBvh;
pub use object_list::ObjectList;
pub use placed::Placed;

use super::{AccelError, BuildLog, Space, TriangleSoup};
use crate::config::Params;
use forest::Forest;
use std::borrow::Cow;

/// What both structures are built from: the placed objects and their BVHs.
struct Base {
    placed: Placed,
    forest: Forest,
}

impl Base {
    fn build(soup: &TriangleSoup, params: &Params, log: &mut BuildLog) -> Result<Self, AccelError> {
        let placed = Placed::of(soup).into_owned();
        let forest = Forest::build(&placed.objects, params, log)?;
        Ok(Self { placed, forest })
    }

    fn space(&self) -> Space {
        if self.placed.instances.iter().all(|i| i.is_identity()) {
            Space::World
        } else {
            Space::Instances
        }
    }

    /// Takes over the transforms of `soup`.
    fn update(&mut self, soup: &TriangleSoup) -> Result<(), AccelError> {
        let moved = Placed::of(soup);
        self.same_instances(&moved)?;
        self.placed.instances.clone_from(&moved.instances);
        Ok(())
    }

    /// Whether `other` has the same instances of the same objects, wherever they stand.
    fn same_instances(&self, other: &Placed) -> Result<(), AccelError> {
        let key = |placed: &Placed| -> Vec<_> {
            let instances = placed.instances.iter();
            instances.map(|i| (i.object, i.first)).collect()
        };
        let sizes = |placed: &Placed| -> Vec<_> {
            placed.objects.iter().map(|o| o.records.len()).collect()
        };
        if key(&self.placed) == key(other) && sizes(&self.placed) == sizes(other) {
            return Ok(());
        }
        Err(AccelError::Invalid(format!(
            "built for {} instances of {} objects, given {} of {}: other ones need a new build",
            self.placed.instances.len(),
            self.placed.objects.len(),
            other.instances.len(),
            other.objects.len()
        )))
    }

    /// Checks objects and transforms against those of `soup`.
    fn validate<'a>(&self, soup: &'a TriangleSoup) -> Result<Cow<'a, Placed>, AccelError> {
        let given = Placed::of(soup);
        self.same_instances(&given)?;
        if let Some(index) = (self.placed.instances.iter())
            .zip(&given.instances)
            .position(|(a, b)| a != b)
        {
            return Err(AccelError::Invalid(format!(
                "instance {index} was moved after the build"
            )));
        }
        self.forest.validate(&given.objects)?;
        Ok(given)
    }
}

/// The step fuse as the uniform holds it: no sum of subtrees wraps around.
fn clamped(steps: u64) -> usize {
    steps.min(u64::from(u32::MAX)) as usize
}
