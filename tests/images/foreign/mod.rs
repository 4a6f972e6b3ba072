//! Images against other programs and formulas: radiosity, figures of Mitsuba 3, Nori's scenes.

mod agreement;
mod cook_torrance;
mod export;
mod lights;
mod luminaires;
mod mitsuba;
mod nori;
mod radiosity;
mod references;

use crate::support::{Stage, builtin, gpu, path, sampler, structure};
use agreement::Replicates;
use glam::{Vec2, Vec3};
use raystone::geometry::{Camera, Triangle};
use raystone::sampling::Sampler;
use raystone::scene::{Material, SceneData};

/// A scene of these quadrilaterals, each with its material, without a sky.
fn scene_of(polygons: &[(Vec<Vec3>, u32)], materials: Vec<Material>, camera: Camera) -> SceneData {
    let mut scene = builtin("single-triangle", &[]);
    scene.triangles.clear();
    scene.material_ids.clear();
    for (corners, material) in polygons {
        for k in 1..corners.len() - 1 {
            let vertices = [corners[0], corners[k], corners[k + 1]];
            scene.triangles.push(Triangle { vertices });
            scene.material_ids.push(*material);
        }
    }
    scene.uvs = Vec::<[Vec2; 3]>::new();
    scene.normals = Vec::new();
    scene.materials = materials;
    scene.environment = Vec3::ZERO;
    scene.daylight = None;
    scene.camera = Some(camera);
    scene
}

/// Images of a scene by the path tracer with this many bounces, one per seed.
fn replicates(scene: SceneData, bounces: i64, size: [u32; 2], spp: u32, count: u32) -> Replicates {
    let sampler = sampler("owen-sobol", "none");
    replicates_by(&sampler, scene, bounces, size, spp, count)
}

/// [`replicates`] with another sampler.
fn replicates_by(
    sampler: &Sampler,
    scene: SceneData,
    bounces: i64,
    size: [u32; 2],
    spp: u32,
    count: u32,
) -> Replicates {
    let stage = Stage::new(gpu(), scene);
    let traced = stage.traced(gpu(), structure("cwbvh"));
    let renderer = stage.renderer(gpu(), &traced, sampler, &path(bounces), size, false);
    let one = |seed| {
        let mut shots = renderer.render(&[spp], seed).expect("the device renders");
        assert_eq!(renderer.error_word().expect("a status"), 0, "error word");
        shots.remove(0).image
    };
    Replicates((0..count).map(|k| one(500 + 13 * k)).collect())
}
