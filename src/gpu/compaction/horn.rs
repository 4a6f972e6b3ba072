//! `horn`: a scan of all holes in log n steps, then each slot searches for its element.

use super::passes::{bound, kernel};
use super::{Compaction, Order, Passes};
use crate::{Bindings, GpuError, Storage};
use raystone_core::parameters;

parameters! {
    /// scan of the holes in log n steps (Hillis and Steele), then a search for each slot (Horn 2005): no scatter; stable
    pub(crate) struct Horn {}
}

impl Compaction for Horn {
    fn order(&self) -> Order {
        Order::Stable
    }

    fn record(&self, passes: &mut Passes) -> Result<(), GpuError> {
        let words = passes.stream.capacity.max(1);
        let mut before = passes.scratch("holes", u64::from(words));
        let mut after = passes.scratch("holes after a step", u64::from(words));
        mark_holes(passes, &before, words)?;
        let mut reach = 1;
        while reach < words {
            let step = ("scan_step", &[("words", words), ("reach", reach)][..]);
            let bindings = bound(&[("before", &before), ("after", &after)], step);
            passes.run_for(kernel("hillis_steele"), &bindings, words)?;
            std::mem::swap(&mut before, &mut after);
            reach *= 2;
        }
        gather(passes, &before, false)
    }
}

/// Records the conversion of each element to a word: 1 for a hole.
pub(super) fn mark_holes(passes: &mut Passes, holes: &Storage, words: u32) -> Result<(), GpuError> {
    let bindings = bound(&[("holes", holes)], ("padded", &[("words", words)]));
    passes.run_for(kernel("holes"), &bindings, words)
}

/// Records the search of each slot in the scanned holes.
pub(super) fn gather(
    passes: &mut Passes,
    holes: &Storage,
    exclusive: bool,
) -> Result<(), GpuError> {
    let mut bindings = Bindings::new();
    bindings.buffer("holes", holes);
    let kernel = kernel("gather").feature("exclusive", exclusive);
    passes.run_for(kernel, &bindings, passes.stream.capacity)
}
