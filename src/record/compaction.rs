//! What is recorded of a compaction of streams.

use super::Interval;
use serde::{Deserialize, Serialize};

/// A compaction of a stream.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct CompactionRecord {
    /// Elements of the stream.
    pub elements: u32,
    /// Share of elements that stay, as it was asked for.
    pub valid: f64,
    /// Bytes of an element.
    pub bytes: u32,
    /// Elements that stay.
    pub kept: u32,
    /// Whether elements keep their order.
    pub stable: bool,
    /// Kernels that run for it, one after another.
    pub passes: u32,
    /// Bytes of the buffers between them.
    pub scratch_bytes: u64,
    /// Bytes that any method has to move: flags once, what stays once from and once to memory.
    pub least_bytes: u64,
    /// Every kept sample, milliseconds on the GPU clock, all passes together; a round of all cells each, in order.
    pub ms: Vec<f64>,
    /// The same by the wall clock, milliseconds.
    pub wall_ms: Vec<f64>,
    /// Nanoseconds per element of the stream, median with interval; absent if the cell failed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ns_per_element: Option<Interval>,
    /// Million elements of the stream per second; absent if the cell failed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub melements_s: Option<Interval>,
    /// Least bytes over time, 10⁹ bytes per second; absent if the cell failed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gb_s: Option<Interval>,
    /// Why there are no figures.
    pub failure: Option<String>,
}
