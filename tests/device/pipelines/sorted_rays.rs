//! A plain BVH whose rays are sorted before tracing: five passes and a clearing one.

use raystone::accel::{
    AccelError, AccelKind, Access, BuildLog, BuiltAccel, BuiltBvh, Bvh, BvhParameters, CpuTwin,
    GpuBuffers, StructureStats, TracePasses, TraceSteps, TriangleSoup,
};
use raystone::gpu::{Bindings, Composition, GpuError, UniformValues};
use raystone::params::{ParameterSchema, Parameters as _, Params};
use std::sync::Arc;

/// Sets of rays of one octant and one of 512 cells.
const BUCKETS: u64 = 4096;

/// The structure; it may declare that it counts no work.
pub struct SortedRays {
    pub name: &'static str,
    pub counts_work: bool,
}

struct Built {
    tree: BuiltBvh,
    low: [f32; 3],
    scale: [f32; 3],
    counts_work: bool,
}

struct Passes {
    counts_work: bool,
}

impl AccelKind for SortedRays {
    fn name(&self) -> &'static str {
        self.name
    }

    fn description(&self) -> &'static str {
        "plain BVH traced in the order of the rays' octants and Morton codes"
    }

    fn parameters(&self) -> ParameterSchema {
        Bvh.parameters()
    }

    fn kernels(&self) -> Vec<String> {
        let passes = ["keys", "starts", "sort", "restore"];
        let kernel = |pass| format!("accel/sorted_rays/{pass}");
        passes.map(kernel).to_vec()
    }

    fn build(
        &self,
        soup: &TriangleSoup,
        params: &Params,
        log: &mut BuildLog,
    ) -> Result<Box<dyn BuiltAccel>, AccelError> {
        let bounds = soup.bounds();
        let scale = |axis: usize| 8.0 / (bounds.max[axis] - bounds.min[axis]).max(1e-20);
        Ok(Box::new(Built {
            tree: BuiltBvh::build(soup, &BvhParameters::from_params(params)?, log)?,
            low: bounds.min,
            scale: [0, 1, 2].map(scale),
            counts_work: self.counts_work,
        }))
    }
}

impl BuiltAccel for Built {
    fn validate(&self, soup: &TriangleSoup) -> Result<(), AccelError> {
        self.tree.validate(soup)
    }

    fn buffers(&self) -> GpuBuffers<'_> {
        let mut buffers = self.tree.buffers();
        let order = UniformValues::new().vec("low", &self.low);
        buffers
            .uniforms
            .push(("order", order.vec("scale", &self.scale)));
        buffers
    }

    fn divisible(&self) -> &'static [&'static str] {
        self.tree.divisible()
    }

    fn access(&self) -> Access {
        Access::Pipeline(Arc::new(Passes {
            counts_work: self.counts_work,
        }))
    }

    fn stats(&self) -> StructureStats {
        self.tree.stats()
    }

    fn cpu_twin<'a>(&'a self, soup: &'a TriangleSoup) -> Option<Box<dyn CpuTwin + 'a>> {
        self.tree.cpu_twin(soup)
    }
}

impl TracePasses for Passes {
    fn scratch(&self, rays: u32) -> Vec<(&'static str, u64)> {
        let rays = u64::from(rays);
        vec![
            ("keys", 4 * rays),
            ("places", 4 * BUCKETS),
            ("origins", 4 * rays),
            ("sorted_rays", 32 * rays),
            ("sorted_answers", 32 * rays),
        ]
    }

    fn counts_work(&self) -> bool {
        self.counts_work
    }

    fn record(&self, steps: &mut TraceSteps) -> Result<(), GpuError> {
        let nothing = Bindings::new();
        let kernel = |pass: &str| Composition::new(&format!("accel/sorted_rays/{pass}"));
        steps.clear("places")?;
        steps.run_rays("keys", kernel("keys"), &nothing)?;
        steps.run("starts", kernel("starts"), [1, 1, 1], &nothing)?;
        steps.run_rays("sort", kernel("sort"), &nothing)?;
        let answers = steps.storage("sorted_answers")?;
        let mut sorted = Bindings::new();
        sorted
            .buffer("rays", steps.storage("sorted_rays")?)
            .buffer("hits", &answers)
            .buffer("work", &answers)
            .uniform("batch", steps.rays_from(0));
        steps.run_rays("trace", Composition::new("integrator/trace_rays"), &sorted)?;
        steps.run_rays("restore", kernel("restore"), &nothing)
    }
}
