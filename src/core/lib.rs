//! What all crates of Raystone share: parameters, geometry, random numbers, texts and files that are whole or not there.
#![warn(missing_docs)]

pub mod atomic;
pub mod clock;
pub mod files;
pub mod geometry;
pub mod load;
pub mod params;
pub mod program;
pub mod random;
pub mod store;
pub mod structure;
pub mod text;
