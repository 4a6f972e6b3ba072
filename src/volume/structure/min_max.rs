//! A pyramid of bounds, without a map. Kernel: `kernels/volume/structure/min_max.wesl`.

use super::{Parts, VolumeStructure, occupied};
use crate::medium::{Medium, Region};
use glam::UVec3;
use raystone_core::parameters;

parameters! {
    /// a pyramid of bounds, descended from its top to the first homogeneous cube
    pub(super) struct MinMax {
        /// true to begin with levels in which no cube is homogeneous
        whole: bool = false;
    }
}

impl VolumeStructure for MinMax {
    fn module(&self) -> &'static str {
        "volume/structure/min_max"
    }

    fn parts(&self, medium: &Medium) -> Parts {
        let pyramid = medium.pyramid(&medium.dilated());
        let (pairs, top) = occupied(medium, pyramid, self.whole);
        let index = Vec::new();
        Parts { pairs, index, top }
    }

    fn region_of(&self, medium: &Medium, voxel: UVec3, fetches: &mut u32) -> Region {
        let mut level = medium.top;
        let mut cube = |level| {
            let pair = medium.fetch_pair(medium.cube_index(voxel, level), fetches);
            medium.cube_of(voxel, level, pair)
        };
        let mut region = cube(level);
        while !region.homogeneous && level > 0 {
            level -= 1;
            region = cube(level);
        }
        region
    }
}
