//! Bounces of each pixel's paths, in place of their radiance.

use super::Organisation;
use crate::{ConfiguredIntegrator, ImageSteps, Integrator};
use raystone_core::params::Params;
use raystone_gpu::{Bindings, Composition, GpuError};
use std::sync::Arc;

/// One kernel, whose image is the mean number of bounces of a pixel's paths: rays from surface to surface. It is asked for by its own
/// renderer, which has to count rays, and has no name in experiments.
struct Bounces;

impl Organisation for Bounces {
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
        if integrator.kernel().is_empty() {
            return Err(GpuError::Kernel(format!(
                "{} has passes of its own: its bounces are not counted by pixels",
                integrator.name()
            )));
        }
        let kernel = Composition::new("integrator/render")
            .with("integrator", "integrator/bounces")
            .with("counted", integrator.kernel());
        steps.run("render", kernel, steps.pixel_groups(), &Bindings::new())
    }
}

impl ConfiguredIntegrator {
    /// The same paths, in one kernel, with an image of how often they bounce: the mean over the samples of a pixel in each of the three
    /// values. For renderers that count rays; the organisation that the integrator had takes the same paths.
    #[must_use]
    pub fn counting_bounces(mut self) -> Self {
        self.facts = self.kind.facts(&self.params);
        self.organisation = Arc::new(Bounces);
        self
    }
}
