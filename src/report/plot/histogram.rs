//! Histograms of p-values.

use super::drawing::{Drawing, FAILED, GRID, INK, Ink};
use super::panels::{Area, Content};

/// The p-values of one sampler's bias check.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Histogram {
    /// Counts in equal bins over [0, 1].
    pub counts: Vec<usize>,
    /// `true` if the check found a bias.
    pub biased: bool,
}

/// χ² with nine degrees of freedom that is exceeded by chance once in a hundred times.
const CHANCE: f64 = 21.67;

impl Histogram {
    /// Returns `true` if chance explains the differences between the bars.
    pub(crate) fn is_flat(&self) -> bool {
        let total: usize = self.counts.iter().sum();
        let mean = total as f64 / self.counts.len().max(1) as f64;
        let square = |&n: &usize| (n as f64 - mean).powi(2) / mean;
        mean == 0.0 || self.counts.iter().map(square).sum::<f64>() <= CHANCE
    }
}

const FILL: Ink = Ink::solid([0x7a, 0x8a, 0x99]);

impl Content for Histogram {
    fn draw(&self, drawing: &mut Drawing, area: Area) {
        let total: usize = self.counts.iter().sum();
        let flat = total as f64 / self.counts.len() as f64;
        let most = self.counts.iter().copied().max().unwrap_or(0) as f64;
        let top = most.max(flat * 1.5).max(1.0);
        let step = 1.0 / self.counts.len() as f64;
        let fill = if self.biased {
            FAILED.with_alpha(0.75)
        } else {
            FILL
        };
        for (bin, &count) in self.counts.iter().enumerate() {
            let (left, right) = (bin as f64 * step, (bin + 1) as f64 * step);
            let ((x0, y0), (x1, y1)) = (area.at([left, count as f64 / top]), area.at([right, 0.0]));
            drawing.bar((x0 + 1.0, y0), (x1 - 1.0, y1), fill);
        }
        drawing.line(vec![area.at([0.0, 0.0]), area.at([1.0, 0.0])], GRID, 1.0);
        let line = [area.at([0.0, flat / top]), area.at([1.0, flat / top])];
        drawing.dashed_line(&line, INK, 1.0, 4.0, 3.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_that_chance_explains_are_flat_and_a_pile_is_not() {
        let is_flat = |counts: [usize; 10]| {
            let counts = counts.to_vec();
            let biased = false;
            Histogram { counts, biased }.is_flat()
        };
        assert!(is_flat([44, 41, 39, 47, 42, 40, 45, 46, 44, 44]));
        assert!(!is_flat([6, 4, 6, 5, 6, 5, 7, 2, 7, 32]) && is_flat([0; 10]));
        // χ² is 18.0, 21.6 and 21.8, and 21.67 once in a hundred times.
        assert!(is_flat([19, 1, 13, 7, 10, 10, 10, 10, 10, 10]));
        assert!(is_flat([20, 0, 12, 8, 12, 8, 10, 10, 10, 10]));
        assert!(!is_flat([20, 0, 13, 7, 10, 10, 10, 10, 10, 10]));
    }
}
