//! Kernel bindings: buffers and uniform values by their kernel variable names.

use super::GpuError;
use super::adapter::Gpu;
use super::buffers::check;
use super::compose::Composition;
use super::pipeline::{Binding, BindingKind, Pipeline, TEXEL_FORMAT, TEXELS_PER_ROW};
use super::uniform::UniformValues;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, OnceLock};

const TEXEL_BYTES: u64 = 16;

/// Feature of kernels that read the arrays of a structure as texels of textures.
pub const TEXELS: &str = "texels";

/// Maximum parts of an array; kernels declare as many.
pub(crate) const MAX_PARTS: usize = 4;

/// A storage buffer: the caller's, or the player's own.
#[derive(Debug, Clone, PartialEq)]
pub enum Storage {
    /// The caller's.
    Own(wgpu::Buffer),
    /// One that the [`super::Player`] creates on first use and reuses by name, content unspecified.
    Scratch {
        /// Its name, shared by all recordings of a player.
        name: String,
        /// Required bytes; it may be larger.
        bytes: u64,
    },
}

impl Storage {
    /// A scratch buffer of the player.
    pub fn scratch(name: &str, bytes: u64) -> Self {
        Self::Scratch {
            name: name.to_owned(),
            bytes,
        }
    }
}

impl From<&wgpu::Buffer> for Storage {
    fn from(buffer: &wgpu::Buffer) -> Self {
        Self::Own(buffer.clone())
    }
}

impl From<&Storage> for Storage {
    fn from(storage: &Storage) -> Self {
        storage.clone()
    }
}

/// A storage buffer, and its texture copy once a kernel has requested one.
#[derive(Clone)]
struct Array {
    storage: Storage,
    texels: Arc<OnceLock<wgpu::TextureView>>,
}

/// Buffers and uniform values by their kernel variable names.
#[derive(Default, Clone)]
pub struct Bindings {
    buffers: BTreeMap<String, Array>,
    pub(super) uniforms: BTreeMap<String, UniformValues>,
    /// Arrays in several parts: number of parts, and `vec4`s in all but the last.
    parts: BTreeMap<String, (usize, u32)>,
    /// Kernel features required by the bound resources.
    features: BTreeSet<&'static str>,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) enum Resource {
    Buffer(wgpu::Buffer),
    Texels(wgpu::TextureView),
}

impl Resource {
    pub(super) fn binding(&self) -> wgpu::BindingResource<'_> {
        match self {
            Self::Buffer(buffer) => buffer.as_entire_binding(),
            Self::Texels(view) => wgpu::BindingResource::TextureView(view),
        }
    }
}

impl Bindings {
    /// Creates empty bindings.
    pub fn new() -> Self {
        Self::default()
    }

    /// Binds a storage buffer to the kernel variable `name`. A kernel that declares the variable as
    /// `Texels` (`kernels/common/texels.wesl`) gets a copy in rows of [`TEXELS_PER_ROW`], made when
    /// it is first bound: the buffer must have its content by then, and must not change afterwards.
    pub fn buffer(&mut self, name: &str, storage: impl Into<Storage>) -> &mut Self {
        let array = Array {
            storage: storage.into(),
            texels: Arc::default(),
        };
        self.buffers.insert(name.to_owned(), array);
        self
    }

    /// The buffer bound to the kernel variable `name`.
    pub fn storage(&self, name: &str) -> Option<&Storage> {
        self.buffers.get(name).map(|array| &array.storage)
    }

    pub(super) fn storages(&self) -> impl Iterator<Item = &Storage> {
        self.buffers.values().map(|array| &array.storage)
    }

    /// Sets the members of the uniform variable `name`.
    pub fn uniform(&mut self, name: &str, values: UniformValues) -> &mut Self {
        self.uniforms.insert(name.to_owned(), values);
        self
    }

    /// Binds an array in parts (see [`Gpu::storage_parts`]) to the variables `name`, `name_1`, …
    pub fn parts(&mut self, name: &str, (buffers, vec4s): &(Vec<wgpu::Buffer>, u32)) -> &mut Self {
        for (index, buffer) in buffers.iter().enumerate() {
            self.buffer(&part_name(name, index), buffer);
        }
        if buffers.len() > 1 {
            self.parts.insert(name.to_owned(), (buffers.len(), *vec4s));
        }
        self
    }

    /// Adds a feature to kernels that use these bindings.
    pub fn feature(&mut self, name: &'static str) -> &mut Self {
        self.features.insert(name);
        self
    }

    /// `composition` with the features of the bound resources, and those of arrays in several
    /// parts: the features `name_1`, … and the constant `NAME_PART`. With the feature [`TEXELS`]
    /// such arrays are whole textures.
    #[must_use]
    pub fn compose(&self, mut composition: Composition) -> Composition {
        for name in &self.features {
            composition = composition.feature(name, true);
        }
        if composition.features.contains(TEXELS) {
            return composition;
        }
        for (name, (count, vec4s)) in &self.parts {
            for index in 1..*count {
                composition = composition.feature(&part_name(name, index), true);
            }
            composition = composition.constant(&format!("{}_PART", name.to_uppercase()), *vec4s);
        }
        composition
    }

    /// These bindings, overridden by those of `other`.
    #[must_use]
    pub fn merged(&self, other: &Bindings) -> Bindings {
        let (mut out, other) = (self.clone(), other.clone());
        out.buffers.extend(other.buffers);
        out.uniforms.extend(other.uniforms);
        out.parts.extend(other.parts);
        out.features.extend(other.features);
        out
    }

