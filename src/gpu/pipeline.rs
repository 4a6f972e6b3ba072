//! Pipelines, by reflection of the composed kernel.

use super::GpuError;
use super::adapter::Gpu;
use super::compose::{ComposedKernel, Composition};
#[cfg(not(target_family = "wasm"))]
use super::wait::wait_for;
use raystone_core::clock::Instant;
use std::collections::{BTreeMap, HashMap};
#[cfg(target_family = "wasm")]
use std::pin::Pin;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// Default edge of a workgroup of pixels, invocations.
pub const WORKGROUP_EDGE: u32 = 8;
/// Default invocations per workgroup of one-dimensional kernels.
pub const WORKGROUP_SIZE: u32 = WORKGROUP_EDGE * WORKGROUP_EDGE;

/// Texels in a row of an array that is read as a texture; same as in `kernels/common/texels.wesl`.
pub const TEXELS_PER_ROW: u32 = 8192;
pub(super) const TEXEL_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Uint;

/// Compiled pipelines by composition and runtime checks, then by the hash of the kernel library.
pub(super) type PipelineCache = HashMap<(Composition, bool), BTreeMap<String, Arc<Pipeline>>>;

#[derive(Debug, Clone, PartialEq)]
pub(super) enum BindingKind {
    Storage,
    Uniform {
        size: u32,
        members: Vec<(String, u32)>,
    },
    /// A storage array read as texels of `rgba32uint`, see [`super::Bindings::buffer`].
    Texels,
}

#[derive(Debug, Clone)]
pub(super) struct Binding {
    pub group: u32,
    pub binding: u32,
    pub name: String,
    pub kind: BindingKind,
}

/// A compute pipeline and its bindings.
pub struct Pipeline {
    /// The kernel.
    pub kernel: Arc<ComposedKernel>,
    runtime_checks: bool,
    /// Further compilations of the same text, from the second on.
    again: Mutex<BTreeMap<usize, Arc<Pipeline>>>,
    pub(super) compute: wgpu::ComputePipeline,
    pub(super) layouts: Vec<wgpu::BindGroupLayout>,
    pub(super) bindings: Vec<Binding>,
    /// Milliseconds of composition and of the driver's front end.
    made_ms: f64,
    /// Milliseconds of its first dispatch, which had no workgroups: see [`Pipeline::cold_ms`].
    pub(super) first_ms: OnceLock<f64>,
    complaint: Complaint,
}

/// What the driver said of a kernel: known at once, in a browser only when awaited.
struct Complaint {
    #[cfg(target_family = "wasm")]
    pending: Mutex<Option<OfOneThread<(String, Pending)>>>,
}

#[cfg(target_family = "wasm")]
type Pending = Pin<Box<dyn Future<Output = Option<wgpu::Error>>>>;

/// A value of the browser that never leaves its thread.
#[cfg(target_family = "wasm")]
struct OfOneThread<T>(T);

// SAFETY: without atomics a wasm module has one thread; wgpu's own handles are `Send` there for the same reason.
#[cfg(all(target_family = "wasm", not(target_feature = "atomics")))]
unsafe impl<T> Send for OfOneThread<T> {}

#[cfg(not(target_family = "wasm"))]
impl Complaint {
    fn new(label: String, scope: wgpu::ErrorScopeGuard) -> Result<Self, GpuError> {
        match wait_for(scope.pop()) {
            Some(error) => Err(refused(&label, &error)),
            None => Ok(Self {}),
        }
    }

    async fn told(&self) -> Result<(), GpuError> {
        Ok(())
    }
}

#[cfg(target_family = "wasm")]
impl Complaint {
    fn new(label: String, scope: wgpu::ErrorScopeGuard) -> Result<Self, GpuError> {
        let pending = OfOneThread((label, Box::pin(scope.pop()) as _));
        Ok(Self {
            pending: Mutex::new(Some(pending)),
        })
    }

    async fn told(&self) -> Result<(), GpuError> {
        let pending = self.pending.lock();
        let pending = pending.unwrap_or_else(PoisonError::into_inner).take();
        match pending {
            None => Ok(()),
            Some(OfOneThread((label, scope))) => match scope.await {
                Some(error) => Err(refused(&label, &error)),
                None => Ok(()),
            },
        }
    }
}

fn refused(label: &str, error: &wgpu::Error) -> GpuError {
    GpuError::Driver(format!("kernel `{label}`: {error}"))
}

