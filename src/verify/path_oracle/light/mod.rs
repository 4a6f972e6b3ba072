//! Choice and weighting of lights, from `docs/shading.md`. Kinds are in `src/verify/lights/`.

mod sky;
mod tree;

use super::hits::{Blocked, Segment};
use super::rounding::Rounding;
use super::surface::Surface;
use super::{PathOracle, Walk};
use crate::lights::{LightChecks, LightRegistry, LightTwin, environment, flat, sphere};
use glam::DVec3;
use raystone_render::CountedRays;
use raystone_scene::{LightList, SceneData, Source};
use std::collections::BTreeMap;
use std::sync::OnceLock;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Choice {
    Power,
    Uniform,
    /// By their approximate contribution at the point.
    Tree,
    All,
}

pub(super) struct Lights {
    list: LightList,
    checks: Vec<&'static LightChecks>,
    /// Cumulative number of values up to each light, when lights are chosen by power.
    ends: Vec<f64>,
    owners: BTreeMap<u32, usize>,
    /// Lights without triangles that rays can hit.
    spheres: Vec<(usize, sphere::Ball)>,
    map: Option<environment::Map>,
    tree: OnceLock<tree::Tree>,
}

/// A shading point for light selection: position, and the triangle's normal on the viewer's side.
pub(super) type Place = (DVec3, DVec3);

/// Number of values of a draw: draws are multiples of the reciprocal.
pub(crate) const UNITS: f64 = (1u32 << 24) as f64;

pub(super) struct Chosen {
    pub light: usize,
    pub share: f64,
}

/// A sampled point of a light, seen from a surface.
pub struct LightSample {
    /// Unit direction from the surface.
    pub direction: DVec3,
    /// Distance, scene units.
    pub distance: f64,
    /// Radiance; for a delta light, irradiance of a surface facing it.
    pub radiance: DVec3,
    /// Density over solid angle, given the light; `None` for delta lights.
    pub density: Option<f64>,
    /// The triangles that the point may lie on.
    pub triangles: Option<[u32; 2]>,
}

/// A luminous sphere that a ray has met.
pub(super) struct Met {
    pub light: usize,
    pub radiance: DVec3,
    /// Density with which light samples find the point, over solid angle.
    pub density: f64,
    pub distance: f64,
    /// Of the ray to the sphere's normal, positive.
    pub cosine: f64,
}

impl Lights {
    /// The lights of a scene.
    ///
    /// # Errors
    /// A light's kind is not registered.
    pub(super) fn new(scene: &SceneData, kinds: &LightRegistry) -> Result<Self, String> {
        let list = LightList::of(scene);
        let mut map = None;
        let mut owners = BTreeMap::new();
        let mut spheres = Vec::new();
        let mut checks = Vec::new();
        for (place, light) in list.lights.iter().enumerate() {
            let kind = light.kind(scene).name;
            checks.push((kinds.get(kind)).ok_or_else(|| format!("light `{kind}`"))?);
            match light.source {
                Source::Triangle(id) => _ = owners.insert(id, place),
                Source::Parallelogram(of) => owners.extend(of.triangles.map(|id| (id, place))),
                Source::Light(id) => {
                    let light = &scene.lights[id as usize];
                    spheres.extend(sphere::Ball::of(light).map(|ball| (place, ball)));
                    map = map.or_else(|| environment::Map::of(light));
                }
            }
        }
        Ok(Self {
            ends: ends(&list),
            list,
            checks,
            owners,
            spheres,
            map,
            tree: OnceLock::new(),
        })
    }

    /// True if there is nothing to sample.
    pub(super) fn are_none(&self) -> bool {
        self.list.lights.is_empty()
    }

    /// Number of lights.
    pub(super) fn count(&self) -> usize {
        self.list.lights.len()
    }

    /// Where a light is.
    pub(super) fn source(&self, light: usize) -> Source {
        self.list.lights[light].source
    }

    /// Area of a triangle or parallelogram.
    pub(super) fn flat_area(&self, light: usize) -> f64 {
        self.list.lights[light].area
    }

    /// The light that a triangle belongs to.
    pub(super) fn owner(&self, triangle: u32) -> Option<usize> {
        self.owners.get(&triangle).copied()
    }

