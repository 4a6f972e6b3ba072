//! Lights of glTF documents: `KHR_lights_punctual`.

use super::Light;
use glam::{Mat4, Vec3};
use gltf::khr_lights_punctual::{Kind, Light as Source};

/// A light of a node with this transform. It shines along −z; scaling does not change its intensity, which is in
/// candela (point, spot) or lux (directional), so that radiance is in nits. What is wrong with it is found out where lights
/// are listed. Its range is no matter of physics and not honoured.
pub(super) fn read(light: &Source<'_>, world: Mat4) -> Light {
    let color = Vec3::from(light.color()) * light.intensity();
    let position = world.transform_point3(Vec3::ZERO);
    let direction = world.transform_vector3(Vec3::NEG_Z);
    match light.kind() {
        Kind::Point => Light::Point {
            position,
            intensity: color,
        },
        Kind::Directional => Light::Directional {
            direction,
            irradiance: color,
        },
        Kind::Spot {
            inner_cone_angle,
            outer_cone_angle,
        } => Light::Spot {
            position,
            direction,
            intensity: color,
            inner: inner_cone_angle,
            outer: outer_cone_angle,
            decay: true,
        },
    }
}
