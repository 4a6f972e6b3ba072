//! Organisations with several kernels: camera, trace, shade, trace shadow rays, finish, and repeat;
//! finally the results are added to the sums.

use super::{Organisation, shading, sorting};
use crate::{ImageSteps, Integrator};
use raystone_accel::{LiveRays, Query};
use raystone_core::parameters;
use raystone_core::params::Params;
use raystone_gpu::compaction::{Compaction, CompactionMethod, Passes, Stays, Stream};
use raystone_gpu::{Bindings, Composition, GpuError, Groups, Storage, UniformValues, grid_of};

/// Rows of 16 bytes of a path: `PATH_ROWS` of `kernels/organisation/paths.wesl`.
const PATH_BYTES: u64 = 7 * 16;
/// Maximum batches per slice: a submission is limited in size, and should end within a second.
const BATCHES: u64 = 4;
/// Words of `counts`, as in `kernels/organisation/queue.wesl`.
const LIVE: u32 = 0;
const SHADOWS: u32 = 1;
/// Bytes of `counts`, with spare words.
const COUNTS_BYTES: u64 = 32;

parameters! {
    /// What is sorted.
    pub(crate) enum Sorting {
        Never = "none",
        /// Paths by the material they hit, before they are shaded.
        Material = "material",
        /// Rays by octant of the direction and Morton code of the origin, before they are traced.
        RayKey = "ray-key",
    }

    /// The number of shading kernels.
    pub(crate) enum Shading {
        /// One, with every kind of material of the scene.
        One = "one",
        /// One per kind of material, each with its own queue, and one for misses.
        PerMaterial = "per-material",
    }

    /// a kernel each for sampling, tracing and adding, run for all paths at every bounce, also for those that have
    /// ended (Dufay 2017, algorithm 3)
    pub(crate) struct MultiKernel {}

    /// queues of live paths and of shadow rays between kernels, kept dense by a compaction (Laine, Karras & Aila 2013)
    pub(crate) struct Wavefront {
        /// paths in flight at most; more wait for their turn
        capacity: u32 = 262_144, in 1024..=4_194_304;
        /// how the queue of live paths is kept without holes
        compaction: CompactionMethod = CompactionMethod::Auto;
        /// what is brought side by side: paths of one material, or rays of one direction and place
        sorting: Sorting = Sorting::Never;
        /// whether one kernel shades everything, or one each kind of material (BSDF), from a queue of its own
        shading: Shading = Shading::One;
        /// whether the slot of a path that has ended is taken by the next at once; else all in flight end first
        regeneration: bool = true;
    }
}

/// Shared state of a batch's passes.
pub(super) struct Queues<'a> {
    pub capacity: u32,
    lanes: u32,
    /// `None` if every bounce processes all slots.
    wavefront: Option<&'a Wavefront>,
    integrator: &'static str,
    pub bindings: Bindings,
}

impl<'a> Queues<'a> {
    fn new(
        steps: &ImageSteps,
        first: u32,
        wavefront: Option<&'a Wavefront>,
        integrator: &'static str,
    ) -> Self {
        let total = steps.count();
        let capacity = wavefront.map_or(total, |w| w.capacity.min(total)).max(1);
        let mut queues = Self {
            capacity,
            lanes: steps.shape().lanes(),
            wavefront,
            integrator,
            bindings: Bindings::new(),
        };
        for (name, bytes) in [
            ("paths", PATH_BYTES),
            ("rays", 64),
            ("answers", 32),
            ("queue", 4),
            ("flags", 4),
        ] {
            let scratch = queues.scratch(name, bytes * u64::from(capacity));
            queues.bindings.buffer(name, scratch);
        }
        for name in ["counts", "live_groups", "kept_count"] {
            let scratch = queues.scratch(name, COUNTS_BYTES);
            queues.bindings.buffer(name, scratch);
        }
        let results = queues.scratch("results", 16 * u64::from(total.max(1)));
        queues.bindings.buffer("results", results);
        let batch = UniformValues::new()
            .u32("capacity", capacity)
            .u32("total", total)
            .u32("first", first);
        queues.bindings.uniform("batch", batch);
        queues
    }

    pub(super) fn scratch(&self, name: &str, bytes: u64) -> Storage {
        Storage::scratch(&format!("image {name}"), bytes)
    }

