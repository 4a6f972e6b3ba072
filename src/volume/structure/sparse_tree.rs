//! An octree without the parts below homogeneous cubes. Kernel: `kernels/volume/structure/sparse_tree.wesl`.

use super::{Parts, VolumeStructure};
use crate::medium::{Medium, Pair, Region};
use glam::UVec3;
use raystone_core::parameters;

parameters! {
    /// an octree with children only below cubes that are not homogeneous
    pub(super) struct SparseTree {}
}

const ROOT: u32 = 0;

/// Which of eight children of a cube of 2^(level + 1) voxels a voxel is in.
fn octant(voxel: UVec3, level: u32) -> u32 {
    let bits = (voxel >> level) & UVec3::ONE;
    bits.x | (bits.y << 1) | (bits.z << 2)
}

impl VolumeStructure for SparseTree {
    fn module(&self) -> &'static str {
        "volume/structure/sparse_tree"
    }

    fn parts(&self, medium: &Medium) -> Parts {
        let pyramid = medium.pyramid(&medium.dilated());
        let pair = |low, level| pyramid[medium.cube_index(low, level) as usize];
        // Low corner and level of each node; those of children come as their parents are looked at.
        let mut nodes = vec![(UVec3::ZERO, medium.levels)];
        let (mut pairs, mut index) = (Vec::new(), Vec::new());
        while let Some(&(low, level)) = nodes.get(pairs.len()) {
            let own = pair(low, level);
            let divided =
                level > 0 && !medium.is_homogeneous(own.n, own.sigma) && own != Pair::NONE;
            index.push(if divided { nodes.len() as u32 } else { 0 });
            pairs.push(own);
            if divided {
                let child = |k: u32| low + (UVec3::new(k & 1, k >> 1 & 1, k >> 2) << (level - 1));
                nodes.extend((0..8).map(|k| (child(k), level - 1)));
            }
        }
        let top = medium.levels;
        Parts { pairs, index, top }
    }

    fn region_of(&self, medium: &Medium, voxel: UVec3, fetches: &mut u32) -> Region {
        let (mut node, mut level) = (ROOT, medium.levels);
        let mut region = medium.cube_of(voxel, level, medium.fetch_pair(node, fetches));
        while !region.homogeneous && level > 0 {
            level -= 1;
            node = medium.fetch_index(node, fetches) + octant(voxel, level);
            region = medium.cube_of(voxel, level, medium.fetch_pair(node, fetches));
        }
        region
    }
}
