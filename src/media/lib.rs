//! Light in participating and refractive media.
//!
//! A [`Volume`] (crate `raystone_volume`) has grids of scattering, absorption and refractive index. A [structure] over it answers, for
//! a voxel, the region around it in which bounds of index and extinction hold; rays walk from region to region
//! ([`walk`]). `docs/media.md` explains the contract and what is measured.
#![warn(missing_docs)]

pub mod adaptive;
mod bend;
pub mod known_figures;
pub mod march;
mod measure;
pub mod optics;
pub mod photons;
pub mod pipeline;
pub mod rays;
pub mod scatter;
pub mod segments;
pub mod tracking;
mod upload;
pub mod voxels;

pub use measure::register;
pub use raystone_volume::{
    Bounds, Homogeneity, Key, MediaError, Medium, Phase, Volume, VolumeStructure, files, medium,
    phase, procedures, structure, volume, walk,
};

#[cfg(test)]
mod tests;
