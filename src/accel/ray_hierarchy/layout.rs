//! Where rays, nodes and streams lie, for a set of rays.

use super::Options;
use super::start::{MOST_NODES, USUAL_NODES};

/// Levels of a tree at most: each has at most a quarter of the nodes below.
pub(super) const LEVELS: u32 = 18;

/// The levels of a tree over rays, and how primitives come in.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Layout {
    pub rays: u32,
    /// First node and number of nodes of each level, from the leaves up.
    pub levels: Vec<[u32; 2]>,
    /// The level that the descent begins at; where it is chosen, the highest.
    pub begin: usize,
    /// The lowest that it may begin at.
    pub lowest: usize,
    /// Pairs that a stream has room for.
    pub capacity: u32,
    /// First primitive and number of primitives of each level that is descended, from those that have triangles up.
    pub primitives: Vec<[u32; 2]>,
    /// Primitives of a batch, of the level that comes in.
    pub batch: u32,
    pub branching: u32,
}

/// First and number of the level above one.
fn above([first, count]: [u32; 2], branching: u32) -> [u32; 2] {
    [first + count, count.div_ceil(branching)]
}

/// First primitive and number of primitives of each level of the tree over them; one level where there is no such tree.
pub(super) fn tree_over(primitives: usize, options: &Options) -> Vec<[u32; 2]> {
    let lowest = Some([0, primitives as u32]);
    let levels = std::iter::successors(lowest, |level| Some(above(*level, options.branching)));
    levels.take(1 + options.dual as usize).collect()
}

impl Layout {
    pub(super) fn new(rays: u32, primitives: usize, options: &Options) -> Self {
        let branching = options.branching;
        let start = match options.start {
            0 if options.chooses_start() => MOST_NODES,
            0 => USUAL_NODES,
            start => start,
        };
        // No rays are as good as some that fill more than the first level: all kernels compile, and find nothing.
        let rays = if rays == 0 {
            start * options.bundle + 1
        } else {
            rays
        };
        let mut levels = vec![[0, rays.div_ceil(options.bundle)]];
        while let &[.., last] = levels.as_slice()
            && last[1] > 1
        {
            levels.push(above(last, branching));
        }
        let highest = levels.len() - 1;
        let lowest = levels.iter().position(|[_, count]| *count <= start);
        let lowest = lowest.unwrap_or(highest);
        let begin = if options.chooses_start() {
            highest
        } else {
            lowest
        };
        let mut over = tree_over(primitives, options);
        over.truncate(begin + 1);
        let coming = over[over.len() - 1][1];
        let children = branching.pow(if over.len() > 1 { 2 } else { 1 });
        let most = u64::from(levels[0][1]) * primitives as u64 * u64::from(children);
        let least = u64::from(start.max(children));
        let capacity = most.clamp(least, u64::from(options.capacity).max(least)) as u32;
        let batch = (capacity / levels[lowest][1]).min(coming.div_ceil(options.chunks));
        Self {
            rays,
            levels,
            begin,
            lowest,
            capacity,
            primitives: over,
            batch: batch.max(1),
            branching,
        }
    }

    /// The levels that the descent may begin at; more than one where the level is chosen.
    pub(super) fn beginnings(&self) -> std::ops::RangeInclusive<usize> {
        self.lowest..=self.begin
    }

    /// The level of the primitives of a level's stream.
    pub(super) fn height(&self, level: usize) -> usize {
        level.min(self.primitives.len() - 1)
    }

    /// Whether the pairs of a level are divided on both sides.
    pub(super) fn is_dual(&self, level: usize) -> bool {
        level > 0 && level < self.primitives.len()
    }

    /// Children of a pair of a level.
    pub(super) fn children(&self, level: usize) -> u32 {
        self.branching.pow(1 + u32::from(self.is_dual(level)))
    }

    /// Pairs of a level's stream that have room for all their children; all of the lowest are tested where they lie.
    pub(super) fn expands(&self, level: usize) -> u32 {
        match level {
            0 => u32::MAX,
            _ => self.capacity / self.children(level),
        }
    }

    /// Nodes of all levels.
    pub(super) fn nodes(&self) -> u32 {
        self.levels.iter().map(|[_, count]| count).sum()
    }
}
