//! Rays through a structure, timed; every turn must answer alike.

use crate::timing::{Measured, Watch};
use raystone_accel::{RayBatch, Space, TriangleSoup};
use raystone_gpu::{Elapsed, Gpu, GpuError};
use raystone_verify::gate::timed_fault;
use raystone_verify::rays::RaySet;
use std::cell::RefCell;

/// A batch whose answers are watched in every turn.
pub(crate) struct TimedRays {
    /// The rays on the device.
    pub(crate) batch: RayBatch,
    watch: Watch,
    fastest: RefCell<Option<(f64, PassTimes)>>,
}

/// Milliseconds of each pass, by name.
pub(crate) type PassTimes = Vec<(String, f64)>;

impl TimedRays {
    pub(crate) fn new(batch: RayBatch) -> Self {
        Self {
            batch,
            watch: Watch::default(),
            fastest: RefCell::default(),
        }
    }

    /// Passes of the fastest turn so far; none on an adapter without timestamps.
    pub(crate) fn passes(&self) -> PassTimes {
        let fastest = self.fastest.borrow();
        (fastest.iter().flat_map(|(_, passes)| passes.clone())).collect()
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
        let (elapsed, passes) = self.batch.trace_by_pass()?;
        self.watch.note(self.batch.digest()?);
        let whole: f64 = passes.iter().map(|(_, ms)| ms).sum();
        let mut fastest = self.fastest.borrow_mut();
        if (fastest.as_ref()).is_none_or(|(least, _)| whole < *least) {
            *fastest = Some((whole, passes));
        }
        Ok(elapsed)
    }

    fn device(&self) -> Option<&Gpu> {
        Some(self.batch.gpu())
    }
}
