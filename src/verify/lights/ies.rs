//! Luminaires by their measured intensities.

use super::{LightChecks, LightTwin, delta, no_lights, towards};
use crate::mitsuba::ExportError;
use crate::path_oracle::{LightSample, Rounding};
use crate::trial_lights;
use glam::{DQuat, DVec3, Quat};
use raystone_scene::{IesProfile, LIGHT_KINDS, Light, Photometry};
use std::f64::consts::TAU;

/// The row.
pub(super) static CHECKS: LightChecks = LightChecks {
    kind: LIGHT_KINDS[5],
    twin: LightTwin::Alone(sample),
    mitsuba: |_, number, light| {
        let reason = "it has no lights with the intensities of a file";
        Err(ExportError::light(number, light, reason))
    },
    points: no_lights,
    trials: trial_lights::luminaires,
};

fn sample(light: &Light, from: DVec3, _: [f64; 2], rounding: &mut Rounding) -> Option<LightSample> {
    let Light::Ies {
        position,
        rotation,
        color,
        profile,
    } = light
    else {
        return None;
    };
    let (direction, distance) = towards(*position, from);
    let candela = candela(profile, *rotation, -direction, rounding);
    let falloff = distance * distance;
    delta(direction, distance, color.as_dvec3() * (candela / falloff))
}

/// Beyond the last angle by this much is not outside yet, degrees.
const SLACK: f64 = 1e-3;

/// Candela in the direction in which light travels.
fn candela(profile: &IesProfile, rotation: Quat, travels: DVec3, rounding: &mut Rounding) -> f64 {
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

/// The angle of (x, y); 0 at their origin, whatever the signs of the zeros.
fn angle(y: f64, x: f64) -> f64 {
    match x == 0.0 && y == 0.0 {
        true => 0.0,
        false => y.atan2(x),
    }
}

/// The two values between which `x` lies, with their weights; nothing outside of all.
fn weights(values: &[f32], x: f64) -> Option<[(usize, f64); 2]> {
    let value = |at: usize| f64::from(values[at]);
    let last = values.len().checked_sub(1)?;
    if x < value(0) - SLACK || x > value(last) + SLACK {
        return None;
    }
    let x = x.clamp(value(0), value(last));
    let low = (0..last).rev().find(|at| value(*at) <= x).unwrap_or(0);
    let high = (low + 1).min(last);
    let part = match high > low {
        true => (x - value(low)) / (value(high) - value(low)),
        false => 0.0,
    };
    Some([(low, 1.0 - part), (high, part)])
}
