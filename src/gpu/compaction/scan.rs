//! Device scans: each word becomes the sum of those before it.
//!
//! Blocks of one workgroup each are scanned in place, then the sums of the blocks, which are added
//! to the words of their blocks; if the sums exceed a block, this is repeated level by level.
//! Workgroups synchronise only between passes: see [`super`].

use super::passes::{Passes, bound, kernel};
use crate::{GpuError, Storage};

pub(crate) const BLOCK: u32 = 256;

/// Records an in-place exclusive scan of the first `words` of `sums`, modulo 2³².
///
/// # Errors
/// A kernel does not compose or compile.
pub(crate) fn record_scan(passes: &mut Passes, sums: &Storage, words: u32) -> Result<(), GpuError> {
    record_level(passes, sums, words, 0)
}

fn record_level(
    passes: &mut Passes,
    sums: &Storage,
    words: u32,
    depth: u32,
) -> Result<(), GpuError> {
    let blocks = words.div_ceil(BLOCK);
    let totals = passes.scratch(&format!("totals {depth}"), u64::from(blocks));
    let level = ("level", &[("words", words), ("blocks", blocks)][..]);
    let bindings = bound(&[("sums", sums), ("totals", &totals)], level);
    let scan = kernel("scan_blocks").constant("SCAN_LANES", BLOCK);
    passes.run(scan, &bindings, blocks)?;
    if blocks < 2 {
        return Ok(());
    }
    record_level(passes, &totals, blocks, depth + 1)?;
    let add = kernel("add_totals").constant("SCAN_LANES", BLOCK);
    passes.run(add, &bindings, blocks)
}
