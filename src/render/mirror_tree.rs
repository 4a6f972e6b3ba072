//! A tree over the perfect mirrors of a scene, in which connections of the path tracer look for the triangles that may reflect one point to
//! another: balls about triangles and cones about their normals, as in B. Walter, S. Zhao, N. Holzschuch, K. Bala, "Single scattering in
//! refractive media with triangle mesh boundaries", 2009, 4.1. The test is in `kernels/integrator/connection.wesl`.

use super::ConfiguredIntegrator;
use glam::DVec3;
use raystone_scene::{Material, SceneData, decode_normal};
use std::f64::consts::{FRAC_PI_2, PI};

/// Written as the triangle of a node that has two below it.
const INNER_NODE: u32 = u32::MAX;
/// The most triangles of mirrors that a scene is searched for: their nodes have 96 bytes each, and tables may be full of textures.
pub(super) const MOST_FACETS: usize = 1 << 15;
/// `vec4`s per node: ball; axis and half angle of the cone; the last node below it and its triangle.
const NODE_ROWS: usize = 3;

/// The tree and the materials in it.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct MirrorTree {
    /// Rows of the nodes, each before those below it.
    pub rows: Vec<[u32; 4]>,
    /// One bit per material.
    pub connecting: Vec<u32>,
    /// Triangles of mirrors, if they are more than [`MOST_FACETS`]: then there is no tree.
    pub left_out: u32,
}

/// Where a tree is in `shading_tables`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct MirrorPlaces {
    /// First row of its nodes, in `vec4`.
    pub first_mirror: u32,
    /// Number of nodes.
    pub mirror_nodes: u32,
    /// Start of the bits of materials, in words.
    pub first_connecting: u32,
    /// Number of triangles of mirrors, if they are too many for a tree, which then has no nodes.
    pub left_out: u32,
}

/// A triangle that reflects.
struct Facet {
    id: u32,
    corners: [DVec3; 3],
    /// Unit axis of the cone of its corners' normals, and its half angle, radians; interpolated normals are in it, too.
    axis: DVec3,
    angle: f64,
}

/// True if connections go over surfaces of this material: perfect mirrors that are whole and not bent by a texture.
fn connects(material: &Material, is_mapped: bool) -> bool {
    let is_bent = is_mapped && material.normal_texture.is_some();
    material.kind.name == "mirror" && material.mask.is_none() && !is_bent
}

impl MirrorTree {
    /// The tree over the mirrors of a scene; empty if it has none.
    pub(crate) fn of(scene: &SceneData) -> Self {
        let is_mapped = scene.uvs.len() == scene.triangles.len();
        let connecting: Vec<bool> = (scene.materials.iter())
            .map(|material| connects(material, is_mapped))
            .collect();
        if !connecting.contains(&true) {
            return Self::default();
        }
        let of_mirrors = (0..scene.triangles.len())
            .filter(|&triangle| connecting[scene.material_ids[triangle] as usize]);
        let mut facets: Vec<Facet> = of_mirrors.filter_map(|id| facet(scene, id)).collect();
        if facets.len() > MOST_FACETS {
            return Self {
                left_out: facets.len() as u32,
                ..Self::default()
            };
        }
        let mut rows = Vec::with_capacity(2 * NODE_ROWS * facets.len());
        if !facets.is_empty() {
            append(&mut facets, &mut rows);
        }
        let word = |bits: &[bool]| -> u32 {
            let set = (0..).zip(bits);
            set.map(|(place, bit)| u32::from(*bit) << place).sum()
        };
        Self {
            rows,
            connecting: connecting.chunks(32).map(word).collect(),
            left_out: 0,
        }
    }

    /// Appends it to `shading_tables`.
    pub(crate) fn append(&self, words: &mut Vec<u32>) -> MirrorPlaces {
        if self.connecting.is_empty() {
            return MirrorPlaces {
                left_out: self.left_out,
                ..MirrorPlaces::default()
            };
        }
        let first_connecting = words.len() as u32;
        words.extend_from_slice(&self.connecting);
        words.resize(words.len().next_multiple_of(4), 0);
        let first_mirror = words.len() as u32 / 4;
        words.extend_from_slice(self.rows.as_flattened());
        MirrorPlaces {
            first_mirror,
            mirror_nodes: (self.rows.len() / NODE_ROWS) as u32,
            first_connecting,
            left_out: 0,
        }
    }
}

impl MirrorPlaces {
    /// The reason why this integrator cannot render the scene, if any.
    pub(super) fn refusal(&self, integrator: &ConfiguredIntegrator) -> Option<String> {
        let features = integrator.kind.features(&integrator.params);
        (self.left_out > 0 && features.contains(&("mirror_connections", true))).then(|| {
            format!(
                "{} with connection = specular searches at most {MOST_FACETS} triangles of mirrors, and the scene has {}: take connection = none",
                integrator.kind.name(),
                self.left_out
            )
        })
    }
}

