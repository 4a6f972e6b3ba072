//! Light in participating and refractive media.
//!
//! A [`Volume`] has grids of scattering, absorption and refractive index. A [structure] over it answers, for
//! a voxel, the region around it in which bounds of index and extinction hold; rays walk from region to region
//! ([`walk`]). `docs/media.md` explains the contract and what is measured.
#![warn(missing_docs)]

pub mod adaptive;
mod error;
pub mod files;
pub mod march;
mod measure;
pub mod medium;
pub mod optics;
pub mod phase;
pub mod photons;
pub mod pipeline;
pub mod procedures;
pub mod rays;
pub mod scatter;
pub mod segments;
pub mod structure;
pub mod tracking;
pub mod volume;
pub mod walk;

pub use error::MediaError;
pub use measure::register;
pub use medium::{Homogeneity, Key, Medium};
pub use phase::Phase;
pub use structure::VolumeStructure;
pub use volume::{Bounds, Volume};

#[cfg(test)]
mod tests;
