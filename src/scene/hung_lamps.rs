//! Lamps added to any scene, to vary its number of lights.

use super::{GEOMETRIC, Material, SceneData, WHITE};
use glam::{Vec2, Vec3};
use raystone_core::geometry::Triangle;
use raystone_core::random::Pcg32;

/// Edge of a lamp as a fraction of the scene's diagonal.
const EDGE: f32 = 0.003;
/// Extent of the region with lamps relative to the box, along each axis.
const INNER: f32 = 0.2;
/// Radiance of a single lamp that carries the power of all.
const RADIANCE: f32 = 2000.0;

/// Adds `lamps` square lamps of equal power at random places of the inner box. A scene without
/// lights loses its default sky; instances are flattened. The first lamps are always the same.
pub(super) fn hang(mut scene: SceneData, lamps: u32) -> SceneData {
    let bounds = scene.bounds();
    let (center, half) = (bounds.center(), 0.5 * (bounds.max - bounds.min));
    let edge = EDGE * 2.0 * bounds.radius();
    let material = scene.materials.len() as u32;
    let emission = Vec3::splat(RADIANCE / lamps as f32);
    scene.materials.push(Material {
        emits_both_sides: false,
        ..Material::diffuse("hung lamp", Vec3::ZERO).emitting(emission)
    });
    let mut random = Pcg32::new(36);
    for _ in 0..lamps {
        let corner = center + 2.0 * INNER * half * random.in_cube().as_vec3();
        let at = |x: f32, z: f32| corner + edge * Vec3::new(x, 0.0, z);
        let [a, b, c, d] = [at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)];
        for vertices in [[a, b, c], [a, c, d]] {
            scene.triangles.push(Triangle { vertices });
            scene.material_ids.push(material);
        }
    }
    let count = scene.triangles.len();
    if !scene.uvs.is_empty() {
        scene.uvs.resize(count, [Vec2::ZERO; 3]);
    }
    if !scene.normals.is_empty() {
        scene.normals.resize(count, [GEOMETRIC; 3]);
    }
    if !scene.colors.is_empty() {
        scene.colors.resize(count, [WHITE; 3]);
    }
    if !scene.mirrored.is_empty() {
        scene.mirrored.resize(count, false);
    }
    scene.assembly = None;
    if let Some(sky) = scene.daylight.take() {
        let note = sky.note();
        scene.report.warnings.retain(|line| *line != note);
        scene.environment = Vec3::ZERO;
    }
    scene.hash = scene.content_hash();
    scene
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LightList;
    use crate::builtin::tests::{load_default, load_unlit, load_with};
    use raystone_core::params::ParamValue;

    #[test]
    fn so_many_lamps_hang_within_the_box_and_shine_down() {
        let plain = load_default("triangle-soup");
        let lamps = |count| {
            load_with(
                "triangle-soup",
                &[("hung_lamps", ParamValue::Integer(count))],
            )
        };
        let scene = lamps(5);
        assert_eq!(LightList::of(&scene).lights.len(), 5);
        assert_eq!(scene.bounds(), plain.bounds());
        assert_ne!(scene.hash, plain.hash);
        for triangle in &scene.triangles[plain.triangles.len()..] {
            let [a, b, c] = triangle.vertices;
            assert!((b - a).cross(c - a).y < 0.0);
        }
        let corners = |scene: &SceneData| scene.triangles[plain.triangles.len()..][..10].to_vec();
        assert_eq!(corners(&lamps(9)), corners(&scene));
    }

    #[test]
    fn a_scene_under_the_sky_of_those_without_a_light_loses_it() {
        assert!(load_unlit(&[]).daylight.is_some());
        let scene = load_unlit(&[("hung_lamps", ParamValue::Integer(1))]);
        assert_eq!((scene.daylight, scene.environment), (None, Vec3::ZERO));
        assert_eq!(scene.report.warnings.len(), 0, "{:?}", scene.report);
    }

    #[test]
    fn lamps_among_mirrored_copies_shine_down_too() {
        let scene = load_with("instances", &[("hung_lamps", ParamValue::Integer(4))]);
        let first = scene.triangles.len() - 8;
        assert!((0..first).any(|id| scene.is_mirrored(id)));
        for id in first..scene.triangles.len() {
            let [a, b, c] = scene.outward(id);
            assert!((b - a).cross(c - a).y < 0.0, "{id}");
        }
    }
}
