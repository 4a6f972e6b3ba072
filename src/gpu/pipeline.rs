//! Pipelines and bind groups, by reflection of the composed kernel.

use super::GpuError;
use super::adapter::Gpu;
use super::compose::{ComposedKernel, Composition};
use super::uniform::UniformValues;
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

/// Invocations per workgroup of every one-dimensional kernel.
pub const WORKGROUP_SIZE: u32 = 64;

/// Compiled pipelines by composition and runtime checks.
pub(super) type PipelineCache = HashMap<(Composition, bool), Arc<Pipeline>>;

#[derive(Debug, Clone, PartialEq)]
enum BindingKind {
    Storage {
        writable: bool,
    },
    Uniform {
        size: u32,
        members: Vec<(String, u32)>,
    },
}

#[derive(Debug, Clone)]
struct Binding {
    group: u32,
    binding: u32,
    name: String,
    kind: BindingKind,
}

/// A compute pipeline with what it binds.
pub struct Pipeline {
    /// The kernel.
    pub kernel: ComposedKernel,
    pub(super) compute: wgpu::ComputePipeline,
    layouts: Vec<wgpu::BindGroupLayout>,
    bindings: Vec<Binding>,
}

/// Buffers and uniform values by the names that kernels give them.
#[derive(Default, Clone)]
pub struct Bindings {
    buffers: BTreeMap<String, wgpu::Buffer>,
    uniforms: BTreeMap<String, UniformValues>,
    /// Arrays in several parts: how many parts, and `vec4`s in all but the last.
    parts: BTreeMap<String, (usize, u32)>,
}

/// Parts that an array may have at most; kernels declare as many.
pub const MAX_PARTS: usize = 4;

impl Bindings {
    /// Nothing bound.
    pub fn new() -> Self {
        Self::default()
    }

    /// Binds a storage buffer to the kernel variable `name`.
    pub fn buffer(&mut self, name: &str, buffer: &wgpu::Buffer) -> &mut Self {
        self.buffers.insert(name.to_owned(), buffer.clone());
        self
    }

    /// Sets the members of the uniform variable `name`.
    pub fn uniform(&mut self, name: &str, values: UniformValues) -> &mut Self {
        self.uniforms.insert(name.to_owned(), values);
        self
    }

    /// Binds an array of `vec4` in parts (see [`Gpu::storage_parts`]): the kernel variables `name`,
    /// `name_1`, …
    pub fn parts(&mut self, name: &str, (buffers, vec4s): &(Vec<wgpu::Buffer>, u32)) -> &mut Self {
        for (index, buffer) in buffers.iter().enumerate() {
            self.buffer(&part_name(name, index), buffer);
        }
        if buffers.len() > 1 {
            self.parts.insert(name.to_owned(), (buffers.len(), *vec4s));
        }
        self
    }

    /// `composition` with what arrays in several parts ask of kernels: the features `name_1`, … and
    /// the constant `NAME_PART`.
    #[must_use]
    pub fn compose(&self, mut composition: Composition) -> Composition {
        for (name, (count, vec4s)) in &self.parts {
            for index in 1..*count {
                composition = composition.feature(&part_name(name, index), true);
            }
            composition = composition.constant(&format!("{}_PART", name.to_uppercase()), *vec4s);
        }
        composition
    }

    /// Everything of `other` on top of this.
    #[must_use]
    pub fn merged(&self, other: &Bindings) -> Bindings {
        let mut out = self.clone();
        out.buffers
            .extend(other.buffers.iter().map(|(k, v)| (k.clone(), v.clone())));
        out.uniforms
            .extend(other.uniforms.iter().map(|(k, v)| (k.clone(), v.clone())));
        out.parts
            .extend(other.parts.iter().map(|(k, v)| (k.clone(), *v)));
        out
    }
}

/// Name of the kernel variable that binds a part of an array.
fn part_name(name: &str, index: usize) -> String {
    match index {
        0 => name.to_owned(),
        _ => format!("{name}_{index}"),
    }
}