    /// True if there is an environment map.
    pub(super) fn have_map(&self) -> bool {
        self.map.is_some()
    }

    fn tree(&self, scene: &SceneData) -> &tree::Tree {
        self.tree.get_or_init(|| tree::Tree::new(scene, &self.list))
    }

    /// Numbers of values of each light without a position, and of the tree over all others.
    fn groups(&self, tree: &tree::Tree) -> [f64; 2] {
        let placeless = (self.list.lights.len() - tree.len()) as f64;
        let each = ((UNITS - tree.len() as f64) / (placeless + 1.0)).floor();
        [each, UNITS - placeless * each]
    }

    /// The first value of a light when all are chosen uniformly.
    fn evenly(&self, light: usize) -> f64 {
        let count = self.list.lights.len() as f64;
        let (each, longer) = ((UNITS / count).floor(), UNITS % count);
        light as f64 * each + longer.min(light as f64)
    }
}

/// One value per light, and the rest by rounded cumulative power.
fn ends(list: &LightList) -> Vec<f64> {
    let powers = || list.lights.iter().map(|light| light.power);
    let all: f64 = powers().sum();
    let spare = UNITS - list.lights.len() as f64;
    let mut below = 0.0;
    let end = |(place, power)| {
        below += power;
        place as f64 + 1.0 + (spare * (below / all)).round()
    };
    powers().enumerate().map(end).collect()
}

/// The random numbers of the k-th light when all are sampled.
pub(super) fn moved([u, v]: [f64; 2], k: usize) -> [f64; 2] {
    let k = k as f64;
    [
        (u + k * 0.754_877_666_246_692_7).fract(),
        (v + k * 0.569_840_290_998_053_2).fract(),
    ]
}

