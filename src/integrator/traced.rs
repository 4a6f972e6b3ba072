//! A built structure on the GPU.

use crate::accel::{AccelKind, BuiltAccel};
use crate::gpu::{Bindings, Composition, Gpu, GpuError};

/// What a kernel needs to trace with a structure: its module, constants, arrays and uniforms.
#[derive(Clone)]
pub struct Traced {
    kernel: String,
    constants: Vec<(&'static str, u32)>,
    /// Arrays and uniforms of the structure.
    pub bindings: Bindings,
}

impl Traced {
    /// Uploads a built structure.
    ///
    /// # Errors
    /// An array exceeds what the adapter can bind.
    pub fn upload(
        gpu: &Gpu,
        kind: &dyn AccelKind,
        built: &dyn BuiltAccel,
    ) -> Result<Self, GpuError> {
        let buffers = built.buffers();
        let mut bindings = Bindings::new();
        for array in &buffers.arrays {
            bindings.buffer(array.name, &gpu.storage(array.name, &array.words)?);
        }
        for (name, values) in buffers.uniforms {
            bindings.uniform(name, values);
        }
        Ok(Self {
            kernel: kind.kernel().to_owned(),
            constants: buffers.constants,
            bindings,
        })
    }

    /// `composition` with this structure as the active one.
    #[must_use]
    pub fn compose(&self, composition: Composition) -> Composition {
        let with_kernel = composition.with("accel", &self.kernel);
        self.constants
            .iter()
            .fold(with_kernel, |c, (name, value)| c.constant(name, *value))
    }
}
