//! Camera and image numbers for `kernels/integrator/frame.wesl`.

use super::tables::SceneBuffers;
use crate::geometry::Camera;
use crate::gpu::UniformValues;
use glam::Vec3;

/// What is rendered.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    /// Image width, pixels.
    pub width: u32,
    /// Image height, pixels.
    pub height: u32,
    /// The camera.
    pub camera: Camera,
    /// Length of AO rays, scene units.
    pub ao_radius: f32,
}

/// The rows and samples of one dispatch.
#[derive(Debug, Clone, Copy)]
pub(super) struct Slice {
    /// First row of the band whose sums are bound.
    pub band_row: u32,
    pub first_row: u32,
    pub rows: u32,
    pub first_sample: u32,
    pub samples: u32,
    pub seed: u32,
}

impl Frame {
    /// Unit viewing direction, and half the image plane at distance 1 to the right and upwards.
    pub fn basis(&self) -> [Vec3; 3] {
        let forward = (self.camera.target - self.camera.eye).normalize();
        let right = forward.cross(self.camera.up).normalize();
        let up = right.cross(forward);
        let half_height = (0.5 * self.camera.vertical_fov_degrees.to_radians()).tan();
        let half_width = half_height * self.width as f32 / self.height as f32;
        [forward, right * half_width, up * half_height]
    }

    pub(super) fn uniform(&self, scene: &SceneBuffers, slice: &Slice) -> UniformValues {
        let [forward, right, up] = self.basis().map(|v| v.to_array());
        UniformValues::new()
            .vec("eye", &self.camera.eye.to_array())
            .vec("forward", &forward)
            .vec("right", &right)
            .vec("up", &up)
            .vec("environment", &scene.environment)
            .u32("width", self.width)
            .u32("height", self.height)
            .u32("band_row", slice.band_row)
            .u32("first_row", slice.first_row)
            .u32("rows", slice.rows)
            .u32("first_sample", slice.first_sample)
            .u32("samples", slice.samples)
            .u32("seed", slice.seed)
            .u32("lights", scene.lights)
            .u32("first_light", scene.first_light)
            .u32("first_uv", scene.first_uv)
            .f32("light_power", scene.light_power)
            .f32("ao_radius", self.ao_radius)
            .f32("transform_scale", scene.transform_error.scale)
            .f32("transform_shift", scene.transform_error.shift)
            .vec("sky_up", &scene.daylight.up.to_array())
            .vec("sky_key", &scene.daylight.key.to_array())
            .f32("sky_reach", scene.daylight.reach)
    }
}
