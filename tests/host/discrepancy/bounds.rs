//! What is certain when time runs out.

use super::sets::*;
use raystone::discrepancy::{Budget, DiscrepancyError, Measure, Quadratic, measure, star};
use raystone::random::Pcg32;

#[test]
fn a_search_without_time_gives_bounds_and_no_value() {
    let points = sobol_in(6, 4096);
    for seconds in [0.0, 0.3] {
        let bracket = star(&points, &Budget::seconds(seconds));
        assert_eq!(bracket.value(), None, "{bracket:?}");
        assert!(0.0 <= bracket.lower && bracket.lower < bracket.upper && bracket.upper <= 1.0);
    }
    let some = star(&points, &Budget::seconds(0.3));
    assert!(some.lower > 0.0, "{some:?}");
}

#[test]
fn many_dimensions_have_bounds() {
    let mut random = Pcg32::new(2);
    for dim in [9, 20, 30] {
        let points = random_in(dim, 40, 1 << 20, &mut random);
        let bracket = star(&points, &Budget::seconds(0.5));
        assert!(
            0.1 < bracket.lower && bracket.lower <= bracket.upper,
            "{dim} {bracket:?}"
        );
        assert!(bracket.upper <= 1.0);
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
