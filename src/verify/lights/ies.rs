//! Luminaires with measured intensities.

use super::{LightChecks, LightTwin, delta};
use crate::known_images::lamps::{NEAR, path, reflected};
use crate::known_images::lights::image;
use crate::known_images::{KnownImage, View};
use crate::mitsuba::ExportError;
use crate::path_oracle::Rounding;
use crate::trial_lights;
use glam::{DQuat, DVec3, Mat3, Quat, Vec3, vec3};
use raystone_scene::{IesProfile, LIGHT_KINDS, Light, Photometry, SceneError};
use std::f64::consts::TAU;
use std::sync::Arc;

pub(super) static CHECKS: LightChecks = LightChecks {
    trials: trial_lights::luminaires,
    images,
    ..LightChecks::new(
        LIGHT_KINDS[5],
        LightTwin::Alone(delta::sample),
        |_, number, light| {
            let reason = "it has no lights with the intensities of a file";
            Err(ExportError::light(number, light, reason))
        },
    )
};

/// Tolerance beyond the last angle, degrees.
const SLACK: f64 = 1e-3;

/// Candela in the direction of propagation.
pub(super) fn candela(
    profile: &IesProfile,
    rotation: Quat,
    travels: DVec3,
    rounding: &mut Rounding,
) -> f64 {
    let turn = DQuat::from_array(rotation.to_array().map(f64::from)).normalize();
    let DVec3 { x, y, z } = rounding.direction(turn.inverse() * travels);
    // Type C: (sin v cos h, sin v sin h, cos v); B: (sin h, cos h sin v, cos h cos v); A: (cos v sin h, sin v, cos v cos h).
    let (vertical, horizontal) = match profile.photometry {
        Photometry::C => (z.clamp(-1.0, 1.0).acos(), angle(y, x).rem_euclid(TAU)),
        Photometry::B => (angle(y, z), x.clamp(-1.0, 1.0).asin()),
        Photometry::A => (y.clamp(-1.0, 1.0).asin(), angle(x, z)),
    };
    let row = weights(&profile.vertical, vertical.to_degrees());
    let column = match profile.horizontal.len() {
        1 => Some([(0, 1.0); 2].map(|(at, _)| (at, 0.5))),
        _ => weights(&profile.horizontal, horizontal.to_degrees()),
    };
    let Some((row, column)) = row.zip(column) else {
        return 0.0;
    };
    let count = profile.vertical.len();
    let measured = |h: usize, v: usize| f64::from(profile.candela[h * count + v]);
    let of_column = |h: usize| row.iter().map(|(v, w)| w * measured(h, *v)).sum::<f64>();
    column.iter().map(|(h, w)| w * of_column(*h)).sum()
}

/// The angle of (x, y); 0 at the origin for either sign of zero.
fn angle(y: f64, x: f64) -> f64 {
    if x == 0.0 && y == 0.0 {
        0.0
    } else {
        y.atan2(x)
    }
}

/// The two values around `x` with their weights; `None` out of range.
fn weights(values: &[f32], x: f64) -> Option<[(usize, f64); 2]> {
    let value = |at: usize| f64::from(values[at]);
    let last = values.len().checked_sub(1)?;
    if x < value(0) - SLACK || x > value(last) + SLACK {
        return None;
    }
    let x = x.clamp(value(0), value(last));
    let low = (0..last).rev().find(|at| value(*at) <= x).unwrap_or(0);
    let high = (low + 1).min(last);
    let part = if high > low {
        (x - value(low)) / (value(high) - value(low))
    } else {
        0.0
    };
    Some([(low, 1.0 - part), (high, part)])
}

/// Candela by vertical and horizontal angle of a luminaire without symmetries.
const LUMINAIRE: &str = "TILT=NONE\n1 -1 2 4 5 1 2 0 0 0\n0.5 1 0\n0 30 50 80\n0 70 180 270 360\n\
                         90 60 40 10\n90 80 20 30\n90 50 70 5\n90 40 10 60\n90 60 40 10\n";

/// A directional light in red, a luminaire in green.
fn images() -> Result<Vec<KnownImage>, SceneError> {
    const WAY: Vec3 = vec3(0.4, -1.0, -0.7);
    const HEIGHT: f32 = 1.6;
    let profile = IesProfile::parse("luminaire", LUMINAIRE)
        .map_err(|e| SceneError::malformed(std::path::Path::new("luminaire"), "", e.to_string()))?;
    // Its nadir points down, its horizontal angle begins at +x and grows towards +z.
    let axes = Mat3::from_cols(Vec3::X, Vec3::Z, Vec3::NEG_Y);
    let lights = vec![
        Light::Directional {
            direction: WAY,
            irradiance: vec3(4.0, 0.0, 0.5),
        },
        Light::Ies {
            position: HEIGHT * Vec3::Y,
            rotation: Quat::from_mat3(&axes).normalize(),
            color: vec3(0.0, 1.0, 0.0),
            profile: Arc::new(profile),
        },
    ];
    let facing = -WAY.as_dvec3().normalize().y;
    // Vertical and horizontal angle, and the candela in the file before its two multipliers.
    let places = [
        ("below the luminaire", 0.0_f64, 0.0_f64, 90.0),
        ("at a measured angle", 30.0, 70.0, 80.0),
        ("between vertical angles", 40.0, 270.0, 25.0),
        ("between horizontal angles", 50.0, 125.0, 45.0),
    ];
    let view = |(name, vertical, horizontal, candela): (&str, f64, f64, f64)| {
        let [v, h] = [vertical, horizontal].map(f64::to_radians);
        let off = f64::from(HEIGHT) * v.tan();
        let point = DVec3::new(off * h.cos(), 0.0, off * h.sin()).as_vec3();
        let distance = f64::from(HEIGHT) / v.cos();
        let green = 0.5 * 2.0 * candela * v.cos() / (distance * distance);
        let irradiance = DVec3::new(4.0 * facing, green, 0.5 * facing);
        View::new(name, point, NEAR, reflected(irradiance))
    };
    let views = places.map(view).into();
    let trial = path(1, &[("lights", "all")]);
    Ok(vec![image(
        "far and measured lights",
        lights,
        trial,
        views,
    )?])
}
