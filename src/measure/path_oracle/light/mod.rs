//! Lights, one file for each way of shining, from `docs/shading.md`.

mod delta;
mod flat;
mod sky;
mod sphere;

use super::PathOracle;
use super::hits::Segment;
use super::rounding::Rounding;
use super::surface::Surface;
use crate::scene::{Light, LightList, SceneData, Source};
use glam::DVec3;
use std::collections::BTreeMap;

/// What lights are chosen by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Choice {
    /// Their power.
    Power,
    /// Nothing.
    Uniform,
    /// All are sampled.
    All,
}

/// What shines on a scene.
pub(super) struct Lights {
    list: LightList,
    power: f64,
    /// The light of an emissive triangle.
    owners: BTreeMap<u32, usize>,
    /// The lights that rays meet though they have no triangles.
    spheres: Vec<(usize, sphere::Ball)>,
}

/// A point of a light, as a surface sees it.
pub(super) struct LightSample {
    pub direction: DVec3,
    pub distance: f64,
    /// Radiance; irradiance of a surface that faces a delta light.
    pub radiance: DVec3,
    /// Over solid angle, without the choice of the light in it; `None` for delta lights.
    pub density: Option<f64>,
    /// The triangle that the point lies on.
    pub triangle: Option<u32>,
}

impl Lights {
    /// The lights of a scene.
    ///
    /// # Errors
    /// One of them is of a kind that the oracle has no formula for.
    pub fn new(scene: &SceneData) -> Result<Self, String> {
        let list = LightList::of(scene);
        let mut owners = BTreeMap::new();
        let mut spheres = Vec::new();
        for (place, light) in list.lights.iter().enumerate() {
            match light.source {
                Source::Triangle(id) => _ = owners.insert(id, place),
                Source::Parallelogram(of) => owners.extend(of.triangles.map(|id| (id, place))),
                Source::Light(id) => match &scene.lights[id as usize] {
                    light @ Light::Sphere { .. } => {
                        spheres.extend(sphere::Ball::of(light).map(|ball| (place, ball)));
                    }
                    Light::Point { .. } | Light::Spot { .. } | Light::Directional { .. } => {}
                    other => return Err(format!("light `{}`", other.kind().name)),
                },
            }
        }
        let power = list.lights.iter().map(|light| light.power).sum();
        Ok(Self {
            list,
            power,
            owners,
            spheres,
        })
    }

    /// Whether there is nothing to sample.
    pub fn are_none(&self) -> bool {
        self.list.lights.is_empty()
    }

    /// Probability with which a light is chosen.
    fn share(&self, light: usize, choice: Choice) -> f64 {
        match choice {
            Choice::Power => self.list.lights[light].power / self.power,
            Choice::Uniform => 1.0 / self.list.lights.len() as f64,
            Choice::All => 1.0,
        }
    }

    /// The lights that are sampled, with the probability of each.
    pub fn chosen(
        &self,
        choice: Choice,
        number: f64,
        rounding: &mut Rounding,
    ) -> Vec<(usize, f64)> {
        let lights = 0..self.list.lights.len();
        if choice == Choice::All {
            return lights.map(|light| (light, 1.0)).collect();
        }
        let number = rounding.share(number);
        let mut below = 0.0;
        let last = lights.end.saturating_sub(1);
        let found = lights.map(|light| (light, self.share(light, choice)));
        let mut found = found.skip_while(|(light, share)| {
            below += share;
            number >= below && *light < last
        });
        found.next().into_iter().collect()
    }
}

/// The point of the k-th light where all are sampled.
pub(super) fn moved([u, v]: [f64; 2], k: usize) -> [f64; 2] {
    let k = k as f64;
    [
        (u + k * 0.754_877_666_246_692_7).fract(),
        (v + k * 0.569_840_290_998_053_2).fract(),
    ]
}

impl PathOracle<'_> {
    /// A point of a light.
    pub(super) fn light_sample(
        &self,
        surface: &Surface,
        light: usize,
        point: [f64; 2],
        rounding: &mut Rounding,
    ) -> Option<LightSample> {
        let from = surface.seen_from(rounding);
        match self.lights.list.lights[light].source {
            Source::Light(id) => match &self.scene.lights[id as usize] {
                light @ Light::Sphere { .. } => sphere::Ball::of(light)?.sample(from, point),
                light => delta::sample(light, from),
            },
            flat => flat::sample((self.scene, &self.textures), flat, from, point, rounding),
        }
    }

    /// With what density light samples find the point of an emitter that a ray has met.
    pub(super) fn light_density(&self, emitter: &Surface, distance: f64, choice: Choice) -> f64 {
        let lights = &self.lights;
        lights.owners.get(&emitter.triangle).map_or(0.0, |light| {
            let cos = emitter.geometric.dot(emitter.out);
            let area = lights.list.lights[*light].area;
            lights.share(*light, choice) * distance * distance / (area * cos)
        })
    }

    /// The nearest sphere before `end` on a ray: its radiance, and the density with which light samples find the direction.
    pub(super) fn sphere_met(
        &self,
        ray: &Segment,
        end: f64,
        choice: Choice,
    ) -> Option<(DVec3, f64)> {
        let met = self.lights.spheres.iter().filter_map(|(light, ball)| {
            let distance = ball.meet(ray)?;
            (distance < end).then_some((light, ball, distance))
        });
        let (light, ball, _) = met.min_by(|a, b| a.2.total_cmp(&b.2))?;
        let density = ball.density(ray.origin, ray.direction);
        Some((ball.radiance, self.lights.share(*light, choice) * density))
    }

    /// Whether anything lies on the way to a light.
    pub(super) fn shadowed(&self, shadow: &Segment, light: usize) -> bool {
        let balls = self.lights.spheres.iter();
        let mut others = balls.filter(|(place, _)| *place != light);
        others.any(|(_, ball)| ball.meet(shadow).is_some_and(|d| d < shadow.length))
            || self.hits.blocked(shadow)
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
