//! The O(N²) sweep for the exact star discrepancy in two dimensions.

use super::DiscrepancyError;

/// Exact star discrepancy D* of `points` in the unit square, in `[1/(2N), 1]`.
///
/// Ties, duplicates and coordinates equal to 0 or 1 are allowed. Counts are integers and every area
/// is one product, so the result is exact to a few units in the last place of an `f64`.
///
/// Cost: O(N²) time with a vectorised inner loop, O(N) memory.
///
/// ```
/// # use raystone::discrepancy::star_2d;
/// // One point in the middle: the closed box up to it holds everything on a quarter of the area.
/// assert_eq!(star_2d(&[[0.5, 0.5]])?, 0.75);
/// # Ok::<(), raystone::discrepancy::DiscrepancyError>(())
/// ```
///
/// # Errors
/// [`DiscrepancyError::Empty`] and [`DiscrepancyError::OutsideUnitSquare`] (NaN included).
pub fn star_2d(points: &[[f64; 2]]) -> Result<f64, DiscrepancyError> {
    check(points)?;
    Ok(sweep(points))
}

/// [`star_2d`] of the first `n` points for each `n` in `counts`, in the order of `counts`.
///
/// # Errors
/// As [`star_2d`], for any prefix; [`DiscrepancyError::PrefixTooLong`].
pub fn star_2d_prefixes(
    points: &[[f64; 2]],
    counts: &[usize],
) -> Result<Vec<f64>, DiscrepancyError> {
    let prefix = |&count: &usize| {
        let too_long = DiscrepancyError::PrefixTooLong {
            count,
            available: points.len(),
        };
        star_2d(points.get(..count).ok_or(too_long)?)
    };
    counts.iter().map(prefix).collect()
}

fn check(points: &[[f64; 2]]) -> Result<(), DiscrepancyError> {
    if points.is_empty() {
        return Err(DiscrepancyError::Empty);
    }
    let inside = |c: &f64| (0.0..=1.0).contains(c);
    match points.iter().position(|p| !p.iter().all(inside)) {
        None => Ok(()),
        Some(index) => Err(DiscrepancyError::OutsideUnitSquare {
            index,
            x: points[index][0],
            y: points[index][1],
        }),
    }
}

/// Sweeps a vertical line over the distinct x, keeping the y of the points passed in sorted order.
///
/// A box `[0, x] × [0, y]` has too many points only if its top touches one of them, and too few only
/// if its top is about to swallow one or is at 1; so the y of the points passed are enough, and the
/// rank in the sorted list is the count. Equal y need no care: of a run of ties the first has the
/// right open count, the last the right closed count, and the others give smaller values.
fn sweep(points: &[[f64; 2]]) -> f64 {
    let n = points.len() as f64;
    let mut by_x = points.to_vec();
    by_x.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
    let ranks: Vec<f64> = (0..points.len()).map(|k| k as f64).collect();
    let mut passed: Vec<f64> = Vec::with_capacity(points.len());

    let mut excess = by_x[0][0] * n; // the empty strip left of the first point
    let mut start = 0;
    while start < by_x.len() {
        let x = by_x[start][0];
        let length = by_x[start..].iter().take_while(|p| p[0] == x).count();
        for p in &by_x[start..start + length] {
            passed.insert(passed.partition_point(|&y| y < p[1]), p[1]);
        }
        start += length;
        // The points passed are those of the closed boxes at this x and of the open ones at the next.
        let next_x = by_x.get(start).map_or(1.0, |p| p[0]);
        let strip = Strip {
            closed: x * n,
            open: next_x * n,
        };
        // With next_x = x = 1 the points at 1 are not inside an open box: no open box is left.
        let open_ends = next_x > x;
        let found = strip.worst(&passed, &ranks, open_ends);
        excess = excess.max(found);
    }
    excess / n
}

/// Areas of boxes of height 1 that end at this and at the next x, times N.
struct Strip {
    closed: f64,
    open: f64,
}

impl Strip {
    /// Largest of `closed count - N·area` and, if asked for, `N·area - open count`; sorted `ys`.
    fn worst(&self, ys: &[f64], ranks: &[f64], with_open: bool) -> f64 {
        const LANES: usize = 8;
        let mut many = [f64::MIN; LANES];
        let mut few = [f64::MIN; LANES];
        let (y_blocks, y_rest) = ys.as_chunks::<LANES>();
        let (rank_blocks, rank_rest) = ranks[..ys.len()].as_chunks::<LANES>();
        for (y, rank) in y_blocks.iter().zip(rank_blocks) {
            for i in 0..LANES {
                many[i] = larger(many[i], rank[i] - self.closed * y[i]);
                few[i] = larger(few[i], self.open * y[i] - rank[i]);
            }
        }
        for (i, (y, rank)) in y_rest.iter().zip(rank_rest).enumerate() {
            many[i] = larger(many[i], rank - self.closed * y);
            few[i] = larger(few[i], self.open * y - rank);
        }
        let many = many.into_iter().fold(f64::MIN, larger) + 1.0;
        if !with_open {
            return many;
        }
        let to_the_top = self.open - ys.len() as f64;
        larger(many, few.into_iter().fold(to_the_top, larger))
    }
}

/// Maximum of two numbers that are never NaN: one instruction, where `f64::max` takes several.
#[inline]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

#[cfg(test)]
#[path = "star_tests.rs"]
mod tests;
