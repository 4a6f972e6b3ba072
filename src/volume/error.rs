//! Errors of media.

use std::path::PathBuf;
use thiserror::Error;

/// A volume that cannot be made, read or built over.
#[derive(Debug, Error, PartialEq)]
pub enum MediaError {
    /// A grid has another number of values than its resolution asks for.
    #[error(
        "the grid of {what} has {found} values, but {} × {} × {} voxels need {expected}: give one for each voxel, x fastest",
        resolution[0], resolution[1], resolution[2]
    )]
    WrongSize {
        /// The quantity.
        what: &'static str,
        /// Voxels along each axis.
        resolution: [u32; 3],
        /// Values needed.
        expected: usize,
        /// Values given.
        found: usize,
    },
    /// A resolution of no voxels, or of more than a structure can name.
    #[error(
        "a grid of {} × {} × {} voxels cannot be used: each axis takes 1 to {most}",
        resolution[0], resolution[1], resolution[2]
    )]
    Resolution {
        /// Voxels along each axis.
        resolution: [u32; 3],
        /// The limit for an axis.
        most: u32,
    },
    /// A value that a medium cannot have.
    #[error("{what} of voxel ({}, {}, {}) is {value}: it has to be {range}", voxel[0], voxel[1], voxel[2])]
    Value {
        /// The quantity.
        what: &'static str,
        /// The first such voxel.
        voxel: [u32; 3],
        /// Its value.
        value: f32,
        /// What is allowed.
        range: &'static str,
    },
    /// Bounds without a volume.
    #[error("the bounds of a medium need a finite size above zero along each axis, not {0}")]
    Bounds(String),
    /// A file that cannot be read.
    #[error("cannot read the volume {}: {problem}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The reason.
        problem: String,
    },
    /// A name that stands for nothing.
    #[error("no {what} is called `{name}`; there are: {}", known.join(", "))]
    Unknown {
        /// What was asked for.
        what: &'static str,
        /// The name.
        name: String,
        /// What could be.
        known: Vec<String>,
    },
    /// Paths would bend.
    #[error(
        "the refractive index of voxel ({}, {}, {}) is {value}: paths through a scene's medium are straight, so it has to be 1 everywhere",
        voxel[0], voxel[1], voxel[2]
    )]
    Refracts {
        /// The first such voxel.
        voxel: [u32; 3],
        /// Its index.
        value: f32,
    },
    /// A tint that no channel can have.
    #[error(
        "the tint of a medium is ({}, {}, {}): each channel takes 0 to 1, larger coefficients those of the medium",
        .0[0], .0[1], .0[2]
    )]
    Tint([f32; 3]),
    /// A mesh that encloses nothing.
    #[error(transparent)]
    Open(#[from] crate::solid::OpenMesh),
    /// A mesh of which parts are inside others.
    #[error(
        "the mesh encloses {found:.1} cells where its triangles enclose {enclosed:.1}: parts of it overlap, or are inside out; join them, or turn them"
    )]
    Overlaps {
        /// Cells whose middles are inside.
        found: f64,
        /// By the divergence theorem.
        enclosed: f64,
    },
    /// Parameters that a structure does not have.
    #[error("the structure over a volume: {0}")]
    Structure(String),
    /// A structure that contradicts the volume under it.
    #[error("the structure says of voxel ({}, {}, {}) {problem}", voxel[0], voxel[1], voxel[2])]
    Invalid {
        /// The voxel that was asked for.
        voxel: [u32; 3],
        /// The contradiction.
        problem: String,
    },
}
