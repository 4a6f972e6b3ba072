//! The driver's ray tracing through wgpu's ray queries, on a separate device of the same adapter.

use super::{BuiltPeer, Peer, PeerBatch};
use raystone_accel::{Hit, NO_HIT, Query, Ray, TriangleSoup};
use raystone_core::clock::Instant;
use raystone_gpu::{Elapsed, Gpu, GpuError, RawDevice, Stopwatch};
use std::cell::RefCell;
use std::num::NonZeroU64;
use wgpu::util::DeviceExt as _;

const LANES: u32 = 64;
/// Rays per dispatch: at microseconds per ray in software, longer dispatches look like a hang.
const SLICE: usize = 1 << 16;
const KERNEL: &str = include_str!("ray_query.wgsl");

pub(super) struct RayQuery;

struct Built {
    raw: RawDevice,
    tlas: wgpu::Tlas,
    /// Referenced by the tree.
    _blas: wgpu::Blas,
    pipelines: [wgpu::ComputePipeline; 2],
    build_ms: f64,
}

struct Batch<'a> {
    built: &'a Built,
    rays: &'a [Ray],
    pipeline: &'a wgpu::ComputePipeline,
    /// Bind group and number of rays of each slice.
    slices: Vec<(wgpu::BindGroup, u32)>,
    answers: wgpu::Buffer,
    staging: wgpu::Buffer,
    clock: Option<Clock>,
    hits: RefCell<Vec<Hit>>,
}

/// Two timestamps per slice, as structures are timed.
struct Clock {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    mapped: wgpu::Buffer,
    /// Nanoseconds per tick.
    period: f32,
}

impl Clock {
    /// `None` without timestamps.
    fn new(raw: &RawDevice, slices: usize) -> Option<Self> {
        let period = raw.timestamp_period.filter(|_| slices > 0)?;
        let buffer = |usage| {
            raw.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("timestamps"),
                size: 16 * slices as u64,
                usage,
                mapped_at_creation: false,
            })
        };
        let queries = raw.device.create_query_set(&wgpu::QuerySetDescriptor {
            label: Some("timestamps"),
            ty: wgpu::QueryType::Timestamp,
            count: 2 * slices as u32,
        });
        Some(Self {
            queries,
            resolved: buffer(wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC),
            mapped: buffer(wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ),
            period,
        })
    }

    /// Timestamps around a slice.
    fn around(&self, slice: usize) -> wgpu::ComputePassTimestampWrites<'_> {
        wgpu::ComputePassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(2 * slice as u32),
            end_of_pass_write_index: Some(2 * slice as u32 + 1),
        }
    }

    /// Milliseconds of all slices; `None` if the clock ran backwards.
    fn read(&self, raw: &RawDevice) -> Result<Option<f64>, GpuError> {
        let mut commands = raw
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        commands.resolve_query_set(&self.queries, 0..self.queries.count(), &self.resolved, 0);
        commands.copy_buffer_to_buffer(&self.resolved, 0, &self.mapped, 0, None);
        raw.queue.submit([commands.finish()]);
        let ticks: Vec<[u64; 2]> = read(raw, &self.mapped)?;
        let spans = ticks.iter().map(|[from, to]| to.checked_sub(*from));
        let ticks: Option<u64> = spans.sum();
        Ok(ticks.map(|ticks| ticks as f64 * f64::from(self.period) * 1e-6))
    }
}

/// The content of a buffer to which commands were submitted.
fn read<T: bytemuck::Pod>(raw: &RawDevice, buffer: &wgpu::Buffer) -> Result<Vec<T>, GpuError> {
    buffer.map_async(wgpu::MapMode::Read, .., |_| {});
    raw.wait()?;
    let view = buffer
        .get_mapped_range(..)
        .map_err(|e| GpuError::Driver(e.to_string()))?;
    let words = bytemuck::pod_collect_to_vec(&view);
    drop(view);
    buffer.unmap();
    Ok(words)
}

