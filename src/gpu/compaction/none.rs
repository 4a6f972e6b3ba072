//! `none`: holes stay.

use super::passes::kernel;
use super::{Compaction, Order, Passes};
use crate::{Bindings, GpuError};
use raystone_core::parameters;

parameters! {
    /// holes stay, elements are copied as they lie: what compacting costs beyond copying stands against this
    pub(crate) struct NoCompaction {}
}

impl Compaction for NoCompaction {
    fn order(&self) -> Order {
        Order::WithHoles
    }

    fn record(&self, passes: &mut Passes) -> Result<(), GpuError> {
        let items = passes.stream.capacity;
        passes.run_for(kernel("none"), &Bindings::new(), items)
    }
}
