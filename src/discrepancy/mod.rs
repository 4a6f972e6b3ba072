//! Exact star discrepancy of point sets in the unit square. Usable on its own: nothing here depends
//! on the rest of the crate.
//!
//! The star discrepancy of N points is the largest difference, over all boxes with one corner at
//! the origin, between the area of the box and the fraction of the points in it (Niederreiter 1992,
//! definition 2.1). The supremum is reached in the limit at the grid of the points' coordinates and
//! 1, where both counts matter: the *open* box `[0, x) × [0, y)` for boxes with too few points and
//! the *closed* box `[0, x] × [0, y]` for boxes with too many.

mod star;

pub use star::{star_2d, star_2d_prefixes};

use thiserror::Error;

/// Why a point set has no star discrepancy.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum DiscrepancyError {
    /// There is nothing to measure.
    #[error("star discrepancy of an empty point set is undefined: give at least one point")]
    Empty,
    /// A coordinate is NaN or outside `[0, 1]`.
    #[error("point {index} is ({x}, {y}): both coordinates must lie in [0, 1]")]
    OutsideUnitSquare {
        /// Index of the first such point.
        index: usize,
        /// Its first coordinate.
        x: f64,
        /// Its second coordinate.
        y: f64,
    },
    /// A prefix is longer than the set.
    #[error("prefix of {count} points asked for, but the set has only {available}")]
    PrefixTooLong {
        /// Points asked for.
        count: usize,
        /// Points there are.
        available: usize,
    },
}
