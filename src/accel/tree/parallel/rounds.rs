//! The rounds of clustering on the device: several per submission, until one cluster is left.

use super::device::{Passes, failed, play};
use crate::tree::depth::SAH_DEPTH;
use crate::{AccelError, BuildLog};
use raystone_gpu::{
    Bindings, GpuError, Groups, Recording, Storage, UniformValues, grid_of, groups_for,
};

/// Rounds in which clusters choose; after these they are merged in order.
pub(super) const FREE_ROUNDS: u32 = SAH_DEPTH;
/// Rounds per submission; even, as two cluster arrays alternate.
const ROUNDS_PER_PLAY: u32 = 16;
/// Clusters of a tile, as in `state.wesl`.
const TILE: u32 = 256;
/// Words of `state.wesl`: the clusters, and the offsets of the three kinds of workgroups.
const CLUSTERS: usize = 0;
const NODES: usize = 1;
const SEARCH_GROUPS: usize = 4;
const TILE_GROUPS: usize = 8;
const TILE_GROUPS_BEFORE: usize = 12;
const STATE_WORDS: usize = 16;

pub(super) struct Rounds<'a> {
    passes: &'a Passes<'a>,
    radius: u32,
    state: Storage,
    clusters: [Storage; 2],
}

impl<'a> Rounds<'a> {
    /// Every leaf is a cluster.
    pub(super) fn new(passes: &'a Passes<'a>, radius: u32) -> Result<Self, GpuError> {
        let (gpu, count) = (passes.gpu, passes.count);
        let mut state = [0; STATE_WORDS];
        state[CLUSTERS] = count;
        state[NODES] = count;
        let tiles = grid_of(count.div_ceil(TILE));
        for (place, groups) in [
            (SEARCH_GROUPS, groups_for(count)),
            (TILE_GROUPS, tiles),
            (TILE_GROUPS_BEFORE, tiles),
        ] {
            state[place..place + 3].copy_from_slice(&groups);
        }
        let leaves: Vec<u32> = (0..count).collect();
        Ok(Self {
            passes,
            radius,
            state: (&gpu.storage("state", &state)?).into(),
            clusters: [
                (&gpu.storage("clusters", &leaves)?).into(),
                (&gpu.zeroed("clusters", 4 * u64::from(count))?).into(),
            ],
        })
    }

    /// Plays `first`, then rounds until one cluster is left; returns the root.
    pub(super) fn play(&self, first: Recording, log: &mut BuildLog) -> Result<u32, AccelError> {
        let count = self.passes.count;
        let most = FREE_ROUNDS + count.ilog2() + 2;
        let mut recording = first;
        for round in (0..most).step_by(ROUNDS_PER_PLAY as usize) {
            for round in round..round + ROUNDS_PER_PLAY {
                self.record(&mut recording, round).map_err(failed)?;
            }
            recording.download("state", &self.state);
            let played = play(&recording, log)?;
            let state: Vec<u32> = played.download("state").map_err(failed)?;
            if state[CLUSTERS] == 1 {
                return Ok(state[NODES] - 1);
            }
            recording = Recording::new();
        }
        Err(AccelError::Device(format!(
            "clustering of {count} triangles did not end within {most} rounds: a kernel is at fault"
        )))
    }

    /// One round; it does nothing once a single cluster is left.
    fn record(&self, recording: &mut Recording, round: u32) -> Result<(), GpuError> {
        let passes = self.passes;
        let words = |name: &str, words: u32| Storage::scratch(name, 4 * u64::from(words));
        let [from, to] = match round % 2 {
            0 => [0, 1],
            _ => [1, 0],
        };
        let values = UniformValues::new()
            .u32("radius", self.radius)
            .u32("blind", u32::from(round >= FREE_ROUNDS));
        let mut bindings: Bindings = passes.bindings();
        bindings
            .uniform("round", values)
            .buffer("state", &self.state)
            .buffer("nearest", words("tree nearest", passes.count))
            .buffer(
                "tiles",
                words("tree tiles", 2 * passes.count.div_ceil(TILE)),
            )
            .buffer("clusters", &self.clusters[from])
            .buffer("next_clusters", &self.clusters[to]);
        let told = |word: usize| Groups::Indirect(self.state.clone(), 4 * word as u64);
        passes.run(recording, "nearest", &bindings, told(SEARCH_GROUPS))?;
        passes.run(recording, "pairs", &bindings, told(TILE_GROUPS))?;
        passes.run(recording, "advance", &bindings, [1, 1, 1])?;
        passes.run(recording, "merge", &bindings, told(TILE_GROUPS_BEFORE))
    }
}
