//! Integrators: what is traced per sample, and the renderer that runs them.

mod frame;
pub mod integrand;
pub mod offset;
mod render;
mod tables;
mod traced;

pub use frame::Frame;
pub use offset::RayOffset;
pub use render::{
    BLOCK_SAMPLES, RAY_COUNT_CLASSES, RenderJob, Renderer, Snapshot, rounding_bound, with_sampler,
};
pub use tables::{SceneBuffers, SceneFeatures};
pub use traced::Traced;

use crate::params::{Entry, ParamRange, ParamValue, Parameter, ParameterSchema, Params};
use crate::sampling::dimensions;

/// An integrator; one static per integrator, one line in the registry.
pub trait Integrator: Sync {
    /// Name as a user types it.
    fn name(&self) -> &'static str;
    /// One line: what it computes.
    fn description(&self) -> &'static str;
    /// Module of the kernel that exports `radiance`, relative to the kernel folder.
    fn kernel(&self) -> &'static str;
    /// Parameters.
    fn parameters(&self) -> ParameterSchema {
        Vec::new()
    }
    /// Constants of `package::active::constants` that the kernel imports.
    fn constants(&self, _params: &Params) -> Vec<(&'static str, u32)> {
        Vec::new()
    }
    /// Sampler dimensions it consumes at most.
    fn dimensions(&self, params: &Params) -> u32;
    /// The value of every pixel, where it is known: it is then the reference.
    fn exact(&self, _params: &Params) -> Option<f64> {
        None
    }
    /// Length of AO rays as a fraction of the scene's diagonal, if it traces any.
    fn ao_radius(&self, _params: &Params) -> Option<f64> {
        None
    }
    /// Whether it draws this dimension, one below [`Integrator::dimensions`], in any sample.
    fn draws(&self, _dimension: u32) -> bool {
        true
    }
    /// Pairs of dimensions that one sample draws both of: among these is a sampler's worst pair looked for.
    fn dimension_pairs(&self, params: &Params) -> Vec<[u32; 2]> {
        let mut drawn: Vec<u32> = (0..self.dimensions(params)).collect();
        drawn.retain(|&dimension| self.draws(dimension));
        let mut pairs = Vec::new();
        for (i, &a) in drawn.iter().enumerate() {
            pairs.extend(drawn[i + 1..].iter().map(|&b| [a, b]));
        }
        pairs
    }
}

/// Bounces before roulette: `ROULETTE_DEPTH` of `kernels/integrator/path.wesl`.
const ROULETTE_DEPTH: u32 = 3;

struct Primary;
struct AmbientOcclusion;
struct Path;

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

    fn dimensions(&self, _: &Params) -> u32 {
        dimensions::FIRST_BOUNCE
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

    fn dimensions(&self, _: &Params) -> u32 {
        dimensions::at_bounce(0, dimensions::DIRECTION) + 2
    }

    fn ao_radius(&self, params: &Params) -> Option<f64> {
        Some(params.number("radius"))
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

    fn dimensions(&self, params: &Params) -> u32 {
        dimensions::needed(params.integer("max_depth") as u32)
    }

    fn draws(&self, dimension: u32) -> bool {
        let roulette = |bounce| dimensions::at_bounce(bounce, dimensions::ROULETTE);
        !(0..ROULETTE_DEPTH).any(|bounce| roulette(bounce) == dimension)
    }
}

/// The registry of integrators.
static INTEGRATORS: &[&dyn Integrator] = &[
    &Primary,
    &AmbientOcclusion,
    &Path,
    &integrand::INTEGRANDS[0],
    &integrand::INTEGRANDS[1],
    &integrand::INTEGRANDS[2],
    &integrand::INTEGRANDS[3],
    &integrand::INTEGRANDS[4],
    &integrand::INTEGRANDS[5],
];

/// All integrators.
pub fn integrators() -> &'static [&'static dyn Integrator] {
    INTEGRATORS
}

/// The integrator of this name.
pub fn integrator(name: &str) -> Option<&'static dyn Integrator> {
    INTEGRATORS.iter().copied().find(|i| i.name() == name)
}

/// Names, descriptions and parameters for parser, help and docs.
pub fn integrator_entries() -> Vec<Entry> {
    let entry = |i: &&dyn Integrator| Entry {
        name: i.name().to_owned(),
        description: i.description().to_owned(),
        schema: i.parameters(),
    };
    INTEGRATORS.iter().map(entry).collect()
}
