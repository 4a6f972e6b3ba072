//! The path tracer, and the strategies of its estimator. Formulas: `docs/shading.md`; kernel:
//! `kernels/integrator/path.wesl`.

use super::kind::CountedRays;
use super::tables::grouped_features;
use super::{Integrator, IntegratorFacts};
use raystone_core::parameters;
use raystone_core::params::{Choice as _, ParameterSchema, Parameters as _, Params};
use raystone_sampling::dimensions::{self, LIGHT_CHOICE, LIGHT_POINT, PIXEL, ROULETTE};

parameters! {
    /// How material and light sampling are combined.
    pub enum Strategy {
        /// Both, weighted by the balance heuristic (Veach & Guibas 1995).
        MisBalance = "mis-balance",
        /// Both, weighted by the power heuristic with exponent 2.
        MisPower = "mis-power",
        /// Emission is found by material sampling only.
        Bsdf = "bsdf",
        /// Light sampling only; other emission (camera rays, delta lobes) is added when hit.
        Light = "light",
    }

    /// The survival criterion of a path.
    pub enum Roulette {
        /// The brightest component of its throughput.
        Throughput = "throughput",
        /// The brightest component of the weight of its last bounce (Dufay 2017, 2.2.3).
        Albedo = "albedo",
        /// No roulette: paths continue to the maximum depth.
        Never = "none",
    }

    /// How the sampled light is chosen.
    pub(crate) enum LightChoice {
        Power = "power",
        Uniform = "uniform",
        /// By approximate contribution, with a light hierarchy (Conty Estevez & Kulla 2018).
        Tree = "tree",
    }

    /// Source of a path's first hit.
    pub enum Primary {
        /// A ray through the sampled point of the pixel.
        Traced = "traced",
        /// A ray through the centre of the pixel.
        Centre = "centre",
        /// The triangle that the centre of the pixel sees, by rasterisation.
        Raster = "raster",
    }

    /// Number of lights sampled at each vertex.
    pub enum Lights {
        /// One.
        One = "one",
        /// Each once.
        All = "all",
    }

    /// Further estimators of light at a vertex.
    pub(crate) enum Connection {
        /// None.
        Nothing = "none",
        /// Light that arrives over one perfect mirror: docs/specular.md.
        Specular = "specular",
    }

    /// Groups of features that a kernel includes although the scene does not need them.
    pub(crate) enum Carry {
        /// Nothing.
        Nothing = "none",
        /// Every kind of material.
        Materials = "materials",
        /// Textures of all uses.
        Textures = "textures",
        /// Normals of vertices and of textures.
        Normals = "normals",
        Lights = "lights",
        /// The choice among lights, and the search for the one that was found.
        Choice = "choice",
        /// Radiance of rays that leave the scene.
        Background = "background",
        /// The error that instances add to points, and the mirrored triangles.
        Transforms = "transforms",
        All = "all",
    }

    /// Parameters of `path`.
    pub(crate) struct PathParameters {
        /// most bounces of a path
        max_depth: u32 = 6, in 0..=20;
        /// how directions of the material and samples of lights are joined: by the balance or the power
        /// heuristic, or one of them alone
        strategy: Strategy = Strategy::MisBalance;
        /// what decides which light is sampled
        light_choice: LightChoice = LightChoice::Power;
        /// how many lights are sampled at each vertex
        lights: Lights = Lights::One;
        /// how else vertices are connected with the sampled light: over the points at which perfect mirrors reflect it to them, which needs
        /// an organisation of one kernel; nothing with strategy = bsdf
        connection: Connection = Connection::Nothing;
        /// what Russian roulette goes by
        roulette: Roulette = Roulette::Throughput;
        /// bounces before roulette
        roulette_depth: u32 = 3, in 0..=20;
        /// greatest component of a contribution after the first bounce, in units of radiance; 0 is no
        /// limit. A limit makes images darker than they should be, and is reported as such
        clamp: f64 = 0.0, in 0.0..=1e6;
        /// where the first hit comes from: a ray through a point of the pixel, or through its centre, or what a rasteriser finds at the
        /// centre (structures without instances, a single kernel). From the centre, edges are not smoothed
        primary: Primary = Primary::Traced;
        /// what the kernel carries though the scene does not need it, to measure what leaving it out gains;
        /// the image stays the same to the bit
        carry: Carry = Carry::Nothing;
    }
}

impl PathParameters {
    /// True if vertices are connected with lights over mirrors.
    fn connects(&self) -> bool {
        self.connection == Connection::Specular && self.strategy != Strategy::Bsdf
    }

