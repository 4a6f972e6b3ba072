//! Real models, if available.

use super::*;
use std::path::PathBuf;

fn real_scene(file: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../shared/scenes")
        .join(file);
    if !path.exists() {
        needs::skip("files", format!("{} is not there", path.display()));
        return None;
    }
    Some(path)
}

#[test]
fn real_models_have_their_published_triangle_counts() {
    // File, triangles, number with zero area.
    for (file, triangles, zero_area) in [
        ("sponza-crytek/sponza.obj", 262_267, 0),
        ("country-kitchen/kitchen.glb", 1_021_815, 219),
        ("stanford-dragon/dragon_100k.obj", 100_000, 0),
        ("fireplace-room/fireplace_room.glb", 105_299, 190),
        (
            "japanese-bridge-garden/japanese_bridge_garden.glb",
            21_883,
            0,
        ),
        ("flight-helmet/FlightHelmet.gltf", 94_722, 0),
        ("sheen-chair/MixedLightingExample.gltf", 40_898, 0),
        ("cornell-box/CornellBox-Empty-CO.obj", 12, 0),
        ("cornell-box/CornellBox-Empty-RG.obj", 10, 0),
        ("cornell-box/CornellBox-Empty-Squashed.obj", 12, 0),
        ("cornell-box/CornellBox-Empty-White.obj", 12, 0),
        ("cornell-box/CornellBox-Glossy-Floor.obj", 1_112, 0),
        ("cornell-box/CornellBox-Glossy.obj", 1_112, 0),
        ("cornell-box/CornellBox-Mirror.obj", 34, 0),
        ("cornell-box/CornellBox-Original.obj", 36, 0),
        ("cornell-box/CornellBox-Sphere.obj", 2_186, 0),
        ("cornell-box/CornellBox-Water.obj", 7_089, 1),
        ("water-caustic/water.ply", 102_938, 0),
    ] {
        let Some(path) = real_scene(file) else {
            continue;
        };
        let options = LoadOptions {
            textures: false,
            ..LoadOptions::default()
        };
        let scene = load(&variant(path.to_str().unwrap()), &options).unwrap();
        assert_eq!(scene.triangles.len(), triangles, "{file}");
        assert_eq!(scene.report.zero_area, zero_area, "{file}");
        assert_eq!(scene.report.dropped_non_finite, 0, "{file}");
    }
}

#[test]
fn the_textures_and_lights_of_real_models_arrive() {
    if let Some(path) = real_scene("sponza-crytek/sponza.obj") {
        let scene = load_path(&path).unwrap();
        assert_eq!(scene.textures.len(), 24, "{:?}", scene.report);
        assert_eq!(scene.uvs.len(), scene.triangles.len());
        let extent = scene.bounds().max - scene.bounds().min;
        assert!(
            (extent - Vec3::new(3721.0, 1555.4, 2288.0))
                .abs()
                .max_element()
                < 1.0
        );
    }
    if let Some(path) = real_scene("country-kitchen/kitchen.glb") {
        let scene = load_path(&path).unwrap();
        assert!(scene.camera.is_some());
        assert!(!scene.textures.is_empty());
    }
    for (file, mirrors) in [("Original", 0), ("Sphere", 1)] {
        if let Some(path) = real_scene(&format!("cornell-box/CornellBox-{file}.obj")) {
            let scene = load_path(&path).unwrap();
            let lit = file == "Original";
            assert_eq!(!scene.emitters().is_empty(), lit, "{file}");
            assert_eq!(scene.environment == Vec3::ZERO, lit, "{file}");
            let is_mirror = |m: &&Material| m.kind == &MIRROR;
            assert_eq!(
                scene.materials.iter().filter(is_mirror).count(),
                mirrors,
                "{file}"
            );
        }
    }
}
