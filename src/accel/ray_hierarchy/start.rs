//! The level that a descent begins at, chosen by a sample of the primitives. Twin of `kernels/accel/ray_hierarchy/passes/choose.wesl`.

use super::layout::Layout;

/// Nodes of the lowest level that a descent may begin at, where that is chosen, at most.
pub(super) const MOST_NODES: u32 = 64;
/// Nodes of the level that it begins at where it could be chosen, but for other parameters.
pub(super) const USUAL_NODES: u32 = 16;
/// Primitives of a sample, at most.
const SAMPLE: u32 = 256;
/// Primitives for one of a sample, at least: what is chosen by a larger part costs more than it saves.
const LEAST_STRIDE: u32 = 32;

/// Every `stride`-th primitive, `count` of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Sample {
    pub stride: u32,
    pub count: u32,
}

impl Sample {
    pub(super) fn of(primitives: u32) -> Self {
        // Odd, so that neither of the two triangles of each square is left out.
        let stride = primitives.div_ceil(SAMPLE).max(LEAST_STRIDE) | 1;
        Self {
            stride,
            count: primitives.div_ceil(stride),
        }
    }
}

impl Layout {
    /// The level with the fewest tests of nodes against the sample, of which `met[k]` pairs meet at the `k`-th level above the
    /// lowest: a descent tests all nodes of its first level, and of each below the children of what was met above it.
    pub(super) fn chosen(&self, sampled: u32, met: &[u32]) -> usize {
        let all = |level: usize| u64::from(self.levels[level][1]) * u64::from(sampled);
        let (mut best, mut least) = (self.lowest, all(self.lowest));
        let mut below = 0;
        for (level, met) in (self.lowest + 1..).zip(met) {
            below += u64::from(*met) * u64::from(self.branching);
            let tests = all(level) + below;
            if tests < least {
                (best, least) = (level, tests);
            }
        }
        best
    }
}
