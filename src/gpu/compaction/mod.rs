//! Stream compaction: the selected elements of a stream, stored contiguously.
//!
//! Methods are a registry ([`CompactionRegistry`]); each records its passes over a [`Stream`]. A
//! flag word per element selects it: 0 is a hole, `k` the `k`-th bucket. Most methods have one
//! bucket, so a flag only says if an element stays; `BucketSort` and `RadixSorted` store several
//! buckets one after the other. The numbers of input and output elements stay on the device,
//! without a round trip to the host, and [`Passes::groups_of_kept`] dispatches a pass over the
//! output.
//!
//! Device scans are *reduce, scan, scatter* in separate passes (`scan`). A single pass in which
//! workgroups wait for earlier ones (decoupled look-back, Merrill and Garland 2016) would read the
//! stream once less, but WebGPU does not guarantee that such a workgroup makes progress, or has
//! even started.

mod atomic;
mod blelloch;
mod bucket_sort;
mod horn;
mod method;
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
pub use method::CompactionMethod;
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

/// The order of the output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// Input order, bucket by bucket.
    Stable,
    /// Unstable: it may differ between runs.
    Any,
    /// Input order, with the holes.
    WithHoles,
}

/// A way to compact streams: its parameter struct, some kernels, one line in the registry.
pub trait Compaction: Send + Sync {
    /// The order of the output.
    fn order(&self) -> Order;

    /// Number of buckets that it stores one after the other; flags are at most this.
    fn buckets(&self) -> u32 {
        1
    }

    /// True if it can write all buckets at once, each in its own part ([`Stays::Apart`]).
    fn keeps_apart(&self) -> bool {
        false
    }

    /// The reason why it cannot run on this adapter, if any.
    fn refusal(&self, _gpu: &Gpu) -> Option<String> {
        None
    }

    /// Records the passes that write the output to [`Stream::kept`], and its length to the first
    /// word of [`Stream::count`].
    ///
    /// # Errors
    /// A kernel does not compose or compile.
    fn record(&self, passes: &mut Passes) -> Result<(), GpuError>;
}
