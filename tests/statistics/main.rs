//! Statistics of samples: what their docstrings promise.

mod hypotheses;
mod intervals;
