//! The pinhole camera.

use glam::{DVec2, DVec3};
use raystone_core::geometry::Camera;

/// A camera with its image plane.
pub(crate) struct Lens {
    pub eye: DVec3,
    forward: DVec3,
    /// Half the image at distance 1.
    right: DVec3,
    up: DVec3,
    size: DVec2,
}

impl Lens {
    pub(crate) fn new(camera: &Camera, [width, height]: [u32; 2]) -> Self {
        let size = DVec2::new(width.into(), height.into());
        let eye = camera.eye.as_dvec3();
        let forward = (camera.target.as_dvec3() - eye).normalize();
        let right = forward.cross(camera.up.as_dvec3()).normalize();
        let half_height = (f64::from(camera.vertical_fov_degrees).to_radians() / 2.0).tan();
        Self {
            eye,
            forward,
            right: right * (half_height * size.x / size.y),
            up: right.cross(forward) * half_height,
            size,
        }
    }

    /// Direction of the ray through the point (u, v) of a pixel; rows and v run downwards.
    pub(crate) fn direction(&self, pixel: [u32; 2], [u, v]: [f64; 2]) -> DVec3 {
        let [column, row] = pixel.map(f64::from);
        let across = 2.0 * (column + u) / self.size.x - 1.0;
        let down = 2.0 * (row + v) / self.size.y - 1.0;
        (self.forward + self.right * across - self.up * down).normalize()
    }
}
