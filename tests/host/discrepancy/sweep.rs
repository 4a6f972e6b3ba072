//! The O(N²) sweep for the exact star discrepancy in two dimensions, a simple reference.

/// Sweeps a vertical line over the distinct x, keeping the y of the points passed in sorted order.
///
/// A box `[0, x] × [0, y]` has too many points only if its top touches one of them, and too few
/// only if its top is about to reach one or is at 1; so the y of the points passed suffice, and the
/// rank in the sorted list is the count. Equal y need no special care: of a run of ties the first
/// has the right open count, the last the right closed count, and the others give smaller values.
pub(super) fn sweep(points: &[[f64; 2]]) -> f64 {
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
        // Points passed are those of closed boxes at this x and of open ones at the next.
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

/// Areas of boxes of height 1 that end at this and the next x, times N.
struct Strip {
    closed: f64,
    open: f64,
}

impl Strip {
    /// Largest `closed count - N·area` and, if requested, `N·area - open count`; sorted `ys`.
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

/// Maximum of two numbers that are never NaN: one instruction, instead of several for `f64::max`.
#[inline]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}