    /// The resource of a kernel's storage binding; `lend` finds scratch buffers.
    pub(super) fn resource<'a>(
        &self,
        gpu: &Gpu,
        pipeline: &Pipeline,
        binding: &Binding,
        lend: impl Fn(&str) -> Option<&'a wgpu::Buffer>,
    ) -> Result<Resource, GpuError> {
        let name = &binding.name;
        let unbound = || pipeline.unbound(name, self.buffers.keys());
        let array = self.buffers.get(name).ok_or_else(unbound)?;
        let buffer = match &array.storage {
            Storage::Own(buffer) => buffer,
            Storage::Scratch { name, .. } => lend(name).ok_or_else(unbound)?,
        };
        if binding.kind == BindingKind::Texels {
            let parts = self.parts.get(name).map_or(1, |(parts, _)| *parts);
            let further = (1..parts).filter_map(|index| self.buffers.get(&part_name(name, index)));
            let arrays: Vec<&Array> = std::iter::once(array).chain(further).collect();
            return texels_of(gpu, name, &arrays).map(Resource::Texels);
        }
        let limit = gpu.limits.max_storage_buffer_binding_size;
        check(name, buffer.size(), limit)?;
        Ok(Resource::Buffer(buffer.clone()))
    }
}

/// Name of the kernel variable that binds a part of an array.
fn part_name(name: &str, index: usize) -> String {
    match index {
        0 => name.to_owned(),
        _ => format!("{name}_{index}"),
    }
}

/// The texture of an array, which may be in several parts.
fn texels_of(gpu: &Gpu, name: &str, parts: &[&Array]) -> Result<wgpu::TextureView, GpuError> {
    let mut buffers = Vec::new();
    for part in parts {
        let Storage::Own(buffer) = &part.storage else {
            let text =
                format!("`{name}` is scratch, whose content changes: it cannot be a texture");
            return Err(GpuError::Driver(text));
        };
        buffers.push(buffer);
    }
    let bytes: u64 = buffers.iter().map(|buffer| buffer.size()).sum();
    let rows = (bytes / TEXEL_BYTES).div_ceil(u64::from(TEXELS_PER_ROW));
    let limit = u64::from(gpu.limits.max_texture_dimension_2d);
    if rows.max(u64::from(TEXELS_PER_ROW)) > limit {
        return Err(GpuError::TooLarge {
            name: format!("{name}, as a texture"),
            needed: bytes,
            limit: limit * u64::from(TEXELS_PER_ROW) * TEXEL_BYTES,
        });
    }
    let made = parts[0]
        .texels
        .get_or_init(|| copy_to_texture(gpu, name, &buffers, rows as u32));
    Ok(made.clone())
}

/// Copies the content of `buffers`, one after the other, to a texture.
fn copy_to_texture(
    gpu: &Gpu,
    name: &str,
    buffers: &[&wgpu::Buffer],
    rows: u32,
) -> wgpu::TextureView {
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(name),
        size: extent([TEXELS_PER_ROW, rows.max(1)]),
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: TEXEL_FORMAT,
        usage: wgpu::TextureUsages::STORAGE_BINDING
            | wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let mut first = 0;
    for buffer in buffers {
        let texels = (buffer.size() / TEXEL_BYTES) as u32;
        let mut done = 0;
        while done < texels {
            let (at, size) = next_rectangle(first + done, texels - done);
            let layout = wgpu::TexelCopyBufferLayout {
                offset: u64::from(done) * TEXEL_BYTES,
                bytes_per_row: Some(TEXELS_PER_ROW * TEXEL_BYTES as u32),
                rows_per_image: None,
            };
            let mut target = texture.as_image_copy();
            [target.origin.x, target.origin.y] = at;
            let source = wgpu::TexelCopyBufferInfo { buffer, layout };
            encoder.copy_buffer_to_texture(source, target, extent(size));
            done += size[0] * size[1];
        }
        first += texels;
    }
    gpu.queue.submit([encoder.finish()]);
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

/// Returns the position of a rectangle of texels from `first` on, and its width and height: the rest of a row, whole
/// rows, or a last row.
fn next_rectangle(first: u32, count: u32) -> ([u32; 2], [u32; 2]) {
    let at = [first % TEXELS_PER_ROW, first / TEXELS_PER_ROW];
    let size = if at[0] > 0 || count < TEXELS_PER_ROW {
        [count.min(TEXELS_PER_ROW - at[0]), 1]
    } else {
        [TEXELS_PER_ROW, count / TEXELS_PER_ROW]
    };
    (at, size)
}

fn extent([width, height]: [u32; 2]) -> wgpu::Extent3d {
    wgpu::Extent3d {
        width,
        height,
        depth_or_array_layers: 1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rectangles_of_texels_follow_one_another() {
        const ROW: u32 = TEXELS_PER_ROW;
        for (first, count) in [
            (0, 1),
            (0, 3 * ROW),
            (5, ROW),
            (ROW - 1, 2 * ROW + 3),
            (7, 2),
        ] {
            let (mut done, mut places) = (0, Vec::new());
            while done < count {
                let ([x, y], [width, height]) = next_rectangle(first + done, count - done);
                for row in y..y + height {
                    places.extend((x..x + width).map(|column| row * ROW + column));
                }
                done += width * height;
            }
            assert!(
                places.into_iter().eq(first..first + count),
                "{first}, {count}"
            );
        }
    }
}
