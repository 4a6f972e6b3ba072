//! Errors of a run or one of its cells.

use raystone_gpu::GpuError;
use std::path::PathBuf;
use thiserror::Error;

/// A run could not start or continue. A cell that fails is a record, not an error.
#[derive(Debug, Error)]
pub enum RunError {
    /// No usable adapter (exit code 3).
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// Bad usage or input (exit code 2).
    #[error("{0}")]
    Input(String),
    /// The run ended early; completed measurements are preserved.
    #[error("{source}; what was measured is in {}", folder.display())]
    EndedEarly {
        /// The folder of the records.
        folder: PathBuf,
        /// The cause.
        source: Box<RunError>,
    },
    /// [`Interrupt::now`](super::Interrupt::now) was called.
    #[error("the run was interrupted")]
    Interrupted,
    /// A result is known to be wrong (exit code 1).
    #[error("{0}")]
    Wrong(String),
}

impl RunError {
    /// True if the run was interrupted on request.
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

/// Why there are no figures.
pub(crate) enum Fault {
    /// Only one cell failed; it gets a record.
    Cell(String),
    /// The run cannot continue.
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
    /// The reason if only a cell failed, or the error that ends the run.
    pub(super) fn of_cell(self) -> Result<String, RunError> {
        match self {
            Self::Cell(reason) => Ok(reason),
            Self::Run(error) => Err(error),
        }
    }
}
