//! The blocks of an image that take samples if not all do: one workgroup each.

use raystone_gpu::{Gpu, GpuError};
use std::cell::RefCell;

/// Edge of a block, pixels: a workgroup of `kernels/integrator/render.wesl`.
pub const BLOCK_EDGE: u32 = 8;

/// A list of blocks, on the device and on the host.
pub(super) struct Blocks {
    list: wgpu::Buffer,
    /// Blocks in a row of the image.
    columns: u32,
    /// Flags of the listed blocks, and their number.
    state: RefCell<(Vec<bool>, u32)>,
}

impl Blocks {
    pub(crate) const PIXELS: u64 = (BLOCK_EDGE * BLOCK_EDGE) as u64;
    pub(crate) const MOST: u64 = 65_535;

    pub(crate) fn all(gpu: &Gpu, size: [u32; 2]) -> Result<Self, GpuError> {
        let [columns, rows] = size.map(|edge| edge.div_ceil(BLOCK_EDGE));
        let all = (0..rows).flat_map(|y| (0..columns).map(move |x| word([x, y])));
        let all: Vec<u32> = all.collect();
        Ok(Self {
            list: gpu.storage("block_list", &all)?,
            columns,
            state: RefCell::new((vec![true; all.len()], all.len() as u32)),
        })
    }

    /// Sets the list to these blocks, without repetition.
    pub(crate) fn set(&self, gpu: &Gpu, blocks: &[[u32; 2]]) {
        let mut state = self.state.borrow_mut();
        state.0.fill(false);
        let mut words = Vec::new();
        for &[x, y] in blocks.iter().filter(|[x, _]| *x < self.columns) {
            if let Some(on @ false) = state.0.get_mut((y * self.columns + x) as usize) {
                *on = true;
                words.push(word([x, y]));
            }
        }
        state.1 = words.len() as u32;
        gpu.queue
            .write_buffer(&self.list, 0, bytemuck::cast_slice(&words));
    }

    pub(crate) fn list(&self) -> &wgpu::Buffer {
        &self.list
    }

    pub(crate) fn len(&self) -> u32 {
        self.state.borrow().1
    }

    /// Number of their pixels, including those beyond the image edges.
    pub(crate) fn pixels(&self) -> u64 {
        u64::from(self.len()) * Self::PIXELS
    }

    /// True if a pixel, by its index in an image of this width, is in a listed block.
    pub(crate) fn has(&self, pixel: usize, width: usize) -> bool {
        let [x, y] = [pixel % width, pixel / width].map(|at| at / BLOCK_EDGE as usize);
        let state = self.state.borrow();
        state
            .0
            .get(y * self.columns as usize + x)
            .is_some_and(|on| *on)
    }
}

/// Kernel layout: the column, with the row in the upper half.
fn word([x, y]: [u32; 2]) -> u32 {
    x | y << 16
}
