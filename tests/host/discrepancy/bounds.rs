//! Certain bounds when time runs out.

use super::sets::*;
use raystone::discrepancy::{
    Bracket, Budget, DiscrepancyError, Measure, PointSet, Quadratic, measure, star,
};
use raystone::random::Pcg32;

#[test]
fn a_search_without_time_gives_bounds_and_no_value() {
    let points = sobol_in(6, 4096);
    for seconds in [0.0, 0.3] {
        let bracket = star(&points, &Budget::seconds(seconds));
        assert_eq!(bracket.value(), None, "{bracket:?}");
        assert!(0.0 <= bracket.lower && bracket.lower < bracket.upper && bracket.upper <= 1.0);
    }
    let some = as_soon_as(&points, |bracket| bracket.lower > 0.0);
    assert_eq!(some.value(), None, "{some:?}");
}

/// The bounds after the shortest time that satisfies `is_so`; busy machines get more.
fn as_soon_as(points: &PointSet, is_so: impl Fn(&Bracket) -> bool) -> Bracket {
    let spans = std::iter::successors(Some(0.25), |seconds| Some(2.0 * seconds));
    let mut brackets = spans.map(|seconds| (seconds, star(points, &Budget::seconds(seconds))));
    let found = brackets.find(|(seconds, bracket)| is_so(bracket) || *seconds > 100.0);
    let (seconds, bracket) = found.expect("spans have no end");
    assert!(is_so(&bracket), "not in {seconds} s: {bracket:?}");
    bracket
}

#[test]
fn many_dimensions_have_bounds() {
    let mut random = Pcg32::new(2);
    for dim in [9, 20, 30] {
        let points = random_in(dim, 40, 1 << 20, &mut random);
        let bracket = as_soon_as(&points, |bracket| bracket.lower > 0.1);
        assert!(
            bracket.lower <= bracket.upper && bracket.upper <= 1.0,
            "{dim} {bracket:?}"
        );
    }
}

#[test]
fn quadratic_work_stops_when_the_time_is_over() {
    let points = sobol_in(2, 64);
    let none = Budget::seconds(0.0);
    for kind in [
        Measure::Extreme,
        Measure::Quadratic(Quadratic::L2Star),
        Measure::Dispersion,
    ] {
        let error = measure(&points, kind, &none).unwrap_err();
        assert!(
            matches!(error, DiscrepancyError::OverBudget { .. }),
            "{error}"
        );
    }
    for odd in [f64::NAN, -1.0] {
        assert!(Budget::seconds(odd).is_spent());
    }
    assert!(!Budget::seconds(f64::INFINITY).is_spent());
}
