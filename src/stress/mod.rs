//! Numerical stress: what every structure and sampler must survive, and a gate that is itself tested.

pub mod mutants;
