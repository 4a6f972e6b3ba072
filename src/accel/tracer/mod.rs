//! Tracing: a buffer of rays in, a buffer of answers out, for any structure.
//!
//! A structure is either *inline*, a kernel module with `closest_hit` and `any_hit` that other
//! kernels import, or a *pipeline*, an object that records passes to answer a buffer of rays
//! ([`TracePasses`]). To a [`Tracer`], an inline structure is a pipeline of one pass.

mod batch;
mod load;
mod passes;
pub(crate) mod refill;
mod traced;
mod workgroup;

pub use batch::{Answers, RayBatch, count_work, count_work_async};
pub use load::{Load, LoadRegistry};
pub use passes::{LiveRays, TracePasses, TraceSteps};
pub(crate) use refill::Refill;
pub use refill::RefillParameters;
pub use traced::{Traced, TriangleBuffers};
pub use workgroup::{GroupShape, Workgroup, WorkgroupRegistry};

use raystone_core::text::cell_hash;
use raystone_gpu::{Bindings, Composition, Gpu, GpuError, Pipeline, Recording, Storage};
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

/// The query for each ray.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Query {
    /// The nearest hit.
    Closest,
    /// Any hit.
    Any,
}

/// Options of a tracer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ask {
    /// The query for each ray.
    pub query: Query,
    /// Counts work and stores it with the answers.
    pub counters: bool,
    /// True if neighbouring rays are similar: see `Auto`.
    pub coherent: bool,
    /// Enables the driver's runtime checks.
    pub runtime_checks: bool,
}

impl From<Query> for Ask {
    /// Answers only, with runtime checks, for rays that are not coherent.
    fn from(query: Query) -> Self {
        Self {
            query,
            counters: false,
            coherent: false,
            runtime_checks: true,
        }
    }
}

/// Buffers of rays and answers.
#[derive(Debug, Clone)]
pub struct RayBuffers {
    /// 32 bytes per ray: origin, `t_min`, direction, `t_max`.
    pub rays: Storage,
    /// 16 bytes per ray: a hit (`t`, triangle, u, v), or 1 or 0 and zeros for [`Query::Any`]; 32 if
    /// work is counted, counters first.
    pub answers: Storage,
    /// At least 4 bytes: the kernels' error word, to which bits are added.
    pub status: Storage,
}

/// Answers buffers of rays through one structure.
pub struct Tracer {
    gpu: Gpu,
    ask: Ask,
    triangles: TriangleBuffers,
    traced: Traced,
    bindings: Bindings,
    pipelines: Mutex<BTreeMap<String, Arc<Pipeline>>>,
}

impl Tracer {
    /// Compiles the kernels for the query.
    ///
    /// # Errors
    /// A kernel does not compose or compile, or the structure does not count the requested work.
    pub fn new(
        gpu: &Gpu,
        triangles: &TriangleBuffers,
        traced: &Traced,
        ask: impl Into<Ask>,
    ) -> Result<Self, GpuError> {
        let tracer = Self {
            gpu: gpu.clone(),
            ask: ask.into(),
            triangles: triangles.clone(),
            traced: traced.clone(),
            bindings: triangles.bindings.merged(&traced.bindings),
            pipelines: Mutex::default(),
        };
        if tracer.ask.counters && !tracer.counts_work() {
            let text = "this structure declares that it counts no work";
            return Err(GpuError::Kernel(text.to_owned()));
        }
        let nothing = || Storage::scratch("nothing", 16);
        let buffers = RayBuffers {
            rays: nothing(),
            answers: nothing(),
            status: nothing(),
        };
        tracer.record(&mut Recording::new(), &buffers, 0..0)?;
        Ok(tracer)
    }

    /// True if the structure can count its work.
    pub fn counts_work(&self) -> bool {
        self.traced.passes.counts_work()
    }

    /// Adds the passes that answer rays `range.start … range.end − 1` of the buffers; each answer
    /// is stored at the index of its ray.
    ///
    /// # Errors
    /// A kernel does not compose or compile, or a pass uses an unknown buffer.
    pub fn record(
        &self,
        recording: &mut Recording,
        buffers: &RayBuffers,
        range: Range<u32>,
    ) -> Result<(), GpuError> {
        self.record_live(recording, buffers, range, None)
    }

