//! `blelloch`: like `horn`, with a work-efficient scan.

use super::horn::{gather, mark_holes};
use super::passes::{bound, kernel};
use super::{Compaction, Order, Passes};
use crate::GpuError;
use raystone_core::parameters;

parameters! {
    /// like `horn` with the scan of 2n additions in 2 log n steps (Blelloch 1990): no scatter; stable
    pub(crate) struct Blelloch {}
}

impl Compaction for Blelloch {
    fn order(&self) -> Order {
        Order::Stable
    }

    fn record(&self, passes: &mut Passes) -> Result<(), GpuError> {
        // The tree is complete, and has a root.
        let words = passes.stream.capacity.max(2).next_power_of_two();
        let tree = passes.scratch("holes", u64::from(words));
        mark_holes(passes, &tree, words)?;
        let levels = words.trailing_zeros();
        let up = (1..=levels).map(|level| (false, level));
        let down = (1..=levels).rev().map(|level| (true, level));
        for (down, level) in up.chain(down) {
            let stride = 1 << level;
            let step = ("scan_step", &[("words", words), ("stride", stride)][..]);
            let bindings = bound(&[("tree", &tree)], step);
            let kernel = kernel("blelloch").feature("down", down);
            passes.run_for(kernel, &bindings, words / stride)?;
        }
        gather(passes, &tree, true)
    }
}
