//! Why a point set, or one of its measures, is refused.

use thiserror::Error;

/// Why a point set has no such measure.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum DiscrepancyError {
    /// There is nothing to measure.
    #[error("discrepancy of an empty point set is undefined: give at least one point")]
    Empty,
    /// A coordinate is NaN or outside `[0, 1]`.
    #[error(
        "point {index} is ({}): every coordinate must lie in [0, 1]",
        list(point)
    )]
    Outside {
        /// Index of the first such point.
        index: usize,
        /// Its coordinates.
        point: Vec<f64>,
    },
    /// The coordinates do not make whole points.
    #[error("{count} coordinates do not make points of {dim} dimensions")]
    Ragged {
        /// Coordinates there are.
        count: usize,
        /// Coordinates of a point; 0 is refused.
        dim: usize,
    },
    /// A line of a file is not a point.
    #[error("line {line}: {reason}")]
    Line {
        /// Number of the line, from 1.
        line: usize,
        /// What is wrong, and what to do.
        reason: String,
    },
    /// A prefix is longer than the set.
    #[error("prefix of {count} points asked for, but the set has only {available}")]
    PrefixTooLong {
        /// Points asked for.
        count: usize,
        /// Points there are.
        available: usize,
    },
    /// More dimensions are asked for than there are.
    #[error("dimension {dim} is asked for, but the points have {available}")]
    NoSuchDimension {
        /// Dimension, from 1.
        dim: usize,
        /// Dimensions there are.
        available: usize,
    },
    /// The measure is not defined for such a set.
    #[error("{measure} {reason}")]
    NotDefined {
        /// Name of the measure.
        measure: &'static str,
        /// What it needs and what the set is.
        reason: String,
    },
    /// The time was spent before there was a result.
    #[error("{measure} was not finished within {seconds} s: allow more time or give fewer points")]
    OverBudget {
        /// Name of the measure.
        measure: &'static str,
        /// Time allowed, s.
        seconds: f64,
    },
}

fn list(point: &[f64]) -> String {
    let texts: Vec<String> = point.iter().map(f64::to_string).collect();
    texts.join(", ")
}
