//! Errors of point sets and measures.

use thiserror::Error;

/// The reason why a point set is invalid or lacks a measure.
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
    /// The number of coordinates is not a multiple of the dimension.
    #[error("{count} coordinates do not make points of {dim} dimensions")]
    Ragged {
        /// Number of coordinates.
        count: usize,
        /// Coordinates per point; must not be 0.
        dim: usize,
    },
    /// A line of a file is not a point.
    #[error("line {line}: {reason}")]
    Line {
        /// Line number, from 1.
        line: usize,
        /// The fault, and how to fix it.
        reason: String,
    },
    /// A prefix is longer than the set.
    #[error("prefix of {count} points asked for, but the set has only {available}")]
    PrefixTooLong {
        /// Requested points.
        count: usize,
        /// Available points.
        available: usize,
    },
    /// A dimension that the points do not have.
    #[error("dimension {dim} is asked for, but the points have {available}")]
    NoSuchDimension {
        /// Dimension, from 1.
        dim: usize,
        /// Available dimensions.
        available: usize,
    },
    /// The measure is not defined for such a set.
    #[error("{measure} {reason}")]
    NotDefined {
        /// Name of the measure.
        measure: &'static str,
        /// The requirement and the actual set.
        reason: String,
    },
    /// The budget was spent before there was a result.
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
