//! The integrators of the program that trace.

use super::kind::CountedRays::{Ao, Bounce, Primary as Camera, Shadow};
use super::{Integrator, IntegratorFacts};
use crate::params::{ParamRange, ParamValue, Parameter, ParameterSchema, Params};
use crate::sampling::dimensions;

/// Bounces before roulette: `ROULETTE_DEPTH` of `kernels/integrator/path.wesl`.
const ROULETTE_DEPTH: u32 = 3;

pub(super) struct Primary;
pub(super) struct AmbientOcclusion;
pub(super) struct Path;

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
        vec![Parameter {
            name: "radius",
            description: "length of AO rays as a fraction of the scene's diagonal",
            default: ParamValue::Number(0.1),
            range: ParamRange::Number {
                min: 1e-6,
                max: 10.0,
            },
        }]
    }

    fn facts(&self, params: &Params) -> IntegratorFacts {
        IntegratorFacts {
            dimensions: dimensions::at_bounce(0, dimensions::DIRECTION) + 2,
            rays: vec![Camera, Ao],
            ao_radius: Some(params.number("radius")),
            needs_inline: true,
            ..Default::default()
        }
    }
}

impl Integrator for Path {
    fn name(&self) -> &'static str {
        "path"
    }

    fn description(&self) -> &'static str {
        "path tracing: cosine sampling and next-event estimation by the balance heuristic, roulette after 3 bounces"
    }

    fn kernel(&self) -> &'static str {
        "integrator/path"
    }

    fn parameters(&self) -> ParameterSchema {
        vec![Parameter {
            name: "max_depth",
            description: "most bounces of a path",
            default: ParamValue::Integer(6),
            range: ParamRange::Integer { min: 0, max: 20 },
        }]
    }

    fn constants(&self, params: &Params) -> Vec<(&'static str, u32)> {
        vec![("MAX_DEPTH", params.integer("max_depth") as u32)]
    }

    fn facts(&self, params: &Params) -> IntegratorFacts {
        let roulette = |bounce| dimensions::at_bounce(bounce, dimensions::ROULETTE);
        IntegratorFacts {
            dimensions: dimensions::needed(params.integer("max_depth") as u32),
            undrawn: (0..ROULETTE_DEPTH).map(roulette).collect(),
            rays: vec![Camera, Shadow, Bounce],
            needs_inline: true,
            ..Default::default()
        }
    }
}
