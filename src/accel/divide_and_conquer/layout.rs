//! How much room a trace takes, and how its rays come.

use super::Options;

/// Pairs per ray that a stream has room for.
const PAIRS_PER_RAY: u32 = 8;

/// Streams and batches for a set of rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Layout {
    /// Rays of a batch.
    pub batch: u32,
    /// Pairs of a stream.
    pub capacity: u32,
    /// Pairs of a stream that have room for both their parts.
    pub expands: u32,
    /// Most problems of a level.
    pub problems: u32,
}

impl Layout {
    pub(super) fn new(rays: u32, triangles: u32, options: &Options) -> Self {
        // Kernels compile without rays, too.
        let batch = rays.clamp(1, options.capacity / PAIRS_PER_RAY);
        // A small set needs less, if each of its rays meets this many problems of a level at most.
        let most = batch.saturating_mul(16 * PAIRS_PER_RAY);
        let capacity = options.capacity.min(most);
        let divided = triangles.min(capacity) / (options.naive + 1);
        Self {
            batch,
            capacity,
            expands: capacity / 2,
            problems: (2 * divided).max(2),
        }
    }
}
