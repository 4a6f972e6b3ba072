//! The passes in which a structure answers a buffer of rays.

use super::{Query, RayBuffers, RefillParameters, Tracer};
use raystone_gpu::{
    Bindings, Composition, GpuError, Groups, Recording, Storage, UniformValues, grid_of,
};
use std::ops::Range;

/// A structure that answers a buffer of rays in passes of its own: rays may be sorted, compacted, traced by
/// levels, and put back.
pub trait TracePasses: Send + Sync {
    /// Buffers that the passes need beside rays, answers and the structure's arrays, for so many rays:
    /// names of kernel variables, and bytes. What they hold at first is unspecified.
    fn scratch(&self, _rays: u32) -> Vec<(&'static str, u64)> {
        Vec::new()
    }
    /// Whether the passes count work where that is asked for; where not, no counters are shown.
    fn counts_work(&self) -> bool {
        false
    }
    /// Records the passes that answer the rays of `steps`. With no rays at all they are recorded, too, to
    /// be compiled, and not played.
    ///
    /// # Errors
    /// A kernel does not compose or compile.
    fn record(&self, steps: &mut TraceSteps) -> Result<(), GpuError>;
}

/// An inline structure: each ray by an invocation of its own, or by one that is refilled.
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

/// What passes are recorded with.
///
/// Kernels find bound: the canonical triangles, the structure's arrays and uniforms, its scratch, `rays`,
/// `hits` (or `work`), `status`, and the uniform `batch` with the members `first` and `count`.
pub struct TraceSteps<'a> {
    tracer: &'a Tracer,
    recording: &'a mut Recording,
    bindings: Bindings,
    row: u32,
    /// The first ray to be answered.
    pub first: u32,
    /// How many are; where the device knows better, at most.
    pub count: u32,
    /// How many of them there are, if that stands on the device. A structure may answer the others, too; kernels that are run by
    /// [`TraceSteps::run_rays`] leave them out.
    pub live: Option<LiveRays>,
}

/// How many rays of a buffer there are, where the device decides.
#[derive(Debug, Clone)]
pub struct LiveRays {
    /// Words on the device.
    pub counts: Storage,
    /// Which of them is the number.
    pub word: u32,
    /// Workgroups for as many rays or more: with as many invocations as the structure's kernels have, see
    /// [`TraceSteps::lanes`].
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

    /// What is asked of each ray.
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

    /// Invocations of a workgroup: 64 in the passes of structures that have their own.
    pub fn lanes(&self) -> u32 {
        self.tracer.traced.workgroup.lanes()
    }

    /// Workgroups for a kernel of one dimension with so many invocations.
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

    /// Runs a kernel of one dimension with an invocation per ray: for all of them, or, where the device knows how many there are, for
    /// about as many. It is composed with the feature `counted` then, and finds that number in `live[batch.word]`;
    /// `batch` is what [`TraceSteps::rays_from`] says, which `special` can say otherwise.
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

    /// The same in so many workgroups, for kernels that share the rays out among their invocations.
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

    /// The uniform `batch` for as many rays, the first of which stands there.
    pub fn rays_from(&self, first: u32) -> UniformValues {
        let batch = rays_of_batch(first, self.count);
        match &self.live {
            Some(live) => batch.u32("word", live.word),
            None => batch,
        }
    }

    /// Runs a kernel with the structure, the tests and the query in it. What `special` binds goes before
    /// the buffers and values of those names. A pass has one kernel: `name` decides.
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

/// The uniform `batch`: which rays of the buffer a kernel looks at.
pub(crate) fn rays_of_batch(first: u32, count: u32) -> UniformValues {
    UniformValues::new().u32("first", first).u32("count", count)
}
