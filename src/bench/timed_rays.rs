//! Rays through a structure, timed; every turn must answer alike.

use crate::timing::{Measured, Watch};
use raystone_accel::{RayBatch, Space, TriangleSoup};
use raystone_gpu::{Elapsed, Gpu, GpuError};
use raystone_verify::gate::timed_fault;
use raystone_verify::rays::RaySet;

/// A batch whose answers are watched in every turn.
pub(crate) struct TimedRays {
    /// The rays on the device.
    pub(crate) batch: RayBatch,
    watch: Watch,
}

impl TimedRays {
    pub(crate) fn new(batch: RayBatch) -> Self {
        let watch = Watch::default();
        Self { batch, watch }
    }

    /// What is wrong with the timed answers to the rays of `set`; no figure is printed then.
    ///
    /// # Errors
    /// The device.
    pub(crate) fn fault(
        &self,
        set: &RaySet,
        soup: &TriangleSoup,
        space: Space,
        exact: bool,
    ) -> Result<Option<String>, GpuError> {
        let last = timed_fault(&self.batch, set, soup, space, exact)?;
        let fault = self.watch.fault().into_iter().chain(last);
        Ok(fault.reduce(|a, b| format!("{a}; {b}")))
    }
}

impl Measured for TimedRays {
    fn measure(&self) -> Result<Elapsed, GpuError> {
        let elapsed = self.batch.trace()?;
        self.watch.note(self.batch.digest()?);
        Ok(elapsed)
    }

    fn device(&self) -> Option<&Gpu> {
        Some(self.batch.gpu())
    }
}
