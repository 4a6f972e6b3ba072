//! Vertex colours, from file to picture: under a white sky, radiance is reflectance.

use crate::support::*;
use glam::Vec3;
use raystone::geometry::Camera;
use raystone::scene::SceneData;
use std::path::Path;

const SIZE: u32 = 17;

/// The scene in a white furnace, with the unit square filling the image: its pixels, from the top.
fn seen(mut scene: SceneData) -> (Vec<[f32; 3]>, Vec<String>) {
    scene.environment = Vec3::ONE;
    scene.daylight = None;
    let fov = 2.0 * 0.5_f32.atan().to_degrees();
    let eye = Vec3::new(0.5, 0.5, 1.0);
    scene.camera = Some(Camera::upright(eye, eye - Vec3::Z, fov));
    let stage = Stage::new(gpu(), scene);
    let traced = stage.traced(gpu(), structure("bvh"));
    let sampler = sampler("pixel-hash", "none");
    let renderer = stage.renderer(gpu(), &traced, &sampler, &path(3), [SIZE, SIZE], false);
    let shots = renderer.render(&[64], 1).expect("a render");
    let image = &shots.last().expect("a snapshot").image;
    (image.pixels.clone(), renderer.features())
}

fn load_text(name: &str, text: &str) -> SceneData {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join(name);
    std::fs::write(&path, text).expect("a model");
    from_file(Path::new(&path))
}

fn ply(left: &str, right: &str, kind: &str) -> String {
    format!(
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
         property {kind} red\nproperty {kind} green\nproperty {kind} blue\nelement face 1\n\
         property list uchar int vertex_indices\nend_header\n\
         0 0 0 {left}\n1 0 0 {right}\n1 1 0 {right}\n0 1 0 {left}\n4 0 1 2 3\n"
    )
}

#[test]
fn a_red_square_is_red_and_half_way_is_the_mean() {
    let obj = |left: &str, right: &str| {
        format!("v 0 0 0 {left}\nv 1 0 0 {right}\nv 1 1 0 {right}\nv 0 1 0 {left}\nf 1 2 3 4\n")
    };
    // Screen value 188 of 255 is 0.5029 of the light.
    let grey = 0.502_886;
    for (name, text, left, right) in [
        (
            "red.ply",
            ply("255 0 0", "255 0 0", "uchar"),
            [1.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
        ),
        (
            "ramp.ply",
            ply("255 0 188", "0 0 188", "uchar"),
            [1.0, 0.0, grey],
            [0.0, 0.0, grey],
        ),
        (
            "ramp.ply",
            ply("0 1 0", "0 0 1", "float"),
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
        ),
        (
            "ramp.obj",
            obj("0 0 1", "1 0 1"),
            [0.0, 0.0, 1.0],
            [1.0, 0.0, 1.0],
        ),
    ] {
        let (pixels, features) = seen(load_text(name, &text));
        assert!(
            features.iter().any(|f| f == "vertex_colors"),
            "{features:?}"
        );
        for (at, pixel) in (0..).zip(&pixels) {
            let along = ((at % SIZE) as f32 + 0.5) / SIZE as f32;
            for ((a, b), found) in left.iter().zip(&right).zip(pixel) {
                let expected = a + along * (b - a);
                // Samples are spread over a pixel.
                let error = (found - expected).abs();
                assert!(error < 0.012, "{name} {at}: {pixel:?}, not {expected}");
            }
        }
    }
    let (pixels, features) = seen(load_text("grey.obj", &obj("", "")));
    assert!(
        !features.iter().any(|f| f == "vertex_colors"),
        "{features:?}"
    );
    assert!((pixels[0][0] - 0.7).abs() < 1e-5, "{:?}", pixels[0]);
}
