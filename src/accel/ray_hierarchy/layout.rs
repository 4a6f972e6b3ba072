//! Where rays, nodes and streams lie, for a set of rays.

use super::Options;

/// Levels of a tree at most: each has at most a quarter of the nodes below.
pub(super) const LEVELS: u32 = 18;

/// The levels of a tree over rays, and how primitives come in.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Layout {
    pub rays: u32,
    /// First node and number of nodes of each level, from the leaves up.
    pub levels: Vec<[u32; 2]>,
    /// The level that the descent begins at.
    pub begin: usize,
    /// Pairs that a stream has room for.
    pub capacity: u32,
    /// Pairs of a stream that have room for all their children.
    pub expands: u32,
    /// Primitives of a batch.
    pub batch: u32,
}

impl Layout {
    pub(super) fn new(rays: u32, primitives: usize, options: &Options) -> Self {
        let branching = options.branching;
        // No rays are as good as some that fill more than the first level: all kernels compile, and find nothing.
        let rays = if rays == 0 {
            options.start * options.bundle + 1
        } else {
            rays
        };
        let mut levels = vec![[0, rays.div_ceil(options.bundle)]];
        while let &[.., [first, count]] = levels.as_slice()
            && count > 1
        {
            levels.push([first + count, count.div_ceil(branching)]);
        }
        let begin = levels.iter().position(|[_, count]| *count <= options.start);
        let begin = begin.unwrap_or(levels.len() - 1);
        let most = u64::from(levels[0][1]) * primitives as u64 * u64::from(branching);
        let least = u64::from(options.start.max(branching));
        let capacity = most.clamp(least, u64::from(options.capacity).max(least)) as u32;
        let batch = (capacity / levels[begin][1]).min((primitives as u32).div_ceil(options.chunks));
        Self {
            rays,
            levels,
            begin,
            capacity,
            expands: capacity / branching,
            batch: batch.max(1),
        }
    }

    /// Nodes of all levels.
    pub(super) fn nodes(&self) -> u32 {
        self.levels.iter().map(|[_, count]| count).sum()
    }
}
