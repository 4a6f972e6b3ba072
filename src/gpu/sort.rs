//! A stable radix sort of pairs of words; the passes are in `kernels/common/sort/`.
//!
//! Each digit of eight bits takes three passes: count the keys of each tile by digit, scan the
//! counts over the tiles, scatter. A single pass with decoupled look-back (Merrill & Garland 2016)
//! would read the keys once instead of twice, but waits for workgroups that WebGPU does not
//! guarantee to run: a started workgroup may make no progress while another spins.

use super::adapter::Gpu;
use super::bindings::{Bindings, Storage};
use super::pipeline::{Pipeline, WORKGROUP_SIZE};
use super::recording::Recording;
use super::{Composition, GpuError, UniformValues};
use std::sync::Arc;

mod known;

pub use known::{check_sizes, fault_of_sort};

const DIGIT_BITS: u32 = 8;
/// Values of a digit, as in `kernels/common/sort/digits.wesl`.
const BINS: u32 = 1 << DIGIT_BITS;
/// Keys of a tile, as in that file.
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
    /// The sort keys.
    pub keys: Storage,
    /// The values that move with the keys.
    pub values: Storage,
    /// Number of pairs.
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

    /// Number of kernels that [`RadixSort::record`] runs.
    pub fn passes(bits: u32) -> u32 {
        3 * bits.div_ceil(DIGIT_BITS)
    }

    /// Bytes of scratch for this many pairs.
    pub fn scratch_bytes(count: u32) -> u64 {
        let counts = BINS * count.div_ceil(TILE);
        4 * (2 * u64::from(count) + u64::from(counts) + u64::from(BINS))
    }

    /// Stable ascending sort by the lowest `bits` of the keys, in whole digits of eight bits.
    /// Returns the location of the sorted pairs: the given buffers, or scratch. Times are reported
    /// as `sort count`, `sort offsets` and `sort scatter`.
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
