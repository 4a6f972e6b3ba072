//! The lights of a scene as kernels read them: the part of `shading_tables` that
//! `kernels/shading/light/table.wesl` takes apart.

use super::tables::emits_in_front;
use crate::gpu::UniformValues;
use crate::scene::{LIGHT_KINDS, Light, LightList, ListedLight, SceneData, Source};
use glam::Vec3;

/// `vec4` a light: its head and three of its kind.
const LIGHT_ROWS: usize = 4;

/// Words for the lights of a scene, and where they stand.
#[derive(Debug, Clone, Default)]
pub struct LightTables {
    /// Number of lights, and how many of them, the last ones, have no place.
    pub lights: u32,
    infinite: u32,
    /// Number of emissive triangles.
    emitters: u32,
    /// First of the spheres among the lights, and how many they are.
    spheres: [u32; 2],
    /// Which of [`LIGHT_KINDS`] there are.
    pub kinds: [bool; LIGHT_KINDS.len()],
    /// Whether some surface emits from its front alone.
    pub one_sided: bool,
    /// Rows of the lights, then of the emissive triangles, each of which knows its light.
    rows: Vec<[u32; 4]>,
    /// Where the rows begin in `shading_tables`, in `vec4`.
    first: u32,
}

fn row(v: Vec3, w: f32) -> [u32; 4] {
    [v.x, v.y, v.z, w].map(f32::to_bits)
}

impl LightTables {
    /// The tables of the lights of `list`.
    pub fn of(scene: &SceneData, list: &LightList) -> Self {
        let total: f64 = list.lights.iter().map(|light| light.power).sum();
        let mut tables = Self {
            lights: list.lights.len() as u32,
            one_sided: scene.materials.iter().any(emits_in_front),
            ..Self::default()
        };
        let mut owners = Vec::new();
        let mut below = 0.0;
        for (number, light) in (0..).zip(&list.lights) {
            below += light.power;
            let kind = light.kind(scene).number();
            let link = match light.source {
                Source::Triangle(id) => {
                    owners.push([id, number, 0, 0]);
                    id
                }
                Source::Parallelogram(of) => {
                    owners.extend(of.triangles.map(|id| [id, number, 0, 0]));
                    scene.material_ids[of.triangles[0] as usize]
                }
                Source::Light(place) => {
                    tables.infinite += u32::from(scene.lights[place as usize].is_infinite());
                    0
                }
            };
            let part = |x: f64| ((x / total) as f32).to_bits();
            tables.rows.push([kind, link, part(below), part(light.power)]);
            tables.rows.extend(own_rows(scene, light));
            tables.kinds[kind as usize] = true;
        }
        tables.emitters = owners.len() as u32;
        tables.rows.append(&mut owners);
        let is_sphere = |light: &ListedLight| light.kind(scene).name == "sphere";
        let first = list.lights.iter().position(is_sphere).unwrap_or_default();
        let spheres = list.lights.iter().filter(|light| is_sphere(light)).count();
        tables.spheres = [first as u32, spheres as u32];
        tables
    }

    /// Appends the rows to `shading_tables`, which is whole in `vec4`.
    pub fn append(&mut self, words: &mut Vec<u32>) {
        self.first = words.len() as u32 / 4;
        words.extend_from_slice(self.rows.as_flattened());
        self.rows = Vec::new();
    }

    /// Features of the kinds that there are.
    pub fn flags(kinds: &[bool; LIGHT_KINDS.len()]) -> impl Iterator<Item = (&'static str, bool)> {
        LIGHT_KINDS.iter().map(|kind| kind.feature).zip(*kinds)
    }

    /// What `kernels/integrator/frame.wesl` is told.
    pub fn uniform(&self, values: UniformValues) -> UniformValues {
        let [first_sphere, spheres] = self.spheres;
        values
            .u32("lights", self.lights)
            .u32("infinite_lights", self.infinite)
            .u32("first_light", self.first)
            .u32("emitters", self.emitters)
            .u32("first_emitter", self.first + self.lights * LIGHT_ROWS as u32)
            .u32("first_sphere", first_sphere)
            .u32("spheres", spheres)
    }
}

/// The rows of a light behind its head.
fn own_rows(scene: &SceneData, listed: &ListedLight) -> [[u32; 4]; LIGHT_ROWS - 1] {
    let none = [0; 4];
    let sides = |triangle: u32| {
        let material = scene.material_ids[triangle as usize] as usize;
        f32::from(u8::from(scene.materials[material].emits_both_sides))
    };
    let area = listed.area as f32;
    match listed.source {
        Source::Triangle(id) => [row(Vec3::ZERO, area), row(Vec3::ZERO, sides(id)), none],
        Source::Parallelogram(of) => [
            row(of.corner, area),
            row(of.edges[0], sides(of.triangles[0])),
            row(of.edges[1], 0.0),
        ],
        Source::Light(place) => light_rows(&scene.lights[place as usize]),
    }
}

fn light_rows(light: &Light) -> [[u32; 4]; LIGHT_ROWS - 1] {
    let unit = |v: &Vec3| v.as_dvec3().normalize_or_zero().as_vec3();
    let none = [0; 4];
    match light {
        Light::Sphere {
            center,
            radius,
            radiance,
        } => [row(*center, *radius), row(*radiance, 0.0), none],
        Light::Point {
            position,
            intensity,
        } => [row(*position, 0.0), row(*intensity, 0.0), none],
        Light::Spot {
            position,
            direction,
            intensity,
            inner,
            outer,
            decay,
        } => [
            row(*position, outer.cos()),
            row(*intensity, inner.cos()),
            row(unit(direction), f32::from(u8::from(*decay))),
        ],
        Light::Directional {
            direction,
            irradiance,
        } => [row(unit(direction), 0.0), row(*irradiance, 0.0), none],
    }
}
