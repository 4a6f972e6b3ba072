//! The passes that build a tree or refit its boxes on the device; their kernels are in
//! `kernels/accel/tree/parallel/device/`.
//!
//! Nodes are read back and laid out on the host, which bounds their depth; device passes then make
//! wide nodes from them (`accel/wide/device.rs`). The transfers are separate phases.

use super::rounds::Rounds;
use super::{LinkedNode, LinkedTree, Method, Settings, too_large};
use crate::{AccelError, BuildLog, TriangleBuffers, TriangleSoup};
use raystone_core::clock::Instant;
use raystone_gpu::{
    Bindings, Composition, Gpu, GpuError, Groups, Pairs, Pipeline, Played, RadixSort, Recording,
    Storage, UniformValues, WORKGROUP_SIZE, groups_for,
};
use std::sync::Arc;

const WORD_BITS: u32 = 30;
/// Children of a block, as in `blocks.wesl`.
const BLOCK: u32 = 8;
/// Words of `boxes.wesl` about the whole scene; the last identifies a too large triangle.
const SCENE_WORDS: u32 = 7;

pub(crate) fn failed(error: GpuError) -> AccelError {
    AccelError::Device(error.to_string())
}

/// Plays a recording. Time that the device clock does not cover is the phase `transfer`:
/// submission, copies to the host, waiting.
pub(crate) fn play(recording: &Recording, log: &mut BuildLog) -> Result<Played, AccelError> {
    let played = log.play(recording)?;
    if let Some(ms) = played.elapsed().gpu_ms {
        log.note("transfer", (played.wall_ms() - ms).max(0.0));
    }
    Ok(played)
}

/// Builds the tree on the device of `log`: bit-identical to [`super::build`] if its arithmetic is
/// exact.
///
/// # Errors
/// There is no device, or it reported an error; a coordinate is too large or NaN.
pub fn build(
    soup: &TriangleSoup,
    settings: &Settings,
    log: &mut BuildLog,
) -> Result<LinkedTree, AccelError> {
    let Some(gpu) = log.gpu().cloned() else {
        // Playing reports the missing device.
        return log.play(&Recording::new()).map(|_| LinkedTree::default());
    };
    if soup.records.is_empty() {
        return Ok(LinkedTree::default());
    }
    let count = soup.records.len() as u32;
    let passes = log.phase("upload", || Passes::new(&gpu, soup, [count, count - 1]));
    let passes = passes.map_err(failed)?;
    let mut recording = Recording::new();
    let long_codes = settings.long_codes;
    let sorted = passes.sort(&mut recording, long_codes).map_err(failed)?;
    let root = match settings.method {
        _ if passes.count == 1 => play(&recording, log).map(|_| 0),
        Method::Lbvh => {
            let recorded = passes.radix_tree(&mut recording, &sorted);
            recorded.map_err(failed)?;
            play(&recording, log).map(|_| passes.count)
        }
        Method::Ploc { radius } => {
            let rounds = Rounds::new(&passes, radius).map_err(failed)?;
            rounds.play(recording, log)
        }
    };
    let nodes = passes.nodes(soup, log)?;
    let tree = LinkedTree { nodes, root: root? };
    log.phase("check", || tree.check(soup.records.len()))?;
    Ok(tree)
}

pub(super) struct Passes<'a> {
    pub gpu: &'a Gpu,
    pub count: u32,
    /// Number of nodes after them.
    inner: u32,
    triangles: TriangleBuffers,
    /// Leaves, inner nodes and blocks, which persist between submissions.
    nodes: wgpu::Buffer,
    scene: wgpu::Buffer,
}

impl<'a> Passes<'a> {
    /// Passes over these triangles, for this many leaves and nodes after them.
    pub(super) fn new(
        gpu: &'a Gpu,
        soup: &TriangleSoup,
        [count, inner]: [u32; 2],
    ) -> Result<Self, GpuError> {
        let blocks: u32 = levels([count, inner]).iter().map(|level| level.count).sum();
        let elements = u64::from(count) + u64::from(inner) + u64::from(blocks);
        Ok(Self {
            gpu,
            count,
            inner,
            triangles: TriangleBuffers::upload(gpu, soup)?,
            nodes: gpu.zeroed("tree nodes", 32 * elements)?,
            scene: gpu.zeroed("tree scene", 4 * u64::from(SCENE_WORDS))?,
        })
    }

    /// Scratch with this many words per triangle.
    fn words(&self, name: &str, each: u32) -> Storage {
        Storage::scratch(name, 4 * u64::from(each) * u64::from(self.count))
    }

    pub(super) fn bindings(&self) -> Bindings {
        let mut bindings = self.triangles.bindings.clone();
        bindings
            .uniform("size", UniformValues::new().u32("count", self.count))
            .uniform("fit", UniformValues::new().u32("nodes", self.inner))
            .buffer("nodes", &self.nodes)
            .buffer("scene", &self.scene)
            .buffer("boxes", self.words("tree boxes", 8))
            .buffer("codes", self.words("tree codes", 2))
            .buffer("sorted_codes", self.words("tree sorted codes", 2));
        bindings
    }