fn reflect(kernel: &ComposedKernel) -> Vec<Binding> {
    let module = &kernel.module;
    let entry = kernel.info.get_entry_point(0);
    let mut bindings = Vec::new();
    for (handle, variable) in module.global_variables.iter() {
        let Some(at) = &variable.binding else {
            continue;
        };
        if entry[handle].is_empty() {
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
            naga::AddressSpace::Storage { access } => BindingKind::Storage {
                writable: access.contains(naga::StorageAccess::STORE),
            },
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

fn layout_entry(binding: &Binding) -> wgpu::BindGroupLayoutEntry {
    let ty = match &binding.kind {
        BindingKind::Storage { writable } => wgpu::BufferBindingType::Storage {
            read_only: !writable,
        },
        BindingKind::Uniform { .. } => wgpu::BufferBindingType::Uniform,
    };
    wgpu::BindGroupLayoutEntry {
        binding: binding.binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer {
            ty,
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    }
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
        let key = (composition.clone(), runtime_checks);
        if let Some(known) = self
            .pipelines
            .lock()
            .ok()
            .and_then(|cache| cache.get(&key).cloned())
        {
            return Ok(known);
        }
        let kernel = self.kernels.compose(composition)?;
        let pipeline = Arc::new(self.compile(kernel, runtime_checks)?);
        if let Ok(mut cache) = self.pipelines.lock() {
            cache.insert(key, Arc::clone(&pipeline));
        }
        Ok(pipeline)
    }

    fn compile(&self, kernel: ComposedKernel, runtime_checks: bool) -> Result<Pipeline, GpuError> {
        let bindings = reflect(&kernel);
        let storage = |b: &&Binding| matches!(b.kind, BindingKind::Storage { .. });
        let needed = bindings.iter().filter(storage).count() as u64;
        let limit = u64::from(self.limits.max_storage_buffers_per_shader_stage);
        if needed > limit {
            return Err(GpuError::TooManyBuffers {
                kernel: kernel.composition.entry,
                needed,
                limit,
            });
        }
        let groups = bindings.iter().map(|b| b.group + 1).max().unwrap_or(0);
        let scope = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let layouts: Vec<_> = (0..groups)
            .map(|group| {
                let mut entries: Vec<_> = bindings
                    .iter()
                    .filter(|b| b.group == group)
                    .map(layout_entry)
                    .collect();
                entries.sort_by_key(|e| e.binding);
                self.device
                    .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                        label: None,
                        entries: &entries,
                    })
            })
            .collect();
        let references: Vec<_> = layouts.iter().map(Some).collect();
        let layout = self
            .device
            .create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: None,
                bind_group_layouts: &references,
                immediate_size: 0,
            });
        let label = kernel.composition.entry.clone();
        let descriptor = wgpu::ShaderModuleDescriptor {
            label: Some(&label),
            source: wgpu::ShaderSource::Wgsl(kernel.wgsl.as_str().into()),
        };
        let module = if runtime_checks {
            self.device.create_shader_module(descriptor)
        } else {
            // SAFETY: reached only for kernels whose checked module passed the gate on this scene
            // and adapter: no access out of bounds was needed and every loop has a fuse.
            unsafe {
                self.device.create_shader_module_trusted(
                    descriptor,
                    wgpu::ShaderRuntimeChecks::unchecked(),
                )
            }
        };
        let compute = self
            .device
            .create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(&label),
                layout: Some(&layout),
                module: &module,
                entry_point: None,
                compilation_options: wgpu::PipelineCompilationOptions {
                    // Kernels write workgroup memory before they read it.
                    zero_initialize_workgroup_memory: false,
                    ..Default::default()
                },
                cache: None,
            });
        if let Some(error) = pollster::block_on(scope.pop()) {
            return Err(GpuError::Driver(format!("kernel `{label}`: {error}")));
        }
        Ok(Pipeline {
            kernel,
            compute,
            layouts,
            bindings,
        })
    }

    /// Bind groups of `pipeline` with the buffers and values of `given`.
    ///
    /// # Errors
    /// The kernel wants a name that was not given, a buffer exceeds the adapter's limit, or the
    /// device is lost.
    pub(super) fn bind(
        &self,
        pipeline: &Pipeline,
        given: &Bindings,
    ) -> Result<Vec<wgpu::BindGroup>, GpuError> {
        let mut uniforms = BTreeMap::new();
        for binding in &pipeline.bindings {
            if let BindingKind::Uniform { size, members } = &binding.kind {
                let unbound = |what: String| pipeline.unbound(&what, given.uniforms.keys());
                let values = given
                    .uniforms
                    .get(&binding.name)
                    .ok_or_else(|| unbound(binding.name.clone()))?;
                let bytes = values
                    .pack(*size, members)
                    .map_err(|member| unbound(format!("{}.{member}", binding.name)))?;
                let buffer = self.filled(&binding.name, &bytes, wgpu::BufferUsages::UNIFORM)?;
                uniforms.insert(binding.name.clone(), buffer);
            }
        }
        let mut groups = Vec::new();
        for (group, layout) in pipeline.layouts.iter().enumerate() {
            let mut entries = Vec::new();
            for binding in pipeline
                .bindings
                .iter()
                .filter(|b| b.group as usize == group)
            {
                let buffer = match binding.kind {
                    BindingKind::Uniform { .. } => uniforms.get(&binding.name),
                    BindingKind::Storage { .. } => given.buffers.get(&binding.name),
                };
                let buffer =
                    buffer.ok_or_else(|| pipeline.unbound(&binding.name, given.buffers.keys()))?;
                let limit = self.limits.max_storage_buffer_binding_size;
                if buffer.size() > limit {
                    return Err(GpuError::TooLarge {
                        name: binding.name.clone(),
                        needed: buffer.size(),
                        limit,
                    });
                }
                entries.push(wgpu::BindGroupEntry {
                    binding: binding.binding,
                    resource: buffer.as_entire_binding(),
                });
            }
            groups.push(self.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: None,
                layout,
                entries: &entries,
            }));
        }
        Ok(groups)
    }
}

impl Pipeline {
    fn unbound<'a>(&self, binding: &str, known: impl Iterator<Item = &'a String>) -> GpuError {
        GpuError::Unbound {
            kernel: self.kernel.composition.entry.clone(),
            binding: binding.to_owned(),
            known: known.cloned().collect::<Vec<_>>().join(", "),
        }
    }

    /// Names of everything the kernel binds.
    pub fn binding_names(&self) -> Vec<&str> {
        self.bindings.iter().map(|b| b.name.as_str()).collect()
    }

    /// Offsets of the members of a uniform struct, as reflected from the composed kernel.
    pub fn uniform_members(&self, name: &str) -> Option<&[(String, u32)]> {
        self.bindings
            .iter()
            .find(|b| b.name == name)
            .and_then(|b| match &b.kind {
                BindingKind::Uniform { members, .. } => Some(members.as_slice()),
                BindingKind::Storage { .. } => None,
            })
    }
}
