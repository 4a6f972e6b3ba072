//! All measures by name.

use super::{
    Budget, DiscrepancyError, Metric, PointSet, Quadratic, elementary_shapes, extreme_2d,
    largest_empty_box, minimum_distance, net_quality, quadratic, radial_spectrum, star,
};

/// A measure of a point set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measure {
    /// Star discrepancy.
    Star,
    /// Extreme discrepancy in two dimensions.
    Extreme,
    /// A discrepancy in the mean square.
    Quadratic(Quadratic),
    /// Minimum distance between two points.
    Distance(Metric),
    /// Largest empty box in two dimensions.
    Dispersion,
    /// Quality of a net in base 2.
    NetQuality,
    /// Elementary intervals of volume 1/N.
    Intervals,
    /// Radial power spectrum in two dimensions.
    Spectrum,
    /// Star discrepancy of all pairs of dimensions.
    Pairs,
}

/// The result of a measure.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// Two bounds, equal if the value is exact.
    Bracket(super::Bracket),
    /// One number.
    Number(f64),
    /// A discrepancy in the mean square.
    Square(f64),
    /// Quality of a net.
    Net(super::Net),
    /// Shapes of intervals of volume 1/N.
    Shapes {
        /// Number of shapes.
        all: u64,
        /// Number of shapes in which each interval has one point.
        even: u64,
    },
    /// Mean power at frequencies 1, 2, ….
    Spectrum(Vec<f64>),
    /// Symmetric matrix over pairs of dimensions; the diagonal is empty.
    Matrix(Vec<Vec<Option<f64>>>),
}

/// Every measure with its name on the command line and in results, and a one-line description; in
/// the order of the documentation.
#[rustfmt::skip]
const TABLE: [(Measure, &str, &str); 14] = [
    (Measure::Star, "star", "star discrepancy: largest error of a box at the origin; exact or bounds"),
    (Measure::Extreme, "extreme", "extreme discrepancy, 2-D: largest error of any box"),
    (Measure::Quadratic(Quadratic::L2Star), "l2star", "L2-star discrepancy, root and square"),
    (Measure::Quadratic(Quadratic::Centered), "centered", "centered L2 discrepancy, root and square"),
    (Measure::Quadratic(Quadratic::WrapAround), "wrap", "wrap-around L2 discrepancy, root and square"),
    (Measure::Quadratic(Quadratic::Mixture), "mixture", "mixture discrepancy, root and square"),
    (Measure::Quadratic(Quadratic::Average), "average", "L2-star averaged over all corners as origin, root and square"),
    (Measure::Distance(Metric::Plain), "distance", "least distance between two points"),
    (Measure::Distance(Metric::Torus), "torus-distance", "least distance between two points on the torus"),
    (Measure::Dispersion, "dispersion", "area of the largest empty axis-parallel box, 2-D"),
    (Measure::NetQuality, "tvalue", "t of a (t, m, d)-net in base 2"),
    (Measure::Intervals, "intervals", "shapes of elementary intervals with one point in each"),
    (Measure::Spectrum, "spectrum", "radial mean of the power spectrum, 2-D"),
    (Measure::Pairs, "pairs", "star discrepancy of every pair of dimensions"),
];

impl Measure {
    /// Every measure, in the order of the documentation.
    pub const ALL: [Self; TABLE.len()] = {
        let mut all = [Self::Star; TABLE.len()];
        let mut row = 0;
        while row < all.len() {
            all[row] = TABLE[row].0;
            row += 1;
        }
        all
    };

    /// The measure of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|m| m.name() == name)
    }

    fn row(self) -> (&'static str, &'static str) {
        let row = TABLE.iter().find(|(measure, ..)| *measure == self);
        row.map_or(("", ""), |(_, name, description)| (name, description))
    }

    /// Name on the command line and in results.
    pub fn name(self) -> &'static str {
        self.row().0
    }

    /// One-line description.
    pub fn description(self) -> &'static str {
        self.row().1
    }
}

/// Limit on a spectrum's highest frequency, otherwise twice that of an equal square grid.
const HIGHEST_FREQUENCY: usize = 256;

/// Measures a set of points within a budget.
///
/// # Errors
/// The measure is not defined for such a set, or did not finish; both suggest a change.
pub fn measure(
    points: &PointSet,
    measure: Measure,
    budget: &Budget,
) -> Result<Value, DiscrepancyError> {
    Ok(match measure {
        Measure::Star => Value::Bracket(star(points, budget)),
        Measure::Extreme => Value::Number(extreme_2d(points, budget)?),
        Measure::Quadratic(kind) => Value::Square(quadratic(points, kind, budget)?),
        Measure::Distance(metric) => {
            let reason = "needs two points, there is one".to_owned();
            let missing = DiscrepancyError::NotDefined {
                measure: measure.name(),
                reason,
            };
            Value::Number(minimum_distance(points, metric).ok_or(missing)?)
        }
        Measure::Dispersion => Value::Number(largest_empty_box(points, budget)?),
        Measure::NetQuality => Value::Net(net_quality(points, budget)?),
        Measure::Intervals => {
            let (all, even) = elementary_shapes(points, budget)?;
            Value::Shapes { all, even }
        }
        Measure::Spectrum => {
            let highest = (2.0 * (points.len() as f64).sqrt()).ceil() as usize;
            let highest = highest.clamp(1, HIGHEST_FREQUENCY);
            Value::Spectrum(radial_spectrum(points, highest, budget)?)
        }
        Measure::Pairs => Value::Matrix(pairs(points, budget)?),
    })
}

fn pairs(points: &PointSet, budget: &Budget) -> Result<Vec<Vec<Option<f64>>>, DiscrepancyError> {
    let dim = points.dim();
    let mut matrix = vec![vec![None; dim]; dim];
    for (i, j) in (0..dim).flat_map(|i| (0..i).map(move |j| (i, j))) {
        budget.check(Measure::Pairs.name())?;
        let value = star(&points.project(&[j, i])?, budget).value();
        matrix[i][j] = value;
        matrix[j][i] = value;
    }
    Ok(matrix)
}
