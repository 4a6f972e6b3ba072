//! Lights of one direction: points, cones, measured luminaires, and light from infinitely far away.

use super::LightSample;
use super::ies::candela;
use crate::path_oracle::rounding::Rounding;
use glam::DVec3;
use raystone_scene::Light;

/// Distance of what has none.
const FAR: f64 = 1e30;

pub(super) fn sample(light: &Light, from: DVec3, rounding: &mut Rounding) -> Option<LightSample> {
    let towards = |place: glam::Vec3| {
        let to_light = place.as_dvec3() - from;
        (to_light.normalize(), to_light.length())
    };
    let (direction, distance, radiance) = match light {
        Light::Point {
            position,
            intensity,
        } => {
            let (direction, distance) = towards(*position);
            (
                direction,
                distance,
                intensity.as_dvec3() / (distance * distance),
            )
        }
        Light::Spot {
            position,
            direction: axis,
            intensity,
            inner,
            outer,
            decay,
        } => {
            let (direction, distance) = towards(*position);
            let [inner, outer] = [inner, outer].map(|angle| f64::from(*angle).cos());
            let cos = -direction.dot(axis.as_dvec3().normalize());
            let step = ((cos - outer) / (inner - outer).max(1e-4)).clamp(0.0, 1.0);
            let falloff = if *decay { distance * distance } else { 1.0 };
            (
                direction,
                distance,
                intensity.as_dvec3() * (step * step / falloff),
            )
        }
        Light::Ies {
            position,
            rotation,
            color,
            profile,
        } => {
            let (direction, distance) = towards(*position);
            let candela = candela(profile, *rotation, -direction, rounding);
            let falloff = distance * distance;
            (direction, distance, color.as_dvec3() * (candela / falloff))
        }
        Light::Directional {
            direction,
            irradiance,
        } => (
            -direction.as_dvec3().normalize(),
            FAR,
            irradiance.as_dvec3(),
        ),
        _ => return None,
    };
    (radiance.max_element() > 0.0).then_some(LightSample {
        direction,
        distance,
        radiance,
        density: None,
        triangles: None,
    })
}