impl Peer for RayQuery {
    fn name(&self) -> &'static str {
        "ray-query"
    }

    fn description(&self) -> &'static str {
        "the driver's own ray tracing, where the adapter has ray queries; scenes without cut-outs"
    }

    fn build<'a>(
        &self,
        gpu: &Gpu,
        soup: &'a TriangleSoup,
    ) -> Result<Box<dyn BuiltPeer + 'a>, String> {
        if soup.masks.is_some() {
            return Err("surfaces of this scene are cut out by masks, which the driver's triangles do not know".into());
        }
        let feature = wgpu::Features::EXPERIMENTAL_RAY_QUERY;
        let raw = gpu.open_beside(feature).map_err(|e| e.to_string())?;
        let vertices: Vec<[[f32; 3]; 3]> = soup.records.iter().map(|r| r.vertices()).collect();
        let start = Instant::now();
        let (blas, tlas) = build_tree(&raw, &vertices);
        raw.wait().map_err(|e| e.to_string())?;
        let build_ms = start.elapsed().as_secs_f64() * 1e3;
        let module = raw
            .device
            .create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some("ray query"),
                source: wgpu::ShaderSource::Wgsl(KERNEL.into()),
            });
        let pipeline = |entry: &str| {
            raw.device
                .create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                    label: Some(entry),
                    layout: None,
                    module: &module,
                    entry_point: Some(entry),
                    compilation_options: wgpu::PipelineCompilationOptions::default(),
                    cache: None,
                })
        };
        let pipelines = [pipeline("nearest_hit"), pipeline("any_hit")];
        raw.wait().map_err(|e| e.to_string())?;
        Ok(Box::new(Built {
            raw,
            tlas,
            _blas: blas,
            pipelines,
            build_ms,
        }))
    }
}

fn build_tree(raw: &RawDevice, vertices: &[[[f32; 3]; 3]]) -> (wgpu::Blas, wgpu::Tlas) {
    let device = &raw.device;
    let buffer = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some("vertices"),
        contents: bytemuck::cast_slice(vertices),
        usage: wgpu::BufferUsages::BLAS_INPUT,
    });
    let size = wgpu::BlasTriangleGeometrySizeDescriptor {
        vertex_format: wgpu::VertexFormat::Float32x3,
        vertex_count: 3 * vertices.len() as u32,
        index_format: None,
        index_count: None,
        flags: wgpu::AccelerationStructureGeometryFlags::OPAQUE,
    };
    let blas = device.create_blas(
        &wgpu::CreateBlasDescriptor {
            label: Some("triangles"),
            flags: wgpu::AccelerationStructureFlags::PREFER_FAST_TRACE,
            update_mode: wgpu::AccelerationStructureUpdateMode::Build,
        },
        wgpu::BlasGeometrySizeDescriptors::Triangles {
            descriptors: vec![size.clone()],
        },
    );
    let mut tlas = device.create_tlas(&wgpu::CreateTlasDescriptor {
        label: Some("scene"),
        max_instances: 1,
        flags: wgpu::AccelerationStructureFlags::PREFER_FAST_TRACE,
        update_mode: wgpu::AccelerationStructureUpdateMode::Build,
    });
    let identity = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    tlas[0] = Some(wgpu::TlasInstance::new(&blas, identity, 0, 0xff));
    let geometry = wgpu::BlasTriangleGeometry {
        size: &size,
        vertex_buffer: &buffer,
        first_vertex: 0,
        vertex_stride: 12,
        index_buffer: None,
        first_index: None,
        transform_buffer: None,
        transform_buffer_offset: None,
    };
    let entry = wgpu::BlasBuildEntry {
        blas: &blas,
        geometry: wgpu::BlasGeometries::TriangleGeometries(vec![geometry]),
    };
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    encoder.build_acceleration_structures([&entry], [&tlas]);
    raw.queue.submit([encoder.finish()]);
    (blas, tlas)
}

/// Refuses more rays than one buffer holds.
fn check_size(device: &wgpu::Device, rays: usize, bytes: u64) -> Result<(), String> {
    let limit = device.limits().max_storage_buffer_binding_size;
    if bytes > limit {
        return Err(format!(
            "{rays} rays need {bytes} bytes in one buffer, the adapter binds {limit}"
        ));
    }
    Ok(())
}

/// Words of a ray for the kernel; an invalid ray has no direction, and gets a range that is empty.
fn words(ray: &Ray) -> [f32; 8] {
    if !ray.is_ray() {
        return [0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0];
    }
    let ([x, y, z], [dx, dy, dz]) = (ray.origin, ray.direction);
    [x, y, z, ray.t_min, dx, dy, dz, ray.t_max.min(f32::MAX)]
}

impl BuiltPeer for Built {
    fn about(&self) -> String {
        format!("ray queries of {}", self.raw.adapter)
    }

