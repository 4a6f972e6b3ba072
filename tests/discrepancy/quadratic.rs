//! Mean-square discrepancies: published values, exact integers, symmetries.

use super::sets::*;
use raystone::discrepancy::{PointSet, Quadratic, quadratic, star};
use raystone::random::Pcg32;

const ALL: [Quadratic; 5] = [
    Quadratic::L2Star,
    Quadratic::Centered,
    Quadratic::WrapAround,
    Quadratic::Mixture,
    Quadratic::Average,
];

fn square(points: &PointSet, kind: Quadratic) -> f64 {
    quadratic(points, kind, &ample()).unwrap()
}

#[track_caller]
fn assert_relative(value: f64, expected: f64, tolerance: f64) {
    let error = (value / expected - 1.0).abs();
    assert!(error <= tolerance, "{value} is not {expected}: {error:e}");
}

#[test]
fn the_example_of_six_points_agrees_with_its_published_values() {
    let raw = [[1, 3], [2, 6], [3, 2], [4, 5], [5, 1], [6, 4]];
    let points = raw.map(|p| p.map(|c| (f64::from(c) - 0.5) / 6.0));
    let points = PointSet::from_points(&points).unwrap();
    for (kind, expected) in [
        (Quadratic::Centered, 0.008142039609053464),
        (Quadratic::Mixture, 0.014895592206789487),
        (Quadratic::WrapAround, 0.01684670781892894),
        (Quadratic::L2Star, 0.068_336_062_125_580_91_f64.powi(2)),
    ] {
        assert_relative(square(&points, kind), expected, 2e-13);
    }
}

#[test]
fn known_sets_have_their_published_values() {
    for (points, root, centered) in [
        (sobol_in(2, 64), 0.01286985, 2.40019626e-4),
        (sobol_in(2, 1024), 8.679283e-4, 1.10673639e-6),
        (halton_in(2, 0, 64), 0.01640944, 7.34084737e-4),
        (halton_in(2, 1, 64), 0.01397069, 5.12487240e-4),
        (halton_in(2, 0, 1024), 1.645495e-3, 5.81618367e-6),
        (
            PointSet::from_points(&hammersley(64)).unwrap(),
            0.02120511,
            3.58103878e-4,
        ),
    ] {
        assert_relative(square(&points, Quadratic::L2Star).sqrt(), root, 5e-7);
        assert_relative(square(&points, Quadratic::Centered), centered, 5e-9);
    }
    // From sums with 64 bits of mantissa.
    let points = sobol_in(2, 4096);
    assert_relative(
        square(&points, Quadratic::L2Star).sqrt(),
        2.34268690789e-4,
        1e-11,
    );
    assert_relative(
        square(&points, Quadratic::Centered),
        7.629496274271e-8,
        1e-11,
    );
    assert_relative(
        square(&points, Quadratic::WrapAround),
        1.2681851559e-7,
        1e-9,
    );
}

#[test]
fn sums_are_right_to_twelve_digits_against_whole_numbers() {
    // In two dimensions, coordinates k/L make all sums whole numbers over powers of L.
    let n: i128 = 4096;
    let points = sobol_in(2, 4096);
    let whole: Vec<[i128; 2]> = points
        .points()
        .map(|p| [0, 1].map(|d| (p[d] * 4096.0) as i128))
        .collect();
    let pairs = || whole.iter().flat_map(|p| whole.iter().map(move |q| (p, q)));
    let factor = |f: &dyn Fn(i128, i128) -> i128| -> i128 {
        pairs().map(|(p, q)| f(p[0], q[0]) * f(p[1], q[1])).sum()
    };
    // L2-star: 9 n⁶ D² = n⁶ − (9/2) n Σ Π (n² − k²) + 9 n² Σ Σ Π (n − max).
    let single: i128 = whole
        .iter()
        .map(|p| (n * n - p[0] * p[0]) * (n * n - p[1] * p[1]))
        .sum();
    let double = factor(&|a, b| n - a.max(b));
    let l2 = 2 * n.pow(6) - 9 * n * single + 18 * n * n * double;
    let expected = l2 as f64 / (18.0 * n.pow(6) as f64);
    assert_relative(square(&points, Quadratic::L2Star), expected, 1e-12);
    // Wrap-around: Π (3/2 − δ(1 − δ)) with δ = k/n is Π (3n² − 2k(n − k)) / (4 n⁴).
    let double = factor(&|a, b| 3 * n * n - 2 * (a - b).abs() * (n - (a - b).abs()));
    let wrap = 9 * double - 64 * n.pow(6);
    let expected = wrap as f64 / (36.0 * n.pow(6) as f64);
    assert_relative(square(&points, Quadratic::WrapAround), expected, 1e-12);
}

