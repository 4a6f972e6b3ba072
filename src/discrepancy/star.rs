//! Star discrepancy: the method for each dimension, and bounds if time runs out.

use super::{Budget, DiscrepancyError, PointSet, ascent, orthants, planar};

/// A star discrepancy, or proven bounds of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bracket {
    /// The difference of an actual box.
    pub lower: f64,
    /// Bound of the differences of all boxes.
    pub upper: f64,
}

impl Bracket {
    /// The value, if known: both bounds are equal.
    pub fn value(&self) -> Option<f64> {
        (self.lower == self.upper).then_some(self.lower)
    }

    fn exact(value: f64) -> Self {
        Self {
            lower: value,
            upper: value,
        }
    }
}

/// Star discrepancy D* of a set of points of any dimension.
///
/// Exact in one and two dimensions, for any budget. From three on it is exact if the search ends
/// within the budget; if not, the ends of the bracket are proven bounds. Exact means: up to a few
/// units in the last place of 1, as counts are integers and volumes are products of coordinates.
pub fn star(points: &PointSet, budget: &Budget) -> Bracket {
    match (points.dim(), points.pairs()) {
        (1, _) => Bracket::exact(linear(points.column(0))),
        (_, Some(pairs)) => Bracket::exact(planar::star(pairs)),
        _ => spatial(points, budget),
    }
}

/// Exact star discrepancy D* of `points` in the unit square, in `[1/(2N), 1]`.
///
/// Ties, duplicates and coordinates equal to 0 or 1 are allowed. Counts are integers and every area
/// is one product, so the result is exact to a few units in the last place of 1.
///
/// Cost: about N log N time and memory for some 10 N numbers.
///
/// ```
/// # use raystone_discrepancy::star_2d;
/// // One point in the middle: the closed box up to it contains everything in a quarter of the area.
/// assert_eq!(star_2d(&[[0.5, 0.5]])?, 0.75);
/// # Ok::<(), raystone_discrepancy::DiscrepancyError>(())
/// ```
///
/// # Errors
/// [`DiscrepancyError::Empty`] and [`DiscrepancyError::Outside`] (NaN included).
pub fn star_2d(points: &[[f64; 2]]) -> Result<f64, DiscrepancyError> {
    PointSet::from_points(points)?;
    Ok(planar::star(points))
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

/// One dimension: `1/(2N) + max |x_i - (2i - 1)/(2N)|` over sorted points (Niederreiter 1992,
/// theorem 2.6), as two differences without the halves.
fn linear(mut points: Vec<f64>) -> f64 {
    points.sort_unstable_by(f64::total_cmp);
    let n = points.len() as f64;
    let worst = |(i, &x): (usize, &f64)| (x - i as f64 / n).max((i + 1) as f64 / n - x);
    points.iter().enumerate().map(worst).fold(0.0, f64::max)
}

/// Tolerance of the first search, and factor from one to the next.
const FIRST_TOLERANCE: f64 = 0.25;
const TIGHTER: f64 = 0.5;

/// Searches with decreasing tolerance, each of which misses no box that is worse than the best
/// known one by more than its tolerance, until the tolerance is 0 or the time is spent. Each costs
/// several times the one before, so the last dominates; a search that takes little of the budget is
/// followed by the exact one.
fn spatial(points: &PointSet, budget: &Budget) -> Bracket {
    let mut lower = ascent::ascend(points, 1, &budget.part(0.1));
    let mut upper = 1.0f64;
    let searching = budget.part(0.8);
    let mut tolerance = FIRST_TOLERANCE;
    loop {
        let before = searching.left();
        if orthants::search(points, &mut lower, tolerance, &searching).is_none() {
            break;
        }
        if tolerance == 0.0 {
            return Bracket::exact(lower);
        }
        upper = upper.min(lower + tolerance);
        let spent = before - searching.left();
        tolerance *= TIGHTER;
        if spent * 100 < searching.left() || tolerance < lower / 64.0 {
            tolerance = 0.0;
        }
    }
    lower = lower.max(ascent::ascend_on(points, 2.., budget));
    Bracket {
        lower,
        upper: upper.max(lower),
    }
}
