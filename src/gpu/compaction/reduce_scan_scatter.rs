//! `reduce-scan-scatter`: counts of tiles, a scan of the counts, and the scatter.

use super::passes::{bound, kernel};
use super::scan::record_scan;
use super::tile::Tile;
use super::{Compaction, Order, Passes};
use crate::GpuError;
use raystone_core::parameters;

parameters! {
    /// counts each tile, scans the counts, and copies each element to its slot (Harris, Sengupta, Owens 2007); stable
    pub(crate) struct ReduceScanScatter {
        /// What a workgroup takes.
        tile: Tile;
    }
}

impl Compaction for ReduceScanScatter {
    fn order(&self) -> Order {
        Order::Stable
    }

    fn record(&self, passes: &mut Passes) -> Result<(), GpuError> {
        record_buckets(passes, &self.tile, 1)
    }
}

/// Records the counts of each bucket and tile, their scan, and the scatter.
pub(super) fn record_buckets(
    passes: &mut Passes,
    tile: &Tile,
    buckets: u32,
) -> Result<(), GpuError> {
    let tiles = tile.count(passes.stream.capacity);
    let words = buckets * tiles + 1;
    let sums = passes.scratch("sums", u64::from(words));
    let bindings = bound(&[("sums", &sums)], ("tiling", &[("tiles", tiles)]));
    let kernel = |name| tile.kernel(kernel(name)).constant("BUCKETS", buckets);
    passes.run(kernel("reduce"), &bindings, tiles)?;
    record_scan(passes, &sums, words)?;
    passes.run(kernel("scatter"), &bindings, tiles)
}
