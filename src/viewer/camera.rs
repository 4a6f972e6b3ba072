//! Moves of the camera: around its target, or through the scene.

use glam::{Quat, Vec2, Vec3};
use raystone_core::geometry::Camera;

/// Least angle between view and vertical, radians: there the image would turn over.
const POLE: f32 = 0.01;

/// A move of the camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Motion {
    /// Around the target: to the right, and up, radians.
    Orbit([f32; 2]),
    /// Looks to the right, and up, radians; the eye stays.
    Turn([f32; 2]),
    /// Eye and target along the image: to the right, and up, in heights of the image at the target.
    Pan([f32; 2]),
    /// The distance to the target, times this.
    Approach(f32),
    /// Eye and target to the right, up, and forward, in distances from the eye to the target.
    Fly([f32; 3]),
}

/// The camera after a move; it stays where it is if the move leads to no valid one.
#[must_use]
pub fn moved(camera: Camera, motion: Motion) -> Camera {
    let view = camera.target - camera.eye;
    let (forward, up) = (view.normalize_or_zero(), camera.up.normalize_or_zero());
    let right = forward.cross(up).normalize_or_zero();
    let across = right.cross(forward);
    let distance = view.length();
    let mut next = camera;
    match motion {
        Motion::Orbit([x, y]) => {
            next.eye = camera.target - turned(view, (up, right), [x, -y]);
        }
        Motion::Turn([x, y]) => {
            next.target = camera.eye + turned(view, (up, right), [-x, y]);
        }
        Motion::Pan([x, y]) => {
            let height = 2.0 * distance * (0.5 * camera.vertical_fov_degrees.to_radians()).tan();
            let shift = (right * x + across * y) * height;
            (next.eye, next.target) = (camera.eye + shift, camera.target + shift);
        }
        Motion::Approach(times) => next.eye = camera.target - view * times,
        Motion::Fly([x, y, z]) => {
            let shift = (right * x + up * y + forward * z) * distance;
            (next.eye, next.target) = (camera.eye + shift, camera.target + shift);
        }
    }
    match raystone_scene::check_camera(&next) {
        Ok(()) => next,
        Err(_) => camera,
    }
}

/// A view, turned about the vertical, and up to the poles.
fn turned(view: Vec3, (up, right): (Vec3, Vec3), [about_up, about_right]: [f32; 2]) -> Vec3 {
    let angle = view.angle_between(up);
    let most = (angle - POLE).max(0.0);
    let least = (angle - (std::f32::consts::PI - POLE)).min(0.0);
    let pitched = Quat::from_axis_angle(right, about_right.clamp(least, most)) * view;
    Quat::from_axis_angle(up, about_up) * pitched
}

/// Where a point lies in an image of this size, pixels from the top left; `None` behind the eye.
pub fn projected(camera: &Camera, size: [u32; 2], point: Vec3) -> Option<[f32; 2]> {
    let [forward, right, up] = camera.basis(size);
    let d = point - camera.eye;
    let depth = d.dot(forward);
    if depth <= 1e-6 * d.length() || depth <= 0.0 {
        return None;
    }
    let plane = Vec2::new(
        d.dot(right) / right.length_squared(),
        -d.dot(up) / up.length_squared(),
    ) / depth;
    let extent = Vec2::new(size[0] as f32, size[1] as f32);
    Some((0.5 * (plane + 1.0) * extent).to_array())
}

#[cfg(test)]
mod tests {
    use super::*;
    use raystone_verify::rays::{primary_pixels, primary_rays};

    fn camera() -> Camera {
        Camera::upright(Vec3::new(3.0, 1.0, 2.0), Vec3::new(0.5, 0.2, -0.1), 50.0)
    }

    #[test]
    fn orbits_keep_the_distance_and_turns_keep_the_eye() {
        let start = camera();
        let distance = |c: Camera| (c.eye - c.target).length();
        let orbit = moved(start, Motion::Orbit([0.4, 0.3]));
        assert!((distance(orbit) - distance(start)).abs() < 1e-5);
        assert_eq!(orbit.target, start.target);
        assert!(orbit.eye.y > start.eye.y, "up is up");
        let turn = moved(start, Motion::Turn([0.2, 0.1]));
        assert_eq!(turn.eye, start.eye);
        assert!(turn.target.y > start.target.y);
        let [_, right, _] = start.basis([4, 3]);
        assert!(
            (turn.target - start.target).dot(right) > 0.0,
            "right is right"
        );
        let forward = (start.target - start.eye).normalize();
        for (axis, along) in [right.normalize(), start.up.normalize(), forward]
            .into_iter()
            .enumerate()
        {
            let mut step = [0.0; 3];
            step[axis] = 0.1;
            let flown = moved(start, Motion::Fly(step));
            let shift = along * 0.1 * distance(start);
            assert!(
                (flown.eye - start.eye - shift).length() < 1e-5,
                "axis {axis}"
            );
            assert!(
                (flown.target - start.target - shift).length() < 1e-5,
                "axis {axis}"
            );
        }
        let back = moved(
            moved(start, Motion::Fly([0.1, 0.2, 0.3])),
            Motion::Fly([-0.1, -0.2, -0.3]),
        );
        assert!((back.eye - start.eye).length() < 1e-5);
        assert!(
            (distance(moved(start, Motion::Approach(0.5))) - 0.5 * distance(start)).abs() < 1e-5
        );
    }

    #[test]
    fn no_move_turns_the_image_over_or_leads_to_an_invalid_camera() {
        let mut camera = camera();
        for step in 0..100 {
            camera = moved(
                camera,
                Motion::Orbit([0.1, if step < 50 { 0.5 } else { -0.5 }]),
            );
            raystone_scene::check_camera(&camera).unwrap();
        }
        for motion in [
            Motion::Approach(0.0),
            Motion::Approach(f32::NAN),
            Motion::Orbit([f32::NAN, 0.0]),
            Motion::Fly([f32::INFINITY, 0.0, 0.0]),
        ] {
            assert_eq!(moved(camera, motion), camera, "{motion:?}");
        }
    }

    #[test]
    fn points_on_the_ray_of_a_pixel_lie_in_its_middle() {
        let (camera, size) = (camera(), [40, 30]);
        let rays = primary_rays(camera, size[0], size[1]);
        for (ray, pixel) in rays.iter().zip(primary_pixels(size[0], size[1])) {
            let point = Vec3::from(ray.origin) + Vec3::from(ray.direction) * 2.5;
            let [x, y] = projected(&camera, size, point).unwrap();
            assert!((x - (pixel % size[0]) as f32 - 0.5).abs() < 1e-3, "{x}");
            assert!((y - (pixel / size[0]) as f32 - 0.5).abs() < 1e-3, "{y}");
        }
        assert_eq!(projected(&camera, size, camera.eye), None);
        assert_eq!(
            projected(&camera, size, 2.0 * camera.eye - camera.target),
            None
        );
    }
}