/// `None` if the triangle has no area.
fn facet(scene: &SceneData, id: usize) -> Option<Facet> {
    let corners = scene.triangles[id].vertices.map(|v| v.as_dvec3());
    let [a, b, c] = corners;
    let across = (b - a).cross(c - a).try_normalize()?;
    let is_mirrored = scene.mirrored.get(id).copied().unwrap_or_default();
    let face = if is_mirrored { -across } else { across };
    let normals = match scene.normals.get(id) {
        Some(words) => words.map(|word| decode_normal(word).unwrap_or(face)),
        None => [face; 3],
    };
    let (axis, angle) = cone(normals.map(|normal| (normal, 0.0)));
    Some(Facet {
        id: id as u32,
        corners,
        axis,
        angle,
    })
}

/// A cone about cones, each an axis and a half angle.
fn cone(of: impl IntoIterator<Item = (DVec3, f64)> + Clone) -> (DVec3, f64) {
    let sum: DVec3 = of.clone().into_iter().map(|(axis, _)| axis).sum();
    let Some(axis) = sum.try_normalize() else {
        return (DVec3::Z, PI);
    };
    let reach = |(other, angle): (DVec3, f64)| axis.angle_between(other) + angle;
    let angle = of.into_iter().map(reach).fold(0.0, f64::max);
    // Normals between those of the corners leave cones wider than this.
    (axis, if angle < FRAC_PI_2 { angle } else { PI })
}

/// Axes count on either side: a mirror reflects on both.
fn cone_of(facets: &[Facet]) -> (DVec3, f64) {
    let first = facets[0].axis;
    let turned = facets.iter().map(|facet| {
        let axis = facet.axis;
        (
            if first.dot(axis) < 0.0 { -axis } else { axis },
            facet.angle,
        )
    });
    cone(turned.collect::<Vec<_>>())
}

