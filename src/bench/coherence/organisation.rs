//! Assignment of rays to the lanes of a warp.

use super::model::{Pass, Warp};
use super::paths::RayClass;
use super::trace::Trace;
use raystone_core::random::Pcg32;
use raystone_record::SINGLE_KERNEL;
use raystone_render::CountedRays;

/// How rays are assigned to lanes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Organisation {
    /// Megakernel: a lane keeps its pixel, and idles once its path has ended (Dufay 2017, Alg. 2).
    SingleKernel,
    /// One kernel per bounce: remaining rays refill a group's warps in pixel order (stable).
    Compacted,
    /// As `Compacted`, but with warps in random order, as after a scan or ballot with one atomic.
    CompactedByWarps,
    /// As `Compacted`, but with rays in random order, the worst case of one atomic per ray.
    CompactedByRays,
}

impl Organisation {
    /// All organisations.
    pub const ALL: [Self; 4] = [
        Self::SingleKernel,
        Self::Compacted,
        Self::CompactedByWarps,
        Self::CompactedByRays,
    ];

    /// Name of the organisation.
    pub const fn name(self) -> &'static str {
        match self {
            Self::SingleKernel => SINGLE_KERNEL,
            Self::Compacted => "compacted",
            Self::CompactedByWarps => "compacted, warps in any order",
            Self::CompactedByRays => "compacted, rays in any order",
        }
    }

    /// Regroups warps in which every lane keeps its pixel, and which all have the same passes.
    pub fn of(self, warps: Vec<Warp>) -> Vec<Warp> {
        match self {
            Self::SingleKernel => warps,
            _ => self.compacted(&warps),
        }
    }

    /// The remaining rays of a pass in order. Camera rays have not been compacted yet.
    fn left(self, passes: &[&Pass], index: usize) -> Vec<Trace> {
        let is_first = |pass: &&Pass| RayClass::of_word(pass.class).rays == CountedRays::Primary;
        if self != Self::Compacted && passes.first().is_some_and(is_first) {
            return Self::Compacted.left(passes, index);
        }
        let mut random = Pcg32::new(index as u64);
        let of_warp = |pass: &&Pass| pass.lanes.iter().flatten().cloned().collect();
        let mut warps: Vec<Vec<Trace>> = passes.iter().map(of_warp).collect();
        if self == Self::CompactedByWarps {
            shuffle(&mut warps, &mut random);
        }
        let mut rays = warps.concat();
        if self == Self::CompactedByRays {
            shuffle(&mut rays, &mut random);
        }
        rays
    }

    fn compacted(self, warps: &[Warp]) -> Vec<Warp> {
        let mut filled = vec![Warp::default(); warps.len()];
        let count = warps.first().map_or(0, |warp| warp.passes.len());
        for index in 0..count {
            let same: Vec<&Pass> = (warps.iter())
                .filter_map(|warp| warp.passes.get(index))
                .collect();
            let lanes: usize = same.iter().map(|pass| pass.lanes.len()).sum();
            let width = lanes / warps.len();
            let class = same.first().map(|pass| pass.class).unwrap_or_default();
            let left = self.left(&same, index);
            for (warp, rays) in filled.iter_mut().zip(left.chunks(width.max(1))) {
                let mut lanes: Vec<Option<Trace>> = rays.iter().cloned().map(Some).collect();
                lanes.resize(width, None);
                warp.passes.push(Pass { class, lanes });
            }
        }
        filled
    }
}

/// Uniformly random permutation (Fisher & Yates).
fn shuffle<T>(items: &mut [T], random: &mut Pcg32) {
    for last in (1..items.len()).rev() {
        items.swap(last, random.below(last + 1));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn compaction_fills_lanes_in_the_order_of_pixels_and_leaves_the_last_warps_empty() {
        let trace = |steps: usize| {
            let step = |_| (crate::coherence::Kind::Node, Vec::new());
            Trace::of((0..steps).map(step))
        };
        let warp = |lanes: [usize; 3]| Warp {
            passes: vec![Pass {
                class: 7,
                lanes: lanes.map(|n| (n > 0).then(|| trace(n))).to_vec(),
            }],
        };
        let warps = vec![warp([0, 1, 2]), warp([3, 0, 0]), warp([0, 4, 0])];
        let steps = |warps: &[Warp]| -> Vec<Vec<usize>> {
            let of_lane = |lane: &Option<Trace>| lane.as_ref().map_or(0, |t| t.steps.len());
            let of_pass = |pass: &Pass| pass.lanes.iter().map(of_lane).collect();
            warps.iter().flat_map(|w| &w.passes).map(of_pass).collect()
        };
        let filled = Organisation::Compacted.of(warps.clone());
        assert_eq!(steps(&filled), [[1, 2, 3], [4, 0, 0]]);
        assert!(filled[2].passes.is_empty());
        assert!(filled[0].passes[0].class == 7);
        // The same rays in any order; rays of a warp stay together if only warps are permuted.
        let sorted = |organisation: Organisation| {
            let mut all = steps(&organisation.of(warps.clone())).concat();
            all.sort_unstable();
            all
        };
        for organisation in [
            Organisation::CompactedByWarps,
            Organisation::CompactedByRays,
        ] {
            assert_eq!(sorted(organisation), [0, 0, 1, 2, 3, 4]);
        }
        let by_warps = steps(&Organisation::CompactedByWarps.of(warps.clone())).concat();
        assert!(by_warps.windows(2).any(|pair| pair == [1, 2]));
        assert_eq!(
            steps(&Organisation::SingleKernel.of(warps)),
            [[0, 1, 2], [3, 0, 0], [0, 4, 0]]
        );
    }
}
