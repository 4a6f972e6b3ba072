//! The interface of integrators, and their properties.

use super::organisation::SingleKernel;
use super::visibility;
use super::{ImageSteps, Organisation, Traced};
use raystone_core::params::{ParamError, ParameterSchema, Params, Variant};
use raystone_gpu::{Bindings, Composition, GpuError};
use raystone_sampling::Demand;
use std::sync::Arc;
use thiserror::Error;

/// Classes of rays that kernels count, in the order of `kernels/common/ray_counts.wesl`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum CountedRays {
    /// From the camera.
    Primary,
    /// To a sampled point of a light.
    Shadow,
    /// Of limited length, for ambient occlusion.
    Ao,
    /// From surface to surface.
    Bounce,
    /// Not traced: behind the surface, on the dark side of the light, or outside its cone.
    Skipped,
}

/// Properties of an integrator with its parameters.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct IntegratorFacts {
    /// Upper bound (exclusive) of the sampler dimensions that it draws.
    pub dimensions: u32,
    /// Dimensions below it that no sample draws.
    pub undrawn: Vec<u32>,
    /// Classes of rays that it may trace, and counts; empty if it traces nothing.
    pub rays: Vec<CountedRays>,
    /// The value of every pixel, if known: it is then the reference.
    pub exact: Option<f64>,
    /// Length of AO rays as a fraction of the scene's diagonal, if it traces any.
    pub ao_radius: Option<f64>,
    /// True if its kernel splits paths into stages (`begin_path`, `visit` of
    /// `kernels/integrator/path.wesl`), so that it can be organised in several ways.
    pub has_stages: bool,
    /// True if light is sampled by several shadow rays from one point.
    pub has_many_shadow_rays: bool,
    /// True if its parameters bias the mean of its images: such a bias is no fault.
    pub is_biased: bool,
    /// True if paths begin at rasterised triangles instead of with a ray.
    pub is_rasterised: bool,
    /// True if its kernels call `closest_hit` or `any_hit`, and so need an inline traversal.
    pub needs_inline: bool,
}

impl IntegratorFacts {
    /// True if it traces rays.
    pub fn traces(&self) -> bool {
        !self.rays.is_empty()
    }

    /// Pairs of dimensions that one sample draws: the candidates for a sampler's worst pair.
    pub fn dimension_pairs(&self) -> Vec<[u32; 2]> {
        let mut drawn: Vec<u32> = (0..self.dimensions).collect();
        drawn.retain(|dimension| !self.undrawn.contains(dimension));
        let mut pairs = Vec::new();
        for (i, &a) in drawn.iter().enumerate() {
            pairs.extend(drawn[i + 1..].iter().map(|&b| [a, b]));
        }
        pairs
    }
}

/// An integrator: its parameter struct, with one line in the registry.
pub trait Integrator: Send + Sync {
    /// Name used in configurations.
    fn name(&self) -> &'static str;
    /// One-line description.
    fn description(&self) -> &'static str;
    /// Kernel module that exports `radiance`, relative to the kernel folder, for a single-kernel
    /// integrator. One with its own passes needs none.
    fn kernel(&self) -> &'static str {
        ""
    }
    /// Paths and texts of its own kernel modules, for integrators that are not built in.
    fn sources(&self) -> &'static [(&'static str, &'static str)] {
        &[]
    }
    /// Parameters.
    fn parameters(&self) -> ParameterSchema {
        Vec::new()
    }
    /// Constants of `package::active::constants` that the kernel imports.
    fn constants(&self, _params: &Params) -> Vec<(&'static str, u32)> {
        Vec::new()
    }
    /// Features of its kernels, and whether they are enabled.
    fn features(&self, _params: &Params) -> Vec<(&'static str, bool)> {
        Vec::new()
    }
    /// Its properties.
    fn facts(&self, params: &Params) -> IntegratorFacts;
    /// Buffers between its passes: names of kernel variables, and bytes per sample of a slice of
    /// the image. Their initial content is unspecified.
    fn scratch(&self) -> &'static [(&'static str, u64)] {
        &[]
    }
    /// Records the passes that add the samples of a slice to the sums, in sample order within a
    /// pixel, so that the image does not depend on slices. With zero rows, passes are recorded for
    /// compilation only, and not played.
    ///
    /// # Errors
    /// A kernel does not compose or compile.
    fn record(&self, steps: &mut ImageSteps) -> Result<(), GpuError> {
        let kernel = Composition::new("integrator/render").with("integrator", self.kernel());
        steps.run("render", kernel, steps.pixel_groups(), &Bindings::new())
    }
}