pub(super) fn reflect(kernel: &ComposedKernel) -> Vec<Binding> {
    let module = &kernel.module;
    let entries = 0..module.entry_points.len();
    let entries: Vec<_> = entries.map(|e| kernel.info.get_entry_point(e)).collect();
    let mut bindings = Vec::new();
    for (handle, variable) in module.global_variables.iter() {
        let Some(at) = &variable.binding else {
            continue;
        };
        if entries.iter().all(|entry| entry[handle].is_empty()) {
            continue;
        }
        let name = kernel
            .author_name(variable.name.as_deref().unwrap_or(""))
            .to_owned();
        let kind = match variable.space {
            naga::AddressSpace::Uniform => {
                let inner = &module.types[variable.ty].inner;
                let naga::TypeInner::Struct { members, span } = inner else {
                    continue;
                };
                let members = members
                    .iter()
                    .map(|m| (m.name.clone().unwrap_or_default(), m.offset))
                    .collect();
                BindingKind::Uniform {
                    size: span.next_multiple_of(16),
                    members,
                }
            }
            naga::AddressSpace::Storage { .. } => BindingKind::Storage,
            naga::AddressSpace::Handle => BindingKind::Texels,
            _ => continue,
        };
        bindings.push(Binding {
            group: at.group,
            binding: at.binding,
            name,
            kind,
        });
    }
    bindings
}

impl Gpu {
    /// The pipeline of a composition, compiled at most once.
    ///
    /// # Errors
    /// The kernel does not compose or validate, or the driver refuses it.
    pub fn pipeline(
        &self,
        composition: &Composition,
        runtime_checks: bool,
    ) -> Result<Arc<Pipeline>, GpuError> {
        let mut composition = composition.clone();
        if self.loop_limit.is_some() {
            composition = composition.feature("loops_cut", true);
        }
        if self.samples_texels {
            composition = composition.feature("sampled_texels", true);
        }
        let key = (composition, runtime_checks);
        let library = self.kernels.hash();
        let known = |is_it: &dyn Fn(&str, &Pipeline) -> bool| {
            let cache = self.pipelines.lock().ok()?;
            let mut known = cache.get(&key)?.iter();
            known.find_map(|(library, p)| is_it(library, p).then(|| Arc::clone(p)))
        };
        if let Some(pipeline) = known(&|other, _| other == library) {
            self.note_modules(&pipeline.kernel);
            return Ok(pipeline);
        }
        let start = Instant::now();
        let kernel = self.kernels.compose(&key.0)?;
        self.note_modules(&kernel);
        let is_it = |pipeline: &Pipeline| pipeline.kernel.wgsl == kernel.wgsl;
        let shared = self.compilations() == 1;
        let pipeline = match known(&|_, pipeline| shared && is_it(pipeline)) {
            Some(pipeline) => pipeline,
            None => Arc::new(self.compile(Arc::new(kernel), runtime_checks, start)?),
        };
        if let Ok(mut cache) = self.pipelines.lock() {
            let known = cache.entry(key).or_default();
            known.insert(library.to_owned(), Arc::clone(&pipeline));
        }
        Ok(pipeline)
    }

    /// The selected compilation of a kernel. Drivers give each its own place in memory.
    pub(super) fn in_turn(&self, first: &Arc<Pipeline>) -> Result<Arc<Pipeline>, GpuError> {
        let turn = self.turn();
        if turn == 0 {
            return Ok(Arc::clone(first));
        }
        let mut again = first.again.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = again.get(&turn) {
            return Ok(Arc::clone(known));
        }
        let kernel = Arc::clone(&first.kernel);
        let made = Arc::new(self.compile(kernel, first.runtime_checks, Instant::now())?);
        again.insert(turn, Arc::clone(&made));
        Ok(made)
    }

    pub(super) fn note_modules(&self, kernel: &ComposedKernel) {
        let Ok(mut used) = self.used.lock() else {
            return;
        };
        for name in &kernel.modules {
            let hash = self.kernels.text_hash(name);
            used.insert(self.kernels.marked(name), hash);
        }
    }

    /// The modules of all kernels requested since the last call, on this device and its clones:
    /// [marked](super::KernelLibrary::marked) names and [hashes of
    /// texts](super::KernelLibrary::text_hash).
    pub fn take_modules(&self) -> BTreeMap<String, String> {
        let used = self.used.lock();
        used.map(|mut used| std::mem::take(&mut *used))
            .unwrap_or_default()
    }