    fn build_ms(&self) -> f64 {
        self.build_ms
    }

    fn batch<'a>(
        &'a self,
        query: Query,
        rays: &'a [Ray],
    ) -> Result<Box<dyn PeerBatch + 'a>, String> {
        let device = &self.raw.device;
        let bytes = (16 * rays.len().max(1)) as u64;
        check_size(device, rays.len(), 2 * bytes)?;
        let words: Vec<[f32; 8]> = rays.iter().map(words).collect();
        let asked = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("rays"),
            contents: bytemuck::cast_slice(&words),
            usage: wgpu::BufferUsages::STORAGE,
        });
        let buffer = |label, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: bytes,
                usage,
                mapped_at_creation: false,
            })
        };
        let answers = buffer(
            "answers",
            wgpu::BufferUsages::STORAGE
                | wgpu::BufferUsages::COPY_SRC
                | wgpu::BufferUsages::COPY_DST,
        );
        let staging = buffer(
            "staging",
            wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        );
        let pipeline = &self.pipelines[usize::from(query == Query::Any)];
        let bind = |first: usize| {
            let count = SLICE.min(rays.len() - first);
            let part = |buffer, bytes: usize| {
                wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                    buffer,
                    offset: (first * bytes) as u64,
                    size: NonZeroU64::new((count * bytes) as u64),
                })
            };
            let entry = |binding, resource| wgpu::BindGroupEntry { binding, resource };
            let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: None,
                layout: &pipeline.get_bind_group_layout(0),
                entries: &[
                    entry(0, self.tlas.as_binding()),
                    entry(1, part(&asked, 32)),
                    entry(2, part(&answers, 16)),
                ],
            });
            (group, count as u32)
        };
        let slices: Vec<_> = (0..rays.len()).step_by(SLICE).map(bind).collect();
        Ok(Box::new(Batch {
            clock: Clock::new(&self.raw, slices.len()),
            built: self,
            rays,
            pipeline,
            slices,
            answers,
            staging,
            hits: RefCell::default(),
        }))
    }
}

impl PeerBatch for Batch<'_> {
    fn trace(&self) -> Result<Elapsed, GpuError> {
        let raw = &self.built.raw;
        let encoder = || {
            raw.device
                .create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
        };
        let mut wipe = encoder();
        wipe.clear_buffer(&self.answers, 0, None);
        raw.queue.submit([wipe.finish()]);
        raw.wait()?;
        let watch = Stopwatch::start();
        for (slice, (group, rays)) in self.slices.iter().enumerate() {
            let mut commands = encoder();
            {
                let mut pass = commands.begin_compute_pass(&wgpu::ComputePassDescriptor {
                    label: None,
                    timestamp_writes: self.clock.as_ref().map(|clock| clock.around(slice)),
                });
                pass.set_pipeline(self.pipeline);
                pass.set_bind_group(0, group, &[]);
                pass.dispatch_workgroups(rays.div_ceil(LANES), 1, 1);
            }
            raw.queue.submit([commands.finish()]);
            raw.wait()?;
        }
        let mut elapsed = watch.elapsed();
        if let Some(clock) = &self.clock {
            elapsed.gpu_ms = clock.read(raw)?;
            elapsed.backwards |= elapsed.gpu_ms.is_none();
        }
        let words = self.answers()?;
        let hit = |(ray, [kind, t, id, _]): (&Ray, &[u32; 4])| match kind {
            // The kernel writes 1 for a miss; 0 means it wrote nothing, and is no answer.
            1 => Hit::miss(ray),
            _ => Hit {
                t: f32::from_bits(*t),
                triangle: if *kind == 2 { *id } else { NO_HIT - 1 },
                ..Hit::miss(ray)
            },
        };
        *self.hits.borrow_mut() = self.rays.iter().zip(&words).map(hit).collect();
        Ok(elapsed)
    }

    fn hits(&self) -> Result<Vec<Hit>, GpuError> {
        Ok(self.hits.borrow().clone())
    }
}

impl Batch<'_> {
    fn answers(&self) -> Result<Vec<[u32; 4]>, GpuError> {
        let raw = &self.built.raw;
        let mut commands = raw
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        commands.copy_buffer_to_buffer(&self.answers, 0, &self.staging, 0, None);
        raw.queue.submit([commands.finish()]);
        read(raw, &self.staging)
    }
}
