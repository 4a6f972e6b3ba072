//! All lights of a scene in numbering order: emissive triangles and parallelograms by their first
//! triangle, then the other lights by kind.

use super::{Light, LightKind, kind, luminance};
use crate::{Material, SceneData};
use glam::{DVec3, Vec3};
use raystone_core::geometry::Triangle;
use std::f64::consts::PI;

/// Two triangles of one material that form a single light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parallelogram {
    /// The two consecutive triangles.
    pub triangles: [u32; 2],
    /// The shared corner before the one that only the first triangle has.
    pub corner: Vec3,
    /// From `corner` to each triangle's own corner; their cross product points to the front.
    pub edges: [Vec3; 2],
}

/// Tolerance of the fourth corner's position, relative to the diagonal.
const TOLERANCE: f64 = 1e-6;

impl Parallelogram {
    /// The parallelogram of two triangles, if they form one: they share a diagonal, have the same
    /// orientation, and the fourth corner is where the other three imply.
    pub fn of(first: u32, a: &Triangle, b: &Triangle) -> Option<Self> {
        (0..3)
            .flat_map(|i| (0..3).map(move |k| (i, k)))
            .find_map(|(i, k)| {
                let corner = |t: &Triangle, n: usize| t.vertices[n % 3];
                // Around a: corner, own, end of the diagonal; around b: own, corner, end.
                let [own, end, start] = [0, 1, 2].map(|n| corner(a, i + n));
                let [other, from, to] = [0, 1, 2].map(|n| corner(b, k + n));
                let [p, q, r, s] = [own, other, start, end].map(Vec3::as_dvec3);
                let miss = (p + q - r - s).length();
                let shared = from == start && to == end;
                (shared && miss <= TOLERANCE * (s - r).length()).then(|| Self {
                    triangles: [first, first + 1],
                    corner: start,
                    edges: [own - start, other - start],
                })
            })
    }

    /// Area, scene units squared.
    pub fn area(&self) -> f64 {
        let [u, v] = self.edges.map(Vec3::as_dvec3);
        u.cross(v).length()
    }
}

/// Geometry of a listed light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Source {
    /// A triangle.
    Triangle(u32),
    /// A parallelogram.
    Parallelogram(Parallelogram),
    /// The light at this index of [`SceneData::lights`].
    Light(u32),
}

/// A light and its properties for selection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ListedLight {
    /// The light's geometry.
    pub source: Source,
    /// Area of triangles and parallelograms; 0 for others.
    pub area: f64,
    /// Luminous power, positive.
    pub power: f64,
}

impl ListedLight {
    /// Its entry in [`super::LIGHT_KINDS`].
    pub fn kind(&self, scene: &SceneData) -> &'static LightKind {
        match self.source {
            Source::Triangle(_) => &kind::TRIANGLE,
            Source::Parallelogram(_) => &kind::RECTANGLE,
            Source::Light(light) => scene.lights[light as usize].kind(),
        }
    }
}

/// The lights of a scene that shine, and reports on those that do not.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LightList {
    /// Lights with positive power. Triangles come first, lights at infinity last.
    pub lights: Vec<ListedLight>,
    /// One line for each omitted light.
    pub problems: Vec<String>,
}

/// True if the emission is finite, and positive in some channel.
fn shines(material: &Material) -> bool {
    material.emission.is_finite() && luminance(material.emission) > 0.0
}

impl LightList {
    /// The lights of a scene.
    pub fn of(scene: &SceneData) -> Self {
        let mut list = Self::default();
        for material in &scene.materials {
            if !material.emission.is_finite() {
                let problem = "its emission is not finite: it is dark";
                list.problems
                    .push(format!("material `{}`: {problem}", material.name));
            }
        }
        list.push_emitters(scene);
        let radius = f64::from(scene.bounds().radius());
        let mut others: Vec<(u32, u32, &Light)> = (0..)
            .zip(&scene.lights)
            .map(|(place, light)| (light.kind().number(), place, light))
            .collect();
        others.sort_by_key(|(kind, place, light)| (light.is_infinite(), *kind, *place));
        for (_, place, light) in others {
            let power = light.power(radius);
            let name = light.kind().name;
            let is_second = matches!(light, Light::Environment { .. })
                && list
                    .lights
                    .last()
                    .is_some_and(|last| last.kind(scene) == light.kind());
            if is_second {
                let line = format!("light {place} ({name}) is left out: there is one already");
                list.problems.push(line);
            } else if let Some(problem) = light.problem() {
                let line = format!("light {place} ({name}) is left out: {problem}");
                list.problems.push(line);
            } else if power > 0.0 && power.is_finite() {
                list.lights.push(ListedLight {
                    source: Source::Light(place),
                    area: 0.0,
                    power,
                });
            } else {
                let line = format!("light {place} ({name}) is left out: its power is {power}");
                list.problems.push(line);
            }
        }
        list
    }

