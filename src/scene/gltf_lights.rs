//! Lights of glTF documents: `KHR_lights_punctual`.

use super::Light;
use super::gltf_document::Item;
use glam::{Mat4, Vec3};
use std::f32::consts::FRAC_PI_4;

const EXTENSION: &str = "KHR_lights_punctual";

/// The index of a node's light, if it has one.
pub(super) fn of_node(node: Item<'_>) -> Option<usize> {
    node.extension(EXTENSION).index("light")
}

/// True if a light says how far it reaches, which is not read: light has no end.
pub(super) fn has_range(document: Item<'_>, index: usize) -> bool {
    let light = document.extension(EXTENSION).at("lights", index);
    light.is_some_and(|light| light.number("range").is_some())
}

/// Converts a light; `None` if there is none of this number, or of an unknown type. It shines along
/// −z; scaling leaves its intensity alone, in candela (point, spot) or lux (directional), so
/// radiance is in nits. The light list validates it. Its range is not physical and is ignored.
pub(super) fn read(document: Item<'_>, index: usize, world: Mat4) -> Option<Light> {
    let light = document.extension(EXTENSION).at("lights", index)?;
    let color = Vec3::from(light.vector("color", [1.0; 3]));
    let color = color * light.number("intensity").unwrap_or(1.0);
    let position = world.transform_point3(Vec3::ZERO);
    let direction = world.transform_vector3(Vec3::NEG_Z);
    let spot = light.get("spot");
    Some(match light.text("type")? {
        "point" => Light::Point {
            position,
            intensity: color,
        },
        "directional" => Light::Directional {
            direction,
            irradiance: color,
        },
        "spot" => Light::Spot {
            position,
            direction,
            intensity: color,
            inner: spot.number("innerConeAngle").unwrap_or(0.0),
            outer: spot.number("outerConeAngle").unwrap_or(FRAC_PI_4),
            decay: true,
        },
        _ => return None,
    })
}
