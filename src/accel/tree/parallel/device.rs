//! The passes that build a tree on the device; their kernels are in `kernels/accel/tree/parallel/device/`.
//!
//! Nodes are read back, and the host lays them out and collapses them. What that takes is a phase of its own.

use super::{LinkedNode, LinkedTree, Method, Settings, too_large};
use crate::accel::{AccelError, BuildLog, Phase, TriangleBuffers, TriangleSoup};
use crate::gpu::{
    Bindings, Composition, Gpu, GpuError, Pairs, Pipeline, RadixSort, Recording, Storage,
    UniformValues, groups_for,
};
use std::sync::Arc;
use std::time::Instant;

/// Bits of each word of a code.
const WORD_BITS: u32 = 30;
/// Children of a block, as in `blocks.wesl`.
const BLOCK: u32 = 8;

fn failed(error: GpuError) -> AccelError {
    AccelError::Device(error.to_string())
}

/// Builds the tree on the device of `log`: the same to the bit as [`super::build`], where its arithmetic is exact.
///
/// # Errors
/// There is no device, or what it met with; a coordinate is too large or not a number.
pub fn build(
    soup: &TriangleSoup,
    settings: &Settings,
    log: &mut BuildLog,
) -> Result<LinkedTree, AccelError> {
    let Some(gpu) = log.gpu().cloned() else {
        // Playing says that there is none.
        return log.play(&Recording::new()).map(|_| LinkedTree::default());
    };
    if soup.records.is_empty() {
        return Ok(LinkedTree::default());
    }
    let triangles = log.phase("upload", || TriangleBuffers::upload(&gpu, soup));
    let mut passes = Passes::new(&gpu, triangles.map_err(failed)?, soup.records.len() as u32);
    let mut recording = Recording::new();
    passes.sort(&mut recording, settings).map_err(failed)?;
    let root = match settings.method {
        Method::Lbvh => passes.lbvh(&mut recording).map_err(failed)?,
    };
    recording
        .download("scene", passes.words("tree scene", SCENE_WORDS))
        .download("nodes", passes.nodes());
    let start = Instant::now();
    let played = log.play(&recording)?;
    let scene: Vec<u32> = played.download("scene").map_err(failed)?;
    let mut nodes: Vec<LinkedNode> = played.download("nodes").map_err(failed)?;
    // What is not told by the clock of the device: submission, copies of nodes to the host, waiting.
    if let Some(ms) = played.elapsed().gpu_ms {
        log.phases.push(Phase {
            name: "transfer".to_owned(),
            ms: (start.elapsed().as_secs_f64() * 1e3 - ms).max(0.0),
        });
    }
    if scene[6] != 0 {
        return Err(too_large(soup, !scene[6] as usize));
    }
    nodes.truncate(2 * soup.records.len() - 1);
    let tree = LinkedTree { nodes, root };
    log.phase("check", || tree.check(soup.records.len()))?;
    Ok(tree)
}

/// Words that `boxes.wesl` leaves of the whole scene.
const SCENE_WORDS: u32 = 7;

/// The passes over one scene.
struct Passes<'a> {
    gpu: &'a Gpu,
    triangles: TriangleBuffers,
    count: u32,
}

impl<'a> Passes<'a> {
    fn new(gpu: &'a Gpu, triangles: TriangleBuffers, count: u32) -> Self {
        Self {
            gpu,
            triangles,
            count,
        }
    }

    /// So many words of scratch.
    fn words(&self, name: &str, words: u32) -> Storage {
        Storage::scratch(name, 4 * u64::from(words))
    }

    /// Nodes, and behind them the blocks.
    fn nodes(&self) -> Storage {
        let elements = 2 * self.count - 1 + self.levels().iter().map(|l| l.count).sum::<u32>();
        Storage::scratch("tree nodes", 32 * u64::from(elements))
    }

