//! Bricks of voxels. Kernel: `kernels/volume/structure/bricks.wesl`.

use super::{Parts, VolumeStructure};
use crate::medium::{Medium, Pair, Region};
use crate::volume::voxel_at;
use glam::UVec3;
use raystone_core::parameters;

parameters! {
    /// bricks of 8³ voxels with their bounds, and those of voxels where a brick is not homogeneous
    pub(super) struct Bricks {}
}

/// 2^BRICK voxels along an axis.
const BRICK: u32 = 3;

fn brick_index(medium: &Medium, voxel: UVec3) -> u32 {
    let bricks = (medium.resolution + 7) >> BRICK;
    let brick = voxel >> BRICK;
    brick.x + bricks.x * (brick.y + bricks.y * brick.z)
}

impl VolumeStructure for Bricks {
    fn module(&self) -> &'static str {
        "volume/structure/bricks"
    }

    fn parts(&self, medium: &Medium) -> Parts {
        let voxels = medium.dilated();
        let bricks = (medium.resolution + 7) >> BRICK;
        let count = bricks.element_product() as usize;
        let (mut pairs, mut pool) = (Vec::with_capacity(count), Vec::new());
        let mut index = Vec::with_capacity(count);
        for brick in 0..count {
            let low = UVec3::from(voxel_at(bricks.to_array(), brick)) << BRICK;
            let voxel = |place: usize| {
                let voxel = low + UVec3::from(voxel_at([8; 3], place));
                let inside = voxel.cmplt(medium.resolution).all();
                let known = || voxels[medium.voxel_index(voxel) as usize];
                if inside { known() } else { Pair::NONE }
            };
            let own: Vec<Pair> = (0..512).map(voxel).collect();
            let all = own.iter().fold(Pair::NONE, |all, pair| all.joined(*pair));
            index.push((count + pool.len()) as u32);
            pairs.push(all);
            if !medium.is_homogeneous(all.n, all.sigma) {
                pool.extend(own);
            }
        }
        pairs.extend(pool);
        let top = medium.levels;
        Parts { pairs, index, top }
    }

    fn region_of(&self, medium: &Medium, voxel: UVec3, fetches: &mut u32) -> Region {
        let brick = brick_index(medium, voxel);
        let region = medium.cube_of(voxel, BRICK, medium.fetch_pair(brick, fetches));
        if region.homogeneous {
            return region;
        }
        let local = voxel & UVec3::splat(7);
        let place = medium.fetch_index(brick, fetches) + local.x + 8 * (local.y + 8 * local.z);
        medium.bounded(voxel, voxel + 1, medium.fetch_pair(place, fetches))
    }
}
