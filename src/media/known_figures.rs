//! Figures of known photons and paths, computed anew before any is shown: the kernels have twins and oracles, what is
//! counted of their answers has not.

use crate::march::{angle_of, ball_deviation};
use crate::measure;
use crate::photons::{
    Order, cell_deviation, collisions, density_deviation, ordered, segments_of_32,
};
use glam::Vec3;
use raystone_volume::{MediaError, procedures};
use std::f64::consts::PI;

/// One point in each of 2² cells, and all of them in the first.
const SPREAD: [[f64; 2]; 4] = [[0.2, 0.2], [0.7, 0.2], [0.2, 0.7], [0.7, 0.7]];
const TOGETHER: [[f64; 2]; 4] = [[0.2, 0.2], [0.3, 0.2], [0.2, 0.3], [0.3, 0.3]];
/// Relative error of a few operations.
const ROUNDING: f64 = 1e-12;
/// And where paths are those of f32.
const OF_SINGLE: f64 = 1e-5;
/// And where a volume is that of its voxels' points.
const OF_VOLUMES: f64 = 2e-3;
/// Voxels along an axis of a known volume.
const SIDE: u32 = 16;
/// What the index of a lens has above 1, on average over its box.
const OF_LENS: f64 = 0.047_745;

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
    let volumes = volumes()?.into_iter().map(|known| (OF_VOLUMES, known));
    let orders = orders().into_iter().map(|known| (ROUNDING, known));
    let single = measure::known()?
        .into_iter()
        .map(|known| (OF_SINGLE, known));
    for (rounding, (what, found, expected)) in exact.chain(single).chain(volumes).chain(orders) {
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

/// Means over the voxels of volumes that everything else starts from: glass scatters half as much as fog and absorbs nothing,
/// in a ball of 4/3 π 0.3³, a cube of 1/8; a gyroid, of points counted by another program, has the same along three axes; a lens of radius 0.4 has
/// ∫ 4πr² (√(2 − r²) − 1) dr · 0.4³ more than 1.
fn volumes() -> Result<[(&'static str, f64, f64); 8], String> {
    let text = |e: MediaError| e.to_string();
    let mean = |values: &[f32]| {
        let sum: f64 = values.iter().map(|x| f64::from(*x)).sum();
        sum / values.len() as f64
    };
    let ball = procedures::glass_ball(SIDE).map_err(text)?;
    let cube = procedures::noisy_cube(SIDE).map_err(text)?;
    let lens = procedures::luneburg_lens(SIDE).map_err(text)?;
    let cloud = procedures::cloud(SIDE).map_err(text)?;
    let gyroid = procedures::gyroid(SIDE).map_err(text)?;
    let part = 4.0 / 3.0 * PI * 0.027;
    let first = |axis: u32| moment(&gyroid.scattering, axis);
    Ok([
        (
            "scattering of a ball",
            mean(&ball.scattering),
            1.0 - 0.5 * part,
        ),
        (
            "absorption of a ball",
            mean(&ball.absorption),
            0.1 * (1.0 - part),
        ),
        ("index of a ball", mean(&ball.refraction), 1.0 + 0.5 * part),
        ("absorption of a cube", mean(&cube.absorption), 0.1 * 0.875),
        ("index of a lens", mean(&lens.refraction), 1.0 + OF_LENS),
        (
            "scattering of a gyroid",
            mean(&gyroid.scattering),
            0.900_919,
        ),
        (
            "moment of a gyroid",
            first(0) / first(1),
            first(2) / first(1),
        ),
        (
            "absorption of a cloud",
            16.0 * mean(&cloud.absorption),
            mean(&cloud.scattering),
        ),
    ])
}

/// Cells of photons in an order, one of each of `side`² that are given from the last to the first.
fn cells(order: Order, side: u32) -> Vec<[u32; 2]> {
    let middle = |c: u32| (f64::from(c) + 0.5) / f64::from(side);
    let points = (0..side * side).rev();
    let points = points.map(|k| [k % side, k / side].map(middle)).collect();
    let ordered = ordered(points, order, side, 1).into_iter();
    ordered
        .map(|p| p.map(|c| (c * f64::from(side)) as u32))
        .collect()
}

/// Four cells, numbered by rows, as digits in base 4 from the first on: 0123 by rows and by Morton's curve, 0213 by columns, 0231 along
/// Hilbert's curve, 3120 by reversed bits. Along Hilbert's curve every step is to a neighbour; Morton's fifth cell is (2, 0).
fn orders() -> [(&'static str, f64, f64); 7] {
    let digits = |order| {
        let cells = cells(order, 2).into_iter();
        cells.fold(0.0, |sum, [x, y]| 4.0 * sum + f64::from(x + 2 * y))
    };
    let along = cells(Order::Hilbert, 8);
    let steps = along
        .windows(2)
        .map(|two| (0..2).map(|a| two[0][a].abs_diff(two[1][a])).sum::<u32>());
    let [x, y] = cells(Order::Morton, 4)[4];
    [
        ("order by rows", digits(Order::Row), 27.0),
        ("order by columns", digits(Order::Column), 39.0),
        ("order along Morton's curve", digits(Order::Morton), 27.0),
        ("order along Hilbert's curve", digits(Order::Hilbert), 45.0),
        ("order by reversed bits", digits(Order::BitReversed), 216.0),
        (
            "longest step along Hilbert's curve",
            f64::from(steps.max().unwrap_or(0)),
            1.0,
        ),
        ("fifth cell along Morton's curve", f64::from(x + 4 * y), 2.0),
    ]
}

/// The sum of values times the number of their voxel along an axis.
fn moment(values: &[f32], axis: u32) -> f64 {
    let place = |voxel: usize| voxel / (SIDE as usize).pow(axis) % SIDE as usize;
    let values = values.iter().enumerate();
    values
        .map(|(voxel, x)| f64::from(*x) * place(voxel) as f64)
        .sum()
}

#[cfg(test)]
mod tests {
    #[test]
    fn they_are_as_by_hand() {
        assert_eq!(super::check(), Ok(()));
    }
}
