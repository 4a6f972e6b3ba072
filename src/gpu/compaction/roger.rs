//! `roger`: blocks are compacted separately, then concatenated.
//!
//! D. Roger, U. Assarsson, N. Holzschuch, "Efficient stream reduction on the GPU", GPGPU workshop,
//! 2007; D. Roger, "Réflexions spéculaires et glossy interactives dans des scènes dynamiques",
//! thesis, Grenoble 2008, chapter 4. The search stays within a block, so a stream costs O(n + n log
//! s) and not O(n log n). Where kernels can scatter, the method is unnecessary, as he notes
//! himself: `reduce-scan-scatter` has no search.

use super::passes::{bound, kernel};
use super::scan::record_scan;
use super::{Compaction, Order, Passes};
use crate::GpuError;
use raystone_core::parameters;

/// Minimum and maximum invocations of a workgroup.
const LANES: [u32; 2] = [64, 256];

parameters! {
    /// How a slot finds its element.
    pub(crate) enum Search {
        /// jumps as far as the element is away at least (thesis, section 4.3.3)
        Adaptive = "adaptive",
        /// halves what is left
        Bisection = "bisection",
    }

    /// hierarchical stream reduction: a scan and a search in each block, then blocks move together (Roger 2008); stable
    pub(crate) struct Roger {
        /// elements of a block, his s
        block: u32 = 64, in 2..=1024;
        /// how a slot finds its element
        search: Search = Search::Adaptive;
    }
}

impl Compaction for Roger {
    fn order(&self) -> Order {
        Order::Stable
    }

    fn record(&self, passes: &mut Passes) -> Result<(), GpuError> {
        let stream = passes.stream;
        let blocks = stream.capacity.div_ceil(self.block);
        // Whole blocks per workgroup: as many as it has invocations for, or one.
        let lanes = self.block.clamp(LANES[0], LANES[1]);
        let in_tile = (lanes / self.block).max(1);
        let tile = in_tile * self.block;
        let words = u64::from(blocks * self.block) * u64::from(stream.element_bytes / 4);
        let reduced = passes.scratch("reduced", words);
        let sums = passes.scratch("sums", u64::from(blocks) + 1);
        let bindings = bound(
            &[("reduced", &reduced), ("sums", &sums)],
            ("blocked", &[("blocks", blocks)]),
        );
        let reduce = kernel("roger_blocks")
            .constant("BLOCK", self.block)
            .constant("LANES", lanes)
            .constant("TILE", tile)
            .constant("PER_LANE", tile.div_ceil(lanes))
            .feature("bisection", self.search == Search::Bisection);
        passes.run(reduce, &bindings, blocks.div_ceil(in_tile))?;
        record_scan(passes, &sums, blocks + 1)?;
        let together = kernel("roger_move").constant("BLOCK", self.block);
        passes.run_for(together, &bindings, blocks * self.block)
    }
}
