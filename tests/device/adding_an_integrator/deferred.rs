//! `deferred`: the image of `primary` in passes, so that it needs no structure in its kernels. The example of
//! `docs/adding-an-integrator.md`.

use raystone::accel::Query;
use raystone::gpu::{Bindings, Composition, GpuError};
use raystone::integrator::{CountedRays, ImageSteps, Integrator, IntegratorFacts};
use raystone::params::Params;
use raystone::sampling::dimensions::FIRST_BOUNCE;

/// The registry entry.
pub struct Deferred;

impl Integrator for Deferred {
    fn name(&self) -> &'static str {
        "deferred"
    }

    fn description(&self) -> &'static str {
        "base colour of the first hit times the cosine to the viewer, in passes (an example)"
    }

    fn sources(&self) -> &'static [(&'static str, &'static str)] {
        &[
            (
                "deferred/place",
                include_str!("kernels/deferred/place.wesl"),
            ),
            (
                "deferred/camera",
                include_str!("kernels/deferred/camera.wesl"),
            ),
            (
                "deferred/shade",
                include_str!("kernels/deferred/shade.wesl"),
            ),
        ]
    }

    fn facts(&self, _: &Params) -> IntegratorFacts {
        IntegratorFacts {
            dimensions: FIRST_BOUNCE,
            rays: vec![CountedRays::Primary],
            needs_inline: false,
            ..Default::default()
        }
    }

    fn scratch(&self) -> &'static [(&'static str, u64)] {
        &[("rays", 32), ("hits", 16)]
    }

    fn record(&self, steps: &mut ImageSteps) -> Result<(), GpuError> {
        let (pixels, nothing) = (steps.pixels(), Bindings::new());
        let camera = Composition::new("deferred/camera");
        steps.run("camera", camera, pixels, &nothing)?;
        steps.trace(Query::Closest, ("rays", "hits"), steps.count())?;
        let shade = Composition::new("deferred/shade");
        steps.run("shade", shade, pixels, &nothing)
    }
}
