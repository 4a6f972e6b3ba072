//! Environment maps: irradiance against a sum over directions, files, and errors of broken ones.

use super::density::sky;
use super::{estimate, lamp, path_with, towards};
use crate::support::*;
use glam::Vec3;
use raystone::gpu::Gpu;
use raystone::image::{FileFormat, Image};
use raystone::params::ParamValue;
use raystone::scene::{EnvironmentMap, Light, SceneData};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// Bilinear radiance of the map, written from its description.
fn radiance(light: &Light, polar: f64, azimuth: f64) -> f64 {
    let Light::Environment { map, scale, turn } = light else {
        panic!("no environment");
    };
    let (width, height) = (map.width as usize, map.height as usize);
    // A turn by +a about y turns the azimuth φ, measured from −z towards +x, to φ − a.
    let around = (azimuth + f64::from(*turn)).rem_euclid(TAU) / TAU * width as f64 - 0.5;
    let down = (polar / PI * height as f64 - 0.5).clamp(0.0, height as f64 - 1.0);
    let column = around.floor();
    let left = column.rem_euclid(width as f64) as usize;
    let (row, s, t) = (down.floor() as usize, around - column, down.fract());
    let at = |x: usize, y: usize| {
        let texel = map.texels[y.min(height - 1) * width + x % width];
        f64::from(texel.x + texel.y + texel.z) / 3.0
    };
    let along = |y: usize| (1.0 - s) * at(left, y) + s * at(left + 1, y);
    f64::from(*scale) * ((1.0 - t) * along(row) + t * along(row + 1))
}

/// Irradiance of a floor with the normal +y.
fn irradiance(light: &Light) -> f64 {
    let (rows, columns) = (1000, 2000);
    let cell = 0.5 * PI / f64::from(rows) * TAU / f64::from(columns);
    let mut sum = 0.0;
    for row in 0..rows {
        let polar = 0.5 * PI * (f64::from(row) + 0.5) / f64::from(rows);
        for column in 0..columns {
            let azimuth = TAU * (f64::from(column) + 0.5) / f64::from(columns);
            sum += radiance(light, polar, azimuth) * polar.cos() * polar.sin() * cell;
        }
    }
    sum
}

fn floor() -> SceneData {
    let mut scene = lamp("point");
    scene.lights = vec![sky()];
    scene
}

/// The fault in the irradiance of a floor below the map, if any.
pub fn fault(gpu: &Gpu) -> Option<String> {
    let scene = floor();
    let expected = irradiance(&scene.lights[0]) * 0.5 / PI;
    for (strategy, spp) in [("mis-balance", 512), ("light", 1024), ("bsdf", 1024)] {
        let what = path_with(1, &[("strategy", strategy)]);
        let found = estimate(gpu, &scene, towards([0.0, 0.0]), &what, spp);
        if !(found.agrees_with(expected) && found.error < 0.005 * expected) {
            return Some(format!("{strategy}: {found:?}, not {expected}"));
        }
    }
    // The camera sees it unchanged.
    for (polar, azimuth) in [(0.3_f64, 0.2_f64), (1.1, 2.0), (1.4, 4.4), (0.05, 6.0)] {
        let (sin, cos) = polar.sin_cos();
        let towards = Vec3::new(
            (azimuth.sin() * sin) as f32,
            cos as f32,
            (-azimuth.cos() * sin) as f32,
        );
        let camera = raystone::geometry::Camera {
            eye: Vec3::Y,
            target: Vec3::Y + towards,
            up: Vec3::X,
            vertical_fov_degrees: 0.01,
        };
        let expected = radiance(&scene.lights[0], polar, azimuth);
        let found = estimate(gpu, &scene, camera, &path_with(1, &[]), 4).mean;
        if (found / expected - 1.0).abs() > 2e-3 {
            return Some(format!(
                "seen at {polar}, {azimuth}: {found}, not {expected}"
            ));
        }
    }
    None
}

#[test]
fn a_floor_below_a_map_has_the_irradiance_of_a_sum_over_directions() {
    assert_eq!(fault(gpu()), None);
}

