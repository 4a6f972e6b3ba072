//! Irradiance of a plane by lights of simple shapes, in closed form.

use super::{replicates, scene_of};
use glam::{DVec3, Vec3};
use raystone::geometry::Camera;
use raystone::measure::known_images::closed::{disk, polygon};
use raystone::scene::{Material, SceneData};
use std::f64::consts::{PI, TAU};

const SIZE: [u32; 2] = [8, 8];
const ALBEDO: f64 = 0.6;
const RADIANCE: f64 = 5.0;
const HEIGHT: f64 = 1.5;
/// Tolerance of an image's mean beyond five standard errors.
const TOLERANCE: f64 = 0.001;

/// Compares the mean of an oblique image of a lit plane with the light reflected by its points.
fn compare(light: &[DVec3], irradiance: impl Fn(DVec3) -> f64, brighter: f32) -> f64 {
    let camera = Camera::upright(Vec3::new(2.5, 1.0, -2.0), Vec3::new(0.2, 0.0, 0.3), 12.0);
    let corner = |x: f32, z: f32| Vec3::new(x, 0.0, z);
    let plane = vec![
        corner(-9.0, -9.0),
        corner(-9.0, 9.0),
        corner(9.0, 9.0),
        corner(9.0, -9.0),
    ];
    let lamp = light.iter().map(|c| c.as_vec3()).collect();
    let materials = vec![
        Material::diffuse("plane", Vec3::splat(ALBEDO as f32)),
        Material::diffuse("lamp", Vec3::ZERO).emitting(Vec3::splat(brighter * RADIANCE as f32)),
    ];
    let scene: SceneData = scene_of(&[(plane, 0), (lamp, 1)], materials, camera);
    let images = replicates(scene, 1, SIZE, 256, 8);
    let means: Vec<f64> = images.0.iter().map(|image| image.mean()).collect();
    let found = crate::support::Estimate::of(&means);
    // Points within a pixel: the centres of 4 × 4 parts.
    let [forward, right, up] = camera.basis(SIZE).map(Vec3::as_dvec3);
    let eye = camera.eye.as_dvec3();
    let fine = 4 * SIZE[0];
    let place = |k: u32| 2.0 * (f64::from(k) + 0.5) / f64::from(fine) - 1.0;
    let reflected = |(x, y): (u32, u32)| {
        let direction = forward + place(x) * right - place(y) * up;
        let point = eye - direction * (eye.y / direction.y);
        RADIANCE * ALBEDO / PI * irradiance(point)
    };
    let places = (0..fine).flat_map(|y| (0..fine).map(move |x| (x, y)));
    let expected = places.map(reflected).sum::<f64>() / f64::from(fine * fine);
    println!("{found:?} for {expected}");
    assert!(found.error < 0.002 * expected, "{found:?} proves nothing");
    let excess = (found.mean - expected).abs() - 5.0 * found.error;
    excess / expected
}

/// Corners turn counter-clockwise seen from below.
fn rectangle() -> Vec<DVec3> {
    [(-0.4, -0.3), (0.4, -0.3), (0.4, 0.5), (-0.4, 0.5)]
        .map(|(x, z)| DVec3::new(x, HEIGHT, z))
        .to_vec()
}

/// A regular polygon with the area of a circle.
fn circle(radius: f64) -> Vec<DVec3> {
    const SIDES: u32 = 128;
    let step = TAU / f64::from(SIDES);
    let radius = radius * (step / step.sin()).sqrt();
    let corner = |k: u32| {
        let (sin, cos) = (f64::from(k) * step).sin_cos();
        DVec3::new(radius * cos, HEIGHT, radius * sin)
    };
    (0..SIDES).map(corner).collect()
}

#[test]
fn a_rectangle_light_casts_what_lambert_says() {
    let light = rectangle();
    let excess = compare(&light, |p| polygon(p, DVec3::Y, &light), 1.0);
    assert!(excess < TOLERANCE, "{excess}");
    // Tilted: the light is seen obliquely, wholly above the plane.
    let leaning: Vec<DVec3> = light.iter().map(|c| *c + DVec3::Y * (0.8 * c.x)).collect();
    let excess = compare(&leaning, |p| polygon(p, DVec3::Y, &leaning), 1.0);
    assert!(excess < TOLERANCE, "{excess}");
}

#[test]
fn a_disk_light_casts_what_its_configuration_factor_says() {
    let radius = 0.5;
    let irradiance = |p: DVec3| disk(HEIGHT, radius, p.x.hypot(p.z));
    let excess = compare(&circle(radius), irradiance, 1.0);
    assert!(excess < TOLERANCE, "{excess}");
    // Both formulas agree for a polygon with this many sides.
    let point = DVec3::new(0.3, 0.0, 0.2);
    let by_edges = polygon(point, DVec3::Y, &circle(radius));
    assert!((by_edges / irradiance(point) - 1.0).abs() < 1e-4);
}

#[test]
fn a_light_one_percent_too_bright_is_found() {
    let light = rectangle();
    let excess = compare(&light, |p| polygon(p, DVec3::Y, &light), 1.01);
    assert!(excess > TOLERANCE, "{excess}");
}
