//! Known values, a brute-force checker, ties, borders and bad input.

use super::*;

/// Both counts at every corner of the grid of coordinates and 1: O(N³), straight from the definition.
fn brute_force(points: &[[f64; 2]]) -> f64 {
    let n = points.len() as f64;
    let axis = |d: usize| points.iter().map(move |p| p[d]).chain([1.0]);
    let mut worst = 0.0f64;
    for x in axis(0) {
        for y in axis(1) {
            let open = points.iter().filter(|p| p[0] < x && p[1] < y).count() as f64;
            let closed = points.iter().filter(|p| p[0] <= x && p[1] <= y).count() as f64;
            worst = worst.max(x * y - open / n).max(closed / n - x * y);
        }
    }
    worst
}

fn radical_inverse(base: u64, mut i: u64) -> f64 {
    let (mut value, mut scale) = (0u64, 1u64);
    while i > 0 {
        value = value * base + i % base;
        scale *= base;
        i /= base;
    }
    value as f64 / scale as f64
}

fn halton(first: u64, n: u64) -> Vec<[f64; 2]> {
    let point = |i| [radical_inverse(2, i), radical_inverse(3, i)];
    (first..first + n).map(point).collect()
}

fn hammersley(n: u64) -> Vec<[f64; 2]> {
    let point = |i| [i as f64 / n as f64, radical_inverse(2, i)];
    (0..n).map(point).collect()
}

/// First two dimensions of Sobol' in natural order; dimension 2 has m = 1, 3, 5, 15, … by
/// `v_j = v_{j-1} ^ (v_{j-1} >> 1)`.
fn sobol(n: u32) -> Vec<[f64; 2]> {
    let mut directions = [1u32 << 31; 32];
    for j in 1..32 {
        directions[j] = directions[j - 1] ^ (directions[j - 1] >> 1);
    }
    let point = |i: u32| {
        let bits = (0..32).filter(|j| i >> j & 1 == 1);
        let second = bits.fold(0, |acc, j| acc ^ directions[j as usize]);
        [i.reverse_bits(), second].map(|v| f64::from(v) / 2f64.powi(32))
    };
    (0..n).map(point).collect()
}

/// Multiplicative congruential numbers, good enough to place test points.
fn random(n: usize, seed: u64, levels: u64) -> Vec<[f64; 2]> {
    let mut state = seed.wrapping_mul(2) + 1;
    let mut next = || {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 40) % (levels + 1)
    };
    (0..n)
        .map(|_| [next(), next()].map(|k| k as f64 / levels as f64))
        .collect()
}

#[track_caller]
fn assert_star(points: &[[f64; 2]], expected: f64) {
    let star = star_2d(points).unwrap();
    assert!(
        (star - expected).abs() <= 4e-15 + 1e-12 * expected.min(1e-3),
        "{star} is not {expected}"
    );
}

#[test]
fn known_sets_have_their_published_discrepancy() {
    assert_star(&sobol(64), 0.0537109375);
    assert_star(&sobol(1024), 0.004299163818359375);
    assert_star(&halton(0, 1024), 0.0068359375);
    assert_star(&hammersley(64), 0.0537109375);
    assert_star(&sobol(4096), 0.001_329_183_578_491_211);
    assert_star(&halton(0, 4096), 0.001_863_483_974_908_542);
    // Tabled to ten or so digits only.
    for (points, expected) in [
        (halton(0, 64), 0.0520833333),
        (halton(1, 64), 0.0520833333),
        (halton(1, 1024), 0.00658275463),
        (hammersley(1024), 0.00466537476),
    ] {
        let star = star_2d(&points).unwrap();
        assert!((star - expected).abs() < 5e-11, "{star} is not {expected}");
    }
}

#[test]
fn the_example_of_six_points_agrees_with_its_published_value() {
    let raw = [[1, 3], [2, 6], [3, 2], [4, 5], [5, 1], [6, 4]];
    let points = raw.map(|p| p.map(|c| (f64::from(c) - 0.5) / 6.0));
    assert_star(&points, 0.229_166_666_666_666_69);
}

#[test]
fn sets_small_enough_to_know_by_hand() {
    assert_star(&[[0.0, 0.0]], 1.0);
    assert_star(&[[1.0, 1.0]], 1.0);
    assert_star(&[[0.5, 0.5]], 0.75);
    // A point on the right border is in no open box: too few points left of it, up to area 1.
    assert_star(&[[1.0, 0.0]], 1.0);
    assert_star(&[[0.5, 0.5]; 7], 0.75);
}

#[test]
fn the_sweep_equals_brute_force_with_ties_and_borders() {
    // Few levels: many equal coordinates and coordinates 0 and 1; many levels: none.
    for levels in [1, 2, 3, 7, 1 << 24] {
        for n in [1, 2, 3, 9, 40, 97] {
            for seed in 0..6 {
                let points = random(n, seed, levels);
                assert_star(&points, brute_force(&points));
            }
        }
    }
}

#[test]
fn one_moved_point_changes_the_value() {
    let mut points = sobol(64);
    points[17] = [0.999, 0.001];
    let star = star_2d(&points).unwrap();
    assert!((star - 0.0537109375).abs() > 1e-6, "{star}");
}

#[test]
fn prefixes_are_the_discrepancies_of_the_first_points() {
    let points = halton(0, 64);
    let stars = star_2d_prefixes(&points, &[1, 64, 10]).unwrap();
    assert_eq!(stars[0], 1.0);
    assert_eq!(stars[1], star_2d(&points).unwrap());
    assert_eq!(stars[2], star_2d(&points[..10]).unwrap());
}

#[test]
fn bad_input_is_an_error_that_names_the_point() {
    assert_eq!(star_2d(&[]), Err(DiscrepancyError::Empty));
    for bad in [f64::NAN, -1e-9, 1.0 + 1e-9, f64::INFINITY] {
        let error = star_2d(&[[0.5, 0.5], [0.25, bad]]).unwrap_err();
        assert!(
            error.to_string().starts_with("point 1 is (0.25,"),
            "{error}"
        );
    }
    let error = star_2d_prefixes(&halton(0, 4), &[2, 5]).unwrap_err();
    assert!(error.to_string().contains("5 points"), "{error}");
    assert_eq!(
        star_2d_prefixes(&halton(0, 4), &[0]),
        Err(DiscrepancyError::Empty)
    );
}

#[test]
fn sixteen_thousand_points_take_a_fraction_of_a_second() {
    for (n, limit_s) in [(4096, 0.05), (16384, 0.6)] {
        let points = sobol(n);
        let clock = std::time::Instant::now();
        let star = star_2d(&points).unwrap();
        let seconds = clock.elapsed().as_secs_f64();
        println!("star_2d, {n} points: {star:.17}, {:.1} ms", seconds * 1e3);
        // Unoptimised and loaded machines are slower; a cubic algorithm would take minutes.
        assert!(seconds < 10.0 * limit_s, "{seconds} s for {n} points");
    }
}
