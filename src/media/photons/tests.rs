use super::*;
use raystone_core::params::Choice;

const PHOTONS: u32 = 512;
const CELLS: u32 = 128;

fn set(points: Points) -> Vec<[f64; 2]> {
    point_set(points, PHOTONS, 1).unwrap()
}

#[test]
fn numbers_of_photons_in_cells_vary_as_an_independent_program_found() {
    let turns = [
        (0.0, 1.0),
        (0.0, 0.93),
        (0.11, 1.0),
        (0.3, 0.93),
        (0.6, 1.07),
    ];
    // Means of that program, whose random sets are others than these.
    let known = [
        (Points::Random, [0.25, 0.23, 0.25, 0.23, 0.26], 0.012),
        (Points::Grid, [0.00, 0.15, 0.03, 0.05, 0.05], 0.021),
        (Points::Jitter, [0.00, 0.09, 0.10, 0.09, 0.11], 0.012),
        (Points::Halton, [0.06, 0.07, 0.09, 0.09, 0.11], 0.012),
        (Points::Hammersley, [0.00, 0.04, 0.04, 0.07, 0.09], 0.021),
    ];
    for (points, expected, slack) in known {
        let found = turns.map(|(turn, scale)| cell_deviation(&set(points), CELLS, turn, scale));
        println!("{points:?}: {found:.3?}");
        for (found, expected) in found.iter().zip(expected) {
            assert!(
                (found - expected).abs() < slack,
                "{points:?}: {found:.3}, not {expected}"
            );
        }
    }
}

#[test]
fn collisions_and_segments_are_those_of_the_model() {
    let windows = [32, 128, 512, 2048, 8192];
    let known = [
        (Points::Grid, [0.75, 0.75, 0.75, 0.94, 0.94], 1.0),
        (Points::Jitter, [0.75, 0.75, 0.75, 0.94, 0.94], 1.0),
        (Points::Hammersley, [0.0, 0.0, 0.75, 0.94, 0.94], 32.0),
        (
            Points::HammersleyTransposed,
            [0.0, 0.0, 0.75, 0.94, 0.94],
            8.0,
        ),
        (Points::Halton, [0.0, 0.0, 0.0, 0.0, 0.06], 32.0),
        (Points::Random, [0.001, 0.004, 0.015, 0.06, 0.21], 31.5),
    ];
    for (points, expected, segments) in known {
        let list = set(points);
        let found = windows.map(|window| collisions(&list, CELLS, window));
        let of_32 = segments_of_32(&list, CELLS);
        println!("{points:?}: {found:.3?}, {of_32:.2}");
        for (found, expected) in found.iter().zip(expected) {
            assert!(
                (found - expected).abs() < 0.012,
                "{points:?}: {found}, not {expected}"
            );
        }
        assert!(
            (of_32 - segments).abs() < 0.2,
            "{points:?}: {of_32}, not {segments}"
        );
    }
}

#[test]
fn orders_keep_the_set_and_neighbours_on_a_curve_are_neighbours() {
    let list = point_set(Points::Jitter, 32, 3).unwrap();
    let sorted = |mut list: Vec<[f64; 2]>| {
        list.sort_by(|a, b| a.partial_cmp(b).unwrap());
        list
    };
    for order in Order::ALL {
        let found = ordered(list.clone(), *order, 32, 5);
        assert_eq!(sorted(found.clone()), sorted(list.clone()), "{order:?}");
        assert_eq!(
            *order == Order::Natural || *order == Order::Row,
            found == list,
            "{order:?}"
        );
        if *order == Order::Hilbert {
            let cell = |p: &[f64; 2]| p.map(|c| (c * 32.0) as i32);
            for pair in found.windows(2) {
                let ([a, b], [c, d]) = (cell(&pair[0]), cell(&pair[1]));
                assert_eq!((a - c).abs() + (b - d).abs(), 1, "{pair:?}");
            }
        }
    }
    // A column of a grid is written to more segments than a row, and collides as often.
    let grid = set(Points::Grid);
    let column = ordered(grid.clone(), Order::Column, CELLS, 0);
    assert!(segments_of_32(&column, CELLS) > segments_of_32(&grid, CELLS));
    // Reversed bits take collisions apart.
    let reversed = ordered(grid, Order::BitReversed, CELLS, 0);
    assert!(collisions(&reversed, CELLS, 32) < 0.01);
}

#[test]
fn warps_follow_their_map_and_keep_different_parts_of_the_order_of_points() {
    let side = 16;
    let value =
        |i: usize| 0.2 + ((i % side) as f64 * 0.37).sin().abs() + 2.0 * f64::from(i / side == 5);
    let map = ImportanceMap::new((0..side * side).map(value).collect()).unwrap();
    let points = set(Points::Hammersley);
    let mut deviations = Vec::new();
    for warp in [Warp::Inversion, Warp::Alias, Warp::Hierarchical] {
        let warped: Vec<[f64; 2]> = points.iter().map(|p| map.warped(warp, *p)).collect();
        assert!(
            warped.as_flattened().iter().all(|c| (0.0..1.0).contains(c)),
            "{warp:?}"
        );
        let deviation = density_deviation(&warped, side as u32, |at| map.density(at));
        println!("{warp:?}: {deviation:.5}");
        assert!(deviation < 0.02, "{warp:?}: {deviation}");
        deviations.push(deviation);
    }
    // Random points would vary by 1/√1024 = 0.03 in a cell of mean density.
    assert!(deviations.iter().all(|d| *d < 0.02));
    for wrong in [vec![1.0; 15], vec![1.0, 1.0, 0.0, 1.0], vec![1.0; 9]] {
        assert!(ImportanceMap::new(wrong).is_err());
    }
    assert_eq!(map.sent(Warp::None, [0.3, 0.4]), ([0.3, 0.4], 1.0));
}

#[test]
fn parts_of_the_square_that_points_stand_for_make_up_all_of_it_whatever_sends_them() {
    let side = 16;
    let value = |i: usize| 0.1 + 5.0 * f64::from(u8::from(i % side < 5 && i / side > 8));
    let map = ImportanceMap::new((0..side * side).map(value).collect()).unwrap();
    let points = set(Points::Hammersley);
    for warp in [Warp::None, Warp::Inversion, Warp::Alias, Warp::Hierarchical] {
        // Each stands for 1 / (M density) of the square, whose area is 1.
        let parts = points.iter().map(|point| 1.0 / map.sent(warp, *point).1);
        let area = parts.sum::<f64>() / points.len() as f64;
        assert!((area - 1.0).abs() < 5e-3, "{warp:?}: {area}");
    }
}