    fn compile(
        &self,
        kernel: Arc<ComposedKernel>,
        runtime_checks: bool,
        start: Instant,
    ) -> Result<Pipeline, GpuError> {
        let bindings = reflect(&kernel);
        let storage = |b: &&Binding| b.kind == BindingKind::Storage;
        let needed = bindings.iter().filter(storage).count() as u64;
        let limit = u64::from(self.limits.max_storage_buffers_per_shader_stage);
        if needed > limit {
            return Err(GpuError::TooManyBuffers {
                kernel: kernel.composition.entry.clone(),
                needed,
                limit,
            });
        }
        self.check_workgroup(&kernel)?;
        let label = kernel.composition.entry.clone();
        let scope = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let module = self.shader_module(&label, &kernel.wgsl, runtime_checks);
        let compute = self
            .device
            .create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(&label),
                layout: None,
                module: &module,
                entry_point: None,
                compilation_options: wgpu::PipelineCompilationOptions {
                    // Kernels write workgroup memory before they read it.
                    zero_initialize_workgroup_memory: false,
                    ..Default::default()
                },
                cache: None,
            });
        let complaint = Complaint::new(label, scope)?;
        let groups = bindings.iter().map(|b| b.group + 1).max().unwrap_or(0);
        let layouts = (0..groups).map(|group| compute.get_bind_group_layout(group));
        Ok(Pipeline {
            layouts: layouts.collect(),
            kernel,
            runtime_checks,
            again: Mutex::default(),
            compute,
            bindings,
            made_ms: start.elapsed().as_secs_f64() * 1e3,
            first_ms: OnceLock::new(),
            complaint,
        })
    }

    fn check_workgroup(&self, kernel: &ComposedKernel) -> Result<(), GpuError> {
        let module = &kernel.module;
        let [x, y, z] = module.entry_points[0].workgroup_size;
        let used = kernel.info.get_entry_point(0);
        let shared = module.global_variables.iter().filter(|(handle, variable)| {
            variable.space == naga::AddressSpace::WorkGroup && !used[*handle].is_empty()
        });
        let bytes = |ty: naga::Handle<naga::Type>| module.types[ty].inner.size(module.to_ctx());
        let shared: u64 = shared.map(|(_, v)| u64::from(bytes(v.ty))).sum();
        let limits = &self.limits;
        let all = u64::from(x) * u64::from(y) * u64::from(z);
        let most = limits.max_compute_invocations_per_workgroup;
        for (what, needed, limit) in [
            (
                "invocations across",
                x.into(),
                limits.max_compute_workgroup_size_x,
            ),
            (
                "invocations down",
                y.into(),
                limits.max_compute_workgroup_size_y,
            ),
            ("invocations", all, most),
            (
                "bytes of memory",
                shared,
                limits.max_compute_workgroup_storage_size,
            ),
        ] {
            if needed > u64::from(limit) {
                return Err(GpuError::WorkgroupTooLarge {
                    kernel: kernel.composition.entry.clone(),
                    what,
                    needed,
                    limit: limit.into(),
                });
            }
        }
        Ok(())
    }

    fn shader_module(&self, label: &str, wgsl: &str, runtime_checks: bool) -> wgpu::ShaderModule {
        let descriptor = wgpu::ShaderModuleDescriptor {
            label: Some(label),
            source: wgpu::ShaderSource::Wgsl(wgsl.into()),
        };
        if runtime_checks {
            return self.device.create_shader_module(descriptor);
        }
        let checks = wgpu::ShaderRuntimeChecks::unchecked();
        // SAFETY: reached only for kernels whose checked module passed the correctness check on
        // this scene and adapter: no access out of bounds occurred and every loop has a fuse.
        unsafe { self.device.create_shader_module_trusted(descriptor, checks) }
    }
}

impl Pipeline {
    /// Number of compilations so far: see [`Gpu::compiled_apart`].
    pub fn compilations(&self) -> usize {
        1 + self.again.lock().map_or(0, |again| again.len())
    }

    /// Milliseconds of this kernel's first use: composition, the driver's front end, and a dispatch
    /// of no workgroups, in which Mesa's `llvmpipe` does all its compiling (for a path tracer a
    /// second there, a tenth of one before). `None` until then; no other time contains it.
    pub fn cold_ms(&self) -> Option<f64> {
        Some(self.made_ms + self.first_ms.get()?)
    }

    /// What the driver said of the kernel, if it was not known when it was made.
    pub(super) async fn complaint(&self) -> Result<(), GpuError> {
        self.complaint.told().await
    }

    pub(super) fn unbound<'a>(
        &self,
        binding: &str,
        known: impl Iterator<Item = &'a String>,
    ) -> GpuError {
        GpuError::Unbound {
            kernel: self.kernel.composition.entry.clone(),
            binding: binding.to_owned(),
            known: known.cloned().collect::<Vec<_>>().join(", "),
        }
    }
}
