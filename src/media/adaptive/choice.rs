//! Whether pilots pay: the choice between both pipelines by the number of photons.

use super::{Filter, Mode};
use crate::photons::Points;

/// Points of the light's square from which photons by importance, with their pilots, have a smaller product of additions and squared
/// error than as many even ones that are smoothed alike. `None` where they never have. Measured: docs/media.md has the table.
pub const fn break_even(filter: Filter, points: Points) -> Option<u32> {
    match (filter, points) {
        // Fitted: where the geometric mean of the product's ratio over the scenes at hand is 1.
        (Filter::Both, Points::Random) => Some(115_000),
        (Filter::Both, _) => Some(8_500),
        _ => None,
    }
}

impl Mode {
    /// The pipeline that it is at a number of points of the light's square.
    pub fn at(self, count: u32, filter: Filter, points: Points) -> Self {
        match (self, break_even(filter, points)) {
            (Self::Auto, Some(least)) if count >= least => Self::Adaptive,
            (Self::Auto, _) => Self::Reference,
            (mode, _) => mode,
        }
    }
}
