//! One voxel a step. Kernel: `kernels/volume/structure/dda.wesl`.

use super::{Parts, VolumeStructure};
use crate::medium::{Medium, Region};
use glam::UVec3;
use raystone_core::parameters;

parameters! {
    /// one voxel a step, with its own bounds (Amanatides & Woo 1987)
    pub(super) struct Dda {}
}

impl VolumeStructure for Dda {
    fn module(&self) -> &'static str {
        "volume/structure/dda"
    }

    fn parts(&self, medium: &Medium) -> Parts {
        Parts {
            pairs: medium.dilated(),
            index: Vec::new(),
            top: medium.levels,
        }
    }

    fn region_of(&self, medium: &Medium, voxel: UVec3, fetches: &mut u32) -> Region {
        let pair = medium.fetch_pair(medium.voxel_index(voxel), fetches);
        medium.bounded(voxel, voxel + 1, pair)
    }
}
