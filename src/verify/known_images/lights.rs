//! A floor below lights without triangles: images of the light kinds, and the sky.

use super::closed::over_hemisphere;
use super::lamps::{NEAR, on_floor, path, reflected};
use super::{KnownImage, View};
use crate::lights::LightRegistry;
use crate::trial_scenes::Trial;
use glam::{DVec3, Vec3, vec3};
use raystone_scene::{Daylight, Light, SceneError};

pub(super) fn images(kinds: &LightRegistry) -> Result<Vec<KnownImage>, SceneError> {
    let mut all = Vec::new();
    for kind in kinds.iter() {
        all.extend((kind.images)()?.into_iter().map(KnownImage::turned));
    }
    all.push(sky()?);
    Ok(all)
}

pub(crate) fn image(
    name: &'static str,
    lights: Vec<Light>,
    trial: Trial,
    views: Vec<View>,
) -> Result<KnownImage, SceneError> {
    let mut scene = on_floor(name, Vec3::ZERO)?.done(Vec::new());
    scene.lights = lights;
    Ok(KnownImage {
        name,
        scene,
        trial,
        views,
    })
}

/// The sky over scenes without a light, with the radiance given in `docs/shading.md`.
fn sky() -> Result<KnownImage, SceneError> {
    let [up, key] = [vec3(0.1, 1.0, -0.2), vec3(-0.4, 0.7, 0.5)].map(Vec3::normalize);
    let scale = vec3(1.5, 1.0, 0.5);
    let mut scene = on_floor("sky", scale)?.done(Vec::new());
    scene.daylight = Some(Daylight {
        up,
        key,
        reach: f32::MAX,
    });
    let radiance = |d: DVec3| {
        let t = ((d.dot(up.as_dvec3()) + 0.6) / 1.4).clamp(0.0, 1.0);
        let grey = 0.12 + 0.38 * t * t * (3.0 - 2.0 * t);
        let bright = 10.0 * d.dot(key.as_dvec3()).max(0.0).powi(16);
        scale.as_dvec3() * (DVec3::splat(grey) + bright * DVec3::new(1.0, 0.96, 0.9))
    };
    // Directions above z = 0 stand for those above y = 0.
    let floor = over_hemisphere(300, |d| d.z * radiance(DVec3::new(d.y, d.z, d.x)));
    let [ahead, behind] = [vec3(-0.3, 0.8, 0.5), vec3(0.6, 0.1, -0.8)].map(Vec3::normalize);
    let seen = |name, d: Vec3| View::new(name, Vec3::Y + d, -d, radiance(d.as_dvec3()));
    Ok(KnownImage {
        name: "sky",
        scene,
        trial: path(1, &[]),
        views: vec![
            View::new("floor", Vec3::ZERO, NEAR, reflected(floor)),
            seen("ahead", ahead),
            seen("behind", behind),
        ],
    })
}
