//! Discrepancies of fixed points, computed anew and compared with what other programs say.

use crate::{Budget, DiscrepancyError, PointSet, Quadratic, net_quality, quadratic, star_2d};

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
    let known = figures().map_err(|e| format!("discrepancies of known points: {e}"))?;
    known.into_iter().try_for_each(agree)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn they_are_those_of_other_programs_and_a_wrong_one_is_named() {
        assert_eq!(check(), Ok(()));
        for (name, found, expected) in figures().unwrap() {
            let fault = agree((name, found + 1e-9, expected)).unwrap_err();
            assert!(fault.contains(name), "{fault}");
        }
    }
}
