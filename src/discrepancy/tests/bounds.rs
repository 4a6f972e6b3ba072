//! What is certain when time runs out.

use super::super::{ascent, orthants};
use super::sets::*;
use super::*;

#[test]
fn every_tolerance_gives_bounds_that_hold_the_truth() {
    for points in [sobol_in(4, 128), halton_in(5, 1, 64), halton_in(3, 0, 300)] {
        let truth = star(&points, &ample()).value().unwrap();
        for tolerance in [0.5, 0.1, 0.03, 0.01, 0.001] {
            let mut lower = 0.0;
            let done = orthants::search(&points, &mut lower, tolerance, &ample());
            assert!(done.is_some());
            assert!(
                lower <= truth && truth <= lower + tolerance + 1e-15,
                "{lower} {truth}"
            );
        }
    }
}

#[test]
fn threshold_accepting_stays_below_the_truth_and_near_it() {
    for (points, share) in [
        (sobol_in(3, 256), 0.95),
        (halton_in(4, 0, 200), 0.95),
        (halton_in(6, 0, 64), 0.95),
    ] {
        let truth = star(&points, &ample()).value().unwrap();
        let found = ascent::ascend_on(&points, 0..20, &ample());
        println!("{found} {truth}");
        assert!(
            found <= truth + 1e-15 && found >= share * truth,
            "{found} {truth}"
        );
    }
}

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
    let mut random = super::super::random::Random(2);
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
