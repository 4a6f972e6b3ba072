//! Numerical stress.

pub mod numerics;
