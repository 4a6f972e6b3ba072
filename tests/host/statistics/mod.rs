//! Statistics of samples, as promised in their docstrings.

mod bias;
mod comparisons;
mod heavy_tails;
mod hypotheses;
mod intervals;
