//! `bucket-sort`: several compactions at once, one after the other.

use super::reduce_scan_scatter::record_buckets;
use super::tile::Tile;
use super::{Compaction, Order, Passes};
use crate::GpuError;
use raystone_core::parameters;

parameters! {
    /// buckets one behind the other, by as many reductions at once (Roger 2008, section 4.6); one digit of a radix sort; stable
    pub(crate) struct BucketSort {
        /// buckets, beside the holes
        buckets: u32 = 4, in 1..=64;
        /// What a workgroup takes.
        tile: Tile;
    }
}

impl Compaction for BucketSort {
    fn order(&self) -> Order {
        Order::Stable
    }

    fn buckets(&self) -> u32 {
        self.buckets
    }

    fn record(&self, passes: &mut Passes) -> Result<(), GpuError> {
        record_buckets(passes, &self.tile, self.buckets)
    }
}