    /// What all passes bind.
    fn bindings(&self, settings: Option<&Settings>) -> Bindings {
        let long_codes = settings.is_some_and(|s| s.long_codes);
        let size = UniformValues::new()
            .u32("count", self.count)
            .u32("long_codes", u32::from(long_codes));
        let mut bindings = self.triangles.bindings.clone();
        bindings
            .uniform("size", size)
            .buffer("boxes", self.words("tree boxes", 8 * self.count))
            .buffer("scene", self.words("tree scene", SCENE_WORDS))
            .buffer("codes", self.words("tree codes", 2 * self.count))
            .buffer("keys", self.words("tree keys", self.count))
            .buffer("nodes", self.nodes())
            .buffer(
                "sorted_codes",
                self.words("tree sorted codes", 2 * self.count),
            )
            .buffer("ranges", self.words("tree ranges", 2 * self.count));
        bindings
    }

    fn pipeline(&self, pass: &str) -> Result<Arc<Pipeline>, GpuError> {
        let kernel = Composition::new(&format!("accel/tree/parallel/device/{pass}"));
        let kernel = self.triangles.intersection.activate(kernel);
        self.gpu
            .pipeline(&self.triangles.bindings.compose(kernel), true)
    }

    /// Runs a pass with an invocation an item.
    fn run(
        &self,
        recording: &mut Recording,
        pass: &str,
        bindings: &Bindings,
        items: u32,
    ) -> Result<(), GpuError> {
        recording.run(pass, &self.pipeline(pass)?, bindings, groups_for(items));
        Ok(())
    }

    /// Boxes and codes of the triangles, and the leaves in the order of the codes.
    fn sort(&mut self, recording: &mut Recording, settings: &Settings) -> Result<(), GpuError> {
        let mut bindings = self.bindings(Some(settings));
        let mut pairs = Pairs {
            keys: self.words("tree keys", self.count),
            values: self.words("tree triangles", self.count),
            count: self.count,
        };
        bindings.buffer("sorted_triangles", &pairs.values);
        recording.clear(self.words("tree scene", SCENE_WORDS));
        self.run(recording, "boxes", &bindings, self.count)?;
        self.run(recording, "codes", &bindings, self.count)?;
        let sort = RadixSort::new(self.gpu)?;
        // The lower word first: the sort is stable.
        let words: &[u32] = if settings.long_codes { &[1, 0] } else { &[0] };
        for word in words {
            bindings
                .uniform("part", UniformValues::new().u32("word", *word))
                .buffer("keys", &pairs.keys)
                .buffer("sorted_triangles", &pairs.values);
            self.run(recording, "keys", &bindings, self.count)?;
            pairs = sort.record(recording, &pairs, WORD_BITS);
        }
        bindings.buffer("sorted_triangles", &pairs.values);
        self.run(recording, "leaves", &bindings, self.count)
    }

    /// The radix tree over the sorted codes; tells its root.
    fn lbvh(&self, recording: &mut Recording) -> Result<u32, GpuError> {
        if self.count == 1 {
            return Ok(0);
        }
        let bindings = self.bindings(None);
        self.run(recording, "links", &bindings, self.count - 1)?;
        self.blocks(recording, &bindings)?;
        self.run(recording, "inner", &bindings, self.count - 1)?;
        Ok(self.count)
    }

    /// Boxes around blocks of leaves, level by level: a dispatch sees what those before it wrote.
    fn blocks(&self, recording: &mut Recording, bindings: &Bindings) -> Result<(), GpuError> {
        let mut bindings = bindings.clone();
        for level in self.levels() {
            let values = UniformValues::new()
                .u32("below", level.below)
                .u32("below_count", level.below_count)
                .u32("here", level.here)
                .u32("count", level.count);
            bindings.uniform("level", values);
            self.run(recording, "blocks", &bindings, level.count)?;
        }
        Ok(())
    }

    /// Levels of blocks, up to the first of a single one.
    fn levels(&self) -> Vec<Level> {
        let mut out = Vec::new();
        let (mut below, mut below_count) = (0, self.count);
        let mut here = 2 * self.count - 1;
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
}

/// Blocks of one size: see `blocks.wesl`.
struct Level {
    below: u32,
    below_count: u32,
    here: u32,
    count: u32,
}