    /// The same, with the number of rays on the device.
    ///
    /// # Errors
    /// As [`Tracer::record`].
    pub fn record_live(
        &self,
        recording: &mut Recording,
        buffers: &RayBuffers,
        range: Range<u32>,
        live: Option<LiveRays>,
    ) -> Result<(), GpuError> {
        let mut steps = TraceSteps::new(self, recording, buffers, range, u32::MAX);
        steps.live = live;
        self.record_steps(steps)
    }

    /// [`Tracer::record`] with a limit on the workgroups in a row.
    fn record_in_rows(
        &self,
        recording: &mut Recording,
        buffers: &RayBuffers,
        range: Range<u32>,
        row: u32,
    ) -> Result<(), GpuError> {
        self.record_steps(TraceSteps::new(self, recording, buffers, range, row))
    }

    fn record_steps(&self, mut steps: TraceSteps) -> Result<(), GpuError> {
        let passes = Arc::clone(&self.traced.passes);
        for (name, bytes) in passes.scratch(steps.count) {
            steps.add_scratch(name, bytes);
        }
        passes.record(&mut steps)
    }

    /// The pipeline of a pass: composed with the structure, the tests and the query.
    fn pipeline(&self, pass: &str, kernel: Composition) -> Result<Arc<Pipeline>, GpuError> {
        let mut known = self
            .pipelines
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        if let Some(pipeline) = known.get(pass) {
            return Ok(Arc::clone(pipeline));
        }
        let kernel = self
            .traced
            .compose(self.triangles.intersection.activate(kernel));
        let kernel = kernel
            .feature("any", self.ask.query == Query::Any)
            .feature("counters", self.ask.counters);
        let kernel = self.bindings.compose(kernel);
        let pipeline = self.gpu.pipeline(&kernel, self.ask.runtime_checks)?;
        known.insert(pass.to_owned(), Arc::clone(&pipeline));
        Ok(pipeline)
    }

    fn pipelines(&self) -> BTreeMap<String, Arc<Pipeline>> {
        let known = self.pipelines.lock();
        known.unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Feature flags of the kernels.
    pub fn features(&self) -> Vec<String> {
        let pipelines = self.pipelines();
        let all = pipelines.values();
        let mut all: Vec<String> = all
            .flat_map(|p| p.kernel.composition.features.iter().cloned())
            .collect();
        all.sort();
        all.dedup();
        all
    }

    /// Texts of the composed kernels.
    pub fn kernel_texts(&self) -> Vec<String> {
        let pipelines = self.pipelines();
        pipelines.values().map(|p| p.kernel.wgsl.clone()).collect()
    }

    /// Milliseconds of the first use of each pass's kernel, after it; see [`Pipeline::cold_ms`].
    pub fn cold_ms(&self) -> Vec<(String, Option<f64>)> {
        let pipelines = self.pipelines();
        let entries = pipelines.into_iter();
        entries.map(|(pass, p)| (pass, p.cold_ms())).collect()
    }

    fn hash(&self) -> String {
        let hashes: Vec<(String, String)> = self
            .pipelines()
            .into_iter()
            .map(|(pass, p)| (pass, p.kernel.hash()))
            .collect();
        match &hashes[..] {
            [(_, only)] => only.clone(),
            all => {
                let parts: Vec<_> = all.iter().map(|(p, h)| (p.as_str(), h.as_str())).collect();
                cell_hash(&parts)
            }
        }
    }
}

/// BLAKE3 of the kernels that answer both queries through a structure.
///
/// # Errors
/// A kernel does not compile.
pub fn kernel_hash(
    gpu: &Gpu,
    triangles: &TriangleBuffers,
    traced: &Traced,
) -> Result<String, GpuError> {
    let hash = |query: Query| Ok::<_, GpuError>(Tracer::new(gpu, triangles, traced, query)?.hash());
    let (closest, any) = (hash(Query::Closest)?, hash(Query::Any)?);
    Ok(cell_hash(&[("closest", &closest), ("any", &any)]))
}
