//! `facing`: an integrator of one kernel.

use raystone::integrator::{CountedRays, Integrator, IntegratorFacts};
use raystone::params::{ParamRange, ParamValue, Parameter, ParameterSchema, Params};
use raystone::sampling::dimensions::FIRST_BOUNCE;

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
        vec![Parameter {
            name: "brightness",
            description: "what the cosine is multiplied with",
            default: ParamValue::Integer(1),
            range: ParamRange::Integer { min: 1, max: 100 },
        }]
    }

    fn constants(&self, params: &Params) -> Vec<(&'static str, u32)> {
        vec![("BRIGHTNESS", params.integer("brightness") as u32)]
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
