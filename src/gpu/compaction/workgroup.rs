//! `workgroup`: a scan and one atomic per workgroup.

use super::passes::kernel;
use super::tile::Tile;
use super::{Compaction, Order, Passes};
use crate::{Bindings, GpuError};
use raystone_core::parameters;

parameters! {
    /// a scan places the elements of a workgroup, one atomic takes slots for all of them; unstable
    pub struct Workgroup {
        /// What a workgroup takes.
        tile: Tile;
    }
}

impl Compaction for Workgroup {
    fn order(&self) -> Order {
        Order::Any
    }

    fn record(&self, passes: &mut Passes) -> Result<(), GpuError> {
        passes.clear_count();
        let tiles = self.tile.count(passes.stream.capacity);
        let kernel = self.tile.kernel(kernel("workgroup"));
        passes.run(kernel, &Bindings::new(), tiles)
    }
}