    /// A kernel with the bindings of paths, queues and the integrator.
    pub(super) fn kernel(&self, entry: &str) -> Composition {
        let is = |of: fn(&Wavefront) -> bool| self.wavefront.is_some_and(of);
        Composition::new(entry)
            .with("integrator", self.integrator)
            .feature("queued", true)
            .feature("compacted", self.wavefront.is_some())
            .feature("regenerated", is(|w| w.regeneration))
            .feature("by_kind", is(|w| w.shading == Shading::PerMaterial))
            .feature("sorted_hits", is(|w| w.sorting == Sorting::Material))
    }

    /// An invocation per slot.
    pub(super) fn all(&self) -> Groups {
        grid_of(self.capacity.div_ceil(self.lanes)).into()
    }

    /// An invocation per live path.
    pub(super) fn live_groups(&self) -> Groups {
        match self.wavefront {
            Some(_) => Groups::Indirect(self.scratch("live_groups", COUNTS_BYTES), 0),
            None => self.all(),
        }
    }

    /// Number of rays in a half of `rays`.
    fn live(&self, word: u32) -> Option<LiveRays> {
        self.wavefront.map(|_| LiveRays {
            counts: self.scratch("counts", COUNTS_BYTES),
            word,
            groups: self.live_groups(),
        })
    }

    fn run(&self, steps: &mut ImageSteps, name: &str, groups: Groups) -> Result<(), GpuError> {
        let kernel = self.kernel(&format!("organisation/{name}"));
        steps.run(name, kernel, groups, &self.bindings)
    }

    fn trace(
        &self,
        steps: &mut ImageSteps,
        query: Query,
        half: u32,
        word: u32,
    ) -> Result<(), GpuError> {
        let buffers = ["rays", "answers"].map(|name| {
            let bytes = if name == "rays" { 64 } else { 32 };
            self.scratch(name, bytes * u64::from(self.capacity))
        });
        let range = half * self.capacity..(half + 1) * self.capacity;
        steps.trace_live(query, buffers, range, self.live(word))
    }

    /// Compacts flagged elements: words of `elements`, one per live path, are copied to `kept`, and
    /// their number to `count`.
    pub(super) fn keep(
        &self,
        steps: &mut ImageSteps,
        method: &dyn Compaction,
        stays: Stays,
        [elements, kept, count]: [&Storage; 3],
    ) -> Result<(), GpuError> {
        let gpu = steps.gpu().clone();
        let stream = Stream {
            capacity: self.capacity,
            element_bytes: 4,
            length: self.scratch("counts", COUNTS_BYTES),
            flags: self.scratch("flags", 4 * u64::from(self.capacity)),
            stays,
            elements: elements.clone(),
            kept: kept.clone(),
            count: count.clone(),
        };
        method.record(&mut Passes::new(&gpu, steps.recording(), &stream))
    }

    /// Compacts the slots of live paths.
    fn compact(&self, steps: &mut ImageSteps, wavefront: &Wavefront) -> Result<(), GpuError> {
        let place = steps.recording().len();
        let queue = self.scratch("queue", 4 * u64::from(self.capacity));
        let method = wavefront.compaction.on(steps.gpu())?;
        let kept = self.scratch("kept queue", 4 * u64::from(self.capacity));
        let count = self.scratch("kept_count", COUNTS_BYTES);
        self.keep(steps, &*method, Stays::All, [&queue, &kept, &count])?;
        steps.recording().copy(&kept, &queue);
        self.run(steps, "plan", Groups::Direct([1, 1, 1]))?;
        steps.recording().name_since(place, "compaction");
        Ok(())
    }

    /// Shades the hits, in this order if given.
    fn shade(&self, steps: &mut ImageSteps, order: Option<Storage>) -> Result<(), GpuError> {
        if let Some(wavefront) = self.wavefront
            && wavefront.shading == Shading::PerMaterial
        {
            return shading::by_kind(steps, self, wavefront, order);
        }
        let mut bindings = self.bindings.clone();
        if let Some(order) = order {
            bindings.buffer("order", order);
        }
        let kernel = self.kernel("organisation/shade");
        steps.run("shade", kernel, self.live_groups(), &bindings)
    }

