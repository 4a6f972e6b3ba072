//! What is recorded of the gate of integrators.

use super::Verdict;
use serde::{Deserialize, Serialize};

/// Single paths of an integrator against the oracle for images, see `image_gate`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct PathsRecord {
    /// Paths judged; 0 if none could be.
    pub paths: usize,
    /// Paths that differ by no more than rounding makes them differ, all decisions being the same.
    pub ill_conditioned: usize,
    /// Paths that decide otherwise within rounding of a boundary.
    pub flips: usize,
    /// Of those the ones that meet another surface which lies within rounding of the first.
    #[serde(default)]
    pub surfaces: usize,
    /// Of those the ones that pass an edge of what is met or in the way.
    #[serde(default)]
    pub edges: usize,
    /// Paths that meet a surface with another one within rounding, whatever they make of it.
    #[serde(default)]
    pub layered: usize,
    /// Paths that differ, not to be explained by rounding.
    pub wrong: usize,
    /// Median relative difference of the paths that found light.
    pub median: f64,
    /// Greatest relative difference of the paths that agree.
    pub worst: f64,
    /// What is wrong: the first wrong path with its vertices, or a number beyond its bound.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fault: Option<String>,
    /// What there is no formula for in the oracle, so that nothing was judged.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub not_judged: Option<String>,
}

impl PathsRecord {
    /// Nothing was judged, for this reason.
    pub fn not_judged(reason: impl Into<String>) -> Self {
        Self {
            not_judged: Some(reason.into()),
            ..Self::default()
        }
    }

    /// Both together; the median is the greater one.
    pub fn and(self, other: Self) -> Self {
        Self {
            paths: self.paths + other.paths,
            ill_conditioned: self.ill_conditioned + other.ill_conditioned,
            flips: self.flips + other.flips,
            surfaces: self.surfaces + other.surfaces,
            edges: self.edges + other.edges,
            layered: self.layered + other.layered,
            wrong: self.wrong + other.wrong,
            median: self.median.max(other.median),
            worst: self.worst.max(other.worst),
            fault: self.fault.or(other.fault),
            not_judged: self.not_judged.or(other.not_judged),
        }
    }

    /// What the gate says.
    pub fn verdict(&self) -> Verdict {
        Verdict::new(self.paths > 0, self.fault.is_some())
    }
}
