//! Lights, one file for each way of shining, from `docs/shading.md`.

mod delta;
mod environment;
mod flat;
mod ies;
mod sky;
mod sphere;
mod tree;

use super::hits::{Blocked, Segment};
use super::rounding::Rounding;
use super::surface::Surface;
use super::{PathOracle, Walk};
use crate::integrator::CountedRays;
use crate::scene::{Light, LightList, SceneData, Source};
use glam::DVec3;
use std::collections::BTreeMap;
use std::sync::OnceLock;

/// What lights are chosen by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Choice {
    /// Their power.
    Power,
    /// Nothing.
    Uniform,
    /// What they contribute at the point, about.
    Tree,
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
    /// The map around the scene, which is the last light.
    map: Option<environment::Map>,
    tree: OnceLock<tree::Tree>,
}

/// Where a light is chosen: a point of a surface, and the normal of the triangle there on the viewer's side.
pub(super) type Place = (DVec3, DVec3);

/// A light that was chosen.
pub(super) struct Chosen {
    pub light: usize,
    /// With what probability.
    pub share: f64,
    /// What is left of the number.
    pub remainder: f64,
}

/// A point of a light, as a surface sees it.
pub(super) struct LightSample {
    pub direction: DVec3,
    pub distance: f64,
    /// Radiance; irradiance of a surface that faces a delta light.
    pub radiance: DVec3,
    /// Over solid angle, without the choice of the light in it; `None` for delta lights.
    pub density: Option<f64>,
    /// The triangles that the point may lie on.
    pub triangles: Option<[u32; 2]>,
}