    /// Features of the kernel, and whether they are enabled.
    fn features(&self) -> Vec<(&'static str, bool)> {
        let mut features = vec![
            ("next_event", self.strategy != Strategy::Bsdf),
            ("found_emission", self.strategy != Strategy::Light),
            ("uniform_lights", self.light_choice == LightChoice::Uniform),
            ("light_tree", self.light_choice == LightChoice::Tree),
            ("all_lights", self.lights == Lights::All),
            ("mirror_connections", self.connects()),
            ("power_heuristic", self.strategy == Strategy::MisPower),
            ("roulette", self.roulette != Roulette::Never),
            ("roulette_by_albedo", self.roulette == Roulette::Albedo),
            ("clamped", self.clamp > 0.0),
            ("pixel_centres", self.primary != Primary::Traced),
            ("rasterised", self.primary == Primary::Raster),
            ("carried", self.carry != Carry::Nothing),
        ];
        features.extend(self.carry.features().map(|name| (name, true)));
        features
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
        let choice = |bounce| dimensions::at_bounce(bounce, LIGHT_CHOICE);
        let mut undrawn: Vec<u32> = (0..self.max_depth).filter_map(roulette).collect();
        if self.strategy == Strategy::Bsdf {
            undrawn.extend((0..self.max_depth).flat_map(light));
        } else if self.lights == Lights::All {
            undrawn.extend((0..self.max_depth).map(choice));
        }
        if self.primary != Primary::Traced {
            undrawn.extend([PIXEL, PIXEL + 1]);
        }
        undrawn.sort_unstable();
        undrawn
    }
}

impl Carry {
    /// Features that are enabled for any scene.
    fn features(self) -> impl Iterator<Item = &'static str> {
        let is_carried = move |group: &str| self == Self::All || group == self.name();
        let carried = grouped_features().filter(move |(group, _)| is_carried(group));
        carried.map(|(_, feature)| feature)
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
        let mut rays = match params.strategy {
            Strategy::Bsdf => vec![CountedRays::Primary, CountedRays::Bounce],
            _ => vec![
                CountedRays::Primary,
                CountedRays::Shadow,
                CountedRays::Bounce,
            ],
        };
        rays.retain(|class| *class != CountedRays::Primary || params.primary != Primary::Raster);
        IntegratorFacts {
            dimensions: dimensions::needed(params.max_depth),
            undrawn: params.undrawn(),
            rays,
            needs_inline: true,
            has_stages: true,
            has_many_shadow_rays: params.connects()
                || params.lights == Lights::All && params.strategy != Strategy::Bsdf,
            is_biased: params.clamp > 0.0 || params.primary != Primary::Traced,
            is_rasterised: params.primary == Primary::Raster,
            ..Default::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SceneFeatures;
    use raystone_core::params::ParamValue;
    use std::collections::BTreeSet;

    #[test]
    fn a_kernel_can_carry_every_feature_of_scenes_and_each_in_one_group() {
        let all: Vec<&str> = Carry::All.features().collect();
        let single = Carry::ALL.iter().filter(|carry| **carry != Carry::All);
        let mut parts: Vec<&str> = single.flat_map(|carry| carry.features()).collect();
        assert_eq!(parts.len(), all.len());
        parts.sort_unstable();
        let flags = SceneFeatures::default().flags();
        let known: BTreeSet<&str> = flags.iter().map(|(name, _)| *name).collect();
        assert_eq!(parts, known.into_iter().collect::<Vec<_>>());
        let alone = |carry: Carry| carry.features().count();
        assert_eq!(alone(Carry::Nothing), 0);
        assert!(Carry::ALL.iter().skip(1).all(|carry| alone(*carry) > 0));
    }

    #[test]
    fn rays_that_are_not_traced_are_not_counted() {
        let word = |name: &str, value: &str| (name.to_owned(), ParamValue::Name(value.to_owned()));
        let rays = |strategy: Strategy, primary: Primary| {
            let chosen = [
                word("strategy", strategy.name()),
                word("primary", primary.name()),
            ];
            Path.facts(&Params(chosen.into())).rays
        };
        use CountedRays::{Bounce, Primary as First, Shadow};
        let traced = Primary::Traced;
        assert_eq!(rays(Strategy::MisBalance, traced), [First, Shadow, Bounce]);
        assert_eq!(rays(Strategy::Bsdf, traced), [First, Bounce]);
        assert_eq!(
            rays(Strategy::MisBalance, Primary::Raster),
            [Shadow, Bounce]
        );
        assert_eq!(rays(Strategy::Bsdf, Primary::Raster), [Bounce]);
    }

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