    /// Answers the next ray of each live path.
    pub(super) fn trace_rays(&self, steps: &mut ImageSteps) -> Result<(), GpuError> {
        self.run(steps, "extend", self.live_groups())?;
        self.trace(steps, Query::Closest, 0, LIVE)
    }

    /// One ray of each live path.
    fn bounce(&self, steps: &mut ImageSteps) -> Result<(), GpuError> {
        let sorting = self.wavefront.map_or(Sorting::Never, |w| w.sorting);
        if sorting == Sorting::RayKey {
            sorting::by_ray(steps, self)?;
        }
        self.trace_rays(steps)?;
        let order = match sorting {
            Sorting::Material => Some(sorting::by_material(steps, self)?),
            _ => None,
        };
        self.shade(steps, order)?;
        self.trace(steps, Query::Any, 1, SHADOWS)?;
        self.run(steps, "finish", self.live_groups())?;
        match self.wavefront {
            Some(wavefront) => self.compact(steps, wavefront),
            None => Ok(()),
        }
    }
}

fn rays_of_path(integrator: &dyn Integrator, params: &Params) -> u32 {
    let constants = integrator.constants(params);
    let depth = constants.iter().find(|(name, _)| *name == "MAX_DEPTH");
    depth.map_or(1, |(_, depth)| depth + 1)
}

/// The first paths of a slice after their first bounce.
pub(super) fn begin_and_bounce<'a>(
    steps: &mut ImageSteps,
    wavefront: &'a Wavefront,
    integrator: &dyn Integrator,
) -> Result<Queues<'a>, GpuError> {
    let queues = Queues::new(steps, 0, Some(wavefront), integrator.kernel());
    queues.run(steps, "generate", queues.all())?;
    queues.bounce(steps)?;
    Ok(queues)
}

/// All batches of a slice; adds its results to the sums.
fn record(
    steps: &mut ImageSteps,
    wavefront: Option<&Wavefront>,
    integrator: &dyn Integrator,
    params: &Params,
) -> Result<(), GpuError> {
    let total = steps.count();
    let rays = rays_of_path(integrator, params);
    let mut first = 0;
    let results = loop {
        let queues = Queues::new(steps, first, wavefront, integrator.kernel());
        let batches = total.div_ceil(queues.capacity);
        if first == 0 {
            steps
                .recording()
                .clear(queues.scratch("results", 16 * u64::from(total.max(1))));
        }
        queues.run(steps, "generate", queues.all())?;
        // With regeneration no path waits while a slot is free, and none lives longer than its rays: all have ended
        // by then.
        let is_refilled = wavefront.is_some_and(|w| w.regeneration);
        let bounces = if is_refilled {
            batches.max(1) * rays
        } else {
            rays
        };
        for _ in 0..bounces {
            queues.bounce(steps)?;
        }
        first += queues.capacity;
        if is_refilled || first >= total {
            break queues;
        }
    };
    let kernel = results.kernel("organisation/accumulate");
    steps.run("accumulate", kernel, steps.pixels(), &results.bindings)
}

impl Organisation for MultiKernel {
    fn samples_at_once(&self, bytes: u64) -> u64 {
        bytes / PATH_BYTES
    }

    fn record(
        &self,
        steps: &mut ImageSteps,
        integrator: &dyn Integrator,
        params: &Params,
    ) -> Result<(), GpuError> {
        record(steps, None, integrator, params)
    }
}

impl Organisation for Wavefront {
    fn samples_at_once(&self, bytes: u64) -> u64 {
        (bytes / 16).min(u64::from(self.capacity) * BATCHES)
    }

    fn record(
        &self,
        steps: &mut ImageSteps,
        integrator: &dyn Integrator,
        params: &Params,
    ) -> Result<(), GpuError> {
        let (bytes, limit) = (
            u64::from(self.capacity) * PATH_BYTES,
            steps.gpu().limits.max_storage_buffer_binding_size,
        );
        if bytes > limit {
            return Err(GpuError::Kernel(format!(
                "wavefront with capacity = {}: {bytes} bytes of paths, and a buffer of this adapter has at most {limit}; at most {} fit",
                self.capacity,
                limit / PATH_BYTES
            )));
        }
        record(steps, Some(self), integrator, params)
    }
}
