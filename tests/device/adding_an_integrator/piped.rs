//! `piped-bvh`: the plain BVH as a structure that answers buffers of rays alone.

use raystone::accel::{
    AccelError, AccelKind, AccelRegistry, Access, BuildLog, BuiltAccel, CpuTwin, GpuBuffers,
    StructureStats, TracePasses, TraceSteps, TriangleSoup,
};
use raystone::gpu::{Bindings, Composition, GpuError};
use raystone::params::{ParameterSchema, Params};
use std::sync::Arc;

/// The registry entry.
pub struct PipedBvh;

struct Piped(Box<dyn BuiltAccel>);

struct OnePass;

impl TracePasses for OnePass {
    fn counts_work(&self) -> bool {
        true
    }

    fn record(&self, steps: &mut TraceSteps) -> Result<(), GpuError> {
        let kernel = Composition::new("integrator/trace_rays");
        steps.run_rays("trace", kernel, &Bindings::new())
    }
}

fn bvh() -> &'static dyn AccelKind {
    AccelRegistry::default()
        .get("bvh")
        .expect("it is registered")
}

impl AccelKind for PipedBvh {
    fn name(&self) -> &'static str {
        "piped-bvh"
    }

    fn description(&self) -> &'static str {
        "a BVH that answers buffers of rays (an example)"
    }

    fn parameters(&self) -> ParameterSchema {
        bvh().parameters()
    }

    fn build(
        &self,
        soup: &TriangleSoup,
        params: &Params,
        log: &mut BuildLog,
    ) -> Result<Box<dyn BuiltAccel>, AccelError> {
        Ok(Box::new(Piped(bvh().build(soup, params, log)?)))
    }
}

impl BuiltAccel for Piped {
    fn validate(&self, soup: &TriangleSoup) -> Result<(), AccelError> {
        self.0.validate(soup)
    }

    fn buffers(&self) -> GpuBuffers<'_> {
        self.0.buffers()
    }

    fn access(&self) -> Access {
        Access::Pipeline(Arc::new(OnePass))
    }

    fn stats(&self) -> StructureStats {
        self.0.stats()
    }

    fn cpu_twin<'a>(&'a self, soup: &'a TriangleSoup) -> Option<Box<dyn CpuTwin + 'a>> {
        self.0.cpu_twin(soup)
    }
}
