//! Lights from files: photometry of luminaires, lights of glTF models.

use super::density::{FLUX, probe, probing};
use super::{estimate, path_with, towards};
use crate::support::*;
use glam::Vec3;
use raystone::gpu::{Gpu, KernelLibrary};
use raystone::params::ParamValue;
use raystone::scene::{IesProfile, Light};
use std::f64::consts::PI;
use std::path::{Path, PathBuf};

/// Photometric files next to the project; reports if they are missing.
fn photometry() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/scenes/ies");
    let found = std::fs::read_dir(&folder).map(|entries| {
        let files = entries.flatten().map(|entry| entry.path());
        files
            .filter(|path| path.extension().is_some_and(|e| e == "ies"))
            .collect()
    });
    let mut files: Vec<PathBuf> = found.unwrap_or_default();
    files.sort();
    if files.is_empty() {
        crate::support::needs::skip(
            "files",
            format!("no photometric files in {}", folder.display()),
        );
    }
    files
}

/// Published flux of these files in lumens (linear interpolation).
const PUBLISHED: [(&str, f64); 6] = [
    ("cu-1.ies", 9217.18),
    ("cu-2.ies", 5834.2),
    ("cu-3.ies", 13359.57),
    ("cu-4.ies", 5821.76),
    ("cu-5.ies", 753.8),
    ("cu-7.ies", 531.98),
];

/// A luminaire without symmetry, of this photometry type.
fn uneven(kind: u32) -> String {
    let (vertical, horizontal) = match kind {
        1 => ("0 20 45 90 150", "0 60 180 270 360"),
        _ => ("-90 -30 0 40 90", "-90 -20 10 50 90"),
    };
    let column = |k: u32| format!("{} {} {} {} {}", 90, 40 + 7 * k, 70, 20 + 3 * k, 5);
    let columns: Vec<String> = [0, 3, 1, 8, 0].map(column).into();
    format!(
        "TILT=NONE\n1 -1 2.5 5 5 {kind} 2 0 0 0\n0.5 1 0\n{vertical}\n{horizontal}\n{}\n",
        columns.join("\n")
    )
}

fn flux(gpu: &Gpu, file: &Path) -> f64 {
    let file = ParamValue::Name(file.display().to_string());
    let scene = builtin("luminaire", &[("file", file)]);
    let means = probe(gpu, scene, &FLUX, 256, [16, 1]);
    means[0][0]
}

/// The fault in the flux of asymmetric luminaires, if any.
pub fn fault(gpu: &Gpu) -> Option<String> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    (1..=3).find_map(|kind| {
        let file = folder.path().join("uneven.ies");
        std::fs::write(&file, uneven(kind)).expect("a file");
        let expected = IesProfile::read(&file).expect("a profile").lumens();
        let found = flux(gpu, &file);
        let error = found / expected - 1.0;
        (error.is_nan() || error.abs() > 0.002)
            .then(|| format!("type {kind}: {found} lm, not {expected}"))
    })
}

#[test]
fn the_flux_of_luminaires_is_that_of_their_files() {
    let gpu = probing(KernelLibrary::default());
    assert_eq!(fault(&gpu), None);
    for file in photometry() {
        let profile = IesProfile::read(&file).unwrap_or_else(|e| panic!("{e}"));
        let exact = profile.lumens();
        let name = file
            .file_name()
            .expect("a name")
            .to_string_lossy()
            .into_owned();
        let found = flux(&gpu, &file);
        let published = PUBLISHED.iter().find(|(known, _)| *known == name);
        println!("{name}: {found:.2} lm in the kernel, {exact:.2} exact, {published:?} published");
        assert!(
            (found / exact - 1.0).abs() < 0.005,
            "{name}: {found}, not {exact}"
        );
        if let Some((_, lumens)) = published {
            assert!(
                (found / lumens - 1.0).abs() < 0.005,
                "{name}: {found}, not {lumens}"
            );
        }
    }
}

#[test]
fn the_floor_below_a_luminaire_has_the_illuminance_of_its_file() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("uneven.ies");
    std::fs::write(&file, uneven(1)).expect("a file");
    let changes = [
        ("file", ParamValue::Name(file.display().to_string())),
        ("height", ParamValue::Number(2.0)),
    ];
    let scene = builtin("luminaire", &changes);
    let mut camera = towards([0.0, 0.0]);
    let below = estimate(gpu(), &scene, camera, &path_with(1, &[]), 4).mean;
    // 90 units of 2.5 · 0.5 candela straight down, 2 units away.
    let expected = 90.0 * 1.25 / 4.0 * 0.5 / PI;
    assert!(
        (below / expected - 1.0).abs() < 3e-3,
        "{below}, not {expected}"
    );
    // At 45 degrees towards +z the horizontal angle is 90, between 60 and 180.
    camera = towards([0.0, 2.0]);
    let beside = estimate(gpu(), &scene, camera, &path_with(1, &[]), 4).mean;
    let candela = 1.25 * 70.0;
    let expected = candela * 0.5_f64.sqrt() / 8.0 * 0.5 / PI;
    assert!(
        (beside / expected - 1.0).abs() < 3e-3,
        "{beside}, not {expected}"
    );
}

const MODEL: &str = r#"{"asset":{"version":"2.0"},"extensionsUsed":["KHR_lights_punctual"],
"extensions":{"KHR_lights_punctual":{"lights":[
{"type":"point","color":[1,0.5,0.25],"intensity":8},
{"type":"directional","intensity":3},
{"type":"spot","intensity":5,"spot":{"innerConeAngle":0.2,"outerConeAngle":0.6}},
{"type":"point","intensity":0}]}},
"scenes":[{"nodes":[0,1,2,3,4]}],"scene":0,
"nodes":[{"mesh":0},{"translation":[1,2,3],"scale":[5,5,5],"extensions":{"KHR_lights_punctual":{"light":0}}},
{"rotation":[0.70710678,0,0,-0.70710678],"extensions":{"KHR_lights_punctual":{"light":1}}},
{"translation":[0,1,0],"extensions":{"KHR_lights_punctual":{"light":2}}},
{"extensions":{"KHR_lights_punctual":{"light":3}}}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
"bufferViews":[{"buffer":0,"byteLength":36}],
"buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;

#[test]
fn lights_of_gltf_models_are_where_their_nodes_are() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("lights.gltf");
    std::fs::write(&path, MODEL).expect("a file");
    let scene = from_file(&path);
    let point = Light::Point {
        position: Vec3::new(1.0, 2.0, 3.0),
        intensity: Vec3::new(8.0, 4.0, 2.0),
    };
    assert_eq!(scene.lights[0], point);
    let Light::Directional {
        direction,
        irradiance,
    } = scene.lights[1]
    else {
        panic!("{:?}", scene.lights[1]);
    };
    assert!(
        direction.distance(Vec3::NEG_Y) < 1e-6,
        "{direction}: turned from -z"
    );
    assert_eq!(irradiance, Vec3::splat(3.0));
    let spot = Light::Spot {
        position: Vec3::Y,
        direction: Vec3::NEG_Z,
        intensity: Vec3::splat(5.0),
        inner: 0.2,
        outer: 0.6,
        decay: true,
    };
    assert_eq!(scene.lights[2], spot);
    assert!(scene.daylight.is_none());
    assert!(
        scene.report.warnings[0].contains("left out: its power is 0 (node 4)"),
        "{:?}",
        scene.report
    );
}
