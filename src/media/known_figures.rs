//! Figures of known photons and paths, computed anew before any is shown: the kernels have twins and oracles, what is
//! counted of their answers has not.

use crate::march::{angle_of, ball_deviation};
use crate::measure;
use crate::photons::{cell_deviation, collisions, density_deviation, segments_of_32};
use glam::Vec3;

/// One point in each of 2² cells, and all of them in the first.
const SPREAD: [[f64; 2]; 4] = [[0.2, 0.2], [0.7, 0.2], [0.2, 0.7], [0.7, 0.7]];
const TOGETHER: [[f64; 2]; 4] = [[0.2, 0.2], [0.3, 0.2], [0.2, 0.3], [0.3, 0.3]];
/// Relative error of a few operations.
const ROUNDING: f64 = 1e-12;
/// And where paths are those of f32.
const OF_SINGLE: f64 = 1e-5;

/// Computes them.
///
/// # Errors
/// One is not what it should be: what of which, and both values.
pub fn check() -> Result<(), String> {
    // Neighbours in a row: 32 of them in two segments of 16.
    let row: Vec<[f64; 2]> = (0..64)
        .map(|k| [(f64::from(k) + 0.5) / 512.0, 0.0])
        .collect();
    // In a ball of index 3/2 the ray at height 0.8: 2 (asin 0.8 − asin 0.8/1.5), here by the tangents of both angles.
    let inside = 0.8 / 1.5;
    let tangents = [0.8 / 0.6, inside / (1.0_f64 - inside * inside).sqrt()];
    let turned = -2.0 * (tangents[0].atan() - tangents[1].atan()).to_degrees();
    let photons = [
        (
            "deviation of cells with one photon each",
            cell_deviation(&SPREAD, 2, 0.0, 1.0),
            0.0,
        ),
        // 4, 0, 0, 0 about 1: √((9 + 1 + 1 + 1) / 4).
        (
            "deviation of cells",
            cell_deviation(&TOGETHER, 2, 0.0, 1.0),
            3.0_f64.sqrt(),
        ),
        (
            "error of a density",
            density_deviation(&TOGETHER, 2, |_| 1.0),
            3.0_f64.sqrt(),
        ),
        // Twice as many as there should be, and none: 1 off in each.
        (
            "error of a density of its own",
            density_deviation(
                &TOGETHER,
                2,
                |[x, y]| {
                    if x < 0.5 && y < 0.5 { 2.0 } else { 0.5 }
                },
            ),
            1.0,
        ),
        ("share of collisions", collisions(&TOGETHER, 2, 4), 0.75),
        (
            "share of collisions in pairs",
            collisions(&TOGETHER, 2, 2),
            0.5,
        ),
        ("share of collisions apart", collisions(&SPREAD, 2, 4), 0.0),
        ("segments of 32 photons", segments_of_32(&row, 512), 2.0),
        (
            "angle of a direction",
            angle_of(Vec3::new(1.0, 1.0, 0.0)),
            45.0,
        ),
        (
            "deviation of a ball",
            ball_deviation(1.5, 10.0, 8.0),
            turned,
        ),
    ];
    let exact = photons.into_iter().map(|known| (ROUNDING, known));
    let single = measure::known()?
        .into_iter()
        .map(|known| (OF_SINGLE, known));
    for (rounding, (what, found, expected)) in exact.chain(single) {
        let agrees = (found - expected).abs() <= rounding * expected.abs();
        if !agrees {
            return Err(format!(
                "the {what}, known photons or rays, is {found}, and should be {expected}: this program shows wrong \
                 figures; build it anew, and report what stays wrong"
            ));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    #[test]
    fn they_are_as_by_hand() {
        assert_eq!(super::check(), Ok(()));
    }
}
