//! What an integrator is, and what the others have to know of it.

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
    /// To a point of a light.
    Shadow,
    /// Of limited length, for ambient occlusion.
    Ao,
    /// From surface to surface.
    Bounce,
    /// Not traced, because the light cannot contribute: behind the surface, dark on this side, outside of its cone.
    Skipped,
}

/// What others have to know of an integrator with its parameters.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct IntegratorFacts {
    /// Sampler dimensions that it draws at most: 0 … this, excluded.
    pub dimensions: u32,
    /// Those among them that no sample draws.
    pub undrawn: Vec<u32>,
    /// Classes of rays that it may trace, and counts; none if it traces nothing.
    pub rays: Vec<CountedRays>,
    /// The value of every pixel, where it is known: it is then the reference.
    pub exact: Option<f64>,
    /// Length of AO rays as a fraction of the scene's diagonal, if it traces any.
    pub ao_radius: Option<f64>,
    /// Whether its kernel takes paths apart (`begin_path`, `visit` of `kernels/integrator/path.wesl`), so that it can be organised
    /// in several ways.
    pub has_stages: bool,
    /// Whether light is sampled by several shadow rays from one point.
    pub has_many_shadow_rays: bool,
    /// Whether the mean of its images is not the integral, by its parameters: a bias is no fault then.
    pub is_biased: bool,
    /// Whether paths begin at triangles that were rasterised, and not with a ray.
    pub is_rasterised: bool,
    /// Whether its kernels call `closest_hit` or `any_hit` themselves, and so need a structure whose
    /// traversal is a function.
    pub needs_inline: bool,
}

impl IntegratorFacts {
    /// Whether it traces anything.
    pub fn traces(&self) -> bool {
        !self.rays.is_empty()
    }

    /// Pairs of dimensions that one sample draws both of: among these is a sampler's worst pair looked for.
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

/// An integrator: the struct of its parameters, one line in the registry.
pub trait Integrator: Send + Sync {
    /// Name as a user types it.
    fn name(&self) -> &'static str;
    /// One line: what it computes.
    fn description(&self) -> &'static str;
    /// Module of the kernel that exports `radiance`, relative to the kernel folder: what an integrator of one
    /// kernel is. One that records passes of its own needs none.
    fn kernel(&self) -> &'static str {
        ""
    }
    /// Paths and texts of the kernel modules that it brings along, because they are not the program's.
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
    /// Features that its kernels are composed with, and whether they are on.
    fn features(&self, _params: &Params) -> Vec<(&'static str, bool)> {
        Vec::new()
    }
    /// What others have to know of it.
    fn facts(&self, params: &Params) -> IntegratorFacts;
    /// Buffers between its passes: names of kernel variables, and bytes for each sample of a slice of the
    /// image. What they hold at first is unspecified.
    fn scratch(&self) -> &'static [(&'static str, u64)] {
        &[]
    }
    /// Records the passes that add the samples of a slice to the sums, sample after sample within a pixel,
    /// so that the image does not depend on slices. With no rows they are recorded, too, to be compiled, and not
    /// played.
    ///
    /// # Errors
    /// A kernel does not compose or compile.
    fn record(&self, steps: &mut ImageSteps) -> Result<(), GpuError> {
        let kernel = Composition::new("integrator/render").with("integrator", self.kernel());
        steps.run("render", kernel, steps.pixel_groups(), &Bindings::new())
    }
}

/// Why there is no such integrator.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum IntegratorError {
    /// A name that is not registered.
    #[error("no integrator is called `{name}`{}", .nearest.map_or(String::new(), |n| format!("; did you mean `{n}`?")))]
    Unknown {
        /// What was asked for.
        name: String,
        /// The most similar name.
        nearest: Option<&'static str>,
    },
    /// A parameter that it does not have, or a value that it does not allow.
    #[error("{name}: {error}")]
    Parameter {
        /// The integrator.
        name: String,
        /// What is wrong.
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
    /// What is to be known of it with these.
    pub facts: IntegratorFacts,
    /// How it is organised on the device.
    pub organisation: Arc<dyn Organisation>,
}

impl ConfiguredIntegrator {
    /// `kind` with the parameters of `variant`, and its defaults for those that it lacks.
    ///
    /// # Errors
    /// A parameter that it does not have, or a value that it does not allow.
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

    /// The same, organised in another way.
    ///
    /// # Errors
    /// The integrator cannot be; why, in words.
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
                "{name} with lights = all sends several shadow rays from one point, and there is one place in the queues for each path: take lights = one, or an organisation of one kernel"
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

    /// Why it cannot render through this structure, if so.
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

    /// What a sampler must offer for images of this width.
    pub fn demand(&self, samples: u32, width: u32) -> Demand {
        Demand {
            samples: Some(samples),
            dimensions: self.facts.dimensions,
            width: Some(width),
        }
    }
}
