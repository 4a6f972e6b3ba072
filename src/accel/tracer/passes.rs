//! The passes in which a structure answers a buffer of rays.

use super::{Query, RayBuffers, RefillParameters, Tracer};
use raystone_gpu::compaction::{CompactionMethod, Passes, Stream};
use raystone_gpu::{
    Bindings, Composition, GpuError, Groups, Pairs, RadixSort, Recording, Storage, UniformValues,
    grid_of,
};
use std::ops::Range;

/// A structure with its own passes, which may sort, compact, trace by level, and reorder.
pub trait TracePasses: Send + Sync {
    /// Additional buffers: kernel variable names and bytes, with unspecified initial content.
    fn scratch(&self, _rays: u32) -> Vec<(&'static str, u64)> {
        Vec::new()
    }
    /// True if the passes can count work; otherwise no counters are shown.
    fn counts_work(&self) -> bool {
        false
    }
    /// Records the passes that answer the rays of `steps`. With zero rays, passes are recorded for
    /// compilation only, and not played.
    ///
    /// # Errors
    /// A kernel does not compose or compile.
    fn record(&self, steps: &mut TraceSteps) -> Result<(), GpuError>;
}

/// An inline structure: one invocation per ray, or refilled invocations.
pub(super) struct OnePass(pub RefillParameters);

impl TracePasses for OnePass {
    fn counts_work(&self) -> bool {
        true
    }

    fn record(&self, steps: &mut TraceSteps) -> Result<(), GpuError> {
        let (ask, gpu) = (steps.tracer.ask, &steps.tracer.gpu);
        let refilled = self.0.applies(ask.coherent, gpu.is_software());
        let lanes = if refilled {
            self.0.lanes(steps.count, steps.lanes())
        } else {
            steps.count
        };
        let kernel = Composition::new("integrator/trace_rays").feature("refill", refilled);
        if refilled {
            steps.run_counted("trace", kernel, steps.groups(lanes), &Bindings::new())
        } else {
            steps.run_rays("trace", kernel, &Bindings::new())
        }
    }
}

/// Recorder of a structure's passes.
///
/// Kernels can bind: triangles, the structure's arrays and uniforms, its scratch, `rays`, `hits`
/// (or `work`), `status`, and the uniform `batch` with the members `first` and `count`.
pub struct TraceSteps<'a> {
    tracer: &'a Tracer,
    recording: &'a mut Recording,
    bindings: Bindings,
    row: u32,
    /// The first ray.
    pub first: u32,
    /// Number of rays; an upper bound if `live` is set.
    pub count: u32,
    /// The number of rays if stored on the device. A structure may answer the others too; kernels
    /// run by [`TraceSteps::run_rays`] skip them.
    pub live: Option<LiveRays>,
}

/// A ray count stored on the device.
#[derive(Debug, Clone)]
pub struct LiveRays {
    /// Words on the device.
    pub counts: Storage,
    /// Index of the count among them.
    pub word: u32,
    /// Workgroups for at least that many rays, with [`TraceSteps::lanes`] invocations each.
    pub groups: Groups,
}

impl<'a> TraceSteps<'a> {
    pub(super) fn new(
        tracer: &'a Tracer,
        recording: &'a mut Recording,
        buffers: &RayBuffers,
        range: Range<u32>,
        row: u32,
    ) -> Self {
        let (first, count) = (range.start, range.end - range.start);
        let mut bindings = tracer.bindings.clone();
        let answers = if tracer.ask.counters { "work" } else { "hits" };
        bindings
            .buffer("rays", &buffers.rays)
            .buffer("status", &buffers.status)
            .buffer(answers, &buffers.answers)
            .uniform("batch", rays_of_batch(first, count));
        Self {
            tracer,
            recording,
            bindings,
            row,
            first,
            count,
            live: None,
        }
    }

    pub(super) fn add_scratch(&mut self, name: &str, bytes: u64) {
        let scratch = Storage::scratch(&format!("trace {name}"), bytes);
        self.bindings.buffer(name, scratch);
    }

    /// The query for each ray.
    pub fn query(&self) -> Query {
        self.tracer.ask.query
    }

    /// The buffer of this name.
    ///
    /// # Errors
    /// There is none.
    pub fn storage(&self, name: &str) -> Result<Storage, GpuError> {
        let found = self.bindings.storage(name).cloned();
        found.ok_or_else(|| GpuError::Kernel(format!("a pass names the buffer `{name}`, which is neither scratch nor an array of the structure")))
    }

