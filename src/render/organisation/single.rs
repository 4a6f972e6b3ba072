//! One kernel for whole paths.

use super::Organisation;
use crate::{ImageSteps, Integrator};
use raystone_core::parameters;
use raystone_core::params::Params;
use raystone_gpu::{Bindings, Composition, GpuError};

parameters! {
    /// one kernel takes a path from its camera to its end; invocations wait for the longest path beside theirs (Dufay
    /// 2017, algorithm 2)
    pub struct SingleKernel {}

    /// one kernel; an invocation begins the next sample of its pixel as soon as a path has ended (Novák, Havran &
    /// Dachsbacher 2010)
    pub(crate) struct Regeneration {}
}

impl Organisation for SingleKernel {
    fn is_inline(&self) -> bool {
        true
    }

    fn takes_any(&self) -> bool {
        true
    }

    fn record(
        &self,
        steps: &mut ImageSteps,
        integrator: &dyn Integrator,
        _: &Params,
    ) -> Result<(), GpuError> {
        integrator.record(steps)
    }
}

impl Organisation for Regeneration {
    fn is_inline(&self) -> bool {
        true
    }

    fn record(
        &self,
        steps: &mut ImageSteps,
        integrator: &dyn Integrator,
        _: &Params,
    ) -> Result<(), GpuError> {
        let kernel =
            Composition::new("organisation/regeneration").with("integrator", integrator.kernel());
        steps.run("render", kernel, steps.pixel_groups(), &Bindings::new())
    }
}