    fn push_emitters(&mut self, scene: &SceneData) {
        let shining: Vec<bool> = scene.materials.iter().map(shines).collect();
        if !shining.contains(&true) {
            return;
        }
        let material = |id: usize| scene.material_ids.get(id).map(|m| *m as usize);
        let mut next = 0;
        while let Some(of) = material(next) {
            let id = next as u32;
            next += 1;
            if !shining[of] {
                continue;
            }
            let there = |id: &usize| *id < scene.triangles.len();
            let outward = |id: usize| there(&id).then(|| Triangle::from(scene.outward(id)));
            let [a, b] = [next - 1, next].map(outward);
            // A lamp with a texture or mask is sampled per triangle, for its texture coordinates.
            let lamp = &scene.materials[of];
            let plain = lamp.emission_texture.is_none() && lamp.mask.is_none();
            let pair = a.zip(b).filter(|_| plain && material(next) == Some(of));
            let formed = pair.and_then(|(a, b)| Parallelogram::of(id, &a, &b));
            let (source, area) = match formed {
                Some(formed) => {
                    next += 1;
                    (Source::Parallelogram(formed), formed.area())
                }
                None => (Source::Triangle(id), a.as_ref().map_or(0.0, area)),
            };
            let sides = if scene.materials[of].emits_both_sides {
                2.0
            } else {
                1.0
            };
            let power = area * luminance(scene.materials[of].emission) * PI * sides;
            if power > 0.0 {
                self.lights.push(ListedLight {
                    source,
                    area,
                    power,
                });
            }
        }
    }
}

fn area(triangle: &Triangle) -> f64 {
    let [a, b, c]: [DVec3; 3] = triangle.vertices.map(Vec3::as_dvec3);
    0.5 * (b - a).cross(c - a).length()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builtin::tests::load_default;

    #[test]
    fn two_triangles_with_a_common_diagonal_are_one_parallelogram_whatever_corner_comes_first() {
        let [a, b, c, d] =
            [[0.0, 0.0], [2.0, 0.0], [3.0, 1.0], [1.0, 1.0]].map(|[x, y]| Vec3::new(x, y, 0.0));
        for turn in 0..9 {
            let mut pair = [[a, b, c], [a, c, d]];
            pair[0].rotate_left(turn % 3);
            pair[1].rotate_left(turn / 3);
            let [first, second] = pair.map(Triangle::from);
            let formed = Parallelogram::of(4, &first, &second).expect("a parallelogram");
            assert_eq!((formed.corner, formed.edges), (a, [b - a, d - a]));
            assert_eq!((formed.triangles, formed.area()), ([4, 5], 2.0));
            let swapped = Parallelogram::of(4, &second, &first).expect("a parallelogram");
            let [u, v] = swapped.edges;
            assert_eq!(swapped.corner + u + v, a);
            assert!(u.cross(v).z > 0.0, "the front stays in front");
        }
        let moved = [a, c, d + 1e-3 * Vec3::X].into();
        let turned = [a, d, c].into();
        for other in [moved, turned, [a, b, c].into()] {
            assert_eq!(Parallelogram::of(0, &[a, b, c].into(), &other), None);
        }
    }

    #[test]
    fn lights_are_numbered_triangles_first_and_those_without_power_are_told() {
        let mut scene = load_default("cornell-box");
        let dim = Light::Point {
            position: Vec3::ZERO,
            intensity: Vec3::ZERO,
        };
        let sun = Light::Directional {
            direction: Vec3::NEG_Y,
            irradiance: Vec3::ONE,
        };
        let broken = Light::Point {
            position: Vec3::ZERO,
            intensity: Vec3::splat(f32::NAN),
        };
        let point = Light::Point {
            position: Vec3::X,
            intensity: Vec3::ONE,
        };
        scene.lights = vec![sun, dim, broken, point];
        let list = LightList::of(&scene);
        let sources: Vec<_> = list.lights.iter().map(|light| light.source).collect();
        assert!(matches!(sources[0], Source::Parallelogram(_)));
        assert_eq!(sources[1..], [Source::Light(3), Source::Light(0)]);
        assert_eq!(list.problems.len(), 2);
        assert!(list.problems[0].contains("light 1") && list.problems[1].contains("not finite"));
    }

    #[test]
    fn a_second_environment_map_is_left_out_and_told() {
        let map = |name: &str| {
            let map = crate::EnvironmentMap::new(name, [2, 1], vec![Vec3::ONE; 2], &mut Vec::new());
            Light::Environment {
                map: std::sync::Arc::new(map.expect("a map")),
                scale: 1.0,
                turn: 0.0,
            }
        };
        let mut scene = load_default("cornell-box");
        let before = LightList::of(&scene);
        scene.lights.extend([map("first"), map("second")]);
        let list = LightList::of(&scene);
        assert_eq!(list.lights.len(), before.lights.len() + 1);
        let Some(last) = list.lights.last() else {
            panic!("no light")
        };
        assert_eq!(last.source, Source::Light(0));
        assert_eq!(
            list.problems[..],
            ["light 1 (environment) is left out: there is one already"]
        );
    }
}
