//! Homogeneous cubes around every voxel. Kernel: `kernels/volume/structure/chebyshev.wesl`.

use super::{Parts, VolumeStructure, packed_bytes};
use crate::medium::{Medium, Region};
use glam::UVec3;
use raystone_core::parameters;

parameters! {
    /// how far the cube around each voxel may reach and be homogeneous, 15 voxels at most (Cohen & Sheffer 1994)
    pub(super) struct Chebyshev {}
}

/// The farthest that a cube reaches from its voxel, for the sake of the build's time.
const MOST_REACH: u8 = 15;

impl VolumeStructure for Chebyshev {
    fn module(&self) -> &'static str {
        "volume/structure/chebyshev"
    }

    fn parts(&self, medium: &Medium) -> Parts {
        let mut pairs = medium.dilated();
        let mut reach = vec![0_u8; pairs.len()];
        let mut wider = pairs.clone();
        for step in 1..=MOST_REACH {
            medium.dilate(&mut wider);
            let mut grown = 0;
            for (place, reach) in reach.iter_mut().enumerate() {
                let pair = wider[place];
                // Cubes are nested: one that cannot reach so far reaches no farther.
                if *reach + 1 == step && medium.is_homogeneous(pair.n, pair.sigma) {
                    (*reach, pairs[place], grown) = (step, pair, grown + 1);
                }
            }
            if grown == 0 {
                break;
            }
        }
        Parts {
            pairs,
            index: packed_bytes(&reach),
            top: medium.levels,
        }
    }

    fn region_of(&self, medium: &Medium, voxel: UVec3, fetches: &mut u32) -> Region {
        let place = medium.voxel_index(voxel);
        let reach = medium.fetch_byte(place, fetches);
        let low = voxel.max(UVec3::splat(reach)) - reach;
        let high = (voxel + reach + 1).min(medium.resolution);
        medium.bounded(low, high, medium.fetch_pair(place, fetches))
    }
}
