//! Rasterisation by a vertex and a fragment entry: one word per pixel, for the nearest triangle.

use super::adapter::Gpu;
use super::bindings::{Bindings, Resource};
use super::buffers::check;
use super::clock::{Elapsed, Stopwatch};
use super::compose::Composition;
use super::pipeline::{Binding, BindingKind, reflect};
use super::wait::wait_for;
use super::{GpuError, UniformValues};

/// Row padding in words, as required for texture copies.
const ROW_WORDS: u32 = wgpu::COPY_BYTES_PER_ROW_ALIGNMENT / 4;
/// Word of a pixel without a triangle, 2³² − 1, as a clear colour.
const NOTHING: f64 = u32::MAX as f64;
const IDS: wgpu::TextureFormat = wgpu::TextureFormat::R32Uint;
const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// A compiled rasterisation for images of one size.
pub struct Raster {
    gpu: Gpu,
    size: [u32; 2],
    pipeline: wgpu::RenderPipeline,
    bindings: Vec<Binding>,
    bound: Bindings,
    ids: wgpu::Texture,
    depth: wgpu::Texture,
    words: wgpu::Buffer,
}

impl Gpu {
    /// Compiles the entries of a kernel, one for triangle corners and one for pixels, for images of
    /// this size. Depth is largest nearby; both faces are drawn; the first of equally near
    /// triangles wins.
    ///
    /// # Errors
    /// The kernel does not compose or compile, or the image exceeds the adapter's limits.
    pub fn raster(
        &self,
        composition: &Composition,
        bound: &Bindings,
        size: [u32; 2],
    ) -> Result<Raster, GpuError> {
        if cfg!(target_family = "wasm") {
            let reason = "a browser does not let rasterisation be waited for: choose rays";
            return Err(GpuError::Kernel(reason.to_owned()));
        }
        let kernel = self.kernels.compose(&bound.compose(composition.clone()))?;
        self.note_modules(&kernel);
        let edge = u64::from(self.limits.max_texture_dimension_2d);
        for pixels in size {
            check("an edge of a rasterised image", pixels.into(), edge)?;
        }
        let words = size[0].next_multiple_of(ROW_WORDS) * size[1];
        let words = self.zeroed("visible", 4 * u64::from(words))?;
        let scope = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let pipeline = self.render_pipeline(&composition.entry, &kernel.wgsl);
        let texture = |format, usage| {
            self.device.create_texture(&wgpu::TextureDescriptor {
                label: Some("raster"),
                size: extent(size),
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | usage,
                view_formats: &[],
            })
        };
        let raster = Raster {
            gpu: self.clone(),
            size,
            pipeline,
            bindings: reflect(&kernel),
            bound: bound.clone(),
            ids: texture(IDS, wgpu::TextureUsages::COPY_SRC),
            depth: texture(DEPTH, wgpu::TextureUsages::empty()),
            words,
        };
        match wait_for(scope.pop()) {
            Some(error) => Err(GpuError::Driver(error.to_string())),
            None => Ok(raster),
        }
    }

    fn render_pipeline(&self, label: &str, wgsl: &str) -> wgpu::RenderPipeline {
        let module = &self
            .device
            .create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(label),
                source: wgpu::ShaderSource::Wgsl(wgsl.into()),
            });
        self.device
            .create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some(label),
                layout: None,
                vertex: wgpu::VertexState {
                    module,
                    entry_point: None,
                    compilation_options: Default::default(),
                    buffers: &[],
                },
                primitive: wgpu::PrimitiveState::default(),
                depth_stencil: Some(wgpu::DepthStencilState {
                    format: DEPTH,
                    depth_write_enabled: Some(true),
                    depth_compare: Some(wgpu::CompareFunction::Greater),
                    stencil: Default::default(),
                    bias: Default::default(),
                }),
                multisample: Default::default(),
                fragment: Some(wgpu::FragmentState {
                    module,
                    entry_point: None,
                    compilation_options: Default::default(),
                    targets: &[Some(IDS.into())],
                }),
                multiview_mask: None,
                cache: None,
            })
    }
}

fn extent([width, height]: [u32; 2]) -> wgpu::Extent3d {
    wgpu::Extent3d {
        width,
        height,
        depth_or_array_layers: 1,
    }
}

impl Raster {
    /// One word per pixel, row by row, 2³² − 1 where empty; rows begin at multiples of 64 words.
    pub fn words(&self) -> &wgpu::Buffer {
        &self.words
    }

    fn stride(&self) -> u32 {
        self.size[0].next_multiple_of(ROW_WORDS)
    }

