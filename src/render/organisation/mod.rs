//! How the path tracer is organised on the device: which kernels take a path from its camera to its end, and when its rays
//! are traced. Every organisation makes the same image to the bit: a path draws the same numbers, adds what it finds in
//! the same order, and samples are added in theirs. `docs/organisations.md` says how.

mod queued;
mod registry;
mod shading;
mod single;
mod sorting;

pub(crate) use queued::{MultiKernel, Wavefront};
pub use registry::OrganisationRegistry;
pub use registry::organisation_kind;
pub(crate) use single::Regeneration;
pub use single::SingleKernel;

use super::{ImageSteps, Integrator};
use raystone_core::params::Params;
use raystone_gpu::GpuError;

/// An organisation: the struct of its parameters, one line in the registry.
pub trait Organisation: Send + Sync {
    /// Whether its kernels call the structure themselves, so that they need one whose traversal is a function.
    fn is_inline(&self) -> bool {
        false
    }

    /// Whether the integrator's own passes are recorded, whatever they are.
    fn takes_any(&self) -> bool {
        false
    }

    /// Samples that a slice of the image may have, where no buffer between passes may have more than so many bytes.
    fn samples_at_once(&self, _bytes: u64) -> u64 {
        u64::MAX
    }

    /// Records the passes that add the samples of a slice to the sums, sample after sample within a pixel.
    ///
    /// # Errors
    /// A kernel does not compose or compile, or the adapter cannot run it.
    fn record(
        &self,
        steps: &mut ImageSteps,
        integrator: &dyn Integrator,
        params: &Params,
    ) -> Result<(), GpuError>;
}
