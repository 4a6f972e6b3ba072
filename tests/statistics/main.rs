//! Statistics of samples: what their docstrings promise.

mod bias;
mod hypotheses;
mod intervals;
