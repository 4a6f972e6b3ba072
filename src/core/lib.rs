//! Shared by all crates of Raystone: parameters, geometry, random numbers, text and atomic files.
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
