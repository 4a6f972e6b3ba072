//! Lights, one file each, from `docs/shading.md`.

mod sky;
mod triangles;

use super::PathOracle;
use super::rounding::Rounding;
use super::surface::Surface;
use crate::scene::SceneData;
use glam::DVec3;
use triangles::EmissiveTriangles;

/// What shines on a scene.
pub(super) struct Lights {
    triangles: EmissiveTriangles,
}

/// A point of a light, as a surface sees it.
pub(super) struct LightSample {
    pub direction: DVec3,
    pub distance: f64,
    pub radiance: DVec3,
    /// Over solid angle, with the choice of the light in it.
    pub density: f64,
    /// The light's triangle.
    pub triangle: u32,
}

impl Lights {
    pub fn new(scene: &SceneData) -> Self {
        Self {
            triangles: EmissiveTriangles::new(scene),
        }
    }

    /// Whether there is nothing to sample.
    pub fn are_none(&self) -> bool {
        self.triangles.is_empty()
    }
}

impl PathOracle<'_> {
    /// A point of a light, by the choice of the light and the place on it.
    pub(super) fn light_sample(
        &self,
        surface: &Surface,
        choice: f64,
        point: [f64; 2],
        rounding: &mut Rounding,
    ) -> Option<LightSample> {
        let lights = &self.lights.triangles;
        let tables = (self.scene, &self.textures);
        lights.sample(tables, surface, choice, point, rounding)
    }

    /// With what density [`PathOracle::light_sample`] finds the point of an emitter.
    pub(super) fn light_density(&self, emitter: &Surface, distance: f64) -> f64 {
        self.lights.triangles.density(emitter, distance)
    }

    /// What comes along a ray that leaves the scene.
    pub(super) fn escaped(&self, direction: DVec3) -> DVec3 {
        sky::radiance(self.scene, direction)
    }

    /// Whether a bounced ray counts as one that leaves, though it hits something so far away.
    pub(super) fn escapes(&self, distance: f64) -> bool {
        let sky = &self.scene.daylight;
        (sky.as_ref()).is_some_and(|sky| distance > f64::from(sky.reach))
    }
}
