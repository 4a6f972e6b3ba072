//! Dispatches, read-back and clocks.

use super::GpuError;
use super::adapter::Gpu;
use super::pipeline::{Bindings, MAX_PARTS, Pipeline, WORKGROUP_SIZE};
use bytemuck::Pod;
use std::time::{Duration, Instant};

/// Work that takes longer than this is given up: the driver hangs.
const PATIENCE: Duration = Duration::from_secs(120);
/// WebGPU's limit on workgroups per dimension.
const MAX_GROUPS: u32 = 65535;

/// How long a dispatch took.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Elapsed {
    /// Milliseconds between the GPU timestamps around the pass; `None` where there are none.
    pub gpu_ms: Option<f64>,
    /// Milliseconds by the wall clock from submission to completion.
    pub wall_ms: f64,
}

impl Elapsed {
    /// GPU time where there is one, wall time elsewhere.
    pub fn ms(&self) -> f64 {
        self.gpu_ms.unwrap_or(self.wall_ms)
    }
}

/// One dispatch: which kernel, over what.
pub struct Dispatch<'a> {
    /// The kernel.
    pub pipeline: &'a Pipeline,
    /// Its buffers and values.
    pub bindings: &'a Bindings,
    /// Workgroups in x, y, z.
    pub groups: [u32; 3],
}

/// Workgroups for `items` invocations of a one-dimensional kernel; kernels compute their index as
/// `x + y * WORKGROUP_SIZE * num_workgroups.x`.
pub fn groups_for(items: u32) -> [u32; 3] {
    let groups = items.div_ceil(WORKGROUP_SIZE).max(1);
    if groups <= MAX_GROUPS {
        [groups, 1, 1]
    } else {
        [MAX_GROUPS, groups.div_ceil(MAX_GROUPS), 1]
    }
}

/// Refuses what needs more bytes than `limit`.
pub(super) fn check(name: &str, needed: u64, limit: u64) -> Result<(), GpuError> {
    if needed > limit {
        return Err(GpuError::TooLarge {
            name: name.to_owned(),
            needed,
            limit,
        });
    }
    Ok(())
}

impl Gpu {
    /// A storage buffer with this content, at least 16 bytes long.
    ///
    /// # Errors
    /// It is larger than the adapter can bind, or the device is lost or out of memory.
    pub fn storage<T: Pod>(&self, name: &str, content: &[T]) -> Result<wgpu::Buffer, GpuError> {
        self.check_size(name, size_of_val(content) as u64)?;
        self.array(name, content)
    }

    /// The same, but only as a kernel binds it decides whether it is too large: as a texture
    /// ([`super::Bindings::buffer`]) it may be larger than a storage buffer.
    ///
    /// # Errors
    /// It is larger than any buffer, or the device is lost or out of memory.
    pub fn array<T: Pod>(&self, name: &str, content: &[T]) -> Result<wgpu::Buffer, GpuError> {
        let bytes: &[u8] = bytemuck::cast_slice(content);
        check(name, bytes.len() as u64, self.limits.max_buffer_size)?;
        let padding;
        let contents = if bytes.len() < 16 {
            padding = [bytes, &[0u8; 16][bytes.len()..]].concat();
            padding.as_slice()
        } else {
            bytes
        };
        let usage = wgpu::BufferUsages::STORAGE
            | wgpu::BufferUsages::COPY_SRC
            | wgpu::BufferUsages::COPY_DST;
        self.filled(name, contents, usage)
    }

    /// Storage buffers that together hold an array of `vec4`, each as large as the adapter can bind,
    /// and the number of `vec4`s in each but the last. Parts end between elements of 16 to 64 bytes.
    ///
    /// # Errors
    /// It needs more than [`MAX_PARTS`] parts, or the device is lost or out of memory.
    pub fn storage_parts(
        &self,
        name: &str,
        words: &[u32],
    ) -> Result<(Vec<wgpu::Buffer>, u32), GpuError> {
        // Three and four vec4s an element: triangles and nodes.
        const ALIGNMENT: u64 = 12;
        let limit = self.limits.max_storage_buffer_binding_size / 16;
        let vec4s = (limit / ALIGNMENT * ALIGNMENT).clamp(ALIGNMENT, 1 << 28);
        let needed = words.len() as u64 * 4;
        let most = vec4s * 16 * MAX_PARTS as u64;
        if needed > most {
            return Err(GpuError::TooLarge {
                name: name.to_owned(),
                needed,
                limit: most,
            });
        }
        if words.is_empty() {
            return Ok((vec![self.storage(name, words)?], vec4s as u32));
        }
        let parts = words.chunks(4 * vec4s as usize);
        let buffers: Result<Vec<_>, _> = parts.map(|part| self.storage(name, part)).collect();
        Ok((buffers?, vec4s as u32))
    }