    /// Draws this many triangles with these uniform values, and returns the wall time.
    ///
    /// # Errors
    /// A binding is missing, the driver complains, or the device is lost or hangs.
    pub fn draw(
        &self,
        triangles: u32,
        uniform: (&str, UniformValues),
    ) -> Result<Elapsed, GpuError> {
        let scope = self
            .gpu
            .device
            .push_error_scope(wgpu::ErrorFilter::Validation);
        let drawn = self.encoded(triangles, &uniform).and_then(|commands| {
            let watch = Stopwatch::start();
            self.gpu.queue.submit([commands]);
            self.gpu.wait()?;
            Ok(watch.elapsed())
        });
        match wait_for(scope.pop()) {
            Some(error) if self.gpu.lost().is_none() => Err(GpuError::Driver(error.to_string())),
            _ => drawn,
        }
    }

    /// The words of all pixels, row by row from the top.
    ///
    /// # Errors
    /// The device is lost or hangs.
    pub fn read(&self) -> Result<Vec<u32>, GpuError> {
        let words: Vec<u32> = self.gpu.read(&self.words)?;
        let rows = words.chunks(self.stride() as usize);
        let pixels = rows.flat_map(|row| &row[..self.size[0] as usize]);
        Ok(pixels.copied().collect())
    }

    fn encoded(
        &self,
        triangles: u32,
        uniform: &(&str, UniformValues),
    ) -> Result<wgpu::CommandBuffer, GpuError> {
        let groups = self.groups(uniform)?;
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        {
            let [ids, depth] = [&self.ids, &self.depth].map(|t| t.create_view(&Default::default()));
            let nothing = wgpu::Color {
                r: NOTHING,
                ..wgpu::Color::TRANSPARENT
            };
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("raster"),
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: &ids,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(nothing),
                        store: wgpu::StoreOp::Store,
                    },
                })],
                depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                    view: &depth,
                    depth_ops: Some(wgpu::Operations {
                        load: wgpu::LoadOp::Clear(0.0),
                        store: wgpu::StoreOp::Discard,
                    }),
                    stencil_ops: None,
                }),
                ..Default::default()
            });
            pass.set_pipeline(&self.pipeline);
            for (index, group) in &groups {
                pass.set_bind_group(*index, group, &[]);
            }
            pass.draw(0..3 * triangles, 0..1);
        }
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(4 * self.stride()),
            rows_per_image: None,
        };
        let to = wgpu::TexelCopyBufferInfo {
            buffer: &self.words,
            layout,
        };
        encoder.copy_texture_to_buffer(self.ids.as_image_copy(), to, extent(self.size));
        Ok(encoder.finish())
    }

    fn groups(
        &self,
        (given, values): &(&str, UniformValues),
    ) -> Result<Vec<(u32, wgpu::BindGroup)>, GpuError> {
        let unbound = |binding: &str| {
            GpuError::Kernel(format!(
                "a rasterisation binds `{binding}`, which nobody gave"
            ))
        };
        let mut resources = Vec::new();
        for binding in &self.bindings {
            let resource = match &binding.kind {
                BindingKind::Uniform { size, members } if binding.name == *given => {
                    let bytes = values.pack(*size, members).map_err(|name| unbound(&name))?;
                    let usage = wgpu::BufferUsages::UNIFORM;
                    Resource::Buffer(self.gpu.filled(&binding.name, &bytes, usage)?)
                }
                BindingKind::Storage => match self.bound.storage(&binding.name) {
                    Some(super::Storage::Own(buffer)) => Resource::Buffer(buffer.clone()),
                    _ => return Err(unbound(&binding.name)),
                },
                BindingKind::Uniform { .. } | BindingKind::Texels => {
                    return Err(unbound(&binding.name));
                }
            };
            resources.push((binding, resource));
        }
        let mut used: Vec<u32> = self.bindings.iter().map(|b| b.group).collect();
        used.sort_unstable();
        used.dedup();
        let group = |index: u32| {
            let of_group = resources.iter().filter(|(b, _)| b.group == index);
            let entries: Vec<_> = of_group
                .map(|(b, resource)| wgpu::BindGroupEntry {
                    binding: b.binding,
                    resource: resource.binding(),
                })
                .collect();
            let made = self
                .gpu
                .device
                .create_bind_group(&wgpu::BindGroupDescriptor {
                    label: None,
                    layout: &self.pipeline.get_bind_group_layout(index),
                    entries: &entries,
                });
            (index, made)
        };
        Ok(used.into_iter().map(group).collect())
    }
}
