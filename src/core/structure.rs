//! Recorded properties of a built structure and of the work in it.

use serde::{Deserialize, Serialize};

/// A timed phase of a build.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Phase {
    /// For instance `bounds`, `binned-sah`, `layout`.
    pub name: String,
    /// Milliseconds: wall time, or GPU time of a pass on the device.
    pub ms: f64,
    /// Milliseconds of all processors, all threads of the process together; absent where not counted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cpu_ms: Option<f64>,
}

/// Static figures of a built structure.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct StructureStats {
    /// Nodes (inner and leaf) or cells.
    pub nodes: u64,
    /// Leaves or non-empty cells.
    pub leaves: u64,
    /// Triangle references held by leaves or cells.
    pub references: u64,
    /// `[k]` is the number of leaves or cells that hold k references; longer ones are counted at the last index.
    /// Empty where not known.
    #[serde(default)]
    pub leaf_histogram: Vec<u64>,
    /// Deepest leaf (root = 0); absent for flat structures.
    pub depth: Option<u32>,
    /// SAH cost with traversal and intersection constants both 1; absent where not defined.
    pub sah_cost: Option<f64>,
    /// End-point overlap with both constants 1 (Aila, Karras, Laine 2013), of binary trees; of large ones
    /// an estimate from a part of the triangles.
    #[serde(default)]
    pub epo: Option<f64>,
    /// Bytes of the structure's GPU buffers (the canonical triangle buffer is not counted).
    pub bytes: u64,
}

impl StructureStats {
    /// Leaves, references and histogram from the number of triangles per non-empty leaf or cell;
    /// other fields are 0.
    pub fn of_leaves(counts: impl Iterator<Item = usize>) -> Self {
        let mut stats = Self::default();
        let histogram = &mut stats.leaf_histogram;
        for count in counts {
            let place = count.min(LEAF_HISTOGRAM_END);
            if histogram.len() <= place {
                histogram.resize(place + 1, 0);
            }
            histogram[place] += 1;
            stats.leaves += u64::from(count > 0);
            stats.references += count as u64;
        }
        stats
    }
}

/// Counted work of one ray. Twin of `kernels/common/counters.wesl`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counters {
    /// Nodes or cells visited.
    pub nodes: u32,
    /// Ray–box tests.
    pub box_tests: u32,
    /// Ray–triangle tests.
    pub triangle_tests: u32,
    /// Deepest stack, entries.
    pub stack_high_water: u32,
}

/// The space in which a structure intersects triangles, and so the reference tracer that it must equal to the bit.
#[derive(
    Debug,
    Clone,
    Copy,
    Default,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    Serialize,
    Deserialize,
    schemars::JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Space {
    /// World space: the flat list of triangles.
    #[default]
    World,
    /// The space of each instance's object: rays are transformed, triangles are not. Rounding then
    /// differs from the flat list's.
    Instances,
}

/// Last index of a leaf histogram, which also counts larger leaves.
pub const LEAF_HISTOGRAM_END: usize = 32;

/// Names of ray-query passes in records: nearest hits, any hits.
pub const RAY_QUERIES: [&str; 2] = ["closest hits", "any hits"];

/// Names of the ray classes that integrators count in records, in order.
pub const RAY_COUNT_CLASSES: [&str; 5] = ["primary", "shadow", "ao", "bounce", "skipped"];
/// Number of traced classes, which come first.
pub const TRACED_CLASSES: usize = 4;
