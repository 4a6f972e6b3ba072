//! The record of a scene.

use raystone_advice::SceneFeatures;
use raystone_core::geometry::Camera;
use raystone_record::SceneRecord;
use raystone_scene::SceneData;

/// What a run tells of a scene that it loaded in `load_ms` milliseconds.
pub fn scene_record(scene: &SceneData, camera: Camera, load_ms: f64) -> SceneRecord {
    let bounds = scene.bounds();
    SceneRecord {
        triangles: scene.triangles.len(),
        bounds_min: bounds.min.to_array(),
        bounds_max: bounds.max.to_array(),
        load_ms,
        bytes: scene.bytes() as u64,
        materials: scene.materials.len(),
        textures: scene.textures.len(),
        emitters: scene.emitters().len(),
        camera,
        features: Some(SceneFeatures::of(
            scene.triangles.iter().map(|t| t.vertices),
            scene.assembly.as_ref().map_or(1, |a| a.instances().len()),
        )),
        report: scene.report.clone(),
        scene_hash: scene.hash.clone(),
    }
}
