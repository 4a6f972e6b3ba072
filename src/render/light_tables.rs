//! The lights of a scene for kernels: the part of `shading_tables` that
//! `kernels/shading/light/table.wesl` reads.

use super::environment_tables::environment_rows;
use super::light_tree::{LightBounds, TreeNode, light_tree, tree_rows};
use super::scene_kinds::SceneKinds;
use super::tables::emits_in_front;
use super::units::{shared_out, unit_share};
use glam::Vec3;
use raystone_gpu::UniformValues;
use raystone_scene::{
    IesProfile, Light, LightKind, LightList, ListedLight, Photometry, SceneData, Source,
};
use std::f64::consts::FRAC_PI_2;

/// `vec4`s per light: its head and three specific to its kind.
const LIGHT_ROWS: usize = 4;

/// Words for the lights of a scene, and their offsets.
#[derive(Debug, Clone, Default)]
pub struct LightTables {
    /// Number of lights; the next field counts those at the end that have no position.
    pub lights: u32,
    infinite: u32,
    emitters: u32,
    /// First of the spheres among the lights, and their number.
    spheres: [u32; 2],
    /// Kinds.
    pub kinds: SceneKinds<LightKind>,
    /// True if some surface emits only from its front.
    pub one_sided: bool,
    /// Row of the tree over lights with a position, and row of their leaves.
    tree: [u32; 2],
    /// Rows of lights, emissive triangles with their light, profiles and maps, and the tree.
    rows: Vec<[u32; 4]>,
    /// Start of the rows in `shading_tables`, in `vec4`.
    first: u32,
}

fn row(v: Vec3, w: f32) -> [u32; 4] {
    [v.x, v.y, v.z, w].map(f32::to_bits)
}

impl LightTables {
    /// The tables of the lights of `list`.
    pub fn of(scene: &SceneData, list: &LightList) -> Self {
        let powers: Vec<f64> = list.lights.iter().map(|light| light.power).collect();
        let shares = shared_out(&powers);
        let mut tables = Self {
            lights: list.lights.len() as u32,
            kinds: SceneKinds::of(list.lights.iter().map(|light| light.kind(scene))),
            one_sided: scene.materials.iter().any(emits_in_front),
            ..Self::default()
        };
        let mut owners = Vec::new();
        let mut extras = Vec::new();
        let mut bounds = Vec::new();
        let mut below = 0;
        for ((number, light), share) in (0..).zip(&list.lights).zip(shares) {
            below += share;
            let kind = tables.kinds.number(light.kind(scene));
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
                    let light = &scene.lights[place as usize];
                    tables.infinite += u32::from(light.is_infinite());
                    let link = LIGHT_ROWS * list.lights.len() + owners.len() + extras.len();
                    extras.extend(extra_rows(light));
                    link as u32
                }
            };
            let [upto, own] = [below, share].map(|units| unit_share(units).to_bits());
            tables.rows.push([kind, link, upto, own]);
            tables.rows.extend(own_rows(scene, light));
            bounds.extend(light_bounds(scene, light));
        }
        tables.emitters = owners.len() as u32;
        tables.rows.append(&mut owners);
        tables.rows.append(&mut extras);
        let mut tree = tree_rows(&bounds);
        let leaves = tables.rows.len() + tree.len() - bounds.len();
        tables.tree = [tables.rows.len() as u32, leaves as u32];
        tables.rows.append(&mut tree);
        let is_sphere = |light: &ListedLight| light.kind(scene).name == "sphere";
        let first = list.lights.iter().position(is_sphere).unwrap_or_default();
        let spheres = list.lights.iter().filter(|light| is_sphere(light)).count();
        tables.spheres = [first as u32, spheres as u32];
        tables
    }

    /// Appends the rows to `shading_tables`, whose length must be whole `vec4`s.
    pub fn append(&mut self, words: &mut Vec<u32>) {
        self.first = words.len() as u32 / 4;
        words.extend_from_slice(self.rows.as_flattened());
        self.rows = Vec::new();
    }

    /// True if a light is an environment map.
    pub(super) fn has_map(&self) -> bool {
        let mut there = self.kinds.present();
        there.any(|number| self.kinds.kind(number).name == "environment")
    }

    /// True if there is more than one light, or an emissive triangle outside of the only one.
    pub(super) fn are_chosen(&self, scene: &SceneData) -> bool {
        let emits = |of: &&u32| scene.materials[**of as usize].emission != Vec3::ZERO;
        let emissive = scene.material_ids.iter().filter(emits).count();
        self.lights > 1 || emissive != self.emitters as usize
    }

    /// Values for the uniform of `kernels/integrator/frame.wesl`.
    pub fn uniform(&self, values: UniformValues) -> UniformValues {
        let [first_sphere, spheres] = self.spheres;
        values
            .u32("lights", self.lights)
            .u32("infinite_lights", self.infinite)
            .u32("first_light", self.first)
            .u32("emitters", self.emitters)
            .u32(
                "first_emitter",
                self.first + self.lights * LIGHT_ROWS as u32,
            )
            .u32("first_tree", self.first + self.tree[0])
            .u32("first_leaf", self.first + self.tree[1])
            .u32("first_sphere", first_sphere)
            .u32("spheres", spheres)
    }
}

