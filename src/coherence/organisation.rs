//! Which rays the lanes of a warp have.

use super::model::{Pass, Warp};
use super::trace::Trace;

/// How rays are given to lanes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Organisation {
    /// One kernel: a lane keeps its pixel, and waits once its path has ended (Dufay 2017, Alg. 2).
    SingleKernel,
    /// A kernel for each bounce: the rays that are left, in the order of their pixels, fill warps anew (stable
    /// compaction), among the warps of one group.
    Compacted,
}

impl Organisation {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::SingleKernel, Self::Compacted];

    /// What it is called.
    pub const fn name(self) -> &'static str {
        match self {
            Self::SingleKernel => "single kernel",
            Self::Compacted => "compacted",
        }
    }

    /// The warps of a group, from those in which every lane keeps its pixel. These have all the same passes.
    pub fn of(self, warps: Vec<Warp>) -> Vec<Warp> {
        match self {
            Self::SingleKernel => warps,
            Self::Compacted => compacted(&warps),
        }
    }
}

fn compacted(warps: &[Warp]) -> Vec<Warp> {
    let mut filled = vec![Warp::default(); warps.len()];
    let passes = warps.first().map_or(0, |warp| warp.passes.len());
    for index in 0..passes {
        let same = warps.iter().filter_map(|warp| warp.passes.get(index));
        let lanes: Vec<&Option<Trace>> = same.clone().flat_map(|pass| &pass.lanes).collect();
        let width = lanes.len() / warps.len();
        let alive: Vec<Option<Trace>> = lanes
            .iter()
            .filter(|lane| lane.is_some())
            .map(|lane| (*lane).clone())
            .collect();
        let class = same.map(|pass| pass.class).next().unwrap_or_default();
        for (warp, rays) in filled.iter_mut().zip(alive.chunks(width.max(1))) {
            let mut lanes = rays.to_vec();
            lanes.resize(width, None);
            warp.passes.push(Pass { class, lanes });
        }
    }
    filled
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
        assert_eq!(
            steps(&Organisation::SingleKernel.of(warps)),
            [[0, 1, 2], [3, 0, 0], [0, 4, 0]]
        );
    }
}