    /// A buffer with this content; wgpu's `create_buffer_init` panics where this fails.
    ///
    /// # Errors
    /// The device is lost or out of memory.
    pub(super) fn filled(
        &self,
        name: &str,
        content: &[u8],
        usage: wgpu::BufferUsages,
    ) -> Result<wgpu::Buffer, GpuError> {
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(name),
            size: (content.len() as u64).next_multiple_of(wgpu::COPY_BUFFER_ALIGNMENT),
            usage,
            mapped_at_creation: true,
        });
        let failed = |e: wgpu::MapRangeError| match self.lost() {
            Some(cause) => GpuError::Lost(cause),
            None => GpuError::Driver(format!("buffer `{name}`: {e}")),
        };
        buffer
            .get_mapped_range_mut(..)
            .map_err(failed)?
            .slice(..content.len())
            .copy_from_slice(content);
        buffer.unmap();
        Ok(buffer)
    }

    /// A zeroed storage buffer of `bytes` (rounded up to 16).
    ///
    /// # Errors
    /// It is larger than the adapter can bind.
    pub fn zeroed(&self, name: &str, bytes: u64) -> Result<wgpu::Buffer, GpuError> {
        self.check_size(name, bytes)?;
        Ok(self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(name),
            size: bytes.max(16).next_multiple_of(16),
            usage: wgpu::BufferUsages::STORAGE
                | wgpu::BufferUsages::COPY_SRC
                | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        }))
    }

    fn check_size(&self, name: &str, needed: u64) -> Result<(), GpuError> {
        check(name, needed, self.limits.max_storage_buffer_binding_size)
    }

    /// Runs one dispatch to its end and measures it.
    ///
    /// # Errors
    /// A binding is missing, the driver complains, the device is lost or does not finish.
    pub fn run(&self, dispatch: &Dispatch) -> Result<Elapsed, GpuError> {
        let groups = self.bind(dispatch.pipeline, dispatch.bindings)?;
        let clock = self
            .timestamp_period
            .map(|period| (Timestamps::new(&self.device), period));
        let scope = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let mut encoder = self
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: None,
                timestamp_writes: clock
                    .as_ref()
                    .map(|(t, _)| wgpu::ComputePassTimestampWrites {
                        query_set: &t.queries,
                        beginning_of_pass_write_index: Some(0),
                        end_of_pass_write_index: Some(1),
                    }),
            });
            pass.set_pipeline(&dispatch.pipeline.compute);
            for (index, group) in groups.iter().enumerate() {
                pass.set_bind_group(index as u32, group, &[]);
            }
            let [x, y, z] = dispatch.groups;
            pass.dispatch_workgroups(x, y, z);
        }
        if let Some((t, _)) = &clock {
            encoder.resolve_query_set(&t.queries, 0..2, &t.resolved, 0);
            encoder.copy_buffer_to_buffer(&t.resolved, 0, &t.mapped, 0, 16);
        }
        let commands = encoder.finish();
        let start = Instant::now();
        self.queue.submit([commands]);
        self.wait()?;
        let wall_ms = start.elapsed().as_secs_f64() * 1e3;
        if let Some(error) = pollster::block_on(scope.pop()) {
            return Err(GpuError::Driver(error.to_string()));
        }
        let gpu_ms = match &clock {
            Some((t, period)) => {
                let ticks: Vec<u64> = self.map(&t.mapped)?;
                // A negative span is a driver fault, not a measurement.
                ticks[1]
                    .checked_sub(ticks[0])
                    .map(|span| span as f64 * f64::from(*period) * 1e-6)
            }
            None => None,
        };
        Ok(Elapsed { gpu_ms, wall_ms })
    }

    /// Waits for all submitted work.
    ///
    /// # Errors
    /// The device is lost or does not finish in time.
    pub fn wait(&self) -> Result<(), GpuError> {
        let waited = self.device.poll(wgpu::PollType::Wait {
            submission_index: None,
            timeout: Some(PATIENCE),
        });
        if let Some(cause) = self.lost() {
            return Err(GpuError::Lost(cause));
        }
        waited.map(|_| ()).map_err(|_| GpuError::Timeout {
            seconds: PATIENCE.as_secs(),
        })
    }

    /// Copies a buffer to the host.
    ///
    /// # Errors
    /// The device is lost or does not finish in time.
    pub fn read<T: Pod>(&self, buffer: &wgpu::Buffer) -> Result<Vec<T>, GpuError> {
        let staging = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("staging"),
            size: buffer.size(),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = self
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, buffer.size());
        self.queue.submit([encoder.finish()]);
        self.map(&staging)
    }

    fn map<T: Pod>(&self, staging: &wgpu::Buffer) -> Result<Vec<T>, GpuError> {
        let (sender, receiver) = std::sync::mpsc::channel();
        staging
            .slice(..)
            .map_async(wgpu::MapMode::Read, move |result| {
                let _ = sender.send(result);
            });
        self.wait()?;
        let mapped = receiver
            .recv()
            .map_err(|_| GpuError::Driver("a buffer was never mapped".to_owned()))?;
        mapped.map_err(|e| GpuError::Driver(e.to_string()))?;
        let view = staging
            .slice(..)
            .get_mapped_range()
            .map_err(|e| GpuError::Driver(e.to_string()))?;
        let out = bytemuck::pod_collect_to_vec(&view);
        drop(view);
        staging.unmap();
        Ok(out)
    }
}

/// Query set and buffers for the two timestamps of a pass.
struct Timestamps {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    mapped: wgpu::Buffer,
}

impl Timestamps {
    fn new(device: &wgpu::Device) -> Self {
        let queries = device.create_query_set(&wgpu::QuerySetDescriptor {
            label: Some("timestamps"),
            ty: wgpu::QueryType::Timestamp,
            count: 2,
        });
        let buffer = |usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("timestamps"),
                size: 16,
                usage,
                mapped_at_creation: false,
            })
        };
        Self {
            queries,
            resolved: buffer(wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC),
            mapped: buffer(wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ),
        }
    }
}
