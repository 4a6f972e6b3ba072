//! Scenes and samplers for the figures.

use super::NumericsError;
use crate::accel::{AccelRegistry, Intersection, Traced};
use crate::geometry::Camera;
use crate::gpu::Gpu;
use crate::integrator::{
    self, ConfiguredIntegrator, IntegratorRegistry, RayOffset, RenderJob, Renderer,
};
use crate::params::{Entry, ParamValue, Variant};
use crate::sampling::{Demand, Sampler, SamplerRegistry};
use crate::scene::{LoadOptions, SceneData, builtin_scenes, load};

/// The entry called `name`, all parameters at their defaults.
pub fn default_variant(
    kind: &'static str,
    entries: &[Entry],
    name: &'static str,
) -> Result<Variant, NumericsError> {
    let found = entries.iter().find(|entry| entry.name == name);
    let entry = found.ok_or(NumericsError::Missing { kind, name })?;
    Ok(entry.default_variant())
}

/// A sequence without decorrelation, for so many dimensions.
pub fn sampler(sequence: &'static str, dimensions: u32) -> Result<Sampler, NumericsError> {
    let registry = SamplerRegistry::default();
    let mut sequence = default_variant("sequence", &registry.sequence_entries(), sequence)?;
    if let Some(digits) = sequence.params.0.get_mut("digits") {
        *digits = ParamValue::Name("plain".to_owned());
    }
    let none = default_variant("decorrelation", &registry.decorrelation_entries(), "none")?;
    let demand = Demand {
        samples: None,
        dimensions,
        width: None,
    };
    Ok(registry.sampler(&sequence, &none, &demand)?)
}

/// The path tracer with `depth` bounces at most.
pub fn path(depth: Option<i64>) -> Result<ConfiguredIntegrator, NumericsError> {
    let registry = IntegratorRegistry::default();
    let mut variant = default_variant("integrator", &registry.entries(), "path")?;
    if let Some(depth) = depth {
        let depth = ParamValue::Integer(depth);
        variant.params.0.insert("max_depth".to_owned(), depth);
    }
    Ok(registry.configured(&variant)?)
}

/// A built-in scene with default parameters.
pub fn scene(name: &'static str) -> Result<SceneData, NumericsError> {
    let variant = default_variant("scene", &builtin_scenes(), name)?;
    Ok(load(&variant, &LoadOptions::default())?)
}

/// A scene on the device, traced through the plain BVH.
pub struct Stage {
    camera: Camera,
    stage: integrator::Stage,
    traced: Traced,
}

impl Stage {
    pub fn new(gpu: &Gpu, scene: &SceneData) -> Result<Self, NumericsError> {
        let (kind, name) = ("accel", "bvh");
        let registry = AccelRegistry::default();
        let bvh = registry
            .get(name)
            .ok_or(NumericsError::Missing { kind, name })?;
        let variant = default_variant(kind, &registry.entries(), name)?;
        let stage = integrator::Stage::new(gpu, scene.clone(), Intersection::default())?;
        Ok(Self {
            camera: scene.view(1.0),
            traced: stage.traced(bvh, &variant.params)?,
            stage,
        })
    }

    /// A compiled image of `size` × `size` pixels.
    pub fn renderer<'a>(
        &'a self,
        gpu: &'a Gpu,
        integrator: &ConfiguredIntegrator,
        sampler: &Sampler,
        size: u32,
    ) -> Result<Renderer<'a>, NumericsError> {
        let job = RenderJob {
            size: [size; 2],
            camera: self.camera,
            sampler,
            integrator,
            offset: RayOffset::default(),
            runtime_checks: true,
        };
        Ok(Renderer::new(
            gpu,
            &self.stage.buffers,
            &self.traced,
            &job,
            false,
        )?)
    }
}
