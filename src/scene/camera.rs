//! Where the image is taken from: boxes around scenes, and cameras that see something.

use super::SceneError;
use crate::geometry::{Camera, Triangle};
use glam::Vec3;

/// An axis-aligned box, scene units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Least corner.
    pub min: Vec3,
    /// Greatest corner.
    pub max: Vec3,
}

impl Bounds {
    /// The box that contains nothing; neutral to [`Bounds::extend`].
    pub const EMPTY: Self = Self {
        min: Vec3::INFINITY,
        max: Vec3::NEG_INFINITY,
    };

    /// The box of `triangles`; [`Bounds::EMPTY`] if there are none.
    pub fn of(triangles: &[Triangle]) -> Self {
        triangles
            .iter()
            .flat_map(|triangle| triangle.vertices)
            .fold(Self::EMPTY, Self::extend)
    }

    /// The least box that contains `self` and `point`.
    #[must_use]
    pub fn extend(self, point: Vec3) -> Self {
        Self {
            min: self.min.min(point),
            max: self.max.max(point),
        }
    }

    /// Whether the box contains no point.
    pub fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    /// Middle of the box.
    pub fn center(&self) -> Vec3 {
        0.5 * (self.min + self.max)
    }

    /// Radius of the sphere through the corners.
    pub fn radius(&self) -> f32 {
        0.5 * (self.max - self.min).length()
    }
}

impl Camera {
    /// Unit viewing direction, and half the plane of an image of so many pixels at distance 1, to the right
    /// and upwards.
    pub fn basis(&self, [width, height]: [u32; 2]) -> [Vec3; 3] {
        let forward = (self.target - self.eye).normalize();
        let right = forward.cross(self.up).normalize();
        let up = right.cross(forward);
        let half_height = (0.5 * self.vertical_fov_degrees.to_radians()).tan();
        let half_width = half_height * width as f32 / height as f32;
        [forward, right * half_width, up * half_height]
    }

    /// Checks that the camera defines an image.
    ///
    /// # Errors
    /// [`SceneError::Camera`] if a component is not finite, the field of view is not in
    /// (0, 180) degrees, `eye` equals `target`, or `up` is zero or parallel to the view.
    pub fn validate(&self) -> Result<(), SceneError> {
        let error = |problem: String, advice| Err(SceneError::Camera { problem, advice });
        let vectors = [("eye", self.eye), ("target", self.target), ("up", self.up)];
        if let Some((name, value)) = vectors.iter().find(|(_, v)| !v.is_finite()) {
            return error(
                format!("`{name}` is {value}"),
                "all coordinates must be finite",
            );
        }
        let fov = self.vertical_fov_degrees;
        if !(fov > 0.0 && fov < 180.0) {
            return error(
                format!("the vertical field of view is {fov} degrees"),
                "give an angle between 0 and 180, for example 40",
            );
        }
        let view = (self.target - self.eye).as_dvec3();
        if view == glam::DVec3::ZERO {
            return error(
                format!("`eye` and `target` are both {}", self.eye),
                "move one of them",
            );
        }
        let up = self.up.as_dvec3().normalize_or_zero();
        if view.normalize().cross(up).length() < 1e-6 {
            return error(
                format!("`up` {} is zero or parallel to the view", self.up),
                "give a vector across the viewing direction",
            );
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cameras_that_see_nothing_are_refused() {
        let good = Camera::upright(Vec3::ONE, Vec3::ZERO, 40.0);
        good.validate().unwrap();
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
            assert!(camera.validate().is_err(), "case {index}");
        }
    }
}
