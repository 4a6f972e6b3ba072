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

/// The published formulae of each measure, times 24 L² for coordinates k/L: `m`, h(x) and K(x, y).
/// L2-star: Warnock 1972; centered and wrap-around: Hickernell 1998; mixture: Zhou, Fang & Ning
/// 2013, eq. 17; average: the mean of L2-star's factors over x → 1 − x.
fn whole_numbers(kind: Quadratic, l: i128, x: i128, y: i128) -> [i128; 3] {
    let (z, zy, d) = ((2 * x - l).abs(), (2 * y - l).abs(), (x - y).abs());
    // z is 2 L |x − ½|.
    let [m, h, k] = match kind {
        Quadratic::L2Star => [8 * l * l, 12 * (l * l - x * x), 24 * l * (l - x.max(y))],
        Quadratic::Centered => [
            26 * l * l,
            24 * l * l + 6 * l * z - 3 * z * z,
            24 * l * l + 6 * l * (z + zy) - 12 * l * d,
        ],
        Quadratic::WrapAround => [32 * l * l, 32 * l * l, 36 * l * l - 24 * d * (l - d)],
        Quadratic::Mixture => [
            38 * l * l,
            // 24 L² (5/3 − z/4 − z²/4), in halves of z: 40 L² − 3 L z − 3/2 z².
            (80 * l * l - 6 * l * z - 3 * z * z) / 2,
            45 * l * l - 3 * l * (z + zy) - 18 * l * d + 12 * d * d,
        ],
        Quadratic::Average => [
            8 * l * l,
            6 * l * l + 12 * l * x - 12 * x * x,
            12 * l * (l - d),
        ],
    };
    [m, h, k]
}

/// The squared discrepancy in integers modulo 2^128, sufficient as the result is far smaller.
fn by_whole_numbers(kind: Quadratic, points: &PointSet, l: i128) -> f64 {
    let whole: Vec<Vec<i128>> = points
        .points()
        .map(|p| p.iter().map(|x| (x * l as f64) as i128).collect())
        .collect();
    let (n, dim) = (points.len() as i128, points.dim());
    let product = |p: &[i128], q: &[i128], which: usize| {
        let factors = p
            .iter()
            .zip(q)
            .map(|(&x, &y)| whole_numbers(kind, l, x, y)[which]);
        factors.fold(1_i128, i128::wrapping_mul)
    };
    let mut sum = product(&whole[0], &whole[0], 0).wrapping_mul(n * n);
    for p in &whole {
        sum = sum.wrapping_sub(product(p, p, 1).wrapping_mul(2 * n));
        let row = whole.iter().map(|q| product(p, q, 2));
        sum = sum.wrapping_add(row.fold(0, i128::wrapping_add));
    }
    sum as f64 / (24.0 * (l * l) as f64).powi(dim as i32) / (n * n) as f64
}

#[test]
fn sums_are_right_to_twelve_digits_against_whole_numbers() {
    let mut random = Pcg32::new(11);
    let mut first = |dim: usize, count: usize, bits: u32| {
        // Slightly scrambled, so that coordinates use all their bits.
        let sobol = sobol_in(dim, count.next_power_of_two() as u32);
        let l = f64::from(1_u32 << bits);
        let cut = |x: &f64| {
            ((x * l).floor() + random.uniform() * l / 4096.0)
                .floor()
                .min(l - 1.0)
                / l
        };
        let coordinates = sobol.points().take(count).flatten().map(cut).collect();
        PointSet::new(dim, coordinates).unwrap()
    };
    for (points, bits) in [
        (sobol_in(2, 4096), 12),
        (first(2, 4096, 12), 12),
        (first(2, 4096, 24), 24),
        // Weights 1/N² that are not powers of two.
        (first(2, 3000, 24), 24),
        (first(3, 1500, 14), 14),
        (first(4, 1000, 10), 10),
    ] {
        for kind in ALL {
            let expected = by_whole_numbers(kind, &points, 1 << bits);
            let found = square(&points, kind);
            println!(
                "{kind:?}, {} points: {found:e}, {:e}",
                points.len(),
                found / expected - 1.0
            );
            assert_relative(found, expected, 1e-13);
        }
    }
}

/// L2-star by direct integration: over each rectangle between coordinates the count is constant.
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
