//! Choice of a compaction by those who have a stream to compact.

use super::{Compaction, CompactionRegistry};
use crate::{Gpu, GpuError};
use raystone_core::parameters;
use raystone_core::params::{Choice as _, Params, Variant};
use std::sync::Arc;

parameters! {
    /// A compaction with its default parameters.
    pub enum CompactionMethod {
        /// `atomic` on software adapters, with their expensive barriers, else `workgroup`, as
        /// measured.
        Auto = "auto",
        /// An atomic for each element.
        Atomic = "atomic",
        /// A scan and one atomic for each workgroup.
        Workgroup = "workgroup",
        /// A ballot and one atomic for each subgroup.
        Subgroup = "subgroup",
        /// Counts, a scan of them, and each element to its place: stable.
        ReduceScanScatter = "reduce-scan-scatter",
        /// A scan of all holes in log n steps, and a search for each slot: stable.
        Horn = "horn",
        /// The same with a scan of 2n additions.
        Blelloch = "blelloch",
        /// A scan and a search in each block, and blocks moved together: stable.
        Roger = "roger",
    }
}

impl CompactionMethod {
    /// The compaction on this adapter.
    ///
    /// # Errors
    /// The adapter cannot run it.
    pub fn on(self, gpu: &Gpu) -> Result<Arc<dyn Compaction>, GpuError> {
        let method = match self {
            Self::Auto if gpu.is_software() => Self::Atomic,
            Self::Auto => Self::Workgroup,
            chosen => chosen,
        };
        let method = Variant {
            label: String::new(),
            name: method.name().to_owned(),
            params: Params::default(),
        };
        let method = CompactionRegistry::default().configured(&method);
        let method = method.map_err(GpuError::Kernel)?;
        match method.refusal(gpu) {
            Some(reason) => Err(GpuError::Kernel(reason)),
            None => Ok(method),
        }
    }
}
