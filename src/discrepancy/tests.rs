//! The two searches behind a star discrepancy that runs out of time; see also `tests/discrepancy`.

use super::*;

fn ample() -> Budget {
    Budget::seconds(600.0)
}

/// Halton points in any dimension up to 6.
fn halton(dim: usize, n: u32) -> PointSet {
    let inverse = |base: u32, mut i: u32| {
        let (mut value, mut scale) = (0.0, 1.0);
        while i > 0 {
            scale /= f64::from(base);
            value += f64::from(i % base) * scale;
            i /= base;
        }
        value
    };
    let bases = &[2, 3, 5, 7, 11, 13][..dim];
    let points = (0..n).flat_map(|i| bases.iter().map(move |&base| inverse(base, i)));
    PointSet::new(dim, points.collect()).unwrap()
}

#[test]
fn every_tolerance_gives_bounds_that_hold_the_truth() {
    for points in [halton(4, 128), halton(5, 64), halton(3, 300)] {
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
        (halton(3, 256), 0.95),
        (halton(4, 200), 0.95),
        (halton(6, 64), 0.95),
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