impl PathOracle<'_> {
    pub(super) fn share(
        &self,
        light: usize,
        choice: Choice,
        at: Place,
        rounding: &mut Rounding,
    ) -> f64 {
        let lights = &self.lights;
        match choice {
            Choice::Power => {
                let before = light.checked_sub(1).map_or(0.0, |other| lights.ends[other]);
                (lights.ends[light] - before) / UNITS
            }
            Choice::All => 1.0,
            Choice::Tree if !lights.tree(self.scene).is_empty() => {
                let tree = lights.tree(self.scene);
                let [each, all] = lights.groups(tree);
                if light < tree.len() {
                    tree.values(light, all, at, rounding) / UNITS
                } else {
                    each / UNITS
                }
            }
            Choice::Uniform | Choice::Tree => {
                (lights.evenly(light + 1) - lights.evenly(light)) / UNITS
            }
        }
    }

    pub(super) fn chosen(
        &self,
        choice: Choice,
        number: f64,
        at: Place,
        rounding: &mut Rounding,
    ) -> Vec<Chosen> {
        let lights = self.lights.list.lights.len();
        let chosen = |light| Chosen {
            light,
            share: self.share(light, choice, at, &mut Rounding::none()),
        };
        if choice == Choice::All {
            return (0..lights).map(chosen).collect();
        }
        // Comparisons of a number with integer values are free of rounding.
        let value = (number * UNITS).floor();
        let last = lights - 1;
        if choice == Choice::Power {
            let light = self.lights.ends.partition_point(|end| *end <= value);
            return vec![chosen(light.min(last))];
        }
        let tree = (choice == Choice::Tree).then(|| self.lights.tree(self.scene));
        if let Some(tree) = tree.filter(|tree| !tree.is_empty()) {
            let [each, all] = self.lights.groups(tree);
            let placeless = (lights - tree.len()) as f64;
            if value < placeless * each {
                return vec![chosen(tree.len() + (value / each) as usize)];
            }
            let found = tree.choose(value - placeless * each, all, at, rounding);
            let found = found.map(|(light, values)| Chosen {
                light,
                share: values / UNITS,
            });
            return found.into_iter().collect();
        }
        let light = (0..last).find(|light| value < self.lights.evenly(light + 1));
        vec![chosen(light.unwrap_or(last))]
    }

    /// A sampled point of a light, and which part of the light it is on, if it has several.
    pub(super) fn light_sample(
        &self,
        surface: &Surface,
        chosen: &Chosen,
        point: [f64; 2],
        rounding: &mut Rounding,
    ) -> (usize, Option<LightSample>) {
        let from = surface.position;
        let source = self.lights.list.lights[chosen.light].source;
        let light = match (self.lights.checks[chosen.light].twin, source) {
            (LightTwin::Alone(sample), Source::Light(id)) => {
                sample(&self.scene.lights[id as usize], from, point, rounding)
            }
            (LightTwin::Map, _) => {
                let map = self.lights.map.as_ref();
                let found = map.map(|map| map.sample(point, rounding));
                return found.unwrap_or((0, None));
            }
            _ => {
                let of = (self.scene, &self.textures, &self.hits);
                flat::sample(of, source, from, point, rounding)
            }
        };
        (0, light)
    }

    /// Density with which light sampling finds the point of an emitter hit by a ray.
    pub(super) fn light_density(
        &self,
        emitter: &Surface,
        ray: &Segment,
        choice: Choice,
        rounding: &mut Rounding,
    ) -> f64 {
        let lights = &self.lights;
        lights.owners.get(&emitter.triangle).map_or(0.0, |light| {
            let cos = emitter.geometric.dot(emitter.out);
            let distance = emitter.geometric.dot(ray.start - emitter.position) / cos;
            let area = lights.list.lights[*light].area;
            self.share(*light, choice, ray.place(), rounding) * distance * distance / (area * cos)
        })
    }

    /// The nearest sphere before `end` on a ray.
    pub(super) fn sphere_met(
        &self,
        ray: &Segment,
        end: f64,
        choice: Choice,
        rounding: &mut Rounding,
    ) -> Option<Met> {
        let met = self.lights.spheres.iter().filter_map(|(light, ball)| {
            let distance = ball.meet(ray)?;
            (distance < end).then_some((light, ball, distance))
        });
        let (light, ball, distance) = met.min_by(|a, b| a.2.total_cmp(&b.2))?;
        let density = ball.density(ray.start, ray.direction);
        let share = self.share(*light, choice, ray.place(), rounding);
        Some(Met {
            light: *light,
            radiance: ball.radiance,
            density: share * density,
            distance,
            cosine: ball.cosine(ray.start + distance * ray.direction, ray.direction),
        })
    }

    /// True if a way for a light, which may end at it, is occluded.
    pub(super) fn shadowed(
        &self,
        walk: &mut Walk,
        shadow: &Segment,
        (light, ends_there): (usize, bool),
    ) -> Blocked {
        let balls = self.lights.spheres.iter();
        let mut others = balls.filter(|(place, _)| !ends_there || *place != light);
        if others.any(|(_, ball)| ball.meet(shadow).is_some_and(|d| d < shadow.length)) {
            return Blocked::Yes;
        }
        walk.note_ray(CountedRays::Shadow, light, shadow);
        self.hits.blocked(shadow, &mut walk.rounding)
    }

    /// Radiance along a ray that leaves the scene. A map replaces the sky.
    pub(super) fn escaped(&self, direction: DVec3) -> DVec3 {
        let map = self.lights.map.as_ref();
        map.map_or_else(
            || sky::radiance(self.scene, direction),
            |map| map.radiance(direction),
        )
    }

    /// The map texel hit by a ray that leaves the scene, and the density of light sampling for its
    /// direction; `None` without a map.
    pub(super) fn escaped_density(
        &self,
        ray: &Segment,
        choice: Choice,
        rounding: &mut Rounding,
    ) -> Option<(usize, f64)> {
        let (texel, density) = self.lights.map.as_ref()?.density(ray.direction);
        let last = self.lights.list.lights.len() - 1;
        Some((
            texel,
            density * self.share(last, choice, ray.place(), rounding),
        ))
    }

    /// True if a bounced ray counts as escaping although it hits something at this distance.
    pub(super) fn escapes(&self, distance: f64) -> bool {
        let sky = &self.scene.daylight;
        (sky.as_ref()).is_some_and(|sky| distance > f64::from(sky.reach))
    }
}
