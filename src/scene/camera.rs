//! Bounding boxes and camera checks.

use super::SceneError;
use glam::Vec3;
use raystone_core::geometry::{Camera, Triangle};

/// An axis-aligned box in scene units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Minimum corner.
    pub min: Vec3,
    /// Maximum corner.
    pub max: Vec3,
}

impl Bounds {
    /// The empty box, the identity of [`Bounds::extend`].
    pub const EMPTY: Self = Self {
        min: Vec3::INFINITY,
        max: Vec3::NEG_INFINITY,
    };

    /// Bounding box of `triangles`; [`Bounds::EMPTY`] if there are none.
    pub fn of(triangles: &[Triangle]) -> Self {
        triangles
            .iter()
            .flat_map(|triangle| triangle.vertices)
            .fold(Self::EMPTY, Self::extend)
    }

    /// The smallest box that contains `self` and `point`.
    #[must_use]
    pub fn extend(self, point: Vec3) -> Self {
        Self {
            min: self.min.min(point),
            max: self.max.max(point),
        }
    }

    /// True if the box contains no point.
    pub fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    /// Centre of the box.
    pub fn center(&self) -> Vec3 {
        0.5 * (self.min + self.max)
    }

    /// Radius of the circumscribed sphere.
    pub fn radius(&self) -> f32 {
        0.5 * (self.max - self.min).length()
    }
}

/// Checks that the camera defines an image.
///
/// # Errors
/// [`SceneError::Camera`] if a component is not finite, the field of view is not in
/// (0, 180) degrees, `eye` equals `target`, or `up` is zero or parallel to the view.
pub fn check_camera(camera: &Camera) -> Result<(), SceneError> {
    let error = |problem: String, advice| Err(SceneError::Camera { problem, advice });
    let vectors = [
        ("eye", camera.eye),
        ("target", camera.target),
        ("up", camera.up),
    ];
    if let Some((name, value)) = vectors.iter().find(|(_, v)| !v.is_finite()) {
        return error(
            format!("`{name}` is {value}"),
            "all coordinates must be finite",
        );
    }
    let fov = camera.vertical_fov_degrees;
    if !(fov > 0.0 && fov < 180.0) {
        return error(
            format!("the vertical field of view is {fov} degrees"),
            "give an angle between 0 and 180, for example 40",
        );
    }
    let view = (camera.target - camera.eye).as_dvec3();
    if view == glam::DVec3::ZERO {
        return error(
            format!("`eye` and `target` are both {}", camera.eye),
            "move one of them",
        );
    }
    let up = camera.up.as_dvec3().normalize_or_zero();
    if view.normalize().cross(up).length() < 1e-6 {
        return error(
            format!("`up` {} is zero or parallel to the view", camera.up),
            "give a vector across the viewing direction",
        );
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cameras_that_see_nothing_are_refused() {
        let good = Camera::upright(Vec3::ONE, Vec3::ZERO, 40.0);
        check_camera(&good).unwrap();
        let bad: [fn(&mut Camera); 7] = [
            |c| c.vertical_fov_degrees = 0.0,
            |c| c.vertical_fov_degrees = 180.0,
            |c| c.vertical_fov_degrees = f32::NAN,
            |c| c.eye = c.target,
            |c| c.up = c.target - c.eye,
            |c| c.up = Vec3::ZERO,
            |c| c.eye.x = f32::INFINITY,
        ];
        for (index, change) in bad.iter().enumerate() {
            let mut camera = good;
            change(&mut camera);
            assert!(check_camera(&camera).is_err(), "case {index}");
        }
    }
}
