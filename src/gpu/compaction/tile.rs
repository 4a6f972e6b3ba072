//! The tile of a workgroup: its invocations, each with several consecutive elements.

use crate::Composition;
use raystone_core::parameters;

parameters! {
    /// A tile of elements.
    pub(crate) struct Tile {
        /// invocations of a workgroup
        lanes: u32 = 256, in 1..=256;
        /// elements of an invocation, side by side
        per_lane: u32 = 1, in 1..=64;
    }
}

impl Tile {
    /// Number of tiles for this many elements.
    pub(crate) fn count(&self, elements: u32) -> u32 {
        elements.div_ceil(self.lanes * self.per_lane)
    }

    pub(crate) fn kernel(&self, kernel: Composition) -> Composition {
        kernel
            .constant("SCAN_LANES", self.lanes)
            .constant("PER_LANE", self.per_lane)
    }
}
