//! Radiance of rays that leave the scene.

use glam::DVec3;
use raystone_scene::SceneData;

/// The environment's radiance, times the sky's if the scene has no light of its own.
pub(super) fn radiance(scene: &SceneData, direction: DVec3) -> DVec3 {
    let constant = scene.environment.as_dvec3();
    let Some(sky) = &scene.daylight else {
        return constant;
    };
    let height = direction.dot(sky.up.as_dvec3());
    let t = ((height + 0.6) / 1.4).clamp(0.0, 1.0);
    let grey = 0.12 + 0.38 * t * t * (3.0 - 2.0 * t);
    let key = 10.0 * direction.dot(sky.key.as_dvec3()).max(0.0).powi(16);
    constant * (DVec3::splat(grey) + key * DVec3::new(1.0, 0.96, 0.9))
}
