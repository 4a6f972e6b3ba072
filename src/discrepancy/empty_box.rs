//! Dispersion in two dimensions: the largest empty box.

use super::{Budget, DiscrepancyError, PointSet};

const NAME: &str = "dispersion";

/// Area of the largest axis-parallel box in the unit square without a point in its interior.
///
/// A largest box has a point inside its left or right side, or extends from x = 0 to 1. In the
/// first case it grows to the right from that point, and each point that it meets cuts off the part
/// above or below (Naamad, Lee & Hsu 1984, "On the maximum empty rectangle problem"). Cost: at most
/// N² steps.
///
/// # Errors
/// The budget is spent first; points that are not pairs.
pub(crate) fn largest_empty_box(
    points: &PointSet,
    budget: &Budget,
) -> Result<f64, DiscrepancyError> {
    let pairs = points.pairs_for(NAME)?;
    let mut ys: Vec<f64> = pairs.iter().map(|p| p[1]).chain([0.0, 1.0]).collect();
    ys.sort_unstable_by(f64::total_cmp);
    let mut largest = ys.windows(2).map(|w| w[1] - w[0]).fold(0.0, f64::max);

    let mut by_x = pairs.to_vec();
    by_x.sort_unstable_by(|p, q| p[0].total_cmp(&q[0]));
    grow_all(&by_x, budget, &mut largest)?;
    let mirror = |p: &[f64; 2]| [1.0 - p[0], p[1]];
    let mirrored: Vec<[f64; 2]> = by_x.iter().rev().map(mirror).collect();
    grow_all(&mirrored, budget, &mut largest)?;
    Ok(largest)
}

fn grow_all(by_x: &[[f64; 2]], budget: &Budget, largest: &mut f64) -> Result<(), DiscrepancyError> {
    for (i, &seed) in by_x.iter().enumerate() {
        if i % 64 == 0 {
            budget.check(NAME)?;
        }
        *largest = largest.max(grow(seed, &by_x[i + 1..], *largest));
    }
    Ok(())
}

/// Area of the largest box with `seed` on its left side, at least `known`; points sorted by x.
fn grow(seed: [f64; 2], right: &[[f64; 2]], known: f64) -> f64 {
    let [left, middle] = seed;
    let (mut bottom, mut top) = (0.0, 1.0);
    let mut largest = known;
    for &[x, y] in right {
        if (1.0 - left) * (top - bottom) <= largest {
            return largest;
        }
        if x == left || y <= bottom || y >= top {
            continue;
        }
        largest = largest.max((x - left) * (top - bottom));
        if y > middle {
            top = y;
        } else if y < middle {
            bottom = y;
        } else {
            return largest;
        }
    }
    largest.max((1.0 - left) * (top - bottom))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::SplitMix64;

    /// All boxes between coordinates of points and borders.
    fn brute_force(points: &[[f64; 2]]) -> f64 {
        let axis = |d: usize| points.iter().map(move |p| p[d]).chain([0.0, 1.0]);
        let mut largest = 0.0f64;
        for (x0, x1) in axis(0).flat_map(|a| axis(0).map(move |b| (a, b))) {
            for (y0, y1) in axis(1).flat_map(|a| axis(1).map(move |b| (a, b))) {
                let inside = |p: &&[f64; 2]| x0 < p[0] && p[0] < x1 && y0 < p[1] && p[1] < y1;
                if x0 < x1 && y0 < y1 && points.iter().find(inside).is_none() {
                    largest = largest.max((x1 - x0) * (y1 - y0));
                }
            }
        }
        largest
    }

    #[test]
    fn growing_boxes_finds_what_all_boxes_have() {
        let mut random = SplitMix64(11);
        for round in 0..1000 {
            let n = 1 + random.below(8);
            let levels = [3, 8, 1 << 20][round % 3];
            let mut coordinate = || random.below(levels + 1) as f64 / levels as f64;
            let points: Vec<[f64; 2]> = (0..n).map(|_| [coordinate(), coordinate()]).collect();
            let set = PointSet::from_points(&points).unwrap();
            let found = largest_empty_box(&set, &Budget::seconds(60.0)).unwrap();
            let expected = brute_force(&points);
            assert!(
                (found - expected).abs() < 1e-15,
                "{found} {expected} {points:?}"
            );
        }
    }

    #[test]
    fn a_point_in_the_middle_leaves_half_of_the_square() {
        let set = PointSet::from_points(&[[0.5, 0.5]]).unwrap();
        let budget = Budget::seconds(1.0);
        assert_eq!(largest_empty_box(&set, &budget), Ok(0.5));
        let cube = PointSet::from_points(&[[0.5; 3]]).unwrap();
        let message = largest_empty_box(&cube, &budget).unwrap_err().to_string();
        assert!(message.contains("2 dimensions"), "{message}");
    }
}
