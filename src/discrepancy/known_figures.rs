//! Discrepancies of fixed points, computed anew and compared with what other programs say.

use crate::{
    Budget, DiscrepancyError, Measure, Metric, PointSet, Quadratic, Value, elementary_shapes,
    measure, net_quality, quadratic, star, star_2d, star_2d_prefixes,
};

/// Eight points in eighths.
pub const POINTS: [[f64; 2]; 8] = [
    [0.0, 0.0],
    [0.5, 0.5],
    [0.25, 0.75],
    [0.75, 0.25],
    [0.125, 0.375],
    [0.625, 0.875],
    [0.375, 0.625],
    [0.875, 0.125],
];
const SECONDS: f64 = 60.0;

/// Computes the figures anew.
///
/// # Errors
/// One is not what it should be: which, and both values.
pub fn check() -> Result<(), String> {
    let known = figures().and_then(|known| Ok(known.into_iter().chain(further()?)));
    let mut known = known.map_err(|e| format!("discrepancies of known points: {e}"))?;
    known.try_for_each(agree)
}

fn agree((name, found, expected): (&str, f64, f64)) -> Result<(), String> {
    let agrees = (found - expected).abs() <= 1e-12;
    agrees.then_some(()).ok_or_else(|| {
        format!(
            "the {name} of known points is {found}, and should be {expected}: this program computes wrong \
             figures; build it anew, and report what stays wrong"
        )
    })
}

fn figures() -> Result<[(&'static str, f64, f64); 6], DiscrepancyError> {
    let points = PointSet::from_points(&POINTS)?;
    let square = |kind| quadratic(&points, kind, &Budget::seconds(SECONDS));
    Ok([
        // One point: the closed box up to (½, ½) holds too much, the open one before 0.9 nothing.
        ("D* of a closed box", star_2d(&[[0.5, 0.5]])?, 0.75),
        ("D* of an open box", star_2d(&[[0.9, 0.9]])?, 0.9),
        // All open and closed boxes with corners at coordinates of points, in NumPy.
        ("D*", star_2d(&POINTS)?, 0.25),
        // SciPy 1.17, scipy.stats.qmc.discrepancy with the methods "L2-star" and "CD".
        (
            "L2 discrepancy",
            square(Quadratic::L2Star)?.sqrt(),
            0.092_255_154_082_908_05,
        ),
        (
            "centred discrepancy",
            square(Quadratic::Centered)?,
            0.015_346_950_954_860_938,
        ),
        // Of the intervals of area 1/8 only the squares of two by four quarters hold two points or none.
        (
            "t of a net",
            f64::from(net_quality(&points, &Budget::seconds(SECONDS))?.t),
            1.0,
        ),
    ])
}

/// Points whose nearest pair on the torus is another than in the plane.
const ACROSS: [[f64; 2]; 4] = [[0.125, 0.5], [0.9375, 0.5], [0.5, 0.25], [0.5, 0.6875]];
/// Points without a symmetry, for their spectrum.
const THREE: [[f64; 2]; 3] = [[0.125, 0.25], [0.5, 0.625], [0.8125, 0.0625]];

/// Measures beyond those that a run shows: by SciPy, or by their definitions in NumPy.
fn further() -> Result<Vec<(&'static str, f64, f64)>, DiscrepancyError> {
    let budget = Budget::seconds(SECONDS);
    let points = PointSet::from_points(&POINTS)?;
    let across = PointSet::from_points(&ACROSS)?;
    let number = |points: &PointSet, what| {
        Ok::<f64, DiscrepancyError>(match measure(points, what, &budget)? {
            Value::Number(x) | Value::Square(x) => x,
            Value::Bracket(bracket) => bracket.value().unwrap_or(f64::NAN),
            _ => f64::NAN,
        })
    };
    let of = |what| number(&points, what);
    // First coordinates of five points; and a third coordinate, the second of the points in reverse.
    let line = PointSet::new(1, POINTS[..5].iter().map(|p| p[0]).collect())?;
    let pairs = POINTS.iter().zip(POINTS.iter().rev());
    let space = PointSet::new(3, pairs.flat_map(|(p, q)| [p[0], p[1], q[1]]).collect())?;
    let prefixes = star_2d_prefixes(&POINTS, &[2, 4])?;
    let (all, even) = elementary_shapes(&points, &budget)?;
    let radial = crate::radial_spectrum(&PointSet::from_points(&THREE)?, 3, &budget)?;
    let at = |place: usize| radial.get(place).copied().unwrap_or(f64::NAN);
    Ok(vec![
        ("D* of the first two", prefixes[0], 0.75),
        ("D* of the first four", prefixes[1], 0.4375),
        ("D* on a line", number(&line, Measure::Star)?, 0.35),
        (
            "D* in space",
            star(&space, &budget).value().unwrap_or(f64::NAN),
            0.408_203_125,
        ),
        // "WD" and "MD".
        (
            "wrap-around discrepancy",
            of(Measure::Quadratic(Quadratic::WrapAround))?,
            0.011_406_792_534_722_321,
        ),
        (
            "mixture discrepancy",
            of(Measure::Quadratic(Quadratic::Mixture))?,
            0.015_755_547_417_533_49,
        ),
        // The mean of "L2-star" squared over the points and their reflections.
        (
            "average discrepancy",
            of(Measure::Quadratic(Quadratic::Average))?,
            0.005_581_325_954_861_105,
        ),
        // All boxes between coordinates of points, open and closed.
        ("extreme discrepancy", of(Measure::Extreme)?, 0.375),
        ("largest empty box", of(Measure::Dispersion)?, 0.3125),
        (
            "least distance",
            number(&across, Measure::Distance(Metric::Plain))?,
            0.419_262_745_781_210_6,
        ),
        (
            "least distance on the torus",
            number(&across, Measure::Distance(Metric::Torus))?,
            0.1875,
        ),
        ("number of shapes of intervals", all as f64, 4.0),
        ("number of even shapes", even as f64, 3.0),
        // Means of |Σ exp(−2πi k·x)|² / N over frequencies k by their rounded length.
        ("number of radii", radial.len() as f64, 3.0),
        ("spectrum at 1", at(0), 0.782_239_505_853_937_3),
        ("spectrum at 3", at(2), 0.996_284_138_543_274_5),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn they_are_those_of_other_programs_and_a_wrong_one_is_named() {
        assert_eq!(check(), Ok(()));
        let all = figures().unwrap().into_iter();
        for (name, found, expected) in all.chain(further().unwrap()) {
            let fault = agree((name, found + 1e-9, expected)).unwrap_err();
            assert!(fault.contains(name), "{fault}");
        }
    }
}
