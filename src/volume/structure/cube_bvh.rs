//! A BVH over homogeneous cubes. Kernel: `kernels/volume/structure/cube_bvh.wesl`.

use super::{Parts, VolumeStructure, levels_of};
use crate::medium::{Medium, Region};
use crate::volume::voxel_at;
use glam::UVec3;
use raystone_core::parameters;

parameters! {
    /// a BVH over the largest homogeneous cubes, with skip pointers
    pub(super) struct CubeBvh {}
}

const NODE_WORDS: u32 = 4;
const CORNER_BITS: u32 = 10;

/// A homogeneous cube, with the place of its bounds.
struct Cube {
    low: UVec3,
    high: UVec3,
    pair: u32,
}

fn corner(word: u32) -> UVec3 {
    let mask = (1 << CORNER_BITS) - 1;
    UVec3::new(
        word & mask,
        (word >> CORNER_BITS) & mask,
        word >> (2 * CORNER_BITS),
    )
}

/// Appends a tree over cubes, split at the median along the longest axis of their box.
fn append(cubes: &mut [Cube], index: &mut Vec<u32>) {
    let none = (UVec3::MAX, UVec3::ZERO);
    let join = |(low, high): (UVec3, UVec3), cube: &Cube| (low.min(cube.low), high.max(cube.high));
    let (low, high) = cubes.iter().fold(none, join);
    let packed = |v: UVec3| v.x | v.y << CORNER_BITS | v.z << (2 * CORNER_BITS);
    let node = index.len();
    let pair = if let [only] = &*cubes { only.pair } else { 0 };
    match cubes.len() {
        0 => return,
        1 => index.extend([packed(low), packed(high), 0, pair]),
        count => {
            index.extend([packed(low), packed(high), 0, 0]);
            let size = high - low;
            let axis = usize::from(size.y > size.x.max(size.z))
                + 2 * usize::from(size.z > size.x && size.z >= size.y);
            let middle = count / 2;
            cubes.select_nth_unstable_by_key(middle, |cube| cube.low[axis] + cube.high[axis]);
            let (left, right) = cubes.split_at_mut(middle);
            append(left, index);
            append(right, index);
        }
    }
    index[node + 2] = index.len() as u32;
}

impl VolumeStructure for CubeBvh {
    fn module(&self) -> &'static str {
        "volume/structure/cube_bvh"
    }

    fn parts(&self, medium: &Medium) -> Parts {
        let voxels = medium.dilated();
        let pyramid = medium.pyramid(&voxels);
        let mut cubes = Vec::new();
        for (place, level) in levels_of(medium, &pyramid).into_iter().enumerate() {
            let voxel = UVec3::from(voxel_at(medium.resolution.to_array(), place));
            let low = (voxel >> u32::from(level)) << u32::from(level);
            if level > 0 && voxel == low {
                let high = (low + (1 << level)).min(medium.resolution);
                let pair = medium.cube_index(low, level.into());
                cubes.push(Cube { low, high, pair });
            }
        }
        let mut pairs = voxels;
        for cube in &mut cubes {
            pairs.push(pyramid[cube.pair as usize]);
            cube.pair = pairs.len() as u32 - 1;
        }
        let mut index = Vec::new();
        append(&mut cubes, &mut index);
        let top = medium.levels;
        Parts { pairs, index, top }
    }

    fn region_of(&self, medium: &Medium, voxel: UVec3, fetches: &mut u32) -> Region {
        let mut node = 0;
        while node < medium.index.len() as u32 {
            let low = corner(medium.fetch_index(node, fetches));
            let high = corner(medium.fetch_index(node + 1, fetches));
            if (voxel.cmpge(low) & voxel.cmplt(high)).all() {
                let pair = medium.fetch_index(node + 3, fetches);
                if pair != 0 {
                    return medium.bounded(low, high, medium.fetch_pair(pair, fetches));
                }
                node += NODE_WORDS;
            } else {
                node = medium.fetch_index(node + 2, fetches);
            }
        }
        let pair = medium.fetch_pair(medium.voxel_index(voxel), fetches);
        medium.bounded(voxel, voxel + 1, pair)
    }
}
