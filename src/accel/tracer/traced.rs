//! Triangles and a built structure on the device.

use super::load::Load;
use super::passes::{OnePass, TracePasses};
use super::workgroup::{GroupShape, Workgroup};
use crate::{Access, BuiltAccel, GpuBuffers, Intersection, Space, TriangleSoup};
use raystone_gpu::{Bindings, Composition, Gpu, GpuError, TEXELS};
use std::sync::Arc;

/// The canonical triangles on the device, and how rays intersect them.
#[derive(Clone)]
pub struct TriangleBuffers {
    /// `triangles`, in as many parts as the adapter's limits require.
    pub bindings: Bindings,
    /// The tests.
    pub intersection: Intersection,
}

impl TriangleBuffers {
    /// Uploads the triangles.
    ///
    /// # Errors
    /// They need more parts than kernels declare.
    pub fn upload(gpu: &Gpu, soup: &TriangleSoup) -> Result<Self, GpuError> {
        let mut bindings = Bindings::new();
        let words = soup.words();
        let parts = gpu.storage_parts("triangles", words.as_flattened())?;
        bindings.parts("triangles", &parts);
        if let Some(masks) = &soup.masks {
            bindings.feature("alpha_masks");
            if masks.are_blended {
                bindings.feature("blended");
            }
        }
        Ok(Self {
            bindings,
            intersection: soup.intersection,
        })
    }
}

/// Everything that kernels need to trace with a structure: its module, features, constants, arrays
/// and uniforms, or its own passes.
#[derive(Clone)]
pub struct Traced {
    /// The structure's data, without the arrays and uniforms, which are bound.
    active: GpuBuffers<'static>,
    pub(super) passes: Arc<dyn TracePasses>,
    /// True if other kernels can import it.
    inline: bool,
    /// Arrays and uniforms of the structure.
    pub bindings: Bindings,
    /// Workgroup shape of the kernels that trace with it.
    pub workgroup: GroupShape,
    /// True if kernels read arrays as texels.
    pub texels: bool,
    /// The space in which triangles are intersected: selects the reference for hits and images.
    pub space: Space,
}

impl Traced {
    /// Uploads a built structure, read by the default load path; arrays that its build left on the
    /// device stay there.
    ///
    /// # Errors
    /// An array needs more parts, or more bytes, than the adapter offers; or the load paths cannot
    /// be measured.
    pub fn upload(gpu: &Gpu, built: &dyn BuiltAccel) -> Result<Self, GpuError> {
        let buffers = built.buffers();
        let mut bindings = Bindings::new();
        for array in &buffers.arrays {
            if built.divisible().contains(&array.name) {
                bindings.parts(array.name, &gpu.storage_parts(array.name, &array.words)?);
            } else {
                // Data read as a texture may exceed the buffer binding limit.
                bindings.buffer(array.name, &gpu.array(array.name, &array.words)?);
            }
        }
        for (name, buffer) in built.on_device() {
            bindings.buffer(name, &buffer);
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
        let (inline, passes): (bool, Arc<dyn TracePasses>) = match built.access() {
            Access::Inline => (true, Arc::new(OnePass(built.refill()))),
            Access::Pipeline(passes) => (false, passes),
        };
        let workgroup = if inline {
            Workgroup::default().shape(gpu)
        } else {
            GroupShape::default()
        };
        Ok(Self {
            active,
            passes,
            inline,
            bindings,
            workgroup,
            texels: Load::default().reads_texels(gpu)?,
            space: built.space(),
        })
    }

    /// True if other kernels can import it; a pipeline only answers buffers of rays.
    pub fn is_inline(&self) -> bool {
        self.inline
    }

    /// The same with another workgroup shape.
    ///
    /// # Errors
    /// A structure with its own passes, and thus workgroups, supports the default only.
    pub fn in_workgroups(mut self, gpu: &Gpu, workgroup: &Workgroup) -> Result<Self, GpuError> {
        if self.inline {
            self.workgroup = workgroup.shape(gpu);
        } else if *workgroup != Workgroup::default() {
            return Err(GpuError::Kernel(format!(
                "workgroup = {}: this structure answers buffers of rays in passes of its own, whose workgroups are its own; take `{}`",
                workgroup.name,
                Workgroup::default().name
            )));
        }
        Ok(self)
    }

    /// The same by another load path.
    ///
    /// # Errors
    /// The load paths cannot be measured.
    pub fn loading(mut self, gpu: &Gpu, load: &Load) -> Result<Self, GpuError> {
        self.texels = load.reads_texels(gpu)?;
        Ok(self)
    }

    /// `composition` with this structure as the active one, in its workgroups and by its load path.
    #[must_use]
    pub fn compose(&self, composition: Composition) -> Composition {
        let composition = self.active.activate(composition);
        (self.workgroup.activate(composition)).feature(TEXELS, self.texels)
    }
}
