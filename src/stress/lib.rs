//! The numerical stress suite: every triangle test and structure on scenes and rays that rounding makes
//! hard, judged exactly. What is counted and why: `docs/stress.md`.
//!
//! Families make cases (`families`), which are traced on the adapter (`suite`) beside a million shots at closed
//! meshes ([`shots`]); the exact oracle judges ([`tally`]). Each part of the suite is a measurement ([`register`]) of an
//! ordinary experiment, [`EXPERIMENT`], whose targets are its `[[expect]]`.
#![warn(missing_docs)]

mod axes;
pub(crate) mod bench;
pub mod case;
pub mod explain;
pub(crate) mod families;
mod found;
mod measurement;
pub mod numerics;
pub mod placement;
pub(crate) mod shapes;
pub(crate) mod shot_meshes;
pub mod shots;
pub(crate) mod suite;
pub mod tally;

pub use found::Found;
pub use measurement::{Settings, register};

use raystone_accel::AccelError;
use raystone_bench::run::Absent;
use raystone_gpu::GpuError;
use thiserror::Error;

/// The experiment of the whole suite.
pub const EXPERIMENT: &str = include_str!("../../experiments/stress.toml");

/// Why a part of the suite has no figures.
#[derive(Debug, Error)]
pub(crate) enum StressError {
    /// The adapter.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The figures of accumulation and sampling.
    #[error(transparent)]
    Numerics(#[from] numerics::NumericsError),
    /// A tree that the suite itself needs.
    #[error("a tree of the suite is not built: {0}")]
    Build(#[from] AccelError),
    /// A name on an axis that is not registered.
    #[error("{0}")]
    Unknown(String),
}

impl StressError {
    /// What it means for each cell of the part.
    pub(crate) fn absent(&self) -> Absent {
        Absent::Failed(self.to_string())
    }
}
