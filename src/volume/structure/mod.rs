//! Structures over volumes: each answers, for a voxel, the region around it in which bounds of refractive index and
//! extinction hold. An entry of the registry is a line of [`registry`].

mod bricks;
mod chebyshev;
mod cube_bvh;
mod dda;
mod level_map;
mod min_max;
mod sparse_tree;

use crate::medium::{Medium, Pair, Region};
use glam::UVec3;
use raystone_core::params::{Parameters as _, Registered, Registry};
use std::sync::Arc;

/// A structure over a volume.
pub trait VolumeStructure: Send + Sync {
    /// The kernel module that exports its `region_of`.
    fn module(&self) -> &'static str;

    /// Bounds, and what leads to them, of a medium that has its field alone.
    fn parts(&self, medium: &Medium) -> Parts;

    /// The region around a voxel: the scalar twin. `fetches` counts what is read.
    fn region_of(&self, medium: &Medium, voxel: UVec3, fetches: &mut u32) -> Region;
}

/// The arrays of a structure.
pub struct Parts {
    /// Bounds of its boxes.
    pub pairs: Vec<Pair>,
    /// What leads to them.
    pub index: Vec<u32>,
    /// The highest level of cubes that are asked for.
    pub top: u32,
}

/// All structures by name.
pub fn registry() -> Registry<dyn VolumeStructure> {
    Registry::new(vec![
        Registered::new::<dda::Dda>("dda", |_| Ok(Arc::new(dda::Dda {}))),
        Registered::new::<level_map::LevelMap>("level-map", |params| {
            Ok(Arc::new(level_map::LevelMap::from_params(params)?))
        }),
        Registered::new::<min_max::MinMax>("min-max", |params| {
            Ok(Arc::new(min_max::MinMax::from_params(params)?))
        }),
        Registered::new::<bricks::Bricks>("bricks", |_| Ok(Arc::new(bricks::Bricks {}))),
        Registered::new::<sparse_tree::SparseTree>("sparse-tree", |_| {
            Ok(Arc::new(sparse_tree::SparseTree {}))
        }),
        Registered::new::<chebyshev::Chebyshev>("chebyshev", |_| {
            Ok(Arc::new(chebyshev::Chebyshev {}))
        }),
        Registered::new::<cube_bvh::CubeBvh>("cube-bvh", |_| Ok(Arc::new(cube_bvh::CubeBvh {}))),
    ])
}

/// Bytes, four to a word, the first in the lowest bits.
fn packed_bytes(bytes: &[u8]) -> Vec<u32> {
    let word = |of: &[u8]| {
        of.iter()
            .rev()
            .fold(0, |word, byte| word << 8 | u32::from(*byte))
    };
    bytes.chunks(4).map(word).collect()
}

/// A pyramid without the levels in which no cube is homogeneous, and the highest one left: no answer is from those above it. As it is,
/// if it is to be `whole`.
fn occupied(medium: &Medium, mut pyramid: Vec<Pair>, whole: bool) -> (Vec<Pair>, u32) {
    // Cubes beyond the grid are none.
    let is_even = |pair: &Pair| *pair != Pair::NONE && medium.is_homogeneous(pair.n, pair.sigma);
    let start = |level: u32| medium.level_start(level) as usize;
    let mut top = medium.levels;
    while !whole && top > 0 && !pyramid[start(top)..].iter().any(is_even) {
        pyramid.truncate(start(top));
        top -= 1;
    }
    (pyramid, top)
}

/// The level of the largest homogeneous cube around each voxel, 0 where only the voxel itself could be one
/// (Pfeuti 2009, §3.3).
fn levels_of(medium: &Medium, pyramid: &[Pair]) -> Vec<u8> {
    let is_even = |voxel: UVec3, level: u32| {
        let pair = pyramid[medium.cube_index(voxel, level) as usize];
        medium.is_homogeneous(pair.n, pair.sigma)
    };
    let level = |place: usize| {
        let voxel = UVec3::from(crate::volume::voxel_at(medium.resolution.to_array(), place));
        let levels = (1..=medium.levels).rev();
        levels
            .into_iter()
            .find(|level| is_even(voxel, *level))
            .unwrap_or(0) as u8
    };
    (0..medium.field.len()).map(level).collect()
}
