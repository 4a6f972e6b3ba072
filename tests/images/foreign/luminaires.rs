//! Irradiance of a plane by an IES luminaire: I(θ, φ) cos³θ / h², with intensities that are a
//! product of two linear functions, so values between the file's angles are known. Mitsuba does not
//! read such files.

use super::{replicates, scene_of};
use glam::{DVec3, Mat3, Quat, Vec3};
use raystone::geometry::Camera;
use raystone::image::Image;
use raystone::scene::{IesProfile, Light, Material};
use std::f64::consts::PI;
use std::sync::Arc;

const SIZE: [u32; 2] = [12, 12];
const ALBEDO: f32 = 0.6;
const HEIGHT: f32 = 2.0;
const MULTIPLIER: f64 = 2.5;

/// Candela at an angle from the nadir and one around it, degrees, before the multiplier.
fn intensity(vertical: f64, horizontal: f64) -> f64 {
    (900.0 - 7.0 * vertical) * (0.3 + horizontal / 300.0)
}

/// A file of 2002 whose factors are 1.
fn file(horizontal: &[f64]) -> String {
    let vertical: Vec<f64> = (0..=6).map(|k| f64::from(15 * k)).collect();
    let words = |numbers: &mut dyn Iterator<Item = f64>| {
        let words: Vec<String> = numbers.map(|x| format!("{x:.6}")).collect();
        words.join(" ")
    };
    let mut lines = vec![
        "IESNA:LM-63-2002".to_owned(),
        "[TEST] none".to_owned(),
        "[MANUFAC] none".to_owned(),
        "TILT=NONE".to_owned(),
        format!(
            "1 1000 {MULTIPLIER} {} {} 1 2 0 0 0",
            vertical.len(),
            horizontal.len()
        ),
        "1 1 100".to_owned(),
        words(&mut vertical.iter().copied()),
        words(&mut horizontal.iter().copied()),
    ];
    for h in horizontal {
        lines.push(words(&mut vertical.iter().map(|v| intensity(*v, *h))));
    }
    lines.join("\n") + "\n"
}

fn camera() -> Camera {
    Camera::upright(Vec3::new(2.5, 5.0, -2.0), Vec3::new(0.1, 0.0, 0.2), 50.0)
}

/// An image of the plane y = 0 under a luminaire.
fn image_under(horizontal: &[f64]) -> Image {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("luminaire.ies");
    std::fs::write(&path, file(horizontal)).expect("a writable folder");
    let profile = IesProfile::read(&path).unwrap_or_else(|e| panic!("{e}"));
    let corners = [(-29.0, -29.0), (-29.0, 29.0), (29.0, 29.0), (29.0, -29.0)];
    let corners = corners.map(|(x, z)| Vec3::new(x, 0.0, z)).to_vec();
    let material = Material::diffuse("plane", Vec3::splat(ALBEDO));
    let mut scene = scene_of(&[(corners, 0)], vec![material], camera());
    scene.lights = vec![Light::Ies {
        position: Vec3::new(0.0, HEIGHT, 0.0),
        // Its z, the nadir, points down; its x, where angles begin, along x, and so its y along z.
        rotation: Quat::from_mat3(&Mat3::from_cols(Vec3::X, Vec3::Z, -Vec3::Y)),
        color: Vec3::ONE,
        profile: Arc::new(profile),
    }];
    replicates(scene, 1, SIZE, 256, 1).0.remove(0)
}

/// Relative differences of mean and worst pixel from those of an intensity by angles (degrees).
fn compare(image: &Image, of: impl Fn(f64, f64) -> f64) -> [f64; 2] {
    let camera = camera();
    // Points within a pixel: the centres of 8 × 8 parts.
    let [forward, right, up] = camera.basis(SIZE).map(Vec3::as_dvec3);
    let eye = camera.eye.as_dvec3();
    let fine = 8;
    let place = |k: u32| 2.0 * (f64::from(k) + 0.5) / f64::from(fine * SIZE[0]) - 1.0;
    // Reflected radiance of a point, and its angle around.
    let reflected = |x: u32, y: u32| {
        let direction: DVec3 = forward + place(x) * right - place(y) * up;
        let p = eye - direction * (eye.y / direction.y);
        let height = f64::from(HEIGHT);
        let vertical = p.x.hypot(p.z).atan2(height);
        let around = p.z.atan2(p.x).to_degrees().rem_euclid(360.0);
        let candela = MULTIPLIER * of(vertical.to_degrees(), around);
        let irradiance = candela * vertical.cos().powi(3) / (height * height);
        (f64::from(ALBEDO) / PI * irradiance, around)
    };
    let (mut total, mut worst) = ([0.0; 2], 0.0_f64);
    for (k, pixel) in (0..).zip(&image.pixels) {
        let (x, y) = (fine * (k % SIZE[0]), fine * (k / SIZE[0]));
        let parts = (0..fine * fine).map(|k| reflected(x + k % fine, y + k / fine));
        let parts: Vec<(f64, f64)> = parts.collect();
        let expected = parts.iter().map(|p| p.0).sum::<f64>() / parts.len() as f64;
        let found = f64::from(pixel[0]);
        total = [total[0] + found, total[1] + expected];
        // Without symmetry there is a step at 0 = 360: pixels there use their own points.
        let above = parts.iter().filter(|p| p.1 > 180.0).count();
        let is_across = parts.iter().any(|p| p.1 > 270.0) && (1..parts.len()).contains(&above);
        if !is_across {
            worst = worst.max((found / expected - 1.0).abs());
        }
    }
    [(total[0] / total[1] - 1.0).abs(), worst]
}

/// A name, the horizontal angles of the file, and the equivalent of each angle.
type Kind = (&'static str, Vec<f64>, fn(f64) -> f64);

#[test]
fn a_luminaire_casts_what_its_file_says_around_every_kind_of_symmetry() {
    let steps = |from: i32, to: i32| -> Vec<f64> {
        (from / 30..=to / 30).map(|k| f64::from(30 * k)).collect()
    };
    let kinds: [Kind; 5] = [
        ("about the axis", vec![0.0], |_| 0.0),
        ("four quadrants", steps(0, 90), |h| {
            let half = h.min(360.0 - h);
            half.min(180.0 - half)
        }),
        ("two halves, 0 to 180", steps(0, 180), |h| h.min(360.0 - h)),
        ("two halves, 90 to 270", steps(90, 270), |h| {
            if (90.0..=270.0).contains(&h) {
                h
            } else {
                (540.0 - h) % 360.0
            }
        }),
        ("none", steps(0, 360), |h| h),
    ];
    for (name, angles, of_file) in kinds {
        let image = image_under(&angles);
        let by = |shift: f64, sign: f64| {
            let around = move |h: f64| (720.0 + shift + sign * h) % 360.0;
            compare(&image, |v, h| intensity(v, of_file(around(h))))
        };
        let [mean, worst] = by(0.0, 1.0);
        println!("{name}: mean {mean:.1e}, worst pixel {worst:.1e}");
        assert!(mean < 1e-3 && worst < 0.003, "{name}: {mean}, {worst}");
        // A quarter turn would be detected, and reversed angles.
        let [_, turned] = by(90.0, 1.0);
        assert!(turned > 0.2 || angles.len() == 1, "{name}: {turned}");
        let [_, backwards] = by(0.0, -1.0);
        assert!(backwards > 0.2 || name != "none", "{name}: {backwards}");
    }
}
