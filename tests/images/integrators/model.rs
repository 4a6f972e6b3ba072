//! Models from files: a mirror shows the scene behind the camera, a texture is right side up.

use crate::support::*;
use glam::Vec3;
use raystone::geometry::Camera;
use raystone::image::Image;
use raystone::scene::{DIFFUSE, MIRROR, SceneData};
use std::path::Path;

const SIZE: u32 = 16;

/// Looks down at the origin from z = 2; x to the right, y up. The square [−1, 1]² at z = 0 fills
/// the image.
fn camera() -> Camera {
    Camera {
        eye: Vec3::new(0.0, 0.0, 2.0),
        target: Vec3::ZERO,
        up: Vec3::Y,
        vertical_fov_degrees: 2.0 * 0.5_f32.atan().to_degrees(),
    }
}

/// Loads `model.obj` with the material library `materials`.
fn load(folder: &Path, model: &str, materials: &str) -> SceneData {
    std::fs::write(folder.join("model.mtl"), materials).expect("a writable folder");
    let path = folder.join("model.obj");
    std::fs::write(&path, format!("mtllib model.mtl\n{model}")).expect("a writable folder");
    let mut scene = from_file(&path);
    scene.camera = Some(camera());
    scene
}

fn render(stage: &Stage, depth: i64, spp: u32) -> Image {
    let traced = stage.traced(gpu(), structure("bvh"));
    let sampler = sampler("pixel-hash", "none");
    let renderer = stage.renderer(gpu(), &traced, &sampler, &path(depth), [SIZE; 2], false);
    renderer
        .render(&[spp], 21)
        .expect("a render")
        .remove(0)
        .image
}

const MIRROR_MODEL: &str = "
v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0
v 0 -9 3\nv 0 9 3\nv 9 9 3\nv 9 -9 3
usemtl mirror\nf 1 2 3 4\nusemtl lamp\nf 5 6 7 8\n";
const MIRROR_MATERIALS: &str = "
newmtl mirror\nillum 3\nKd 0 0 0\nKs 0.5 0.75 0.25\nNs 1000
newmtl lamp\nKd 0 0 0\nKe 4 2 8\n";

#[test]
fn a_mirror_shows_the_tinted_radiance_of_a_lamp_behind_the_camera() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scene = load(folder.path(), MIRROR_MODEL, MIRROR_MATERIALS);
    let kinds: Vec<_> = scene.materials.iter().map(|m| m.kind).collect();
    assert_eq!(kinds, [&MIRROR, &DIFFUSE]);
    let pixel = |image: &Image, x: u32, y: u32| image.pixels[(y * SIZE + x) as usize];
    let mirror = Stage::new(gpu(), scene.clone());
    let image = render(&mirror, 1, 4);
    for y in 0..SIZE {
        for x in 0..SIZE {
            // The lamp is to the right of the camera only.
            let expected = if x < SIZE / 2 {
                [0.0; 3]
            } else {
                [2.0, 1.5, 2.0]
            };
            assert_eq!(pixel(&image, x, y), expected, "pixel {x}, {y}");
        }
    }
    let mut diffuse = scene;
    diffuse.materials[0].kind = &DIFFUSE;
    let image = render(&Stage::new(gpu(), diffuse), 1, 16);
    let left = pixel(&image, 2, 8);
    assert!(left[0] > 0.0, "{left:?}: a diffuse surface scatters");
}

const QUAD: &str = "
v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0
vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1
usemtl picture\nf 1/1 2/2 3/3 4/4\n";

/// Rows from the top, as in the file.
const TEXELS: [[[u8; 3]; 2]; 2] = [[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [188, 188, 188]]];

/// The sRGB transfer function, IEC 61966-2-1.
fn linear(encoded: u8) -> f64 {
    let x = f64::from(encoded) / 255.0;
    if x <= 0.04045 {
        x / 12.92
    } else {
        ((x + 0.055) / 1.055).powf(2.4)
    }
}

/// Mean weight of the second of two texels over a pixel, bilinear and repeated.
fn second_weight(pixel: u32) -> f64 {
    let steps = 1000;
    let weight = |k: u32| {
        let x = (f64::from(pixel) + (f64::from(k) + 0.5) / f64::from(steps)) / f64::from(SIZE);
        // Texel centres are at a quarter and three quarters; 1 at the second, 0 at the first.
        1.0 - (2.0 * (x - 0.75)).abs().min((2.0 * (x + 0.25)).abs())
    };
    (0..steps).map(weight).sum::<f64>() / f64::from(steps)
}

fn expected_color(x: u32, y: u32) -> [f64; 3] {
    let (wx, wy) = (second_weight(x), second_weight(y));
    let mix = |a: f64, b: f64, w: f64| (1.0 - w) * a + w * b;
    [0, 1, 2].map(|c| {
        let row = |r: usize| mix(linear(TEXELS[r][0][c]), linear(TEXELS[r][1][c]), wx);
        mix(row(0), row(1), wy)
    })
}