/// Appends the nodes over these facets, of which there is one at least.
fn append(facets: &mut [Facet], rows: &mut Vec<[u32; 4]>) {
    let corners = || facets.iter().flat_map(|facet| facet.corners);
    let low = corners().fold(DVec3::INFINITY, DVec3::min);
    let high = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
    let center = 0.5 * (low + high);
    let radius = corners().map(|corner| corner.distance(center));
    let radius = radius.fold(0.0, f64::max);
    let (axis, angle) = cone_of(facets);
    // In f32 they hold all that they did.
    let row = |v: DVec3, w: f64| {
        [v.x, v.y, v.z, w * (1.0 + 1e-6) + 1e-6 * v.length()].map(|x| (x as f32).to_bits())
    };
    let own = rows.len();
    rows.extend([row(center, radius), row(axis, angle), [0; 4]]);
    let triangle = match facets {
        [one] => one.id,
        several => {
            let axis = (high - low).max_position();
            let middle = several.len() / 2;
            several.select_nth_unstable_by(middle, |a, b| {
                let at = |facet: &Facet| facet.corners.iter().map(|v| v[axis]).sum::<f64>();
                at(a).total_cmp(&at(b)).then(a.id.cmp(&b.id))
            });
            let (left, right) = several.split_at_mut(middle);
            append(left, rows);
            append(right, rows);
            INNER_NODE
        }
    };
    let last = rows.len() / NODE_ROWS - 1;
    rows[own + NODE_ROWS - 1] = [last as u32, triangle, 0, 0];
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Vec3, vec3};
    use raystone_core::geometry::Triangle;
    use raystone_core::params::{ParamValue, Params, Variant};
    use raystone_scene::{encode_normal, named};

    /// Triangles of a mirror, of another mirror and of something else, in turn, with normals that lean.
    fn scene(count: usize) -> SceneData {
        let corner = |i: usize, k: usize| {
            let x = (i * 7 + k * 5) as f32;
            vec3(
                (x * 0.7).sin() * 3.0,
                (x * 1.3).cos(),
                (x * 0.4).sin() * 2.0,
            )
        };
        let triangles = (0..count).map(|i| Triangle {
            vertices: [0, 1, 2].map(|k| corner(i, k)),
        });
        let normal =
            |i: usize| [0, 1, 2].map(|k| encode_normal(corner(i, k) + vec3(0.0, 5.0, 0.0)));
        SceneData {
            triangles: triangles.collect(),
            normals: (0..count).map(normal).collect(),
            material_ids: (0..count as u32).map(|i| i % 3).collect(),
            materials: vec![
                Material::mirror("one", Vec3::ONE),
                Material::diffuse("other", Vec3::ONE),
                Material::mirror("two", Vec3::ONE),
            ],
            ..named("single-triangle").unwrap()
        }
    }

    fn numbers(row: [u32; 4]) -> (DVec3, f64) {
        let [x, y, z, w] = row.map(|word| f64::from(f32::from_bits(word)));
        (DVec3::new(x, y, z), w)
    }

    /// Triangles below a node, each of which it holds.
    fn below(tree: &MirrorTree, scene: &SceneData, node: usize) -> Vec<u32> {
        let [ball, cone, links] = [0, 1, 2].map(|k| tree.rows[NODE_ROWS * node + k]);
        let last = links[0] as usize;
        let found: Vec<u32> = if links[1] == INNER_NODE {
            let left = node + 1;
            let right = tree.rows[NODE_ROWS * left + 2][0] as usize + 1;
            assert_eq!(tree.rows[NODE_ROWS * right + 2][0] as usize, last);
            [below(tree, scene, left), below(tree, scene, right)].concat()
        } else {
            assert_eq!(last, node);
            vec![links[1]]
        };
        let ((center, radius), (axis, angle)) = (numbers(ball), numbers(cone));
        for &id in &found {
            for v in scene.triangles[id as usize].vertices {
                assert!(v.as_dvec3().distance(center) <= radius);
            }
            let normals = scene.normals[id as usize].map(|word| decode_normal(word).unwrap());
            let within = |side: f64| {
                let angles = normals.map(|n| (side * axis).angle_between(n));
                angles.into_iter().all(|a| a <= angle + 1e-6)
            };
            assert!(within(1.0) || within(-1.0), "{id}");
        }
        found
    }

    #[test]
    fn nodes_hold_their_triangles_and_each_mirror_is_below_the_root_once() {
        for count in [1, 3, 4, 97] {
            let scene = scene(count);
            let tree = MirrorTree::of(&scene);
            let mut found = below(&tree, &scene, 0);
            found.sort_unstable();
            let mirrors: Vec<u32> = (0..count as u32).filter(|i| i % 3 != 1).collect();
            assert_eq!(found, mirrors);
            assert_eq!(tree.rows.len(), NODE_ROWS * (2 * mirrors.len() - 1));
            assert_eq!(tree.connecting, [0b101]);
        }
    }

    #[test]
    fn cones_about_opposite_normals_hold_them_and_wide_ones_hold_all() {
        let (axis, angle) = cone([(DVec3::X, 0.1), (DVec3::Y, 0.2)]);
        assert!(
            (angle - (PI / 4.0 + 0.2)).abs() < 1e-12
                && axis.distance(DVec3::new(1.0, 1.0, 0.0).normalize()) < 1e-12
        );
        assert_eq!(cone([(DVec3::X, 0.0), (-DVec3::X, 0.0)]).1, PI);
        assert_eq!(cone([(DVec3::X, 1.0), (DVec3::Y, 1.0)]).1, PI);
    }

    #[test]
    fn too_many_mirrors_have_no_tree_and_are_refused() {
        let count = 3 * MOST_FACETS / 2;
        assert_eq!(MirrorTree::of(&scene(count)).left_out, 0);
        let places = MirrorTree::of(&scene(count + 3)).append(&mut Vec::new());
        assert_eq!(
            (places.mirror_nodes, places.left_out as usize),
            (0, MOST_FACETS + 2)
        );
        let path = |connection: &str| {
            let changes = [("connection", connection)];
            let changes = changes.map(|(k, v)| (k.to_owned(), ParamValue::Name(v.to_owned())));
            let variant = Variant {
                name: "path".to_owned(),
                params: Params(changes.into_iter().collect()),
                label: "path".to_owned(),
            };
            crate::IntegratorRegistry::default()
                .configured(&variant)
                .unwrap()
        };
        let reason = places.refusal(&path("specular")).unwrap();
        assert!(
            reason.contains(&format!("{}", MOST_FACETS + 2))
                && reason.contains("connection = none"),
            "{reason}"
        );
        assert_eq!(places.refusal(&path("none")), None);
        assert_eq!(MirrorPlaces::default().refusal(&path("specular")), None);
    }

    #[test]
    fn what_is_no_whole_and_straight_mirror_is_left_out() {
        let mut scene = scene(9);
        let used = raystone_scene::TextureUse::plain(0);
        scene.materials[0].normal_texture = Some(used);
        // Without coordinates, a map bends nothing.
        assert_eq!(MirrorTree::of(&scene).connecting, [0b101]);
        scene.uvs = vec![[glam::Vec2::ZERO; 3]; 9];
        assert_eq!(MirrorTree::of(&scene).connecting, [0b100]);
        scene.materials[2] = Material::diffuse("other", Vec3::ONE);
        let tree = MirrorTree::of(&scene);
        assert_eq!(tree, MirrorTree::default());
        let mut words = vec![1, 2, 3];
        assert_eq!(tree.append(&mut words), MirrorPlaces::default());
        assert_eq!(words, [1, 2, 3]);
    }
}
