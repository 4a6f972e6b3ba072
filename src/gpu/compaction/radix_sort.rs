//! `radix-sort`: indices are sorted by bucket, then each element is moved to its place.
//!
//! [`super::BucketSort`] reads a tile once per bucket; here a digit of eight bits takes three
//! passes over words for any number of buckets, and elements move once. So one bucket costs the
//! same as 255.

use super::passes::{bound, kernel};
use super::{Compaction, Order, Passes};
use crate::{Bindings, GpuError, Pairs};
use raystone_core::parameters;

parameters! {
    /// places are sorted by bucket as one digit of a radix sort, then elements follow; stable
    pub(crate) struct RadixSorted {
        /// buckets, beside the holes
        buckets: u32 = 4, in 1..=255;
    }
}

/// Bits of a digit: holes are its last value.
const BITS: u32 = 8;

impl Compaction for RadixSorted {
    fn order(&self) -> Order {
        Order::Stable
    }

    fn buckets(&self) -> u32 {
        self.buckets
    }

    fn record(&self, passes: &mut Passes) -> Result<(), GpuError> {
        let count = passes.stream.capacity;
        let words = u64::from(count.max(1));
        let pairs = Pairs {
            keys: passes.scratch("keys", words),
            values: passes.scratch("places", words),
            count,
        };
        passes.clear_count();
        passes.run_for(kernel("keys"), &bindings(&pairs), count)?;
        let sorted = passes.sort(&pairs, BITS)?;
        passes.run_for(kernel("follow"), &bindings(&sorted), count)
    }
}

fn bindings(pairs: &Pairs) -> Bindings {
    bound(
        &[("keys", &pairs.keys), ("places", &pairs.values)],
        ("sorting", &[("count", pairs.count)]),
    )
}