/// The rows of a light after its head.
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
        Light::Ies {
            position,
            rotation,
            color,
            ..
        } => [
            row(*position, 0.0),
            row(*color, 0.0),
            rotation.to_array().map(f32::to_bits),
        ],
        Light::Environment { scale, turn, .. } => [
            row(Vec3::new(turn.cos(), turn.sin(), 0.0), 0.0),
            row(Vec3::splat(*scale), 0.0),
            none,
        ],
        Light::Other {
            position,
            direction,
            color,
            parameters: [a, b, c],
            ..
        } => [row(*position, *a), row(*color, *b), row(*direction, *c)],
    }
}

fn extra_rows(light: &Light) -> Vec<[u32; 4]> {
    match light {
        Light::Ies { profile, .. } => ies_rows(profile),
        Light::Environment { map, .. } => environment_rows(map),
        _ => Vec::new(),
    }
}

/// Type of photometry and numbers of angles; vertical and horizontal angles; candela.
fn ies_rows(profile: &IesProfile) -> Vec<[u32; 4]> {
    let photometry = match profile.photometry {
        Photometry::C => 0,
        Photometry::B => 1,
        Photometry::A => 2,
    };
    let counts = [&profile.vertical, &profile.horizontal].map(|angles| angles.len() as u32);
    let mut rows = vec![[photometry, counts[0], counts[1], 0]];
    let lists = [&profile.vertical, &profile.horizontal, &profile.candela];
    let words: Vec<u32> = lists.into_iter().flatten().map(|x| x.to_bits()).collect();
    rows.extend(words.chunks(4).map(|four| {
        let mut row = [0; 4];
        row[..four.len()].copy_from_slice(four);
        row
    }));
    rows
}

/// The nodes of the tree over the lights of a scene with a position: see `light_tree`.
pub fn light_branches(scene: &SceneData, list: &LightList) -> Vec<TreeNode> {
    let lights = list.lights.iter();
    let bounds: Vec<LightBounds> = lights.filter_map(|l| light_bounds(scene, l)).collect();
    light_tree(&bounds).0
}

/// Position and emission bounds of a light, if it has a position.
fn light_bounds(scene: &SceneData, listed: &ListedLight) -> Option<LightBounds> {
    let power = listed.power;
    let flat = |corners: &[Vec3], normal: Vec3, triangle: u32| {
        let corners = || corners.iter().map(|c| c.as_dvec3());
        let material = scene.material_ids[triangle as usize] as usize;
        LightBounds {
            min: corners().reduce(|a, b| a.min(b)).unwrap_or_default(),
            max: corners().reduce(|a, b| a.max(b)).unwrap_or_default(),
            power,
            axis: normal.as_dvec3().normalize_or_zero(),
            normals: 0.0,
            spread: FRAC_PI_2,
            both_sides: scene.materials[material].emits_both_sides,
        }
    };
    let place = match listed.source {
        Source::Triangle(id) => {
            let [a, b, c] = scene.outward(id as usize);
            return Some(flat(&[a, b, c], (b - a).cross(c - a), id));
        }
        Source::Parallelogram(of) => {
            let (a, [u, v]) = (of.corner, of.edges);
            let corners = [a, a + u, a + v, a + u + v];
            return Some(flat(&corners, u.cross(v), of.triangles[0]));
        }
        Source::Light(place) => place,
    };
    let light = &scene.lights[place as usize];
    let (center, radius) = light.place()?;
    let [center, radius] = [center.as_dvec3(), glam::DVec3::splat(radius.into())];
    let around = LightBounds::everywhere(center - radius, center + radius, power);
    Some(match light {
        Light::Spot {
            direction,
            inner,
            outer,
            ..
        } => LightBounds {
            axis: direction.as_dvec3().normalize_or_zero(),
            normals: f64::from(*inner),
            spread: f64::from(outer - inner),
            ..around
        },
        _ => around,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use raystone_scene::named;

    #[test]
    fn a_spot_is_bright_in_its_inner_cone_and_fades_up_to_the_outer() {
        let spot = Light::Spot {
            position: Vec3::Y,
            direction: Vec3::NEG_Y,
            intensity: Vec3::ONE,
            inner: 0.25,
            outer: 1.0,
            decay: true,
        };
        let scene = SceneData {
            lights: vec![spot],
            ..named("single-triangle").unwrap()
        };
        let list = LightList::of(&scene);
        let mut bounds = list.lights.iter().filter_map(|l| light_bounds(&scene, l));
        let of_spot = bounds.find(|bounds| bounds.min == DVec3::Y);
        let of_spot = of_spot.expect("a spot");
        // As in PBRT v4: the cone of directions is the inner one, and the rest of the outer one is the fall-off.
        let found = (of_spot.axis, of_spot.normals, of_spot.spread);
        assert_eq!(found, (DVec3::NEG_Y, 0.25, 0.75));
    }
}
