//! How evenly point sets fill the unit cube: exact star discrepancy and related measures. Independent
//! of the other crates.
//!
//! The star discrepancy of N points is the largest difference, over all boxes with one corner at
//! the origin, between the volume of the box and the fraction of the points in it (Niederreiter
//! 1992, definition 2.1). The supremum is reached in the limit at the grid of the points'
//! coordinates and 1, where both counts matter: the *open* box `[0, y)` for boxes with too few
//! points and the *closed* box `[0, y]` for boxes with too many.
//!
//! | measure | method | cost |
//! |---|---|---|
//! | star, 1-D | sorted points | N log N |
//! | star, 2-D | `planar`: a tournament over y, with the history of its winners over x | ~ N log N |
//! | star, 3-D and up | `orthants`: orthants decomposed until counts are sums, hopeless cells dropped | between N and N^(1+d/2) cells in practice |
//! | star, over budget | the same with a tolerance, `ascent` from below | the budget |
//! | square means | [`quadratic`]: L2-star, centered, wrap-around, mixture, average | N² d |
//!
//! [`measure()`] computes any [`Measure`] within a time [`Budget`].
#![warn(missing_docs)]

mod ascent;
mod budget;
mod distance;
mod empty_box;
mod error;
mod extreme;
pub mod known_figures;
mod leaf;
mod measure;
mod nets;
mod orthants;
mod planar;
mod points;
mod quadratic;
mod random;
mod spectrum;
mod star;
mod sum;

pub use budget::Budget;
pub use distance::Metric;
pub(crate) use distance::minimum_distance;
pub(crate) use empty_box::largest_empty_box;
pub use error::DiscrepancyError;
pub use extreme::extreme_2d;
pub use measure::{Measure, Value, measure};
pub use nets::{Net, elementary_shapes, net_quality};
pub use points::PointSet;
pub use quadratic::{Quadratic, quadratic};
pub use spectrum::{Periodogram, periodogram, radial_spectrum};
pub use star::{Bracket, star, star_2d, star_2d_prefixes};

#[cfg(test)]
mod tests;
