//! Statistics of samples: what their docstrings promise.

mod bias;
mod comparisons;
mod hypotheses;
mod intervals;
