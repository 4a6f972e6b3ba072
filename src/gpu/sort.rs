//! A stable radix sort of pairs of words, recorded: the passes are in `kernels/common/sort/`.
//!
//! Each digit of eight bits takes three passes: count the keys of each tile by digit, add the counts up over the
//! tiles, scatter. One pass that looks back at its neighbours' sums ("decoupled look-back", Merrill & Garland
//! 2016) would read the keys once instead of twice, but waits for workgroups that WebGPU does not promise to run:
//! nothing there says that a workgroup which was started makes progress while another spins.

use super::adapter::Gpu;
use super::bindings::{Bindings, Storage};
use super::pipeline::{Pipeline, WORKGROUP_SIZE};
use super::recording::Recording;
use super::{Composition, GpuError, UniformValues};
use std::sync::Arc;

/// Bits of a digit.
const DIGIT_BITS: u32 = 8;
/// Values of a digit, as in `kernels/common/sort/digits.wesl`.
const BINS: u32 = 1 << DIGIT_BITS;
/// Keys of a tile, as there.
const TILE: u32 = 2048;

/// The compiled passes of a radix sort.
pub struct RadixSort {
    count: Arc<Pipeline>,
    offsets: Arc<Pipeline>,
    scatter: Arc<Pipeline>,
}

/// Keys and their values, a word each.
#[derive(Clone)]
pub struct Pairs {
    /// What is sorted by.
    pub keys: Storage,
    /// What moves along.
    pub values: Storage,
    /// How many there are.
    pub count: u32,
}

impl RadixSort {
    /// Compiles the passes.
    ///
    /// # Errors
    /// A kernel does not compose, or the driver refuses it.
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let pipeline = |pass: &str| {
            let kernel = Composition::new(&format!("common/sort/{pass}"));
            gpu.pipeline(&kernel.constant("SCAN_LANES", WORKGROUP_SIZE), true)
        };
        Ok(Self {
            count: pipeline("count")?,
            offsets: pipeline("offsets")?,
            scatter: pipeline("scatter")?,
        })
    }

    /// Kernels that [`RadixSort::record`] runs.
    pub fn passes(bits: u32) -> u32 {
        3 * bits.div_ceil(DIGIT_BITS)
    }

    /// Bytes of scratch that it takes for so many pairs.
    pub fn scratch_bytes(count: u32) -> u64 {
        let counts = BINS * count.div_ceil(TILE);
        4 * (2 * u64::from(count) + u64::from(counts) + u64::from(BINS))
    }

    /// Sorts by the lowest `bits` of the keys, in whole digits of eight, ascending; what is equal stays in order. Tells where the sorted
    /// pairs are then: in the buffers given, or in scratch. Times are told under `sort count`, `sort offsets` and
    /// `sort scatter`.
    pub fn record(&self, recording: &mut Recording, pairs: &Pairs, bits: u32) -> Pairs {
        let count = pairs.count;
        let tiles = count.div_ceil(TILE);
        let scratch = |name: &str, words: u32| Storage::scratch(name, 4 * u64::from(words.max(4)));
        let mut from = pairs.clone();
        if count == 0 {
            return from;
        }
        let mut to = Pairs {
            keys: scratch("sort keys", count),
            values: scratch("sort values", count),
            count,
        };
        for digit in 0..bits.div_ceil(DIGIT_BITS) {
            let mut bindings = Bindings::new();
            let uniform = UniformValues::new()
                .u32("count", count)
                .u32("tiles", tiles)
                .u32("shift", digit * DIGIT_BITS);
            bindings
                .uniform("digits", uniform)
                .buffer("counts", scratch("sort counts", BINS * tiles))
                .buffer("totals", scratch("sort totals", BINS))
                .buffer("keys", &from.keys)
                .buffer("values", &from.values)
                .buffer("sorted_keys", &to.keys)
                .buffer("sorted_values", &to.values);
            recording
                .run("sort count", &self.count, &bindings, [tiles, 1, 1])
                .run("sort offsets", &self.offsets, &bindings, [BINS, 1, 1])
                .run("sort scatter", &self.scatter, &bindings, [tiles, 1, 1]);
            std::mem::swap(&mut from, &mut to);
        }
        from
    }
}