impl Lights {
    /// The lights of a scene.
    pub fn new(scene: &SceneData) -> Self {
        let list = LightList::of(scene);
        let mut map = None;
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
                    Light::Environment {
                        map: texels,
                        scale,
                        turn,
                    } => map = Some(environment::Map::new(texels, *scale, *turn)),
                    _ => {}
                },
            }
        }
        let power = list.lights.iter().map(|light| light.power).sum();
        Self {
            list,
            power,
            owners,
            spheres,
            map,
            tree: OnceLock::new(),
        }
    }

    /// Whether there is nothing to sample.
    pub fn are_none(&self) -> bool {
        self.list.lights.is_empty()
    }

    /// Whether a map shines.
    pub fn have_map(&self) -> bool {
        self.map.is_some()
    }

    fn tree(&self, scene: &SceneData) -> &tree::Tree {
        self.tree.get_or_init(|| tree::Tree::new(scene, &self.list))
    }

    /// Groups that a tree chooses evenly from: each light without a place, and all others.
    fn groups(&self, tree: &tree::Tree) -> usize {
        self.list.lights.len() - tree.len() + usize::from(tree.len() > 0)
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
    /// Probability with which a light is chosen.
    fn share(&self, light: usize, choice: Choice, at: Place, rounding: &mut Rounding) -> f64 {
        let lights = &self.lights;
        match choice {
            Choice::Power => lights.list.lights[light].power / lights.power,
            Choice::Uniform => 1.0 / lights.list.lights.len() as f64,
            Choice::All => 1.0,
            Choice::Tree => {
                let tree = lights.tree(self.scene);
                let group = 1.0 / lights.groups(tree) as f64;
                match light < tree.len() {
                    true => group * tree.share(light, at, rounding),
                    false => group,
                }
            }
        }
    }

    /// The lights that are sampled.
    pub(super) fn chosen(
        &self,
        choice: Choice,
        number: f64,
        at: Place,
        rounding: &mut Rounding,
    ) -> Vec<Chosen> {
        let lights = self.lights.list.lights.len();
        let chosen = |light, share, remainder| Chosen {
            light,
            share,
            remainder,
        };
        if choice == Choice::All {
            return (0..lights)
                .map(|light| chosen(light, 1.0, number))
                .collect();
        }
        let number = rounding.share(number).clamp(0.0, 1.0);
        if choice == Choice::Tree {
            let tree = self.lights.tree(self.scene);
            let groups = self.lights.groups(tree);
            let infinite = lights - tree.len();
            let place = number * groups as f64;
            let group = (place as usize).min(groups - 1);
            let rest = place - group as f64;
            let even = 1.0 / groups as f64;
            if group < infinite {
                return vec![chosen(tree.len() + group, even, rest)];
            }
            let found = tree.choose(rest, at, rounding);
            let found = found.map(|(light, share, rest)| chosen(light, even * share, rest));
            return found.into_iter().collect();
        }
        let mut below = 0.0;
        for light in 0..lights {
            let share = self.share(light, choice, at, rounding);
            below += share;
            if number < below || light + 1 == lights {
                let remainder = (number - (below - share)) / share;
                return vec![chosen(light, share, remainder)];
            }
        }
        Vec::new()
    }

    /// A point of a light, and which part of it that is, where lights have parts that are chosen.
    pub(super) fn light_sample(
        &self,
        surface: &Surface,
        chosen: &Chosen,
        point: [f64; 2],
        rounding: &mut Rounding,
    ) -> (usize, Option<LightSample>) {
        let from = surface.position;
        let light = match self.lights.list.lights[chosen.light].source {
            Source::Light(id) => match &self.scene.lights[id as usize] {
                light @ Light::Sphere { .. } => {
                    sphere::Ball::of(light).and_then(|ball| ball.sample(from, point))
                }
                Light::Environment { .. } => {
                    let map = self.lights.map.as_ref();
                    let found = map.map(|map| map.sample(chosen.remainder, point, rounding));
                    return found.unwrap_or((0, None));
                }
                light => delta::sample(light, from, rounding),
            },
            flat => flat::sample(
                (self.scene, &self.textures, &self.hits),
                flat,
                from,
                point,
                rounding,
            ),
        };
        (0, light)
    }

    /// With what density light samples find the point of an emitter that a ray has met.
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

    /// The nearest sphere before `end` on a ray: its radiance, and the density with which light samples find the direction.
    pub(super) fn sphere_met(
        &self,
        ray: &Segment,
        end: f64,
        choice: Choice,
        rounding: &mut Rounding,
    ) -> Option<(DVec3, f64)> {
        let met = self.lights.spheres.iter().filter_map(|(light, ball)| {
            let distance = ball.meet(ray)?;
            (distance < end).then_some((light, ball, distance))
        });
        let (light, ball, _) = met.min_by(|a, b| a.2.total_cmp(&b.2))?;
        let density = ball.density(ray.start, ray.direction);
        let share = self.share(*light, choice, ray.place(), rounding);
        Some((ball.radiance, share * density))
    }

    /// Whether anything lies on the way to a light.
    pub(super) fn shadowed(&self, walk: &mut Walk, shadow: &Segment, light: usize) -> Blocked {
        let balls = self.lights.spheres.iter();
        let mut others = balls.filter(|(place, _)| *place != light);
        if others.any(|(_, ball)| ball.meet(shadow).is_some_and(|d| d < shadow.length)) {
            return Blocked::Yes;
        }
        walk.note_ray(CountedRays::Shadow, light, shadow);
        self.hits.blocked(shadow)
    }

    /// What comes along a ray that leaves the scene. A map takes the place of the sky.
    pub(super) fn escaped(&self, direction: DVec3) -> DVec3 {
        let map = self.lights.map.as_ref();
        map.map_or_else(
            || sky::radiance(self.scene, direction),
            |map| map.radiance(direction),
        )
    }

    /// The part of the map that a ray meets which leaves the scene, and the density with which light samples find its direction;
    /// nothing where there is no map.
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

    /// Whether a bounced ray counts as one that leaves, though it hits something so far away.
    pub(super) fn escapes(&self, distance: f64) -> bool {
        let sky = &self.scene.daylight;
        (sky.as_ref()).is_some_and(|sky| distance > f64::from(sky.reach))
    }
}
