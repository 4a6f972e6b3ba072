//! Stream compaction: of the elements of a stream those that are wanted, side by side, without the holes between.
//!
//! Methods are a registry ([`CompactionRegistry`]); each records its passes over a [`Stream`]. What belongs together
//! is told by a word per element, its flag: 0 is a hole, `k` what belongs to the `k`-th bucket. Most methods know one
//! bucket, so that a flag says whether an element stays; a `BucketSort` or `RadixSorted` puts several buckets one behind the other.
//! How many elements there are stands on the device, and so does how many stay: nothing comes to the host in between,
//! and [`Passes::groups_of_kept`] is what a pass over them is dispatched with.
//!
//! Scans of the device are *reduce, scan, scatter* in passes of their own (`scan`). A single pass in which workgroups
//! wait for those before them (decoupled look-back, Merrill and Garland 2016) would read the stream once less, but
//! WebGPU does not promise that a workgroup which is waited for makes progress, or has even begun.

mod atomic;
mod blelloch;
mod bucket_sort;
mod horn;
mod none;
mod passes;
mod radix_sort;
mod reduce_scan_scatter;
mod registry;
mod roger;
pub(crate) mod scan;
mod subgroup;
mod tile;
mod workgroup;

pub use atomic::Atomic;
pub(crate) use blelloch::Blelloch;
pub(crate) use bucket_sort::BucketSort;
pub(crate) use horn::Horn;
pub(crate) use none::NoCompaction;
pub use passes::{Passes, Stays, Stream};
pub(crate) use radix_sort::RadixSorted;
pub(crate) use reduce_scan_scatter::ReduceScanScatter;
pub use registry::CompactionRegistry;
pub use registry::compaction_kind;
pub(crate) use roger::Roger;
pub(crate) use subgroup::Subgroup;
pub use workgroup::Workgroup;

use crate::{Gpu, GpuError};

/// How a method leaves the elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// As they came, bucket by bucket.
    Stable,
    /// In an order that another run may change.
    Any,
    /// As they came, with the holes between them.
    WithHoles,
}

/// A way to compact streams: the struct of its parameters, a kernel or some, one line in the registry.
pub trait Compaction: Send + Sync {
    /// How it leaves the elements.
    fn order(&self) -> Order;

    /// Buckets that it puts one behind the other; flags are at most this.
    fn buckets(&self) -> u32 {
        1
    }

    /// Whether it can leave all buckets at once, each in a part of its own ([`Stays::Apart`]).
    fn keeps_apart(&self) -> bool {
        false
    }

    /// Why it cannot run on this adapter, if so.
    fn refusal(&self, _gpu: &Gpu) -> Option<String> {
        None
    }

    /// Records the passes that leave what stays in [`Stream::kept`], and how many that are in the first word of
    /// [`Stream::count`].
    ///
    /// # Errors
    /// A kernel does not compose or compile.
    fn record(&self, passes: &mut Passes) -> Result<(), GpuError>;
}
