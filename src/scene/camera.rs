//! Where the image is taken from: validation and automatic framing.

use super::{Camera, SceneError, Triangle};
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

/// Vertical field of view of an automatic camera, degrees.
const FRAMING_FOV_DEGREES: f32 = 40.0;

impl Camera {
    /// A three-quarter view from the front, right and above (y up) whose image contains the
    /// bounding sphere of `bounds` when the image is at least as wide as it is high.
    ///
    /// Empty bounds are framed as the unit box around the origin.
    pub fn frame(bounds: &Bounds) -> Self {
        let (center, radius) = if bounds.is_empty() {
            (Vec3::ZERO, 1.0)
        } else {
            (bounds.center(), bounds.radius())
        };
        // A single point is still looked at from somewhere else.
        let radius = radius.max(1e-3 * center.abs().max_element()).max(1e-6);
        let half_angle = 0.5 * FRAMING_FOV_DEGREES.to_radians();
        let distance = 1.05 * radius / half_angle.sin();
        Self {
            eye: center + distance * Vec3::new(0.55, 0.4, 0.75).normalize(),
            target: center,
            up: Vec3::Y,
            vertical_fov_degrees: FRAMING_FOV_DEGREES,
        }
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

    fn unit_box() -> Bounds {
        Bounds {
            min: Vec3::new(-1.0, 0.0, 2.0),
            max: Vec3::new(3.0, 5.0, 4.0),
        }
    }

    /// Largest |tan| of the angle between the view and a corner, over tan(fov / 2).
    fn largest_image_coordinate(camera: &Camera, bounds: &Bounds) -> f32 {
        let forward = (camera.target - camera.eye).normalize();
        let tangent = (0.5 * camera.vertical_fov_degrees.to_radians()).tan();
        (0..8)
            .map(|corner| {
                let pick = |axis: usize| [bounds.min[axis], bounds.max[axis]][corner >> axis & 1];
                let to = Vec3::new(pick(0), pick(1), pick(2)) - camera.eye;
                let depth = to.dot(forward);
                assert!(depth > 0.0);
                (to - depth * forward).length() / depth / tangent
            })
            .fold(0.0, f32::max)
    }

    #[test]
    fn framing_shows_the_whole_box_and_fills_the_image() {
        let camera = Camera::frame(&unit_box());
        camera.validate().unwrap();
        let extent = largest_image_coordinate(&camera, &unit_box());
        assert!((0.5..1.0).contains(&extent), "{extent}");
        let near = Camera {
            eye: camera.target + 0.5 * (camera.eye - camera.target),
            ..camera
        };
        assert!(largest_image_coordinate(&near, &unit_box()) > 1.0);
    }

    #[test]
    fn degenerate_bounds_still_give_a_valid_camera() {
        Camera::frame(&Bounds::EMPTY).validate().unwrap();
        for point in [Vec3::ZERO, Vec3::splat(1e6), Vec3::splat(-1e16)] {
            Camera::frame(&Bounds::EMPTY.extend(point))
                .validate()
                .unwrap();
        }
    }

    #[test]
    fn cameras_that_see_nothing_are_refused() {
        let good = Camera::frame(&unit_box());
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
