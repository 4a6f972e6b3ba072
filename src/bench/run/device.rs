//! The device of a run.

use super::error::RunError;
use raystone_core::params::Variant;
use raystone_gpu::{AdapterChoice, Gpu};
use std::sync::OnceLock;

/// An open device that composes kernels from every library of a run.
pub(super) struct Device {
    /// Uses the embedded kernels.
    pub gpu: Gpu,
    views: Vec<(Variant, Gpu)>,
    adapter: AdapterChoice,
    /// See [`Self::hands`].
    twin: OnceLock<Option<Gpu>>,
}

impl Device {
    pub(super) fn new(gpu: Gpu, views: Vec<(Variant, Gpu)>, adapter: AdapterChoice) -> Self {
        Self {
            gpu,
            views,
            adapter,
            twin: OnceLock::new(),
        }
    }

    /// Devices with these kernels that may work at once: two of a software adapter, for which the host does most of its work one
    /// thread at a time.
    pub(super) fn hands(&self, kernels: &Variant) -> Result<Vec<Gpu>, RunError> {
        let first = self.of(kernels)?.clone();
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        if !first.is_software() || cores < 2 {
            return Ok(vec![first]);
        }
        let twin = (self.twin).get_or_init(|| self.gpu.twin(&self.adapter).ok());
        let twin = twin.as_ref();
        let twin = twin.map(|twin| twin.with_kernels(first.kernels.clone()));
        Ok([first].into_iter().chain(twin).collect())
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
