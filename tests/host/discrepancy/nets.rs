//! Nets, and the registry of measures.

use super::sets::*;
use raystone::discrepancy::{
    Measure, Net, PointSet, Value, elementary_shapes, measure, net_quality,
};

fn t_value(points: &PointSet) -> Net {
    net_quality(points, &ample()).unwrap()
}

#[test]
fn sobol_points_are_nets_of_their_published_quality() {
    // Two dimensions form a (0, 2)-sequence; the first three have quality 1 at most.
    for m in 0..=10 {
        assert_eq!(t_value(&sobol_in(2, 1 << m)), Net { t: 0, m });
    }
    assert!(t_value(&sobol_in(3, 256)).t <= 1);
    let shapes = elementary_shapes(&sobol_in(2, 256), &ample());
    assert_eq!(shapes, Ok((9, 9)));
}

#[test]
fn digital_shifts_keep_a_net_and_rotations_break_it() {
    let points = sobol_in(2, 256);
    let changed = |f: &dyn Fn(f64) -> f64| {
        PointSet::new(2, points.points().flatten().map(|&x| f(x)).collect()).unwrap()
    };
    let shifted = changed(&|x| f64::from((x * 4294967296.0) as u32 ^ 0x9e37_79b9) / 4294967296.0);
    assert_eq!(t_value(&shifted).t, 0);
    let rotated = changed(&|x| (x + 0.301).fract());
    assert!(t_value(&rotated).t > 0);
    let (all, even) = elementary_shapes(&rotated, &ample()).unwrap();
    assert!(all == 9 && even < 9, "{even}");
}

#[test]
fn one_moved_point_breaks_a_net() {
    let mut points = sobol(64);
    points[5] = points[6];
    let points = PointSet::from_points(&points).unwrap();
    assert!(t_value(&points).t > 0);
}

#[test]
fn sets_that_cannot_be_nets_say_why() {
    for (points, word) in [
        (halton_in(2, 0, 100), "power of two"),
        (
            PointSet::from_points(&[[0.5, 1.0], [0.0, 0.0]]).unwrap(),
            "point 0",
        ),
    ] {
        let message = net_quality(&points, &ample()).unwrap_err().to_string();
        assert!(
            message.starts_with("tvalue") && message.contains(word),
            "{message}"
        );
    }
}

#[test]
fn every_measure_is_found_by_its_name_and_measures_a_small_net() {
    let points = sobol_in(2, 64);
    assert!(!Measure::ALL.is_empty());
    for kind in Measure::ALL {
        assert_eq!(Measure::from_name(kind.name()), Some(kind));
        assert!(!kind.description().is_empty());
        measure(&points, kind, &ample()).unwrap();
    }
    assert_eq!(Measure::from_name("stars"), None);
    let mut names: Vec<_> = Measure::ALL.iter().map(|m| m.name()).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), Measure::ALL.len());
}

#[test]
fn the_matrix_shows_the_pair_that_is_bad() {
    // The fourth dimension repeats the first: their pair lies on a diagonal.
    let points = sobol_in(3, 256);
    let repeated = points.project(&[0, 1, 2, 0]).unwrap();
    let Ok(Value::Matrix(matrix)) = measure(&repeated, Measure::Pairs, &ample()) else {
        panic!("no matrix");
    };
    assert_eq!(matrix.len(), 4);
    for (i, row) in matrix.iter().enumerate() {
        for (j, value) in row.iter().enumerate() {
            assert_eq!(value.is_none(), i == j);
            let bad = value.is_some_and(|v| v > 0.2);
            assert_eq!(bad, (i, j) == (0, 3) || (i, j) == (3, 0), "{matrix:?}");
        }
    }
}
