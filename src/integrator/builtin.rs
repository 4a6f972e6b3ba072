//! The integrators of the program that trace.

use super::kind::CountedRays::{Ao, Bounce, Primary as Camera, Shadow};
use super::{Integrator, IntegratorFacts};
use crate::parameters;
use crate::params::{ParameterSchema, Parameters as _, Params};
use crate::sampling::dimensions;

/// Bounces before roulette: `ROULETTE_DEPTH` of `kernels/integrator/path.wesl`.
const ROULETTE_DEPTH: u32 = 3;

parameters! {
    /// Parameters of `ao`.
    struct AoParameters {
        /// length of AO rays as a fraction of the scene's diagonal
        radius: f64 = 0.1, in 1e-6..=10.0;
    }

    /// Parameters of `path`.
    struct PathParameters {
        /// most bounces of a path
        max_depth: u32 = 6, in 0..=20;
    }
}

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
        PathParameters::schema()
    }

    fn constants(&self, params: &Params) -> Vec<(&'static str, u32)> {
        vec![("MAX_DEPTH", PathParameters::from_checked(params).max_depth)]
    }

    fn facts(&self, params: &Params) -> IntegratorFacts {
        let roulette = |bounce| dimensions::at_bounce(bounce, dimensions::ROULETTE);
        IntegratorFacts {
            dimensions: dimensions::needed(PathParameters::from_checked(params).max_depth),
            undrawn: (0..ROULETTE_DEPTH).map(roulette).collect(),
            rays: vec![Camera, Shadow, Bounce],
            needs_inline: true,
            ..Default::default()
        }
    }
}
