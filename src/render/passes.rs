//! The passes in which an integrator adds samples to an image.

use super::render::with_sampler;
use super::scene_kinds::SceneKinds;
use super::slice::Slice;
use super::tables::{SceneBuffers, SceneFeatures};
use super::visibility::Visibility;
use super::{RenderJob, Traced};
use raystone_accel::tracer::RayBuffers;
use raystone_accel::{Ask, GroupShape, LiveRays, Query, Tracer, TriangleBuffers};
use raystone_core::structure::RAY_QUERIES;
use raystone_gpu::{
    Bindings, Composition, Gpu, GpuError, Groups, Pipeline, Recording, Storage, UniformValues,
};
use raystone_scene::MaterialKind;
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::sync::Arc;

/// Composition and bindings of a job's passes, and the compiled ones.
pub(super) struct Passes {
    gpu: Gpu,
    /// All choices except the entry.
    chosen: Composition,
    bindings: Bindings,
    triangles: TriangleBuffers,
    traced: Traced,
    runtime_checks: bool,
    /// The rasterised start of paths that trace no first ray.
    pub visibility: Option<Visibility>,
    bounds: [[f32; 3]; 2],
    scene: SceneFeatures,
    /// Features that some scenes need but this kernel omits; empty if nothing is traced.
    left_out: Vec<&'static str>,
    pipelines: RefCell<BTreeMap<String, Arc<Pipeline>>>,
    /// Tracers for buffers of rays, by query name.
    tracers: RefCell<BTreeMap<String, Arc<Tracer>>>,
}

impl Passes {
    pub(crate) fn new(
        gpu: &Gpu,
        scene: &SceneBuffers,
        traced: &Traced,
        job: &RenderJob,
        status: &wgpu::Buffer,
        [ray_counts, by_blocks]: [bool; 2],
    ) -> Result<Self, GpuError> {
        let table = gpu.storage("sampler_table", job.sampler.table.words())?;
        let mut bindings = scene.bindings.clone();
        let chosen = scene.triangles.intersection.activate(Composition::new(""));
        let mut chosen = job.offset.activate(chosen);
        // Kernels that call no structure are the same with all of them.
        if job.integrator.facts.needs_inline {
            bindings = bindings.merged(&traced.bindings);
            chosen = traced.compose(chosen);
        }
        // A listed block is one workgroup.
        let shape = if by_blocks {
            GroupShape::default()
        } else {
            traced.workgroup
        };
        let mut chosen = with_sampler(shape.activate(chosen), job.sampler)
            .feature("ray_counts", ray_counts)
            .feature("block_list", by_blocks);
        let of_integrator = job.integrator.kind.features(&job.integrator.params);
        let mut left_out: Vec<&str> = Vec::new();
        let of_scene = scene.features.flags();
        for (name, on) in of_scene.iter().copied().chain(of_integrator) {
            chosen = chosen.feature(name, on);
        }
        if job.integrator.facts.traces() {
            let names = of_scene.iter().map(|(name, _)| *name);
            left_out.extend(names.filter(|name| !chosen.features.contains(*name)));
        }
        for (name, value) in job.integrator.kind.constants(&job.integrator.params) {
            chosen = chosen.constant(name, value);
        }
        let chosen = bindings.compose(scene.features.activate(chosen));
        bindings
            .buffer("status", status)
            .buffer("sampler_table", &table);
        let visibility = if job.integrator.facts.is_rasterised {
            Some(Visibility::new(gpu, scene, traced.space, job.size)?)
        } else {
            None
        };
        if let Some(visibility) = &visibility {
            visibility.draw(job.camera)?;
            bindings.buffer("visible", visibility.words());
        }
        Ok(Self {
            gpu: gpu.clone(),
            chosen,
            bindings,
            triangles: scene.triangles.clone(),
            traced: traced.clone(),
            runtime_checks: job.runtime_checks,
            visibility,
            bounds: scene.bounds,
            scene: scene.features.clone(),
            left_out,
            pipelines: RefCell::default(),
            tracers: RefCell::default(),
        })
    }

