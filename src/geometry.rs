//! Triangles and the camera: what experiments, scenes, structures and the oracle have in common.

use glam::Vec3;
use serde::{Deserialize, Serialize};

/// One triangle in world space, vertices in the order of the file (f32, scene units).
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Triangle {
    /// The three corners.
    pub vertices: [Vec3; 3],
}

impl Triangle {
    /// The triangle whose corners are what `to` makes of this one's.
    pub fn map(self, to: impl FnMut(Vec3) -> Vec3) -> Self {
        self.vertices.map(to).into()
    }
}

impl From<[Vec3; 3]> for Triangle {
    fn from(vertices: [Vec3; 3]) -> Self {
        Self { vertices }
    }
}

/// A pinhole camera. Rays start at `eye`; pixel (0, 0) is the top left one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// Position of the pinhole, scene units.
    pub eye: Vec3,
    /// Point that projects to the centre of the image.
    pub target: Vec3,
    /// Up direction; need not be normalised or orthogonal to the viewing direction.
    pub up: Vec3,
    /// Vertical field of view, degrees, in (0, 180).
    pub vertical_fov_degrees: f32,
}

impl Camera {
    /// A camera for which y is up.
    pub fn upright(eye: Vec3, target: Vec3, vertical_fov_degrees: f32) -> Self {
        Self {
            eye,
            target,
            up: Vec3::Y,
            vertical_fov_degrees,
        }
    }
}
