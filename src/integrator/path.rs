//! The path tracer, and how it joins what finds light: its estimator. Formulas: `docs/shading.md`; kernel:
//! `kernels/integrator/path.wesl`.

use super::kind::CountedRays::{Bounce, Primary, Shadow};
use super::{Integrator, IntegratorFacts};
use crate::parameters;
use crate::params::{ParameterSchema, Parameters as _, Params};
use crate::sampling::dimensions::{self, LIGHT_POINT, ROULETTE};

parameters! {
    /// How directions of the material and samples of lights are joined.
    pub enum Strategy {
        /// Both, weighted by the balance heuristic (Veach & Guibas 1995).
        MisBalance = "mis-balance",
        /// Both, weighted by the power heuristic with exponent 2.
        MisPower = "mis-power",
        /// Emission is found by directions of the material alone.
        Bsdf = "bsdf",
        /// Light samples alone; what they cannot find (the camera's own ray, delta lobes) is found.
        Light = "light",
    }

    /// What decides whether a path goes on.
    pub enum Roulette {
        /// The brightest component of its throughput.
        Throughput = "throughput",
        /// The brightest component of the weight of its last bounce (Dufay 2017, 2.2.3).
        Albedo = "albedo",
        /// Nothing: it goes on to the greatest depth.
        Never = "none",
    }

    /// Parameters of `path`.
    pub struct PathParameters {
        /// most bounces of a path
        max_depth: u32 = 6, in 0..=20;
        /// how directions of the material and samples of lights are joined: by the balance or the power
        /// heuristic, or one of them alone
        strategy: Strategy = Strategy::MisBalance;
        /// what Russian roulette goes by
        roulette: Roulette = Roulette::Throughput;
        /// bounces before roulette
        roulette_depth: u32 = 3, in 0..=20;
        /// greatest component of a contribution after the first bounce, in units of radiance; 0 is no
        /// limit. A limit makes images darker than they should be, and is reported as such
        clamp: f64 = 0.0, in 0.0..=1e6;
    }
}

impl PathParameters {
    /// Features of the kernel, with whether they are on.
    fn features(&self) -> Vec<(&'static str, bool)> {
        vec![
            ("next_event", self.strategy != Strategy::Bsdf),
            ("found_emission", self.strategy != Strategy::Light),
            ("power_heuristic", self.strategy == Strategy::MisPower),
            ("roulette", self.roulette != Roulette::Never),
            ("roulette_by_albedo", self.roulette == Roulette::Albedo),
            ("clamped", self.clamp > 0.0),
        ]
    }

    /// Dimensions that no path draws.
    fn undrawn(&self) -> Vec<u32> {
        let roulette = |bounce: u32| {
            let is_drawn = self.roulette != Roulette::Never && bounce >= self.roulette_depth;
            (!is_drawn).then(|| dimensions::at_bounce(bounce, ROULETTE))
        };
        let light = |bounce| {
            let first = dimensions::at_bounce(bounce, LIGHT_POINT);
            first..dimensions::at_bounce(bounce, ROULETTE)
        };
        let mut undrawn: Vec<u32> = (0..self.max_depth).filter_map(roulette).collect();
        if self.strategy == Strategy::Bsdf {
            undrawn.extend((0..self.max_depth).flat_map(light));
            undrawn.sort_unstable();
        }
        undrawn
    }
}

pub(super) struct Path;

impl Integrator for Path {
    fn name(&self) -> &'static str {
        "path"
    }

    fn description(&self) -> &'static str {
        "path tracing: directions of the material and next-event estimation, joined; Russian roulette"
    }

    fn kernel(&self) -> &'static str {
        "integrator/path"
    }

    fn parameters(&self) -> ParameterSchema {
        PathParameters::schema()
    }

    fn constants(&self, params: &Params) -> Vec<(&'static str, u32)> {
        let params = PathParameters::from_checked(params);
        vec![
            ("MAX_DEPTH", params.max_depth),
            ("ROULETTE_DEPTH", params.roulette_depth),
            ("CLAMP", (params.clamp as f32).to_bits()),
        ]
    }

    fn features(&self, params: &Params) -> Vec<(&'static str, bool)> {
        PathParameters::from_checked(params).features()
    }

    fn facts(&self, params: &Params) -> IntegratorFacts {
        let params = PathParameters::from_checked(params);
        IntegratorFacts {
            dimensions: dimensions::needed(params.max_depth),
            undrawn: params.undrawn(),
            rays: match params.strategy {
                Strategy::Bsdf => vec![Primary, Bounce],
                _ => vec![Primary, Shadow, Bounce],
            },
            needs_inline: true,
            is_biased: params.clamp > 0.0,
            ..Default::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_strategy_does_not_draw_is_not_asked_of_a_sampler() {
        let undrawn = |params: PathParameters| {
            let PathParameters { max_depth, .. } = params;
            assert_eq!(max_depth, 2);
            params.undrawn()
        };
        let base = || PathParameters {
            max_depth: 2,
            roulette_depth: 1,
            ..PathParameters::default()
        };
        let first = dimensions::at_bounce(0, 0);
        assert_eq!(undrawn(base()), [first + ROULETTE]);
        let never = PathParameters {
            roulette: Roulette::Never,
            ..base()
        };
        let per_bounce = dimensions::PER_BOUNCE;
        assert_eq!(
            undrawn(never),
            [first + ROULETTE, first + per_bounce + ROULETTE]
        );
        let bsdf = PathParameters {
            strategy: Strategy::Bsdf,
            ..base()
        };
        let light = LIGHT_POINT..ROULETTE;
        let expected: Vec<u32> = (light.clone().map(|d| first + d))
            .chain([first + ROULETTE])
            .chain(light.map(|d| first + per_bounce + d))
            .collect();
        assert_eq!(undrawn(bsdf), expected);
    }
}