    /// Invocations per workgroup: 64 for structures with their own passes.
    pub fn lanes(&self) -> u32 {
        self.tracer.traced.workgroup.lanes()
    }

    /// Workgroups for a one-dimensional kernel with this many invocations.
    pub fn groups(&self, items: u32) -> [u32; 3] {
        let [x, y, z] = grid_of(items.div_ceil(self.lanes()));
        if x > self.row {
            [self.row, y * x.div_ceil(self.row), z]
        } else {
            [x, y, z]
        }
    }

    /// Fills a buffer with zeros.
    ///
    /// # Errors
    /// There is none of this name.
    pub fn clear(&mut self, name: &str) -> Result<(), GpuError> {
        let storage = self.storage(name)?;
        self.recording.clear(storage);
        Ok(())
    }

    /// Runs a one-dimensional kernel with an invocation per ray: for all of them, or, if the count
    /// is on the device, for about that many. The kernel then has the feature `counted` and reads
    /// the count from `live[batch.word]`. `batch` is that of [`TraceSteps::rays_from`] unless
    /// `special` overrides it.
    ///
    /// # Errors
    /// As [`TraceSteps::run`].
    pub fn run_rays(
        &mut self,
        name: &str,
        kernel: Composition,
        special: &Bindings,
    ) -> Result<(), GpuError> {
        let groups = match &self.live {
            Some(live) => live.groups.clone(),
            None => self.groups(self.count).into(),
        };
        self.run_counted(name, kernel, groups, special)
    }

    /// The same with this many workgroups, for kernels that share out the rays themselves.
    ///
    /// # Errors
    /// As [`TraceSteps::run`].
    pub(crate) fn run_counted(
        &mut self,
        name: &str,
        kernel: Composition,
        groups: impl Into<Groups>,
        special: &Bindings,
    ) -> Result<(), GpuError> {
        let Some(live) = &self.live else {
            return self.run(name, kernel, groups, special);
        };
        let mut bindings = Bindings::new();
        bindings
            .buffer("live", &live.counts)
            .uniform("batch", self.rays_from(self.first));
        let kernel = kernel.feature("counted", true);
        let name = format!("{name} live");
        self.run(&name, kernel, groups, &bindings.merged(special))
    }

    /// Sorts pairs of words by the lowest `bits` of the keys: see [`RadixSort::record`].
    ///
    /// # Errors
    /// A kernel does not compose or compile.
    pub fn sort(&mut self, pairs: &Pairs, bits: u32) -> Result<Pairs, GpuError> {
        let sort = RadixSort::new(&self.tracer.gpu)?;
        Ok(sort.record(self.recording, pairs, bits))
    }

    /// Compacts a stream.
    ///
    /// # Errors
    /// The adapter cannot run the method, or a kernel does not compose or compile.
    pub fn compact(&mut self, method: CompactionMethod, stream: &Stream) -> Result<(), GpuError> {
        let gpu = &self.tracer.gpu;
        let method = method.on(gpu)?;
        method.record(&mut Passes::new(gpu, self.recording, stream))
    }

    /// The uniform `batch` for the same number of rays, starting at `first`.
    pub fn rays_from(&self, first: u32) -> UniformValues {
        let batch = rays_of_batch(first, self.count);
        match &self.live {
            Some(live) => batch.u32("word", live.word),
            None => batch,
        }
    }

    /// Runs a kernel with the structure, the tests and the query. Bindings in `special` override
    /// those of the same name. A pass has one kernel: `name` decides.
    ///
    /// # Errors
    /// The kernel does not compose or compile.
    pub fn run(
        &mut self,
        name: &str,
        kernel: Composition,
        groups: impl Into<Groups>,
        special: &Bindings,
    ) -> Result<(), GpuError> {
        let pipeline = self.tracer.pipeline(name, kernel)?;
        let bindings = self.bindings.merged(special);
        self.recording.run(name, &pipeline, &bindings, groups);
        Ok(())
    }
}

/// The uniform `batch`: the range of rays for a kernel.
pub(crate) fn rays_of_batch(first: u32, count: u32) -> UniformValues {
    UniformValues::new().u32("first", first).u32("count", count)
}
