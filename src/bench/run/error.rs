//! Why a run, or one of its cells, cannot go on.

use raystone_gpu::GpuError;
use std::path::PathBuf;
use thiserror::Error;

/// Why a run could not start or go on. A cell that fails is a record, not an error.
#[derive(Debug, Error)]
pub enum RunError {
    /// No usable adapter (exit code 3).
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// Bad usage or input (exit code 2).
    #[error("{0}")]
    Input(String),
    /// Something that ended a run before its end; what was measured is kept.
    #[error("{source}; what was measured is in {}", folder.display())]
    EndedEarly {
        /// The folder of the records.
        folder: PathBuf,
        /// What ended it.
        source: Box<RunError>,
    },
    /// [`Interrupt::now`](super::Interrupt::now) was called.
    #[error("the run was interrupted")]
    Interrupted,
    /// A result that is known to be wrong (exit code 1).
    #[error("{0}")]
    Wrong(String),
}

impl RunError {
    /// Whether somebody asked for the end.
    pub fn is_interruption(&self) -> bool {
        matches!(self, Self::Interrupted)
    }

    /// The exit code of the program: 1 a wrong result, 2 bad usage or input, 3 no usable adapter.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Wrong(_)
            | Self::Gpu(
                GpuError::LoopsCut { .. } | GpuError::Kernels(_) | GpuError::Samples { .. },
            ) => 1,
            Self::Gpu(
                GpuError::NoAdapter
                | GpuError::UnknownAdapter { .. }
                | GpuError::NoDevice { .. }
                | GpuError::LoopsUnsound { .. },
            ) => 3,
            Self::EndedEarly { source, .. } => source.exit_code(),
            _ => 2,
        }
    }
}

/// Why something has no figures.
pub(crate) enum Fault {
    /// One cell is at fault, which gets a record of it.
    Cell(String),
    /// Nothing can go on.
    Run(RunError),
}

impl From<String> for Fault {
    fn from(reason: String) -> Self {
        Self::Cell(reason)
    }
}

impl From<RunError> for Fault {
    fn from(error: RunError) -> Self {
        Self::Run(error)
    }
}

impl Fault {
    /// The reason that is one cell's, or what ends the run.
    pub(super) fn of_cell(self) -> Result<String, RunError> {
        match self {
            Self::Cell(reason) => Ok(reason),
            Self::Run(error) => Err(error),
        }
    }
}
