//! What is counted of a list of photons.

use super::order::cell_of;
use std::collections::HashSet;

/// Relative standard deviation of the number of points in a cell, over the `cells`² cells that lie wholly in the square,
/// of a set that is turned around the middle by `turn` radians and scaled by `scale`.
///
/// Where points stop, cells would be filled in part: those whose corners are not all inside what the set covers are
/// left out.
pub fn cell_deviation(points: &[[f64; 2]], cells: u32, turn: f64, scale: f64) -> f64 {
    let (sin, cos) = turn.sin_cos();
    let turned = |[x, y]: [f64; 2], scale: f64| {
        let [x, y] = [(x - 0.5) * scale, (y - 0.5) * scale];
        [cos * x - sin * y + 0.5, sin * x + cos * y + 0.5]
    };
    let back = |[x, y]: [f64; 2]| {
        let [x, y] = [(x - 0.5) / scale, (y - 0.5) / scale];
        [cos * x + sin * y + 0.5, cos * y - sin * x + 0.5]
    };
    let side = cells as usize;
    let mut counts = vec![0_u32; side * side];
    for point in points {
        let [x, y] = turned(*point, scale);
        if (0.0..1.0).contains(&x) && (0.0..1.0).contains(&y) {
            counts[cell_of(x, cells) as usize + side * cell_of(y, cells) as usize] += 1;
        }
    }
    let covered = |cell: usize| {
        let corner = |k: usize| [cell % side + (k & 1), cell / side + (k >> 1)];
        (0..4).all(|k| {
            let at = back(corner(k).map(|c| c as f64 / side as f64));
            at.iter().all(|c| (-1e-9..=1.0 + 1e-9).contains(c))
        })
    };
    let whole = (0..counts.len()).filter(|cell| covered(*cell));
    let counts: Vec<f64> = whole.map(|cell| f64::from(counts[cell])).collect();
    let mean = counts.iter().sum::<f64>() / counts.len() as f64;
    let square = counts.iter().map(|n| (n - mean).powi(2)).sum::<f64>() / counts.len() as f64;
    square.sqrt() / mean
}

/// Root of the mean square of a cell's relative error: its number of points against a density relative to the uniform one,
/// constant in each of `cells`² cells.
pub fn density_deviation(
    points: &[[f64; 2]],
    cells: u32,
    density: impl Fn([f64; 2]) -> f64,
) -> f64 {
    let side = cells as usize;
    let mut counts = vec![0_u32; side * side];
    for [x, y] in points {
        counts[cell_of(*x, cells) as usize + side * cell_of(*y, cells) as usize] += 1;
    }
    let even = points.len() as f64 / counts.len() as f64;
    let square = |(cell, count): (usize, &u32)| {
        let middle = [cell % side, cell / side].map(|c| (c as f64 + 0.5) / side as f64);
        (f64::from(*count) / (even * density(middle)) - 1.0).powi(2)
    };
    (counts.iter().enumerate().map(square).sum::<f64>() / counts.len() as f64).sqrt()
}

/// The share of photons in windows of `window` consecutive ones that land in a cell in which one of their window did
/// before: those that have to write again.
pub fn collisions(points: &[[f64; 2]], cells: u32, window: usize) -> f64 {
    let mut again = 0;
    let mut seen = HashSet::new();
    for window in points.chunks(window) {
        seen.clear();
        again += window
            .iter()
            .filter(|p| !seen.insert(p.map(|c| cell_of(c, cells))))
            .count();
    }
    again as f64 / points.len() as f64
}

/// The mean number of segments of 128 bytes, 16 cells of a row of eight bytes each, that 32 consecutive photons write to.
pub fn segments_of_32(points: &[[f64; 2]], cells: u32) -> f64 {
    let groups = points.chunks(32);
    let count = groups.len() as f64;
    let segments = |group: &[[f64; 2]]| {
        let places = group
            .iter()
            .map(|[x, y]| [cell_of(*x, cells) / 16, cell_of(*y, cells)]);
        places.collect::<HashSet<_>>().len() as f64
    };
    groups.map(segments).sum::<f64>() / count
}