/// L2-star as the integral that it is: over each rectangle between coordinates the count is constant.
fn l2_by_integration(points: &[[f64; 2]]) -> f64 {
    let axis = |d: usize| {
        let mut axis: Vec<f64> = points.iter().map(|p| p[d]).chain([0.0, 1.0]).collect();
        axis.sort_unstable_by(f64::total_cmp);
        axis
    };
    let (xs, ys) = (axis(0), axis(1));
    let mut integral = 0.0;
    for x in xs.windows(2) {
        for y in ys.windows(2) {
            let inside = |p: &&[f64; 2]| p[0] <= x[0] && p[1] <= y[0];
            let c = points.iter().filter(inside).count() as f64 / points.len() as f64;
            let power = |w: &[f64], k: i32| (w[1].powi(k) - w[0].powi(k)) / f64::from(k);
            // ∫∫ (xy − c)²
            integral += power(x, 3) * power(y, 3) - 2.0 * c * power(x, 2) * power(y, 2)
                + c * c * power(x, 1) * power(y, 1);
        }
    }
    integral
}

#[test]
fn l2_star_is_the_integral_and_the_average_is_that_of_its_reflections() {
    let mut random = Pcg32::new(1);
    for round in 0..300 {
        let n = 1 + random.below(12);
        let points = random_in(2, n, [3, 1 << 24][round % 2], &mut random);
        let pairs = pairs(&points);
        let expected = l2_by_integration(&pairs);
        assert_relative(square(&points, Quadratic::L2Star), expected, 1e-12);
        let reflected = |flip: [bool; 2]| -> Vec<[f64; 2]> {
            let flip = |p: &[f64; 2]| [0, 1].map(|d| if flip[d] { 1.0 - p[d] } else { p[d] });
            pairs.iter().map(flip).collect()
        };
        let corners = [[false, false], [false, true], [true, false], [true, true]];
        let mean = corners
            .map(|c| l2_by_integration(&reflected(c)))
            .iter()
            .sum::<f64>()
            / 4.0;
        assert_relative(square(&points, Quadratic::Average), mean, 1e-12);
    }
}

#[test]
fn each_measure_has_its_symmetry_and_no_other() {
    let points = halton_in(3, 1, 200);
    let changed = |f: &dyn Fn(f64) -> f64| {
        PointSet::new(3, points.points().flatten().map(|&x| f(x)).collect()).unwrap()
    };
    let shifted = changed(&|x| (x + 0.3125).fract());
    let reflected = changed(&|x| 1.0 - x);
    for kind in ALL {
        let value = square(&points, kind);
        let moves = |other: &PointSet| (square(other, kind) / value - 1.0).abs() > 1e-6;
        assert_eq!(moves(&shifted), kind != Quadratic::WrapAround, "{kind:?}");
        assert_eq!(moves(&reflected), kind == Quadratic::L2Star, "{kind:?}");
    }
    let star_of = |p: &PointSet| star(p, &ample()).value().unwrap();
    assert!((star_of(&shifted) - star_of(&points)).abs() > 1e-4);
    assert!((star_of(&reflected) - star_of(&points)).abs() > 1e-4);
}