    /// The kernel of a pass, composed with all choices except these features.
    fn pipeline(
        &self,
        pass: &str,
        kernel: Composition,
        unneeded: &[&str],
    ) -> Result<Arc<Pipeline>, GpuError> {
        if let Some(pipeline) = self.pipelines.borrow().get(pass) {
            return Ok(Arc::clone(pipeline));
        }
        let mut all = self.chosen.clone();
        all.features.retain(|name| !unneeded.contains(&&**name));
        all.entry = kernel.entry;
        all.active.extend(kernel.active);
        all.features.extend(kernel.features);
        all.constants.extend(kernel.constants);
        let pipeline = self.gpu.pipeline(&all, self.runtime_checks)?;
        let mut known = self.pipelines.borrow_mut();
        known.insert(pass.to_owned(), Arc::clone(&pipeline));
        Ok(pipeline)
    }

    fn tracer(&self, query: Query) -> Result<Arc<Tracer>, GpuError> {
        let name = format!("trace {query:?}").to_lowercase();
        if let Some(tracer) = self.tracers.borrow().get(&name) {
            return Ok(Arc::clone(tracer));
        }
        let ask = Ask {
            runtime_checks: self.runtime_checks,
            ..query.into()
        };
        let tracer = Tracer::new(&self.gpu, &self.triangles, &self.traced, ask)?;
        let tracer = Arc::new(tracer);
        self.tracers.borrow_mut().insert(name, Arc::clone(&tracer));
        Ok(tracer)
    }

    pub(crate) fn features(&self) -> Vec<String> {
        let mut all = BTreeSet::new();
        for pipeline in self.pipelines.borrow().values() {
            all.extend(pipeline.kernel.composition.features.iter().cloned());
        }
        for tracer in self.tracers.borrow().values() {
            all.extend(tracer.features());
        }
        all.into_iter().collect()
    }

    /// Features that other scenes need but these kernels omit.
    pub(crate) fn left_out(&self) -> Vec<String> {
        self.left_out
            .iter()
            .map(|name| (*name).to_owned())
            .collect()
    }

    /// Text of every composed kernel, by pass name.
    pub(crate) fn texts(&self) -> Vec<(String, String)> {
        let pipelines = self.pipelines.borrow();
        let mut texts: Vec<_> = pipelines
            .iter()
            .map(|(pass, pipeline)| (pass.clone(), pipeline.kernel.wgsl.clone()))
            .collect();
        for (name, tracer) in self.tracers.borrow().iter() {
            let of_passes = tracer.kernel_texts().into_iter();
            texts.extend(of_passes.map(|text| (name.clone(), text)));
        }
        texts
    }
}

/// Recorder of passes that add the samples of a slice, some rows of the image, to the sums.
///
/// Kernels can bind: the scene data for shading, `sampler_table`, `status`, `accumulation` (the
/// sums of a band of rows), the uniform `frame` (`kernels/integrator/frame.wesl`), and the scratch.
pub struct ImageSteps<'a> {
    passes: &'a Passes,
    recording: &'a mut Recording,
    bindings: Bindings,
    /// Width of the image, pixels.
    pub width: u32,
    /// Rows of the slice.
    pub rows: u32,
    /// Samples per pixel of the slice.
    pub samples: u32,
    /// True if the slice consists of listed blocks instead of rows.
    by_blocks: bool,
}

