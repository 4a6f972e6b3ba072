//! `atomic`: one atomic for each element that stays.

use super::passes::kernel;
use super::{Compaction, Order, Passes};
use crate::gpu::{Bindings, GpuError};
use crate::parameters;

parameters! {
    /// each element that stays takes the next slot by an atomic of its own; unstable
    pub struct Atomic {}
}

impl Compaction for Atomic {
    fn order(&self) -> Order {
        Order::Any
    }

    fn record(&self, passes: &mut Passes) -> Result<(), GpuError> {
        passes.clear_count();
        let items = passes.stream.capacity;
        passes.run_for(kernel("atomic"), &Bindings::new(), items)
    }
}
