//! Lights of glTF documents: `KHR_lights_punctual`.

use super::Light;
use glam::{Mat4, Vec3};
use gltf::khr_lights_punctual::{Kind, Light as Source};

/// Converts a node's light. It shines along −z; scaling leaves its intensity alone, in candela
/// (point, spot) or lux (directional), so radiance is in nits. The light list validates it. Its
/// range is not physical and is ignored.
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
