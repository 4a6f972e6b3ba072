//! Power spectrum of a point set in two dimensions.

use super::{Budget, DiscrepancyError, PointSet};
use std::f64::consts::TAU;

const NAME: &str = "spectrum";

/// The power of a point set at integer frequencies.
#[derive(Debug, Clone, PartialEq)]
pub struct Periodogram {
    /// Largest component of a frequency.
    pub highest: usize,
    /// `(highest + 1) × (2·highest + 1)` powers: x from 0, y from −highest, y fastest.
    power: Vec<f64>,
}

impl Periodogram {
    /// Power `|Σ_i exp(−2πi k·x_i)|² / N` at frequency k; N at 0, which is meaningless.
    ///
    /// # Panics
    /// A component beyond the highest.
    pub fn power(&self, [x, y]: [i32; 2]) -> f64 {
        // Opposite frequencies have the same power.
        let (x, y) = if x < 0 { (-x, -y) } else { (x, y) };
        let columns = 2 * self.highest + 1;
        self.power[x as usize * columns + (y + self.highest as i32) as usize]
    }

    /// Mean power over the frequencies whose length rounds to 1, 2, …, `highest`; element 0 is for
    /// frequency 1. White noise has power 1 on average.
    pub fn radial(&self) -> Vec<f64> {
        let columns = 2 * self.highest + 1;
        let mut power = vec![0.0; self.highest + 1];
        let mut weight = vec![0.0; self.highest + 1];
        for (index, value) in self.power.iter().enumerate() {
            let (u, v) = (index / columns, index % columns);
            let radius = (u as f64).hypot(v as f64 - self.highest as f64).round() as usize;
            if radius <= self.highest {
                // Frequencies with u = 0 are in the table with their opposites.
                let times = if u == 0 { 0.5 } else { 1.0 };
                power[radius] += times * value;
                weight[radius] += times;
            }
        }
        let mean = |(power, weight): (&f64, &f64)| power / weight;
        power.iter().zip(&weight).skip(1).map(mean).collect()
    }
}

/// Power at all integer frequencies with components up to `highest`.
///
/// Cost: 2·highest²·N complex multiplications.
///
/// # Errors
/// The budget is spent first; points that are not pairs.
pub fn periodogram(
    points: &PointSet,
    highest: usize,
    budget: &Budget,
) -> Result<Periodogram, DiscrepancyError> {
    let pairs = points.pairs_for(NAME)?;
    let size = highest + 1;
    let mut sums = vec![[0.0; 2]; size * (2 * size - 1)];
    let (mut across, mut along) = (Vec::new(), Vec::new());
    for (i, &[x, y]) in pairs.iter().enumerate() {
        if i % 16 == 0 {
            budget.check(NAME)?;
        }
        // Opposite frequencies have the same power: x from 0 up, y from -highest.
        waves(&mut across, x, 0..=highest as i32);
        waves(&mut along, y, -(highest as i32)..=highest as i32);
        for (row, &[a, b]) in sums.chunks_exact_mut(along.len()).zip(&across) {
            for (sum, &[c, d]) in row.iter_mut().zip(&along) {
                sum[0] += a * c - b * d;
                sum[1] += a * d + b * c;
            }
        }
    }
    let n = pairs.len() as f64;
    let power = sums.iter().map(|[re, im]| (re * re + im * im) / n);
    Ok(Periodogram {
        highest,
        power: power.collect(),
    })
}

/// [`Periodogram::radial`] of [`periodogram`].
///
/// # Errors
/// As [`periodogram`].
pub fn radial_spectrum(
    points: &PointSet,
    highest: usize,
    budget: &Budget,
) -> Result<Vec<f64>, DiscrepancyError> {
    Ok(periodogram(points, highest, budget)?.radial())
}

/// `exp(−2πi k x)` for each k, with a reduced angle for equal accuracy at all frequencies.
fn waves(out: &mut Vec<[f64; 2]>, x: f64, frequencies: std::ops::RangeInclusive<i32>) {
    out.clear();
    out.extend(frequencies.map(|k| {
        let turns = f64::from(k) * x;
        let (sin, cos) = (TAU * (turns - turns.round())).sin_cos();
        [cos, -sin]
    }));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::SplitMix64;

    fn spectrum(points: &[[f64; 2]], highest: usize) -> Vec<f64> {
        let set = PointSet::from_points(points).unwrap();
        radial_spectrum(&set, highest, &Budget::seconds(60.0)).unwrap()
    }

    #[test]
    fn a_square_grid_has_peaks_at_multiples_of_its_frequency_only() {
        let grid: Vec<[f64; 2]> = (0..64)
            .map(|i| [i % 8, i / 8].map(|c| f64::from(c) / 8.0))
            .collect();
        let power = spectrum(&grid, 9);
        for (index, &p) in power.iter().enumerate() {
            // At radius 8, (8, 0) and (0, ±8) are peaks of power 64.
            assert_eq!(p > 1.0, index + 1 == 8, "{power:?}");
            assert!(index + 1 == 8 || p < 1e-20, "{power:?}");
        }
    }

    #[test]
    fn opposite_frequencies_of_a_row_have_the_same_power_and_others_none() {
        let row: Vec<[f64; 2]> = (0..4).map(|i| [f64::from(i) / 4.0, 0.5]).collect();
        let set = PointSet::from_points(&row).unwrap();
        let found = periodogram(&set, 5, &Budget::seconds(60.0)).unwrap();
        for (x, y) in [(4, 0), (-4, 0), (4, -3), (-4, 5), (0, 1)] {
            assert!((found.power([x, y]) - 4.0).abs() < 1e-12, "{x} {y}");
        }
        assert!(found.power([1, 0]).abs() < 1e-12 && found.power([-3, 2]).abs() < 1e-12);
    }

    #[test]
    fn one_point_and_random_points_have_power_one() {
        for p in spectrum(&[[0.3, 0.7]], 12) {
            assert!((p - 1.0).abs() < 1e-12, "{p}");
        }
        let mut random = SplitMix64(3);
        let noise: Vec<_> = (0..512)
            .map(|_| [random.uniform(), random.uniform()])
            .collect();
        let power = spectrum(&noise, 24);
        let mean = power.iter().sum::<f64>() / 24.0;
        assert!((mean - 1.0).abs() < 0.2, "{mean}");
    }
}
