//! Single paths on real scenes: every difference from the oracle is explained by a kind of
//! rounding. With RAYSTONE_REAL_PATHS=/, and in a full run, every scene of the list is used with
//! every triangle test, which takes some minutes in release; with a part of names, the scenes that
//! contain it; else one of a few small ones with the default test.

use super::{independent, judged_on};
use crate::support::*;
use raystone::accel::{Intersection, TriangleRegistry};
use raystone::integrator::Stage;
use std::path::Path;
use std::sync::Arc;

/// Below `../shared/scenes`; a run that is not full uses one of the first ones.
const SCENES: [&str; 79] = [
    "cornell-box/CornellBox-Water.obj",
    "cornell-box/CornellBox-Original.obj",
    "ring-caustic/MNCardioid.obj",
    "odd-meshes/woody.obj",
    "bart-kitchen/bart_kitchen_t15.5.glb",
    "country-kitchen/kitchen.glb",
    "fireplace-room/fireplace_room.glb",
    "white-room/white_room.glb",
    "dream-apartment/dream_apartment.glb",
    "sponza-crytek/sponza.obj",
    "sponza-dabrovic/sponza_dabrovic.obj",
    "lego-bulldozer/lego.glb",
    "macross-city-diorama/macross_city_diorama.glb",
    "japanese-bridge-garden/japanese_bridge_garden.glb",
    "flight-helmet/FlightHelmet.gltf",
    "sheen-chair/MixedLightingExample.gltf",
    "usd-shader-ball/usd_shaderball.glb",
    "stanford-bunny/stanford-bunny.obj",
    "stanford-dragon/dragon_100k.obj",
    "nefertiti/nefertiti.obj",
    "utah-teapot/teapot.obj",
    "odd-meshes/alligator.obj",
    "odd-meshes/fandisk.obj",
    "odd-meshes/rocker-arm.obj",
    "odd-meshes/spot.obj",
    "cornell-box/CornellBox-Empty-CO.obj",
    "cornell-box/CornellBox-Empty-Squashed.obj",
    "cornell-box/CornellBox-Glossy.obj",
    "cornell-box/CornellBox-Mirror.obj",
    "cornell-box/CornellBox-Sphere.obj",
    "nori-cbox/cbox-distributed.xml",
    "veach-mis/veach_mis.xml",
    "water-caustic/water.ply",
    "material-test/T-Ball.ply",
    "glass-caustics/caustics.obj",
    "ring-caustic/MNRing.obj",
    "ring-caustic/MNRoom.obj",
    "candles/models/Candle_burn1_Candle.burn1.obj",
    "candles/models/Candle_burn2_Candle.burn2.obj",
    "candles/models/Candle_burn3_Mesh.005.obj",
    "candles/models/Candle_burn4_Mesh.008.obj",
    "candles/models/Candle_burn5_Mesh.013.obj",
    "candles/models/Candle_burn6_Mesh.012.obj",
    "candles/models/Candle_full_Candle_full.obj",
    "candles/models/Candle_wick1_Mesh.003.obj",
    "candles/models/Candle_wick2_Mesh.007.obj",
    "candles/models/Candle_wick3_Mesh.004.obj",
    "candles/models/Candle_wick4_Mesh.009.obj",
    "candles/models/Candle_wick5_Mesh.014.obj",
    "candles/models/Candle_wick6_Mesh.015.obj",
    "candles/models/Candle_wick_Mesh.001.obj",
    "candles/models/Mesh.001_Mesh.002.obj",
    "candles/models/Mesh.002_Mesh.006.obj",
    "candles/models/Mesh.005_Mesh.011.obj",
    "candles/models/Mesh.006_Mesh.016.obj",
    "candles/models/Mesh.008_Mesh.017.obj",
    "candles/models/Mesh.010.obj",
    "candles/models/Mesh.obj",
    "cornell-box/CornellBox-Empty-RG.obj",
    "cornell-box/CornellBox-Empty-White.obj",
    "cornell-box/CornellBox-Glossy-Floor.obj",
    "furniture/door/door.obj",
    "furniture/sash-window/sash-window.obj",
    "furniture/sofa/sofa.obj",
    "furniture/tv/tv.obj",
    "furniture/venetian-blind-window/venetian.obj",
    "furniture/window-curtain/window.obj",
    "furniture/window/window.obj",
    "material-test/Ring.ply",
    "material-test/Stand.ply",
    "nori-cbox/cbox-whitted.xml",
    "torus-in-glass/mesh0.obj",
    "torus-in-glass/mesh1.obj",
    "torus-in-glass/mesh2.obj",
    "torus-in-glass/mesh3.obj",
    "torus-in-glass/mesh4.obj",
    "veach-mis/veach_ems.xml",
    "veach-mis/veach_mats.xml",
    "water-caustic/front.ply",
];
const SMALL_ONES: usize = 4;
const SAMPLES: [u32; 4] = [0, 1, 23, 63];

#[test]
fn no_path_on_a_real_scene_differs_without_a_reason() {
    let asked = std::env::var("RAYSTONE_REAL_PATHS").ok();
    let asked = asked.or_else(|| is_full().then(|| "/".to_owned()));
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/scenes");
    let registry = TriangleRegistry::default();
    let tests: Vec<_> = match asked {
        Some(_) => registry.iter().filter(|test| test.is_exact()).collect(),
        None => vec![Intersection::default().triangle],
    };
    let scenes: Vec<_> = match &asked {
        Some(part) => SCENES.iter().filter(|name| name.contains(part)).collect(),
        None => one_of(
            SMALL_ONES,
            "real scenes path by path",
            &SCENES[..SMALL_ONES],
        ),
    };
    assert!(!scenes.is_empty(), "no scene has {asked:?} in its name");
    let mut faults = Vec::new();
    for name in scenes {
        let path = folder.join(name);
        if !path.exists() {
            needs::skip("files", format!("{} is not there", path.display()));
            continue;
        }
        let scene = Arc::new(from_file(&path));
        for &triangle in &tests {
            let tests = Intersection {
                triangle,
                ..Intersection::default()
            };
            let stage = Stage::new(gpu(), scene.clone(), tests).expect("fits");
            for integrator in ["primary", "ao", "path"] {
                let what = integrator_variant(integrator, &[]);
                let record = judged_on(gpu(), &stage, &scene, &what, &independent(), &SAMPLES);
                let record = record.expect("images");
                println!("{name}, {}, {integrator}: {record:?}", triangle.name());
                let fault = record.fault.map(|f| format!("{name}, {integrator}: {f}"));
                faults.extend(fault);
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
