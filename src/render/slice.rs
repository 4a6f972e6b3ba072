//! The rows and samples of one dispatch, and their values for `kernels/integrator/frame.wesl`.

use super::RenderJob;
use super::tables::SceneBuffers;
use raystone_core::geometry::Camera;
use raystone_gpu::UniformValues;

/// The rows and samples of one dispatch.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Slice {
    /// First row of the band whose sums are bound.
    pub band_row: u32,
    pub first_row: u32,
    pub rows: u32,
    pub first_sample: u32,
    pub samples: u32,
    pub seed: u32,
}

/// Adds the camera of an image of this size to the values of a job.
pub(super) fn lens(values: UniformValues, camera: Camera, size: [u32; 2]) -> UniformValues {
    let [forward, right, up] = camera.basis(size).map(|v| v.to_array());
    values
        .vec("eye", &camera.eye.to_array())
        .vec("forward", &forward)
        .vec("right", &right)
        .vec("up", &up)
}

/// Values common to all slices of a job.
pub(super) fn job_uniform(job: &RenderJob, scene: &SceneBuffers) -> UniformValues {
    let [width, height] = job.size;
    let ao_radius = job.integrator.facts.ao_radius.unwrap_or(0.0) * scene.diagonal;
    let values = lens(UniformValues::new(), job.camera, job.size);
    let values = scene.lights.uniform(values);
    let values = scene.transform_error.uniform(values);
    values
        .vec("environment", &scene.environment)
        .u32("width", width)
        .u32("height", height)
        .u32("first_uv", scene.first_uv)
        .u32("first_normal", scene.first_normal)
        .u32("first_color", scene.first_color)
        .u32("first_mirrored", scene.first_mirrored)
        .u32("first_mirror", scene.mirrors.first_mirror)
        .u32("mirror_nodes", scene.mirrors.mirror_nodes)
        .u32("first_connecting", scene.mirrors.first_connecting)
        .f32("ao_radius", ao_radius as f32)
        .vec("sky_up", &scene.daylight.up.to_array())
        .vec("sky_key", &scene.daylight.key.to_array())
        .f32(
            "sky_reach",
            if scene.features.daylight {
                scene.daylight.reach
            } else {
                0.0
            },
        )
}

impl Slice {
    /// The uniform `frame` for this slice of a job.
    pub(crate) fn uniform(&self, of_job: &UniformValues) -> UniformValues {
        of_job
            .clone()
            .u32("band_row", self.band_row)
            .u32("first_row", self.first_row)
            .u32("rows", self.rows)
            .u32("first_sample", self.first_sample)
            .u32("samples", self.samples)
            .u32("seed", self.seed)
    }
}