#[test]
fn a_scene_takes_a_map_from_a_file_and_tells_what_is_wrong_with_it() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let load = |name: &str, texels: [f32; 3]| {
        let file = folder.path().join(name);
        let picture = Image::new(8, 4, vec![texels; 32]).expect("a picture");
        let format = FileFormat::of(&file).expect("a known ending");
        format.write(&file, &picture, &[]).expect("a written file");
        let name = ParamValue::Name(file.display().to_string());
        builtin("single-triangle", &[("environment", name)])
    };
    let plain = load("white.hdr", [1.0; 3]);
    assert_eq!((plain.lights.len(), plain.environment), (1, Vec3::ZERO));
    assert!(plain.report.warnings.is_empty(), "{:?}", plain.report);
    assert_eq!(load("white.exr", [1.0; 3]).hash, plain.hash);
    assert_ne!(plain.hash, builtin("single-triangle", &[]).hash);
    let black = load("black.hdr", [0.0; 3]);
    let told = &black.report.warnings;
    assert!(
        told.len() == 1 && told[0].contains("its power is 0"),
        "{told:?}"
    );
    // A white furnace by a map: reflected radiance is the colour.
    let found = estimate(
        gpu(),
        &plain,
        plain.camera.expect("a camera"),
        &path_with(1, &[]),
        16,
    );
    assert!(found.mean > 0.49 && found.mean < 1.01, "{found:?}");
}

/// A map of six columns, these white and all others black, turned about +y.
fn columns(white: &[usize], turn: f32) -> Light {
    let texel = |k: usize| Vec3::splat(f32::from(u8::from(white.contains(&(k % 6)))));
    let texels = (0..18).map(texel).collect();
    let map = EnvironmentMap::new("columns", [6, 3], texels, &mut Vec::new());
    Light::Environment {
        map: Arc::new(map.expect("a map")),
        scale: 1.0,
        turn,
    }
}

/// Directions of columns: a quarter of the way across a map is +x, half +z, three quarters −x (Mitsuba 3, `envmap`);
/// a quarter turn turns +x to −z (right-handed about +y).
const PLACES: [(&[usize], f32, Vec3); 5] = [
    (&[1], 0.0, Vec3::X),
    (&[2, 3], 0.0, Vec3::Z),
    (&[4], 0.0, Vec3::NEG_X),
    (&[5, 0], 0.0, Vec3::NEG_Z),
    (&[1], std::f32::consts::FRAC_PI_2, Vec3::NEG_Z),
];

/// The fault in the directions of columns, as seen by rays and found by light samples, if any.
pub fn fault_of_directions(gpu: &Gpu) -> Option<String> {
    for (white, turn, direction) in PLACES {
        let mut scene = floor();
        scene.lights = vec![columns(white, turn)];
        for (towards, seen) in [(direction, 1.0), (-direction, 0.0)] {
            let camera = raystone::geometry::Camera {
                eye: Vec3::Y,
                target: Vec3::Y + towards,
                up: Vec3::Y,
                vertical_fov_degrees: 0.01,
            };
            let found = estimate(gpu, &scene, camera, &path_with(1, &[]), 4).mean;
            if (found - seen).abs() > 1e-3 {
                return Some(format!(
                    "{white:?} turned by {turn}: {found} at {towards}, not {seen}"
                ));
            }
            // A wall facing this way, lit only by samples of the map.
            let turn_up = glam::Quat::from_rotation_arc(Vec3::Y, towards);
            let mut wall = scene.clone();
            for triangle in &mut wall.triangles {
                triangle.vertices = triangle.vertices.map(|v| turn_up * v);
            }
            let camera = raystone::geometry::Camera {
                eye: 0.5 * towards + 0.1 * Vec3::Y,
                target: Vec3::ZERO,
                ..camera
            };
            let what = path_with(1, &[("strategy", "light")]);
            let lit = estimate(gpu, &wall, camera, &what, 64).mean;
            if (lit > 0.05) != (seen > 0.0) {
                return Some(format!(
                    "{white:?} turned by {turn}: a wall towards {towards} is lit by {lit}"
                ));
            }
        }
    }
    None
}

#[test]
fn columns_grow_to_the_right_from_behind_through_plus_x() {
    assert_eq!(fault_of_directions(gpu()), None);
}
