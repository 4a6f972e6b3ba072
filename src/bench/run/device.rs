//! The device of a run.

use super::error::RunError;
use raystone_core::params::Variant;
use raystone_gpu::Gpu;

/// An open device that composes kernels from every library of a run.
pub(super) struct Device {
    /// Uses the embedded kernels.
    pub gpu: Gpu,
    views: Vec<(Variant, Gpu)>,
}

impl Device {
    pub(super) fn new(gpu: Gpu, views: Vec<(Variant, Gpu)>) -> Self {
        Self { gpu, views }
    }

    /// The device with these kernels; an error if they are not in the plan.
    pub(super) fn of(&self, kernels: &Variant) -> Result<&Gpu, RunError> {
        if kernels.name.is_empty() {
            return Ok(&self.gpu);
        }
        let view = self.views.iter().find(|(known, _)| known == kernels);
        let view = view.map(|(_, gpu)| gpu);
        view.ok_or_else(|| {
            RunError::Input(format!("the kernels {kernels} are not those of the plan"))
        })
    }
}
