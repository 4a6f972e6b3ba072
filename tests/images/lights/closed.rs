//! Irradiance of the floor below the lamps of the scene `lamp`, in closed form.

use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// Height, radiance (intensity, irradiance) and half the edge, radius or angles of the lamps.
const HEIGHT: f64 = 2.0;
const STRENGTH: f64 = 10.0;

/// Places on the floor: below the lamp, next to it, far away.
pub const PLACES: [[f64; 2]; 3] = [[0.0, 0.0], [0.7, 0.3], [-1.6, 1.1]];

pub const LAMPS: [&str; 6] = [
    "rectangle",
    "disk",
    "sphere",
    "point",
    "spot",
    "directional",
];

/// Irradiance of a plane with normal +y by a uniform polygon above and facing it (J. Lambert,
/// "Photometria", 1760): half the sum over edges of subtended angle times the plane's cosine.
fn polygon(corners: &[DVec3], place: DVec3) -> f64 {
    let count = corners.len();
    let edge = |k: usize| {
        let [a, b] = [k, (k + 1) % count].map(|k| (corners[k] - place).normalize());
        let angle = a.dot(b).clamp(-1.0, 1.0).acos();
        angle * a.cross(b).normalize().y
    };
    (STRENGTH * 0.5 * (0..count).map(edge).sum::<f64>()).abs()
}

pub fn irradiance(lamp: &str, [x, z]: [f64; 2]) -> f64 {
    let place = DVec3::new(x, 0.0, z);
    let towards = DVec3::new(0.0, HEIGHT, 0.0) - place;
    let squared = towards.length_squared();
    let cosine = HEIGHT / squared.sqrt();
    let at = |x: f64, z: f64| DVec3::new(x, HEIGHT, z);
    let by_point = STRENGTH * cosine / squared;
    match lamp {
        "rectangle" => {
            let corners = [at(-0.5, -0.5), at(0.5, -0.5), at(0.5, 0.5), at(-0.5, 0.5)];
            polygon(&corners, place)
        }
        "disk" => {
            let corner = |k: i32| {
                let (sin, cos) = (TAU * f64::from(k) / 64.0).sin_cos();
                at(0.5 * cos, 0.5 * sin)
            };
            polygon(&(0..64).map(corner).collect::<Vec<_>>(), place)
        }
        "sphere" => PI * STRENGTH * 0.0625 / squared * cosine,
        "point" => by_point,
        "spot" => {
            let [inner, outer] = [20.0_f64, 30.0].map(|x| x.to_radians().cos());
            by_point * ((cosine - outer) / (inner - outer)).clamp(0.0, 1.0).powi(2)
        }
        "directional" => STRENGTH,
        other => panic!("no closed form of {other}"),
    }
}

#[test]
fn a_polygon_of_many_corners_is_a_disk() {
    // π L R² / (R² + h²) below the middle of a disk; 64 corners have 0.16 % less area.
    let disk = PI * STRENGTH * 0.25 / (0.25 + HEIGHT * HEIGHT);
    let area = 32.0 * (TAU / 64.0).sin() / PI;
    let found = irradiance("disk", [0.0, 0.0]);
    assert!(
        (found / (disk * area) - 1.0).abs() < 2e-4,
        "{found}, {disk}"
    );
}
