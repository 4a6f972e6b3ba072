//! Organisations of the path tracer on the device: which kernels process a path from camera to end,
//! and when its rays are traced. All organisations render bit-identical images: a path draws the
//! same numbers, adds its contributions in the same order, and samples are added in order. See
//! `docs/organisations.md`.

mod bounces;
mod known_order;
mod queued;
mod registry;
mod shading;
mod single;
mod sorting;

pub use known_order::fault_of_order;
pub(crate) use queued::{MultiKernel, Wavefront};
pub use registry::OrganisationRegistry;
pub use registry::organisation_kind;
pub(crate) use single::Regeneration;
pub use single::SingleKernel;

use super::{ImageSteps, Integrator};
use raystone_core::params::Params;
use raystone_gpu::GpuError;

/// An organisation: its parameter struct, with one line in the registry.
pub trait Organisation: Send + Sync {
    /// True if its kernels call the structure themselves, and so need an inline traversal.
    fn is_inline(&self) -> bool {
        false
    }

    /// True if it records the integrator's own passes, whatever they are.
    fn takes_any(&self) -> bool {
        false
    }

    /// Maximum samples per slice of the image, given the byte limit of each buffer between passes.
    fn samples_at_once(&self, _bytes: u64) -> u64 {
        u64::MAX
    }

    /// Records the passes that add the samples of a slice to the sums, in sample order within a
    /// pixel.
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
