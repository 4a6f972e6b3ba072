//! Records of the gate of integrators.

use super::Verdict;
use serde::{Deserialize, Serialize};

/// Single paths of an integrator against the oracle for images, see `image_gate`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct PathsRecord {
    /// Paths checked; 0 if none could be.
    pub paths: usize,
    /// Paths that differ by no more than rounding makes them differ, all decisions being the same.
    pub ill_conditioned: usize,
    /// Paths that decide otherwise within rounding of a boundary.
    pub flips: usize,
    /// Of those the ones that meet another surface which lies within rounding of the first.
    #[serde(default)]
    pub surfaces: usize,
    /// Of those the ones that pass an edge of a surface that they hit or that blocks them.
    #[serde(default)]
    pub edges: usize,
    /// Paths that hit a surface with another one within rounding, whatever their result.
    #[serde(default)]
    pub layered: usize,
    /// Paths that differ, not to be explained by rounding.
    pub wrong: usize,
    /// Median relative difference of the paths that found light.
    pub median: f64,
    /// Greatest relative difference of the paths that agree.
    pub worst: f64,
    /// The fault: the first wrong path with its vertices, or a number beyond its bound.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fault: Option<String>,
    /// The feature without a formula in the oracle, because of which nothing was checked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub not_judged: Option<String>,
}

impl PathsRecord {
    /// Returns a record without checked paths, with this reason.
    pub fn not_judged(reason: impl Into<String>) -> Self {
        Self {
            not_judged: Some(reason.into()),
            ..Self::default()
        }
    }

    /// Returns a record of one wrong path, with this fault.
    pub fn wrong(fault: impl Into<String>) -> Self {
        Self {
            paths: 1,
            wrong: 1,
            fault: Some(fault.into()),
            ..Self::default()
        }
    }

    /// Combines both; the median is the greater one.
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

    /// Returns the verdict of the gate.
    pub fn verdict(&self) -> Verdict {
        Verdict::new(self.paths > 0, self.fault.is_some())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_records_together_have_the_paths_of_both_and_the_worst_of_either() {
        let of = |paths, worst| PathsRecord {
            paths,
            worst,
            median: 0.1 * worst,
            ..PathsRecord::default()
        };
        for (a, b) in [(of(5, 0.5), of(7, 2.0)), (of(7, 2.0), of(5, 0.5))] {
            let both = a.and(b);
            assert_eq!((both.paths, both.worst, both.median), (12, 2.0, 0.2));
        }
    }
}
