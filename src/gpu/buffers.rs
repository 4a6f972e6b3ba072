//! Buffers with content, and waiting.

use super::GpuError;
use super::adapter::Gpu;
use super::bindings::MAX_PARTS;
use bytemuck::Pod;
use std::time::Duration;

/// Time limit of work: beyond it, the driver is assumed to hang.
pub(super) const PATIENCE: Duration = Duration::from_secs(120);
pub(super) const STORAGE: wgpu::BufferUsages = wgpu::BufferUsages::STORAGE
    .union(wgpu::BufferUsages::INDIRECT)
    .union(wgpu::BufferUsages::COPY_SRC)
    .union(wgpu::BufferUsages::COPY_DST);

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
    /// It exceeds the adapter's binding limit, or the device is lost or out of memory.
    pub fn storage<T: Pod>(&self, name: &str, content: &[T]) -> Result<wgpu::Buffer, GpuError> {
        self.check_size(name, size_of_val(content) as u64)?;
        self.array(name, content)
    }

    /// The same without a check of the binding limit, which depends on the kernel: as a texture
    /// ([`super::Bindings::buffer`]) an array may be larger than a storage buffer.
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
        self.filled(name, contents, STORAGE)
    }

    /// Storage buffers that together hold an array of `vec4`, each as large as the adapter can
    /// bind, and the number of `vec4`s in each but the last. Parts end between elements of 16 to 64
    /// bytes.
    ///
    /// # Errors
    /// It needs more than `MAX_PARTS` parts, or the device is lost or out of memory.
    pub fn storage_parts(
        &self,
        name: &str,
        words: &[u32],
    ) -> Result<(Vec<wgpu::Buffer>, u32), GpuError> {
        // Elements have three or four vec4s: triangles and nodes.
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

    /// A buffer with this content; wgpu's `create_buffer_init` panics on failure.
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
    /// It exceeds the adapter's binding limit.
    pub fn zeroed(&self, name: &str, bytes: u64) -> Result<wgpu::Buffer, GpuError> {
        self.check_size(name, bytes)?;
        Ok(self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(name),
            size: bytes.max(16).next_multiple_of(16),
            usage: STORAGE,
            mapped_at_creation: false,
        }))
    }

    fn check_size(&self, name: &str, needed: u64) -> Result<(), GpuError> {
        check(name, needed, self.limits.max_storage_buffer_binding_size)
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
}