impl<'a> ImageSteps<'a> {
    /// Steps for a slice of a job with these sums and scratch.
    pub(super) fn new(
        passes: &'a Passes,
        recording: &'a mut Recording,
        (width, of_job): (u32, &UniformValues),
        slice: &Slice,
        sums: &wgpu::Buffer,
        scratch: &[(&'static str, u64)],
        blocks: Option<&wgpu::Buffer>,
    ) -> Self {
        let mut bindings = passes.bindings.clone();
        bindings
            .buffer("accumulation", sums)
            .uniform("frame", slice.uniform(of_job));
        if let Some(blocks) = blocks {
            bindings.buffer("block_list", blocks);
        }
        let count = u64::from(width) * u64::from(slice.rows) * u64::from(slice.samples);
        for (name, bytes) in scratch {
            let storage = Storage::scratch(&format!("image {name}"), bytes * count.max(1));
            bindings.buffer(name, storage);
        }
        Self {
            passes,
            recording,
            bindings,
            width,
            rows: slice.rows,
            samples: slice.samples,
            by_blocks: blocks.is_some(),
        }
    }

    /// Number of samples in the slice.
    pub fn count(&self) -> u32 {
        self.width * self.rows * self.samples
    }

    /// Workgroups of 8 × 8 invocations, one per pixel of the slice.
    pub fn pixels(&self) -> [u32; 3] {
        if self.by_blocks {
            [self.rows, 1, 1]
        } else {
            GroupShape::default().over(self.width, self.rows)
        }
    }

    /// The same for kernels with workgroups of `GROUP_WIDTH` × `GROUP_HEIGHT` invocations.
    pub(crate) fn pixel_groups(&self) -> [u32; 3] {
        if self.by_blocks {
            self.pixels()
        } else {
            self.shape().over(self.width, self.rows)
        }
    }

    /// The shape of these workgroups.
    pub fn shape(&self) -> GroupShape {
        self.passes.traced.workgroup
    }

    /// The buffer of this name.
    ///
    /// # Errors
    /// There is none.
    pub fn storage(&self, name: &str) -> Result<Storage, GpuError> {
        let found = self.bindings.storage(name).cloned();
        found.ok_or_else(|| {
            GpuError::Kernel(format!(
                "a pass names the buffer `{name}`, which is neither scratch nor of the scene"
            ))
        })
    }

    /// Answers the first `count` rays of a buffer (32 bytes each: origin, `t_min`, direction,
    /// `t_max`), inline or in the structure's passes. Answers have 16 bytes: a hit, or 1 or 0 for
    /// any hit.
    ///
    /// # Errors
    /// A kernel does not compose or compile, or there is no such buffer.
    pub fn trace(
        &mut self,
        query: Query,
        (rays, answers): (&str, &str),
        count: u32,
    ) -> Result<(), GpuError> {
        let buffers = RayBuffers {
            rays: self.storage(rays)?,
            answers: self.storage(answers)?,
            status: self.storage("status")?,
        };
        self.trace_buffers(query, &buffers, 0..count, None)
    }

    /// The same for a range of rays, whose number may be stored on the device.
    ///
    /// # Errors
    /// As [`ImageSteps::trace`].
    pub(crate) fn trace_live(
        &mut self,
        query: Query,
        [rays, answers]: [Storage; 2],
        range: Range<u32>,
        live: Option<LiveRays>,
    ) -> Result<(), GpuError> {
        let buffers = RayBuffers {
            rays,
            answers,
            status: self.storage("status")?,
        };
        self.trace_buffers(query, &buffers, range, live)
    }

    /// All passes are timed under [`RAY_QUERIES`].
    fn trace_buffers(
        &mut self,
        query: Query,
        buffers: &RayBuffers,
        range: Range<u32>,
        live: Option<LiveRays>,
    ) -> Result<(), GpuError> {
        let place = self.recording.len();
        let tracer = self.passes.tracer(query)?;
        tracer.record_live(self.recording, buffers, range, live)?;
        let name = match query {
            Query::Closest => RAY_QUERIES[0],
            Query::Any => RAY_QUERIES[1],
        };
        self.recording.name_since(place, name);
        Ok(())
    }

    /// The device.
    pub fn gpu(&self) -> &'a Gpu {
        &self.passes.gpu
    }

    /// The recording, for passes from elsewhere.
    pub fn recording(&mut self) -> &mut Recording {
        self.recording
    }

    /// Corners of the scene's box.
    pub fn bounds(&self) -> [[f32; 3]; 2] {
        self.passes.bounds
    }

    pub(crate) fn material_kinds(&self) -> &SceneKinds<MaterialKind> {
        &self.passes.scene.materials
    }

    /// Runs a kernel, composed with the job's sampler, scene, constants and, if the integrator
    /// needs it inline, structure. Bindings in `special` override those of the same name. A pass
    /// has one kernel: `name` decides.
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
        self.run_without(&[], name, kernel, groups.into(), special)
    }

    /// The same with a kernel for surfaces of one kind of material, by its number, or for misses
    /// only: it is composed without the features of others.
    ///
    /// # Errors
    /// As [`ImageSteps::run`].
    pub(crate) fn run_on(
        &mut self,
        kind: Option<usize>,
        name: &str,
        kernel: Composition,
        groups: impl Into<Groups>,
        special: &Bindings,
    ) -> Result<(), GpuError> {
        let unneeded = self.passes.scene.unneeded(kind);
        self.run_without(&unneeded, name, kernel, groups.into(), special)
    }

    fn run_without(
        &mut self,
        unneeded: &[&str],
        name: &str,
        kernel: Composition,
        groups: Groups,
        special: &Bindings,
    ) -> Result<(), GpuError> {
        let pipeline = self.passes.pipeline(name, kernel, unneeded)?;
        let bindings = self.bindings.merged(special);
        self.recording.run(name, &pipeline, &bindings, groups);
        Ok(())
    }
}
