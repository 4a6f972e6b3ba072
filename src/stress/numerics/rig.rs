//! Scenes and samplers for the figures.

use super::NumericsError;
use raystone_accel::{AccelRegistry, Intersection, Traced};
use raystone_core::params::{ParamValue, Params, Variant};
use raystone_gpu::Gpu;
use raystone_render::{
    ConfiguredIntegrator, IntegratorRegistry, RayOffset, RenderJob, Renderer, Stage,
};
use raystone_sampling::{Demand, Sampler, SamplerRegistry};
use raystone_scene::SceneData;

/// Returns the variant of this name, with these parameters set.
fn variant(name: &str, set: &[(&str, ParamValue)]) -> Variant {
    let set = set
        .iter()
        .map(|(key, value)| ((*key).to_owned(), value.clone()));
    Variant {
        name: name.to_owned(),
        params: Params(set.collect()),
        label: name.to_owned(),
    }
}

/// Returns a sequence without decorrelation, for so many dimensions.
pub(super) fn sampler(sequence: &str, dimensions: u32) -> Result<Sampler, NumericsError> {
    let digits = [("digits", ParamValue::Name("plain".to_owned()))];
    let set: &[_] = if sequence == "halton" { &digits } else { &[] };
    let demand = Demand {
        samples: None,
        dimensions,
        width: None,
    };
    let none = variant("none", &[]);
    Ok(SamplerRegistry::default().sampler(&variant(sequence, set), &none, &demand)?)
}

/// Returns the path tracer with `depth` bounces at most.
pub(super) fn path(depth: Option<i64>) -> Result<ConfiguredIntegrator, NumericsError> {
    let depth = depth.map(|depth| ("max_depth", ParamValue::Integer(depth)));
    let path = variant("path", depth.as_slice());
    Ok(IntegratorRegistry::default().configured(&path)?)
}

/// A scene on the device, traced through the plain BVH.
pub(super) struct Rig {
    stage: Stage,
    traced: Traced,
}

impl Rig {
    pub(super) fn new(gpu: &Gpu, scene: SceneData) -> Result<Self, NumericsError> {
        let stage = Stage::new(gpu, scene, Intersection::default())?;
        let traced = stage.structure(&AccelRegistry::default(), "bvh")?;
        Ok(Self { stage, traced })
    }

    /// Returns a compiled image of `size` × `size` pixels.
    pub(super) fn renderer<'a>(
        &'a self,
        integrator: &ConfiguredIntegrator,
        sampler: &Sampler,
        size: u32,
    ) -> Result<Renderer<'a>, NumericsError> {
        let job = RenderJob {
            size: [size; 2],
            camera: self.stage.scene.view(1.0),
            sampler,
            integrator,
            offset: RayOffset::default(),
            runtime_checks: true,
        };
        let stage = &self.stage;
        Ok(Renderer::new(
            &stage.gpu,
            &stage.buffers,
            &self.traced,
            &job,
            false,
        )?)
    }
}
