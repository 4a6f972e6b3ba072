//! The map of importance (Pfeuti 2009, §3.6.2).

use super::{Adaptive, Pilots};
use crate::photons::ImportanceMap;

/// Taps of a Gaussian of variance 2 over five cells.
const TAPS: [f64; 5] = [0.11170, 0.23648, 0.30364, 0.23648, 0.11170];
/// What a complement has where nothing is left: no density may be 0.
const LEAST: f64 = 1e-3;
/// Rounds in which what a greatest density cuts off is spread again.
const ROUNDS: u32 = 32;

/// The map that pilots ask for: each cell of theirs at an edge of light or in shadow adds a disc of height 1 to where its
/// photons came from, and a blur over 5² cells follows. `cells` are the pilots' cells, x fastest.
///
/// # Errors
/// The number of pilots along an axis is no power of two, the background is not above 0, or the complement leaves nothing.
pub fn importance(adaptive: &Adaptive, cells: &[Pilots]) -> Result<ImportanceMap, String> {
    let side = adaptive.pilots as usize;
    let mut values = vec![0.0; side * side];
    for cell in selected(adaptive, cells) {
        add_disc(&mut values, side, &cells[cell]);
    }
    for value in &mut values {
        *value += adaptive.background;
    }
    values = blurred(&values, side);
    if adaptive.most_density > 0.0 {
        limit(&mut values, adaptive.most_density);
    }
    if adaptive.complement > 0.0 {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let least = values.iter().fold(f64::INFINITY, |a, b| a.min(*b)) / mean;
        if adaptive.complement <= least {
            return Err(format!(
                "`complement` = {} leaves no photons anywhere: the map has at least {least:.3} times as many as even photons \
                 everywhere; set it above that",
                adaptive.complement
            ));
        }
        for value in &mut values {
            *value = (adaptive.complement - *value / mean).max(LEAST);
        }
    }
    ImportanceMap::new(values)
}

/// Lit cells with the greatest gradients, and those with the least radiance.
fn selected(adaptive: &Adaptive, cells: &[Pilots]) -> Vec<usize> {
    let side = adaptive.cells as usize;
    let lit: Vec<usize> = (0..cells.len()).filter(|c| cells[*c].count > 0).collect();
    let part = |share: f64| (share * lit.len() as f64).round() as usize;
    let mut by_gradient = lit.clone();
    let steepness = |cell: &usize| -gradient(cells, side, *cell);
    by_gradient.sort_by(|a, b| steepness(a).total_cmp(&steepness(b)));
    by_gradient.truncate(part(adaptive.edges));
    let mut by_radiance = lit.clone();
    by_radiance.retain(|cell| cells[*cell].radiance > 0.0);
    by_radiance.sort_by(|a, b| cells[*a].radiance.total_cmp(&cells[*b].radiance));
    by_radiance.truncate(part(adaptive.shadows));
    by_gradient.extend(by_radiance);
    by_gradient.sort_unstable();
    by_gradient.dedup();
    by_gradient
}

/// |∇ radiance| by central differences, with the cells of the border repeated.
fn gradient(cells: &[Pilots], side: usize, cell: usize) -> f64 {
    let along = |stride: usize| {
        let place = cell / stride % side;
        let before = if place > 0 { cell - stride } else { cell };
        let after = if place + 1 < side {
            cell + stride
        } else {
            cell
        };
        (cells[after].radiance - cells[before].radiance) / 2.0
    };
    let square = [1, side, side * side].map(|stride| along(stride).powi(2));
    square.iter().sum::<f64>().sqrt()
}

/// Adds 1 to the cells whose middles lie in a disc, and to the one that holds its middle. The diameter is the sum of both
/// deviations, as in the thesis's listing B.1; its text says the variance.
fn add_disc(values: &mut [f64], side: usize, cell: &Pilots) {
    let (middle, deviation) = cell.origin();
    let radius = (deviation[0] + deviation[1]).max(1.0) / 2.0;
    let [x, y] = [middle.x, middle.y];
    let range = |c: f64| {
        let low = (c - radius).floor().max(0.0) as usize;
        low..=((c + radius) as usize).min(side - 1)
    };
    for row in range(y) {
        for column in range(x) {
            let (dx, dy) = (column as f64 + 0.5 - x, row as f64 + 0.5 - y);
            let holds = column == x as usize && row == y as usize;
            if holds || dx * dx + dy * dy <= radius * radius {
                values[row * side + column] += 1.0;
            }
        }
    }
}

/// By a Gaussian along both axes, with the border repeated.
fn blurred(values: &[f64], side: usize) -> Vec<f64> {
    let along = |values: &[f64], stride: usize| -> Vec<f64> {
        let value = |place: usize| {
            let at = place / stride % side;
            let tap = |k: usize| {
                let to = (at + k).saturating_sub(2).min(side - 1);
                TAPS[k] * values[place - at * stride + to * stride]
            };
            (0..5).map(tap).sum()
        };
        (0..values.len()).map(value).collect()
    };
    along(&along(values, 1), side)
}

/// Cuts densities above a limit, relative to the mean, and spreads what is cut over the rest.
fn limit(values: &mut [f64], most: f64) {
    let count = values.len() as f64;
    // Below 1 no map has a mean of 1.
    let most = most.max(1.0);
    for _ in 0..ROUNDS {
        let mean = values.iter().sum::<f64>() / count;
        let top = most * mean;
        for value in values.iter_mut() {
            *value = value.min(top);
        }
    }
}
