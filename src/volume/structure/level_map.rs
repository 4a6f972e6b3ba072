//! The level map of Pfeuti 2009, §3.3. Kernel: `kernels/volume/structure/level_map.wesl`.

use super::{Parts, VolumeStructure, levels_of, occupied, packed_bytes};
use crate::medium::{Medium, Region};
use glam::UVec3;
use raystone_core::parameters;

parameters! {
    /// level of the largest homogeneous cube around each voxel, and a pyramid of bounds (Pfeuti 2009)
    pub(super) struct LevelMap {
        /// true to keep levels of the pyramid in which no cube is homogeneous
        whole: bool = false;
    }
}

impl VolumeStructure for LevelMap {
    fn module(&self) -> &'static str {
        "volume/structure/level_map"
    }

    fn parts(&self, medium: &Medium) -> Parts {
        let pyramid = medium.pyramid(&medium.dilated());
        let index = packed_bytes(&levels_of(medium, &pyramid));
        let (pairs, top) = occupied(medium, pyramid, self.whole);
        Parts { pairs, index, top }
    }

    fn region_of(&self, medium: &Medium, voxel: UVec3, fetches: &mut u32) -> Region {
        let level = medium.fetch_byte(medium.voxel_index(voxel), fetches);
        let pair = medium.fetch_pair(medium.cube_index(voxel, level), fetches);
        medium.cube_of(voxel, level, pair)
    }
}
