//! `facing`: an integrator of one kernel.

use raystone::integrator::{CountedRays, Integrator, IntegratorFacts};
use raystone::parameters;
use raystone::params::{ParameterSchema, Parameters as _, Params};
use raystone::sampling::dimensions::FIRST_BOUNCE;

parameters! {
    struct Brightness {
        /// what the cosine is multiplied with
        brightness: u32 = 1, in 1..=100;
    }
}

/// The registry entry.
pub struct Facing;

impl Integrator for Facing {
    fn name(&self) -> &'static str {
        "facing"
    }

    fn description(&self) -> &'static str {
        "the cosine between the first surface and the viewer (an example)"
    }

    fn kernel(&self) -> &'static str {
        "integrator/facing"
    }

    fn sources(&self) -> &'static [(&'static str, &'static str)] {
        &[(
            "integrator/facing",
            include_str!("kernels/integrator/facing.wesl"),
        )]
    }

    fn parameters(&self) -> ParameterSchema {
        Brightness::schema()
    }

    fn constants(&self, params: &Params) -> Vec<(&'static str, u32)> {
        vec![("BRIGHTNESS", Brightness::from_checked(params).brightness)]
    }

    fn facts(&self, _: &Params) -> IntegratorFacts {
        IntegratorFacts {
            dimensions: FIRST_BOUNCE,
            rays: vec![CountedRays::Primary],
            needs_inline: true,
            ..Default::default()
        }
    }
}
