//! Small multiples of p-value histograms.

use super::drawing::{Anchor, DIM, Drawing, FAILED, GRID, INK, Ink};
use super::paint::fit_text;

/// The p-values of one sampler's bias check.
#[derive(Debug, Clone, PartialEq)]
pub struct Histogram {
    /// Name of the sampler.
    pub label: String,
    /// Counts in equal bins over [0, 1].
    pub counts: Vec<usize>,
    /// Whether the check found a bias.
    pub biased: bool,
}

const WIDTH: f64 = 900.0;
const COLUMNS: usize = 3;
const PANEL: (f64, f64) = (WIDTH / COLUMNS as f64, 150.0);
const FILL: Ink = Ink::solid([0x7a, 0x8a, 0x99]);

/// The picture; `None` without a histogram that counts anything.
pub fn draw(histograms: &[Histogram]) -> Option<Drawing> {
    let shown: Vec<&Histogram> = histograms
        .iter()
        .filter(|h| h.counts.iter().any(|&n| n > 0))
        .collect();
    if shown.is_empty() {
        return None;
    }
    let rows = shown.len().div_ceil(COLUMNS);
    let mut drawing = Drawing::new(WIDTH, rows as f64 * PANEL.1 + 4.0);
    for (i, histogram) in shown.iter().enumerate() {
        let corner = (
            (i % COLUMNS) as f64 * PANEL.0,
            (i / COLUMNS) as f64 * PANEL.1,
        );
        histogram.draw(&mut drawing, corner);
    }
    Some(drawing)
}

impl Histogram {
    fn draw(&self, drawing: &mut Drawing, (x, y): (f64, f64)) {
        let (left, right) = (x + 14.0, x + PANEL.0 - 14.0);
        let (top, bottom) = (y + 32.0, y + PANEL.1 - 28.0);
        let (ink, label) = if self.biased {
            (FAILED, format!("biased: {}", self.label))
        } else {
            (INK, self.label.clone())
        };
        drawing.text(
            (left, y + 16.0),
            fit_text(&label, right - left),
            ink,
            Anchor::Start,
        );
        let total: usize = self.counts.iter().sum();
        let flat = total as f64 / self.counts.len() as f64;
        let most = self.counts.iter().copied().max().unwrap_or(1) as f64;
        let top_count = most.max(flat * 1.5);
        let height = |count: f64| bottom - (bottom - top) * count / top_count;
        let step = (right - left) / self.counts.len() as f64;
        let fill = if self.biased {
            FAILED.with_alpha(0.75)
        } else {
            FILL
        };
        for (bin, &count) in self.counts.iter().enumerate() {
            let from = left + bin as f64 * step;
            drawing.bar(
                (from + 1.0, height(count as f64)),
                (from + step - 1.0, bottom),
                fill,
            );
        }
        drawing.line(vec![(left, bottom), (right, bottom)], GRID, 1.0);
        drawing.dashed_line(
            &[(left, height(flat)), (right, height(flat))],
            INK,
            1.0,
            4.0,
            3.0,
        );
        drawing.text((left, bottom + 14.0), "p = 0", DIM, Anchor::Start);
        drawing.text((right, bottom + 14.0), "1", DIM, Anchor::End);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn empty_histograms_make_no_picture() {
        let empty = Histogram {
            label: "none".into(),
            counts: vec![0; 10],
            biased: false,
        };
        assert!(draw(std::slice::from_ref(&empty)).is_none());
        let full = Histogram {
            counts: vec![3; 10],
            ..empty
        };
        assert!(draw(&[full]).unwrap().texts().contains(&"none"));
    }
}
