//! The batch interface that all measuring goes through: a buffer of rays in, a buffer of hits out.

use super::rays::RaySet;
use crate::accel::{Counters, Hit, Ray};
use crate::gpu::{
    Bindings, Composition, Dispatch, Elapsed, Gpu, GpuError, Pipeline, UniformValues, groups_for,
};
use crate::integrator::{SceneBuffers, Traced};
use crate::text::cell_hash;
use std::sync::Arc;

/// What is asked of each ray.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Query {
    /// The nearest hit.
    Closest,
    /// Whether there is a hit.
    Any,
}

impl Query {
    /// The query that a class of rays is traced with.
    pub fn of(set: &RaySet) -> Self {
        if set.is_any() {
            Self::Any
        } else {
            Self::Closest
        }
    }
}

/// What stands in the output before a trace; no answer of either query begins with it (as a distance it is
/// NaN), so that a ray which a dispatch leaves out is seen.
const POISON: u32 = 0xffff_dead;

/// Workgroups in a row of [`Batch::trace_in_rows`].
const NARROW_ROW: u32 = 3;

/// No dispatch should run longer than this.
const SLICE_MS: f64 = 250.0;
/// Rays of the first dispatch through an unknown structure: few, it may be brute force over a million
/// triangles.
const FIRST_SLICE: u32 = 64;

/// A structure, a query and a ray buffer, compiled.
pub struct Batch<'a> {
    gpu: &'a Gpu,
    pipeline: Arc<Pipeline>,
    bindings: Bindings,
    output: wgpu::Buffer,
    /// As large as `output`, copied over it before each trace.
    poison: wgpu::Buffer,
    status: wgpu::Buffer,
    rays: u32,
    /// Most workgroups in a row.
    row: std::cell::Cell<u32>,
    /// Rays per dispatch, grown until a dispatch takes about [`SLICE_MS`].
    slice: std::cell::Cell<u32>,
}

impl<'a> Batch<'a> {
    /// Compiles the query and uploads the rays.
    ///
    /// # Errors
    /// The kernel does not compile or the rays exceed the adapter's binding limit.
    pub fn new(
        gpu: &'a Gpu,
        scene: &SceneBuffers,
        traced: &Traced,
        query: Query,
        rays: &[Ray],
        runtime_checks: bool,
    ) -> Result<Self, GpuError> {
        Self::compile(gpu, scene, traced, query, rays, runtime_checks, false)
    }

    fn compile(
        gpu: &'a Gpu,
        scene: &SceneBuffers,
        traced: &Traced,
        query: Query,
        rays: &[Ray],
        runtime_checks: bool,
        counters: bool,
    ) -> Result<Self, GpuError> {
        let mut bindings = scene.bindings.merged(&traced.bindings);
        let composition = composition(scene, traced, query).feature("counters", counters);
        let pipeline = gpu.pipeline(&bindings.compose(composition), runtime_checks)?;
        let bytes_per_ray = if counters { 32 } else { 16 };
        let output = gpu.zeroed("hits", rays.len() as u64 * bytes_per_ray)?;
        let poison = gpu.storage("poison", &vec![POISON; output.size() as usize / 4])?;
        let status = gpu.zeroed("status", 64)?;
        bindings
            .buffer("rays", &gpu.storage("rays", rays)?)
            .buffer("status", &status);
        bindings.buffer(if counters { "work" } else { "hits" }, &output);
        let slice = std::cell::Cell::new(FIRST_SLICE);
        Ok(Self {
            gpu,
            pipeline,
            bindings,
            output,
            poison,
            status,
            rays: rays.len() as u32,
            row: std::cell::Cell::new(u32::MAX),
            slice,
        })
    }

    /// Feature flags of the kernel.
    pub fn features(&self) -> Vec<String> {
        self.pipeline
            .kernel
            .composition
            .features
            .iter()
            .cloned()
            .collect()
    }

    /// Text of the composed kernel.
    pub fn kernel_text(&self) -> &str {
        &self.pipeline.kernel.wgsl
    }

    /// Traces all rays, in as many dispatches as needed to keep each short. Answers of earlier traces are
    /// wiped out before the clock starts; the error word is kept.
    ///
    /// # Errors
    /// The device is lost, hangs, or the driver complains.
    pub fn trace(&self) -> Result<Elapsed, GpuError> {
        self.wipe()?;
        let mut total = Elapsed {
            gpu_ms: self.gpu.timestamp_period.map(|_| 0.0),
            wall_ms: 0.0,
        };
        let mut first = 0;
        while first < self.rays {
            let count = self.slice.get().min(self.rays - first);
            let elapsed = self.dispatch(first, count)?;
            total.gpu_ms = total.gpu_ms.zip(elapsed.gpu_ms).map(|(a, b)| a + b);
            total.wall_ms += elapsed.wall_ms;
            let fitting = f64::from(count) * SLICE_MS / elapsed.wall_ms.max(0.1);
            // The first dispatch includes the driver's compiler: growth is stepwise, shrinking is not.
            self.slice
                .set((fitting as u32).clamp(64, count.saturating_mul(8).max(FIRST_SLICE)));
            first += count;
        }
        Ok(total)
    }

