//! A built structure on the GPU.

use crate::accel::{BuiltAccel, GpuBuffers, Space};
use crate::gpu::{Bindings, Composition, Gpu, GpuError};

/// What a kernel needs to trace with a structure: its module, features, constants, arrays and
/// uniforms.
#[derive(Clone)]
pub struct Traced {
    /// What the structure handed over, less the arrays and uniforms, which are bound.
    active: GpuBuffers<'static>,
    /// Arrays and uniforms of the structure.
    pub bindings: Bindings,
    /// Where triangles are met: decides which judge and which images it is compared with.
    pub space: Space,
}

impl Traced {
    /// Uploads a built structure.
    ///
    /// # Errors
    /// An array needs more parts, or more bytes, than the adapter offers.
    pub fn upload(gpu: &Gpu, built: &dyn BuiltAccel) -> Result<Self, GpuError> {
        let buffers = built.buffers();
        let mut bindings = Bindings::new();
        for array in &buffers.arrays {
            if built.divisible().contains(&array.name) {
                bindings.parts(array.name, &gpu.storage_parts(array.name, &array.words)?);
            } else {
                // What a kernel reads as a texture may exceed what it can bind as a buffer.
                bindings.buffer(array.name, &gpu.array(array.name, &array.words)?);
            }
        }
        for (name, values) in buffers.uniforms {
            bindings.uniform(name, values);
        }
        let active = GpuBuffers {
            kernel: buffers.kernel,
            features: buffers.features,
            constants: buffers.constants,
            ..Default::default()
        };
        Ok(Self {
            active,
            bindings,
            space: built.space(),
        })
    }

    /// `composition` with this structure as the active one.
    #[must_use]
    pub fn compose(&self, composition: Composition) -> Composition {
        self.active.activate(composition)
    }
}
