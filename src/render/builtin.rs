//! The built-in integrators that trace.

use super::kind::CountedRays::{Ao, Primary as Camera};
use super::{Integrator, IntegratorFacts};
use raystone_core::parameters;
use raystone_core::params::{ParameterSchema, Parameters as _, Params};
use raystone_sampling::dimensions;

parameters! {
    /// Parameters of `ao`.
    struct AoParameters {
        /// length of AO rays as a fraction of the scene's diagonal
        radius: f64 = 0.1, in 1e-6..=10.0;
    }
}

pub(super) struct Primary;
pub(super) struct AmbientOcclusion;

impl Integrator for Primary {
    fn name(&self) -> &'static str {
        "primary"
    }

    fn description(&self) -> &'static str {
        "base colour of the first hit times the cosine to the viewer: one closest-hit ray a sample"
    }

    fn kernel(&self) -> &'static str {
        "integrator/primary"
    }

    fn facts(&self, _: &Params) -> IntegratorFacts {
        IntegratorFacts {
            dimensions: dimensions::FIRST_BOUNCE,
            rays: vec![Camera],
            needs_inline: true,
            ..Default::default()
        }
    }
}

impl Integrator for AmbientOcclusion {
    fn name(&self) -> &'static str {
        "ao"
    }

    fn description(&self) -> &'static str {
        "ambient occlusion: one cosine-distributed any-hit ray of limited length a sample"
    }

    fn kernel(&self) -> &'static str {
        "integrator/ao"
    }

    fn parameters(&self) -> ParameterSchema {
        AoParameters::schema()
    }

    fn facts(&self, params: &Params) -> IntegratorFacts {
        IntegratorFacts {
            dimensions: dimensions::at_bounce(0, dimensions::DIRECTION) + 2,
            rays: vec![Camera, Ao],
            ao_radius: Some(AoParameters::from_checked(params).radius),
            needs_inline: true,
            ..Default::default()
        }
    }
}
