//! Statistics of samples: what their docstrings promise.

mod bias;
mod comparisons;
mod heavy_tails;
mod hypotheses;
mod intervals;