    fn wipe(&self) -> Result<(), GpuError> {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(&self.poison, 0, &self.output, 0, self.output.size());
        self.gpu.queue.submit([encoder.finish()]);
        self.gpu.wait()
    }

    /// Traces all rays again in dispatches of narrow rows of workgroups, as dispatches of millions of rays
    /// are cut by the limit on a row.
    ///
    /// # Errors
    /// The device is lost, hangs, or the driver complains.
    pub fn trace_in_rows(&self) -> Result<(), GpuError> {
        self.row.set(NARROW_ROW);
        let traced = self.trace();
        self.row.set(u32::MAX);
        traced.map(|_| ())
    }

    /// A dispatch that traces nothing: the fixed cost of a measurement.
    ///
    /// # Errors
    /// The device is lost, hangs, or the driver complains.
    pub fn trace_nothing(&self) -> Result<Elapsed, GpuError> {
        self.dispatch(0, 0)
    }

    fn dispatch(&self, first: u32, count: u32) -> Result<Elapsed, GpuError> {
        let mut bindings = self.bindings.clone();
        bindings.uniform(
            "batch",
            UniformValues::new().u32("first", first).u32("count", count),
        );
        let [mut x, mut y, z] = groups_for(count);
        if x > self.row.get() {
            (x, y) = (self.row.get(), y * x.div_ceil(self.row.get()));
        }
        self.gpu.run(&Dispatch {
            pipeline: &self.pipeline,
            bindings: &bindings,
            groups: [x, y, z],
        })
    }

    /// Hits of the last trace of a closest-hit query.
    ///
    /// # Errors
    /// The device is lost or hangs.
    pub fn hits(&self) -> Result<Vec<Hit>, GpuError> {
        let mut hits: Vec<Hit> = self.gpu.read(&self.output)?;
        hits.truncate(self.rays as usize);
        Ok(hits)
    }

    /// Answers of the last trace of an any-hit query; `None` where there is no answer.
    ///
    /// # Errors
    /// The device is lost or hangs.
    pub fn found(&self) -> Result<Vec<Option<bool>>, GpuError> {
        let words: Vec<[u32; 4]> = self.gpu.read(&self.output)?;
        let answer = |w: &[u32; 4]| (w[0] <= 1).then_some(w[0] == 1);
        Ok(words.iter().take(self.rays as usize).map(answer).collect())
    }

    /// Hash of what the last trace left in the output.
    ///
    /// # Errors
    /// The device is lost or hangs.
    pub fn digest(&self) -> Result<blake3::Hash, GpuError> {
        Ok(blake3::hash(&self.gpu.read::<u8>(&self.output)?))
    }

    /// The error word of the kernels.
    ///
    /// # Errors
    /// The device is lost or hangs.
    pub fn error_word(&self) -> Result<u32, GpuError> {
        Ok(self.gpu.read::<u32>(&self.status)?[0])
    }
}

fn composition(scene: &SceneBuffers, traced: &Traced, query: Query) -> Composition {
    let kernel = Composition::new("integrator/trace_rays");
    let kernel = traced.compose(scene.intersection.activate(kernel));
    kernel.feature("any", query == Query::Any)
}

/// BLAKE3 of the kernels that answer both queries through a structure.
///
/// # Errors
/// A kernel does not compile.
pub fn kernel_hash(gpu: &Gpu, scene: &SceneBuffers, traced: &Traced) -> Result<String, GpuError> {
    let bindings = scene.bindings.merged(&traced.bindings);
    let hash = |query| {
        let kernel = bindings.compose(composition(scene, traced, query));
        Ok::<_, GpuError>(gpu.pipeline(&kernel, true)?.kernel.hash())
    };
    let (closest, any) = (hash(Query::Closest)?, hash(Query::Any)?);
    Ok(cell_hash(&[("closest", &closest), ("any", &any)]))
}

/// Counted work of every ray, from a kernel of its own.
///
/// # Errors
/// The kernel does not compile, or the device is lost or hangs.
pub fn count_work(
    gpu: &Gpu,
    scene: &SceneBuffers,
    traced: &Traced,
    query: Query,
    rays: &[Ray],
) -> Result<Vec<Counters>, GpuError> {
    let batch = Batch::compile(gpu, scene, traced, query, rays, true, true)?;
    batch.trace()?;
    let words: Vec<[u32; 8]> = gpu.read(&batch.output)?;
    let counters = words.iter().take(rays.len()).map(|w| Counters {
        nodes: w[0],
        box_tests: w[1],
        triangle_tests: w[2],
        stack_high_water: w[3],
    });
    Ok(counters.collect())
}
