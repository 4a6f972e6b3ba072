//! Primary visibility by rasterisation: a G-buffer of one word a pixel, the triangle that its centre sees.
//!
//! T. Saito, T. Takahashi, "Comprehensible rendering of 3-D shapes", SIGGRAPH 1990. Paths with `primary = "raster"` begin there, with
//! distance and weights from the triangle test of the run, so that a path whose triangle a ray would have found, too, is the same to
//! the bit. What may differ is which triangle that is: rasterisers move vertices to a grid of fractions of a pixel, and compare
//! depths that they interpolate. Kernels: `kernels/integrator/visibility.wesl` draws, `visible.wesl` beside it reads.

use super::tables::SceneBuffers;
use raystone_accel::Space;
use raystone_core::geometry::Camera;
use raystone_gpu::{Composition, Elapsed, Gpu, GpuError, Raster, UniformValues};

/// Distance of the near plane, as a part of the scene's diagonal. Depth is near / distance in f32, whose relative precision is the same at all
/// distances, so that the plane may be this near; what is nearer still is not seen.
const NEAR: f64 = 1e-6;

/// The triangles of a scene, as a rasteriser sees them.
pub struct Visibility {
    raster: Raster,
    size: [u32; 2],
    triangles: u32,
    near: f32,
}

impl Visibility {
    /// Compiles the rasterisation of a scene to images of this size.
    ///
    /// # Errors
    /// The rays of a structure are of another space, the image exceeds a limit of the adapter, or
    /// the kernel does not compile.
    pub(super) fn new(
        gpu: &Gpu,
        scene: &SceneBuffers,
        space: Space,
        size: [u32; 2],
    ) -> Result<Self, GpuError> {
        if let Some(reason) = refusal(space) {
            return Err(GpuError::Kernel(reason.to_owned()));
        }
        let kernel = Composition::new("integrator/visibility");
        let kernel = scene.triangles.intersection.activate(kernel);
        Ok(Self {
            raster: gpu.raster(&kernel, &scene.triangles.bindings, size)?,
            size,
            triangles: scene.triangle_count,
            near: (NEAR * scene.diagonal) as f32,
        })
    }

    /// Draws what a camera sees, and tells the wall time of it.
    ///
    /// # Errors
    /// The driver complains, or the device is lost or hangs.
    pub fn draw(&self, camera: Camera) -> Result<Elapsed, GpuError> {
        let [forward, right, up] = camera.basis(self.size);
        let view = UniformValues::new()
            .vec("eye", &camera.eye.to_array())
            .f32("near", self.near)
            .vec("right", &right.to_array())
            .vec("up", &up.to_array())
            .vec("forward", &forward.to_array())
            .vec("size", &self.size.map(|pixels| pixels as f32));
        self.raster.draw(self.triangles, ("view", view))
    }

    /// The words as they lie on the device.
    pub(super) fn words(&self) -> &wgpu::Buffer {
        self.raster.words()
    }

    /// The triangle of each pixel, row by row from the top; [`NO_HIT`](raystone_accel::NO_HIT) where there is none.
    ///
    /// # Errors
    /// The device is lost or hangs.
    pub fn triangles(&self) -> Result<Vec<u32>, GpuError> {
        self.raster.read()
    }
}

/// Why what is met in this space is not rasterised.
pub(super) fn refusal(space: Space) -> Option<&'static str> {
    (space == Space::Instances).then_some(
        "primary = raster: this structure meets triangles in the space of their objects, and the rasteriser in that of the world; take another structure, or `traced` or `centre`",
    )
}
