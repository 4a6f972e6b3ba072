//! Primary visibility by rasterisation: a G-buffer of one word per pixel, the triangle seen at its
//! centre.
//!
//! T. Saito, T. Takahashi, "Comprehensible rendering of 3-D shapes", SIGGRAPH 1990. Paths with
//! `primary = "raster"` begin there, with distance and weights from the run's triangle test, so
//! that a path whose triangle a ray would also have found is bit-identical. Only the choice of the
//! triangle may differ: rasterisers snap vertices to a subpixel grid, and compare interpolated
//! depths. Kernels: `kernels/integrator/visibility.wesl` draws, `visible.wesl` beside it reads.

use super::tables::SceneBuffers;
use raystone_accel::Space;
use raystone_core::geometry::Camera;
use raystone_gpu::{Composition, Elapsed, Gpu, GpuError, Raster, UniformValues};

/// Distance of the near plane, as a fraction of the scene's diagonal. Depth is near / distance in
/// f32, equally precise at all distances, so it may be this near; anything nearer is not seen.
const NEAR: f64 = 1e-6;

/// The triangles of a scene, for rasterisation.
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
    /// The structure's rays are in another space, the image exceeds a limit of the adapter, or the
    /// kernel does not compile.
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

    /// Draws the view of a camera, and returns the wall time.
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

    pub(super) fn words(&self) -> &wgpu::Buffer {
        self.raster.words()
    }

    /// The triangle of each pixel, row by row; [`NO_HIT`](raystone_accel::NO_HIT) for none.
    ///
    /// # Errors
    /// The device is lost or hangs.
    pub fn triangles(&self) -> Result<Vec<u32>, GpuError> {
        self.raster.read()
    }
}

/// The reason why this space cannot be rasterised, if any.
pub(super) fn refusal(space: Space) -> Option<&'static str> {
    (space == Space::Instances).then_some(
        "primary = raster: this structure meets triangles in the space of their objects, and the rasteriser in that of the world; take another structure, or `traced` or `centre`",
    )
}