/// The reason why an integrator cannot be configured.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum IntegratorError {
    /// A name that is not registered.
    #[error("no integrator is called `{name}`{}", .nearest.map_or(String::new(), |n| format!("; did you mean `{n}`?")))]
    Unknown {
        /// The requested name.
        name: String,
        /// The most similar name.
        nearest: Option<&'static str>,
    },
    /// An unknown parameter, or a value that is not allowed.
    #[error("{name}: {error}")]
    Parameter {
        /// The integrator.
        name: String,
        /// The error.
        error: ParamError,
    },
}

/// An integrator with all its parameters.
#[derive(Clone)]
pub struct ConfiguredIntegrator {
    /// The integrator.
    pub kind: &'static dyn Integrator,
    /// Its parameters, none missing.
    pub params: Params,
    /// Its properties with these.
    pub facts: IntegratorFacts,
    /// Its organisation on the device.
    pub organisation: Arc<dyn Organisation>,
}

impl ConfiguredIntegrator {
    /// `kind` with the parameters of `variant`, and defaults for the rest.
    ///
    /// # Errors
    /// An unknown parameter, or a value that is not allowed.
    pub fn new(kind: &'static dyn Integrator, variant: &Variant) -> Result<Self, IntegratorError> {
        let params = variant.params.completed(&kind.parameters());
        let params = params.map_err(|error| IntegratorError::Parameter {
            name: variant.name.clone(),
            error,
        })?;
        Ok(Self {
            kind,
            facts: kind.facts(&params),
            organisation: Arc::new(SingleKernel::default()),
            params,
        })
    }

    /// The same with another organisation.
    ///
    /// # Errors
    /// The reason why the integrator does not support it.
    pub fn organised(mut self, by: Arc<dyn Organisation>) -> Result<Self, String> {
        let name = self.kind.name();
        if !by.takes_any() && !self.facts.has_stages {
            return Err(format!(
                "{name} is one kernel that cannot be taken apart: only `single-kernel` organises it"
            ));
        }
        if !by.takes_any() && self.facts.is_rasterised {
            return Err(format!(
                "{name} with primary = raster begins its paths in its own kernel: only `single-kernel` organises it"
            ));
        }
        if !by.is_inline() && self.facts.has_many_shadow_rays {
            return Err(format!(
                "{name} with lights = all or connection = specular sends several shadow rays from one point, and there is one place in the queues for each path: take lights = one and connection = none, or an organisation of one kernel"
            ));
        }
        self.facts.needs_inline &= by.is_inline();
        self.organisation = by;
        Ok(self)
    }

    /// Records the passes of a slice: [`Organisation::record`].
    ///
    /// # Errors
    /// A kernel does not compose or compile.
    pub fn record(&self, steps: &mut ImageSteps) -> Result<(), GpuError> {
        (self.organisation).record(steps, self.kind, &self.params)
    }

    /// The reason why it cannot render through this structure, if any.
    pub fn refusal(&self, traced: &Traced) -> Option<String> {
        if self.facts.is_rasterised {
            let reason = visibility::refusal(traced.space);
            if reason.is_some() {
                return reason.map(str::to_owned);
            }
        }
        (self.facts.needs_inline && !traced.is_inline()).then(|| {
            format!(
                "{} calls the structure from its own kernel, and this structure answers buffers of rays alone; the organisations `multi-kernel` and `wavefront` trace buffers",
                self.kind.name()
            )
        })
    }

    /// The demand on a sampler for images of this width.
    pub fn demand(&self, samples: u32, width: u32) -> Demand {
        Demand {
            samples: Some(samples),
            dimensions: self.facts.dimensions,
            width: Some(width),
        }
    }
}
