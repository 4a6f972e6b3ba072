//! `subgroup`: a ballot and one atomic per subgroup.

use super::passes::kernel;
use super::{Compaction, Order, Passes};
use crate::{Bindings, Gpu, GpuError};
use raystone_core::parameters;

parameters! {
    /// the invocations of a subgroup vote, and one atomic takes slots for all; needs subgroups; unstable
    pub(crate) struct Subgroup {}
}

impl Compaction for Subgroup {
    fn order(&self) -> Order {
        Order::Any
    }

    fn refusal(&self, gpu: &Gpu) -> Option<String> {
        (!gpu.has_subgroups()).then(|| {
            format!(
                "`subgroup` needs ballots of subgroups, which the adapter {} does not offer: `workgroup` does without",
                gpu.info.name
            )
        })
    }

    fn record(&self, passes: &mut Passes) -> Result<(), GpuError> {
        passes.clear_count();
        let items = passes.stream.capacity;
        passes.run_for(kernel("subgroup"), &Bindings::new(), items)
    }
}
