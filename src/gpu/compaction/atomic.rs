//! `atomic`: one atomic for each selected element.

use super::passes::{bound, kernel};
use super::{Compaction, Order, Passes, Stays};
use crate::{Bindings, GpuError};
use raystone_core::parameters;

parameters! {
    /// each element that stays takes the next slot by an atomic of its own; unstable
    pub struct Atomic {}
}

impl Compaction for Atomic {
    fn order(&self) -> Order {
        Order::Any
    }

    fn keeps_apart(&self) -> bool {
        true
    }

    fn record(&self, passes: &mut Passes) -> Result<(), GpuError> {
        passes.clear_count();
        let items = passes.stream.capacity;
        if let Stays::Apart(_) = passes.stream.stays {
            let part = bound(&[], ("part", &[("capacity", items)]));
            return passes.run_for(kernel("atomic").feature("apart", true), &part, items);
        }
        passes.run_for(kernel("atomic"), &Bindings::new(), items)
    }
}
