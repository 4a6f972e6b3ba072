//! Star and extreme discrepancy: known values, brute force, ties, borders.

use super::sets::*;
use super::sweep::sweep;
use crate::support::cpu;
use raystone::discrepancy::{
    DiscrepancyError, PointSet, extreme_2d, star, star_2d, star_2d_prefixes,
};
use raystone::random::Pcg32;

#[track_caller]
fn assert_close(value: f64, expected: f64) {
    assert!(
        (value - expected).abs() <= 2e-15,
        "{value} is not {expected}"
    );
}

#[track_caller]
fn exact(points: &PointSet) -> f64 {
    star(points, &ample()).value().expect("an exact value")
}

#[test]
fn known_sets_in_the_plane_have_their_published_discrepancy() {
    for (points, expected) in [
        (sobol(64), 0.0537109375),
        (sobol(1024), 0.004299163818359375),
        (sobol(4096), 0.001_329_183_578_491_211),
        (sobol(16384), 0.000_372_990_965_843_200_7),
        (halton(0, 1024), 0.0068359375),
        (halton(0, 4096), 0.001_863_483_974_908_542),
        (halton(0, 16384), 0.000_605_030_405_759_432_5),
        (hammersley(64), 0.0537109375),
    ] {
        assert_close(star_2d(&points).unwrap(), expected);
    }
    // Tabulated to about ten digits only.
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
fn known_sets_in_space_have_their_published_discrepancy() {
    for (points, expected) in [
        (sobol_in(3, 256), 0.025443077087402344),
        (sobol_in(3, 1024), 0.008_433_170_616_626_74),
        (sobol_in(3, 4096), 0.002_476_612_105_965_614_3),
        (halton_in(3, 0, 256), 0.03268749999999998),
        (halton_in(3, 0, 1024), 0.013474556327160547),
        (halton_in(3, 0, 4096), 0.00379824567043896),
    ] {
        assert_close(exact(&points), expected);
    }
}

#[test]
fn the_example_of_six_points_agrees_with_its_published_value() {
    let raw = [[1, 3], [2, 6], [3, 2], [4, 5], [5, 1], [6, 4]];
    let points = raw.map(|p| p.map(|c| (f64::from(c) - 0.5) / 6.0));
    assert_close(star_2d(&points).unwrap(), 0.229_166_666_666_666_69);
}

#[test]
fn sets_small_enough_to_know_by_hand() {
    for dim in 1..=8 {
        let power = |c: f64| c.powi(dim as i32);
        let of = |coordinates: Vec<f64>| exact(&PointSet::new(dim, coordinates).unwrap());
        assert_close(of(vec![0.0; dim]), 1.0);
        assert_close(of(vec![1.0; dim]), 1.0);
        // The closed box up to the middle holds all; the open one without it is half the cube.
        assert_close(of(vec![0.5; dim * 7]), (1.0 - power(0.5)).max(0.5));
    }
    // A point on the right border is in no open box: too few points left of it, up to area 1.
    assert_close(star_2d(&[[1.0, 0.0]]).unwrap(), 1.0);
}

#[test]
fn small_random_sets_agree_with_the_definition_in_every_dimension() {
    // Points: few enough for the definition, and for cells both solved at once and cut.
    for (dim, most) in [
        (1, 40),
        (2, 24),
        (3, 14),
        (4, 9),
        (5, 7),
        (6, 5),
        (7, 4),
        (8, 4),
    ] {
        let mut random = Pcg32::new(dim as u64);
        for round in 0..1000 {
            let n = 1 + random.below(most);
            let points = random_in(dim, n, [1, 2, 3, 7, 1 << 24][round % 5], &mut random);
            let (found, expected) = (exact(&points), star_by_definition(&points));
            let fits = (found - expected).abs() <= 2e-15;
            assert!(fits, "{found} is not {expected}: {points:?}");
        }
    }
}

#[test]
fn larger_sets_agree_with_the_definition() {
    let mut random = Pcg32::new(77);
    for (dim, n) in [(3, 70), (3, 61), (4, 24), (5, 13), (6, 9)] {
        for levels in [5, 40, 1 << 24] {
            let points = random_in(dim, n, levels, &mut random);
            assert_close(exact(&points), star_by_definition(&points));
        }
    }
}

#[test]
fn the_tournament_agrees_with_the_quadratic_sweep() {
    let mut random = Pcg32::new(5);
    for n in [1, 2, 3, 50, 257, 1000, 3000] {
        for levels in [1, 3, 60, 1 << 24] {
            let points = random_in(2, n, levels, &mut random);
            assert_close(exact(&points), sweep(&pairs(&points)));
        }
    }
    for points in [sobol(8192), halton(1, 5000), hammersley(5000)] {
        assert_close(star_2d(&points).unwrap(), sweep(&points));
    }
}

#[test]
fn a_plane_in_space_has_the_discrepancy_of_the_plane() {
    // Boxes with too few points lose nothing by extending through; those with too many end at 1.
    let flat = sobol(512);
    let lift = |p: &[f64; 2], z: f64| [p[0], p[1], z];
    let all: Vec<[f64; 3]> = flat.iter().map(|p| lift(p, 0.0)).collect();
    // At height 0 all points lie in boxes of zero volume.
    assert_close(exact(&PointSet::from_points(&all).unwrap()), 1.0);
    let even: Vec<[f64; 3]> = (0..8)
        .flat_map(|k| flat.iter().map(move |p| lift(p, f64::from(k) / 8.0)))
        .collect();
    let value = exact(&PointSet::from_points(&even).unwrap());
    assert!(
        value >= star_2d(&flat).unwrap() && value <= 0.125 + 0.02,
        "{value}"
    );
}

#[test]
fn one_moved_point_changes_the_value() {
    let mut points = sobol(64);
    points[17] = [0.999, 0.001];
    let star = star_2d(&points).unwrap();
    assert!((star - 0.0537109375).abs() > 1e-6, "{star}");
}

#[test]
fn the_discrepancy_has_the_limits_that_theory_sets() {
    let mut random = Pcg32::new(9);
    for round in 0..60 {
        let dim = 1 + round % 5;
        let n = 1 + random.below(60);
        let points = random_in(dim, n, 1 << 30, &mut random);
        let value = exact(&points);
        assert!(value >= 0.5 / n as f64 && value <= 1.0, "{value} {n}");
        let mut with_origin: Vec<f64> = points.points().flatten().copied().collect();
        with_origin[..dim].fill(0.0);
        let value = exact(&PointSet::new(dim, with_origin).unwrap());
        assert!(value >= 1.0 / n as f64 - 1e-16, "{value} {n}");
    }
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
    let ragged = PointSet::new(3, vec![0.5; 4]).unwrap_err();
    assert!(ragged.to_string().contains("4 coordinates"), "{ragged}");
}

#[test]
fn the_extreme_discrepancy_agrees_with_the_definition() {
    let mut random = Pcg32::new(21);
    for round in 0..1000 {
        let n = 1 + random.below(9);
        let points = random_in(2, n, [1, 3, 8, 1 << 24][round % 4], &mut random);
        let found = extreme_2d(&points, &ample()).unwrap();
        assert_close(found, extreme_by_definition(&pairs(&points)));
        // Between D* and 4 D* (Niederreiter 1992, proposition 2.4).
        let star = exact(&points);
        assert!(found >= star - 1e-15 && found <= 4.0 * star + 1e-15);
    }
}

#[test]
fn the_cost_of_many_points_grows_hardly_faster_than_their_number() {
    /// For sixteen times as many points: 21 times the work if N log N, 256 times if N².
    const MOST_GROWTH: f64 = 90.0;
    let growth = |few: u32, cost: fn(&[[f64; 2]]) -> f64| {
        let [few, many] = [few, 16 * few].map(|n| {
            let points = sobol(n);
            let seconds = cpu::seconds(|| cost(&points));
            println!("{n} points: {:.1} ms", seconds * 1e3);
            seconds
        });
        many / few
    };
    let found = growth(8192, |points| star_2d(points).unwrap());
    assert!(found < MOST_GROWTH, "{found} times the work");
    // Every pair of points is visited.
    let pairs = |points: &[[f64; 2]]| {
        let below = |p: &[f64; 2]| {
            points
                .iter()
                .filter(|q| q[0] <= p[0] && q[1] <= p[1])
                .count()
        };
        points.iter().map(below).sum::<usize>() as f64
    };
    let quadratic = growth(1024, pairs);
    assert!(quadratic > MOST_GROWTH, "{quadratic} times the work");
}
