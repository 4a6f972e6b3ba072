//! Extreme discrepancy in two dimensions: boxes with both corners free.

use super::{Budget, DiscrepancyError, PointSet};

/// Largest difference between area and fraction of points over *all* axis-parallel boxes `[a, b)`
/// in the unit square (Niederreiter 1992, definition 2.2).
///
/// For each left side the right side sweeps over the points, whose y are kept sorted; the best
/// lower and upper sides for a given pair are found in one pass, as a maximum sum of consecutive
/// terms. Cost: N³/6 steps; 2,048 points take seconds.
///
/// # Errors
/// The budget is spent first; points that are not pairs.
pub fn extreme_2d(points: &PointSet, budget: &Budget) -> Result<f64, DiscrepancyError> {
    let pairs = points.pairs_for("extreme")?;
    let n = pairs.len() as f64;
    let mut by_x = pairs.to_vec();
    by_x.sort_unstable_by(|p, q| p[0].total_cmp(&q[0]));
    let mut lefts: Vec<f64> = by_x.iter().map(|p| p[0]).collect();
    lefts.push(0.0);
    lefts.sort_unstable_by(f64::total_cmp);
    lefts.dedup();
    let mut worst = 0.0f64;
    for &left in &lefts {
        budget.check("extreme")?;
        let from = by_x.partition_point(|p| p[0] < left);
        let beyond = by_x.partition_point(|p| p[0] <= left);
        worst = worst.max(most(&by_x[from..], left, n));
        worst = worst.max(fewest(&by_x[beyond..], left, n));
    }
    Ok(worst / n)
}

/// Largest `count - N·area` of closed boxes with this left side.
fn most(by_x: &[[f64; 2]], left: f64, n: f64) -> f64 {
    let mut ys: Vec<f64> = Vec::with_capacity(by_x.len());
    let mut worst = 0.0f64;
    for &[x, y] in by_x {
        ys.insert(ys.partition_point(|&other| other < y), y);
        let width = n * (x - left);
        let mut least = f64::INFINITY;
        let mut rise = f64::MIN;
        for (rank, y) in ys.iter().enumerate() {
            // Up to this point, minus up to just below the best lower side.
            let height = rank as f64 - width * y;
            least = if height < least { height } else { least };
            rise = if height - least > rise {
                height - least
            } else {
                rise
            };
        }
        worst = worst.max(rise + 1.0);
    }
    worst
}

/// Largest `N·area - count` of open boxes with this left side: only points beyond it count.
fn fewest(by_x: &[[f64; 2]], left: f64, n: f64) -> f64 {
    let mut ys: Vec<f64> = Vec::with_capacity(by_x.len());
    let mut worst = 0.0f64;
    let ends = by_x.iter().map(|p| (p[0], Some(p[1]))).chain([(1.0, None)]);
    for (x, next) in ends {
        let width = n * (x - left);
        let mut least = 0.0; // the lower border
        let mut rise = f64::MIN;
        for (rank, y) in ys.iter().enumerate() {
            let upper = width * y - rank as f64;
            rise = if upper - least > rise {
                upper - least
            } else {
                rise
            };
            // As a lower side it excludes its own point too.
            let lower = upper - 1.0;
            least = if lower < least { lower } else { least };
        }
        let border = width - ys.len() as f64;
        worst = worst.max(rise.max(border - least));
        if let Some(y) = next {
            ys.insert(ys.partition_point(|&other| other < y), y);
        }
    }
    worst
}