fn largest_difference(image: &Image, turn: impl Fn(u32, u32) -> (u32, u32)) -> f64 {
    let mut largest = 0.0_f64;
    for y in 0..SIZE {
        for x in 0..SIZE {
            let (tx, ty) = turn(x, y);
            let found = image.pixels[(y * SIZE + x) as usize].map(f64::from);
            for (f, e) in found.into_iter().zip(expected_color(tx, ty)) {
                largest = largest.max((f - e).abs());
            }
        }
    }
    largest
}

#[test]
fn a_texture_lies_on_its_quad_the_right_way_up_in_linear_colours() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut picture = image::RgbImage::new(2, 2);
    for (x, y, pixel) in picture.enumerate_pixels_mut() {
        pixel.0 = TEXELS[y as usize][x as usize];
    }
    picture
        .save(folder.path().join("picture.png"))
        .expect("a picture");
    let materials = "newmtl picture\nKd 1 1 1\nmap_Kd picture.png\n";
    let mut scene = load(folder.path(), QUAD, materials);
    // Under a white sky, which is all a plane sees, radiance is the colour.
    assert!(scene.daylight.take().is_some());
    assert_eq!((scene.textures.len(), scene.environment), (1, Vec3::ONE));
    let image = render(&Stage::new(gpu(), scene), 1, 256);
    let last = SIZE - 1;
    let difference = largest_difference(&image, |x, y| (x, y));
    assert!(difference < 0.03, "{difference}");
    for (what, difference) in [
        ("mirrored", largest_difference(&image, |x, y| (last - x, y))),
        (
            "upside down",
            largest_difference(&image, |x, y| (x, last - y)),
        ),
        ("transposed", largest_difference(&image, |x, y| (y, x))),
    ] {
        assert!(difference > 0.5, "{what}: {difference}");
    }
}

#[test]
fn a_scene_without_a_light_is_under_a_grey_sky_with_a_key_light() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut scene = load(folder.path(), QUAD, "newmtl picture\nKd 1 1 1\n");
    let sky = scene.daylight.expect("a sky");
    let side = sky.up.cross(sky.key).normalize();
    for towards in [
        sky.up,
        -sky.up,
        sky.key,
        -sky.key,
        side,
        (side + sky.key).normalize(),
    ] {
        // From above the square, facing away from it.
        scene.camera = Some(Camera {
            eye: Vec3::new(0.0, 0.0, 9.0),
            target: Vec3::new(0.0, 0.0, 9.0) + towards,
            up: if towards.cross(sky.up).length() > 0.1 {
                sky.up
            } else {
                side
            },
            vertical_fov_degrees: 0.1,
        });
        let height = f64::from(towards.dot(sky.up));
        let step = ((height + 0.6) / 1.4).clamp(0.0, 1.0);
        let grey = 0.12 + 0.38 * step * step * (3.0 - 2.0 * step);
        let key = 10.0 * f64::from(towards.dot(sky.key).max(0.0)).powi(16);
        let expected = [1.0, 0.96, 0.9].map(|warm| grey + key * warm);
        let image = render(&Stage::new(gpu(), scene.clone()), 2, 16);
        for (found, expected) in image.pixels[0].iter().zip(expected) {
            let error = (f64::from(*found) / expected - 1.0).abs();
            assert!(error < 0.01, "{towards}: {found} for {expected}");
        }
    }
}

#[test]
fn a_bounced_ray_that_reaches_far_in_a_room_sees_the_sky() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut scene = load(folder.path(), CUBE, "newmtl picture\nKd 0.5 0.5 0.5\n");
    let sky = scene.daylight.as_mut().expect("a sky");
    assert!(sky.reach <= 1.0, "the inside of the cube is a room");
    let mean = |scene: &SceneData| render(&Stage::new(gpu(), scene.clone()), 4, 16).mean();
    sky.reach = 100.0;
    assert_eq!(mean(&scene), 0.0, "there is no hole in the cube");
    scene.daylight.as_mut().expect("a sky").reach = 0.5;
    assert!(mean(&scene) > 0.1);
    // The camera still sees the walls, and not the sky behind them.
    let dark = scene.materials.iter_mut();
    dark.for_each(|material| material.base_color = Vec3::ZERO);
    assert_eq!(mean(&scene), 0.0);
}

/// Facing inwards.
const CUBE: &str = "
v -2 -2 -2\nv 2 -2 -2\nv 2 2 -2\nv -2 2 -2\nv -2 -2 2.5\nv 2 -2 2.5\nv 2 2 2.5\nv -2 2 2.5
usemtl picture
f 1 2 3 4\nf 5 8 7 6\nf 1 5 6 2\nf 4 3 7 8\nf 1 4 8 5\nf 2 6 7 3\n";
