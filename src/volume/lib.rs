//! Volumes of participating and refractive media, and structures over them.
//!
//! A [`Volume`] has grids of scattering, absorption and refractive index. A [structure] over it answers, for
//! a voxel, the region around it in which bounds of index and extinction hold; rays walk from region to region
//! ([`walk`]). All of it is of the host: kernels read the arrays of a [`Medium`]. `docs/media.md` explains the contract.
#![warn(missing_docs)]

mod error;
pub mod files;
pub mod medium;
pub mod phase;
pub mod procedures;
pub mod solid;
mod straight;
pub mod structure;
pub mod volume;
pub mod walk;

pub use error::MediaError;
pub use medium::{Homogeneity, Key, Medium};
pub use phase::Phase;
pub use straight::{Straight, check_straight, grid};
pub use structure::VolumeStructure;
pub use volume::{Bounds, Volume};
