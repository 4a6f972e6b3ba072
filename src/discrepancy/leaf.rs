//! The last step of Dobkin, Eppstein & Mitchell: cells whose points vary in one dimension each.
//!
//! In such a cell the count of a box is a sum over dimensions, and the volume is a product. So the
//! extreme volume for every count is found dimension by dimension, as in a knapsack.

/// Largest `count - scale·volume` of closed boxes in a cell, counting the cell's own points only.
///
/// `low` is the lower corner; `values` contains, for each dimension, the sorted coordinates of the
/// points that vary in it.
pub(super) fn most_points(low: &[f64], values: &[Vec<f64>], scale: f64, work: &mut Work) -> f64 {
    work.start(scale, f64::INFINITY);
    for (&low, values) in low.iter().zip(values) {
        // With r points of this dimension the box extends to the r-th of them.
        work.extend(
            std::iter::once(low).chain(values.iter().copied()),
            values.len(),
            smaller,
        );
    }
    let differences = work
        .volumes
        .iter()
        .enumerate()
        .map(|(count, v)| count as f64 - v);
    differences.fold(f64::MIN, f64::max)
}

/// Largest `scale·volume - count` of open boxes in a cell; `high` is the upper corner.
pub(super) fn fewest_points(high: &[f64], values: &[Vec<f64>], scale: f64, work: &mut Work) -> f64 {
    work.start(scale, f64::MIN);
    for (&high, values) in high.iter().zip(values) {
        // With r points of this dimension the box ends just below the next one.
        work.extend(values.iter().copied().chain([high]), values.len(), larger);
    }
    let differences = work
        .volumes
        .iter()
        .enumerate()
        .map(|(count, v)| v - count as f64);
    differences.fold(f64::MIN, f64::max)
}

/// Extreme volumes, times a scale, by count.
#[derive(Default)]
pub(super) struct Work {
    volumes: Vec<f64>,
    next: Vec<f64>,
    none: f64,
}

impl Work {
    fn start(&mut self, scale: f64, none: f64) {
        self.volumes.clear();
        self.volumes.push(scale);
        self.none = none;
    }

    /// Adds a dimension with `points` points; `sides` contains the side for each count of them.
    fn extend(
        &mut self,
        sides: impl Iterator<Item = f64>,
        points: usize,
        better: impl Fn(f64, f64) -> f64,
    ) {
        self.next.clear();
        self.next.resize(self.volumes.len() + points, self.none);
        for (count, side) in sides.enumerate() {
            for (next, volume) in self.next[count..].iter_mut().zip(&self.volumes) {
                *next = better(*next, volume * side);
            }
        }
        std::mem::swap(&mut self.volumes, &mut self.next);
    }
}

#[inline]
fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

#[inline]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}