    fn pipeline(&self, pass: &str) -> Result<Arc<Pipeline>, GpuError> {
        let kernel = Composition::new(&format!("accel/tree/parallel/device/{pass}"));
        let kernel = kernel.constant("SCAN_LANES", WORKGROUP_SIZE);
        let kernel = self.triangles.intersection.activate(kernel);
        let kernel = self.triangles.bindings.compose(kernel);
        self.gpu.pipeline(&kernel, true)
    }

    pub(super) fn run(
        &self,
        recording: &mut Recording,
        pass: &str,
        bindings: &Bindings,
        groups: impl Into<Groups>,
    ) -> Result<(), GpuError> {
        recording.run(pass, &self.pipeline(pass)?, bindings, groups);
        Ok(())
    }

    /// The nodes, read back to the host.
    pub(super) fn nodes(
        &self,
        soup: &TriangleSoup,
        log: &mut BuildLog,
    ) -> Result<Vec<LinkedNode>, AccelError> {
        let mut recording = Recording::new();
        recording.download("scene", &self.scene);
        recording.download("nodes", &self.nodes);
        let played = play(&recording, log)?;
        let start = Instant::now();
        let scene: Vec<u32> = played.download("scene").map_err(failed)?;
        let mut nodes: Vec<LinkedNode> = played.download("nodes").map_err(failed)?;
        log.note("transfer", start.elapsed().as_secs_f64() * 1e3);
        match scene[SCENE_WORDS as usize - 1] {
            0 => nodes.truncate((self.count + self.inner) as usize),
            too_far => return Err(too_large(soup, !too_far as usize)),
        }
        Ok(nodes)
    }

    pub(super) fn boxes(&self, recording: &mut Recording, triangles: u32) -> Result<(), GpuError> {
        let mut bindings = self.bindings();
        bindings.uniform("size", UniformValues::new().u32("count", triangles));
        self.run(recording, "boxes", &bindings, groups_for(triangles))
    }

    /// Boxes and codes, and the leaves in code order; returns the triangle indices in that order.
    fn sort(&self, recording: &mut Recording, long_codes: bool) -> Result<Storage, GpuError> {
        let items = groups_for(self.count);
        let mut pairs = Pairs {
            keys: self.words("tree keys", 1),
            values: self.words("tree triangles", 1),
            count: self.count,
        };
        let mut bindings = self.bindings();
        let length = UniformValues::new().u32("long_codes", u32::from(long_codes));
        bindings
            .uniform("code", length)
            .buffer("sorted_triangles", &pairs.values);
        self.boxes(recording, self.count)?;
        self.run(recording, "codes", &bindings, items)?;
        let sort = RadixSort::new(self.gpu)?;
        // The lower word first: the sort is stable.
        let words: &[u32] = if long_codes { &[1, 0] } else { &[0] };
        for word in words {
            bindings
                .uniform("part", UniformValues::new().u32("word", *word))
                .buffer("keys", &pairs.keys)
                .buffer("sorted_triangles", &pairs.values);
            self.run(recording, "keys", &bindings, items)?;
            pairs = sort.record(recording, &pairs, WORD_BITS);
        }
        self.leaves(recording, &pairs.values)?;
        Ok(pairs.values)
    }

    /// The leaves in the order of their triangles.
    pub(super) fn leaves(
        &self,
        recording: &mut Recording,
        triangles: &Storage,
    ) -> Result<(), GpuError> {
        let mut bindings = self.bindings();
        bindings.buffer("sorted_triangles", triangles);
        self.run(recording, "leaves", &bindings, groups_for(self.count))
    }

    /// The radix tree over the sorted codes, for at least two leaves.
    fn radix_tree(&self, recording: &mut Recording, sorted: &Storage) -> Result<(), GpuError> {
        let mut bindings = self.bindings();
        let ranges = self.words("tree ranges", 2);
        bindings
            .buffer("sorted_triangles", sorted)
            .buffer("ranges", &ranges);
        self.run(recording, "sorted", &bindings, groups_for(self.count))?;
        self.run(recording, "links", &bindings, groups_for(self.inner))?;
        self.fit(recording, &ranges)
    }

    /// The boxes of the nodes after the leaves, given their first and last leaves.
    pub(super) fn fit(&self, recording: &mut Recording, ranges: &Storage) -> Result<(), GpuError> {
        let mut bindings = self.bindings();
        // Level by level: a dispatch sees the results of earlier ones.
        for level in levels([self.count, self.inner]) {
            let values = UniformValues::new()
                .u32("below", level.below)
                .u32("below_count", level.below_count)
                .u32("here", level.here)
                .u32("count", level.count);
            bindings.uniform("level", values);
            self.run(recording, "blocks", &bindings, groups_for(level.count))?;
        }
        bindings.buffer("ranges", ranges);
        self.run(recording, "inner", &bindings, groups_for(self.inner))
    }
}

/// Blocks of one size: see `blocks.wesl`.
struct Level {
    below: u32,
    below_count: u32,
    here: u32,
    count: u32,
}

/// Levels of blocks over this many leaves, up to a single one; they follow leaves and nodes.
fn levels([leaves, inner]: [u32; 2]) -> Vec<Level> {
    let mut out = Vec::new();
    let (mut below, mut below_count) = (0, leaves);
    let mut here = leaves + inner;
    while below_count > 1 {
        let count = below_count.div_ceil(BLOCK);
        out.push(Level {
            below,
            below_count,
            here,
            count,
        });
        (below, below_count) = (here, count);
        here += count;
    }
    out
}
