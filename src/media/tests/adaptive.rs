//! Photons by importance: against even ones where importance is the same everywhere, and by what has to hold of maps and
//! filters. Every run of `media:pipeline` holds them against f64 (src/media/measure/pipeline/checks.rs).

use super::pipeline::{LAMP, fog, medium, points};
use super::segments::adapter;
use crate::adaptive::{Adaptive, Filter, Pilots, Smoothing, importance};
use crate::photons::{Points, Warp};
use crate::pipeline::oracle::power_into;
use crate::pipeline::{Pipeline, camera};
use crate::scatter::{Adding, Strategy};
use glam::DVec3;
use raystone_core::params::Choice as _;

const EVEN: Adaptive = Adaptive {
    pilots: 16,
    cells: 8,
    edges: 0.0,
    shadows: 0.0,
    background: 1.0,
    most_density: 0.0,
    complement: 0.0,
    warp: Warp::Inversion,
    seed: 5,
};

#[test]
fn photons_by_a_constant_importance_are_those_of_the_reference() {
    let Some(gpu) = adapter() else { return };
    let volume = fog([16; 3]);
    let medium = medium(&volume, "level-map");
    let rays = camera(DVec3::new(0.6, 0.4, -1.6), DVec3::splat(0.5), 0.35, 8);
    let adding = Adding::new(Strategy::Fixed64, 0);
    let set = points(Points::Hammersley, 64, 0);
    let mut pipeline = Pipeline::new(&gpu, (&volume, &medium), adding, LAMP, set).unwrap();
    pipeline.set_view(&rays);
    let reference = pipeline.render().unwrap();
    assert_eq!(reference.passes, ["photons", "resolve", "gather"]);
    let grid = pipeline.radiance().unwrap();
    let largest = grid.as_flattened().iter().fold(0.0, |a: f32, b| a.max(*b));
    for warp in [Warp::Inversion, Warp::Hierarchical] {
        pipeline.set_adaptive(Some(Adaptive { warp, ..EVEN }));
        let adaptive = pipeline.render().unwrap();
        let passes = ["pilots", "resolve", "photons", "resolve", "gather"];
        assert_eq!(adaptive.passes, passes);
        let (_, _, map) = pipeline.pilots().unwrap();
        assert!((map.greatest() - 1.0).abs() < 1e-12);
        let found = pipeline.radiance().unwrap();
        for (even, found) in grid.as_flattened().iter().zip(found.as_flattened()) {
            assert!(
                (even - found).abs() <= 1e-6 * largest,
                "{even}, not {found}"
            );
        }
        for (even, found) in reference.image.iter().zip(&adaptive.image) {
            assert!(
                (*even - *found).abs().max_element() <= 1e-6,
                "{even}, not {found}"
            );
        }
    }
}

#[test]
fn photons_that_no_map_sends_elsewhere_carry_the_power_of_even_ones() {
    let Some(gpu) = adapter() else { return };
    let volume = fog([16; 3]);
    let medium = medium(&volume, "level-map");
    let adding = Adding::new(Strategy::Fixed64, 0);
    let set = points(Points::Hammersley, 64, 0);
    let mut pipeline = Pipeline::new(&gpu, (&volume, &medium), adding, LAMP, set).unwrap();
    pipeline.set_adaptive(Some(Adaptive {
        warp: Warp::None,
        edges: 0.3,
        background: 0.1,
        ..EVEN
    }));
    pipeline.render().unwrap();
    let (_, _, map) = pipeline.pilots().unwrap();
    assert!(map.greatest() > 2.0, "{}", map.greatest());
    let energies = pipeline.photons().iter().map(|p| p.energy.as_dvec3());
    let power: DVec3 = energies.sum();
    // The lamp's intensity times the solid angle of the box.
    let exact = power_into(&volume, &LAMP).unwrap();
    let off = (power / exact - 1.0).abs().max_element();
    assert!(off < 0.01, "{power}, not {exact}");
}

#[test]
fn a_filter_keeps_even_light_and_a_wider_one_spreads_a_voxel_further() {
    let Some(gpu) = adapter() else { return };
    // No side is another: voxels are counted along each.
    let volume = fog([16, 20, 12]);
    let medium = medium(&volume, "level-map");
    let adding = Adding::new(Strategy::Fixed64, 0);
    let set = points(Points::Hammersley, 128, 0);
    let mut pipeline = Pipeline::new(&gpu, (&volume, &medium), adding, LAMP, set).unwrap();
    let mut deviations = Vec::new();
    let mut totals = Vec::new();
    for level in 0..=3 {
        pipeline.set_smoothing(Smoothing {
            filter: Filter::Constant,
            level,
            ..Smoothing::default()
        });
        pipeline.render().unwrap();
        let grid = pipeline.gathered().unwrap();
        assert!(grid.iter().all(|(_, of)| *of == level));
        let red: Vec<f64> = grid.iter().map(|(sums, _)| f64::from(sums[0])).collect();
        let mean = red.iter().sum::<f64>() / red.len() as f64;
        let square = red.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
        deviations.push((square / red.len() as f64).sqrt());
        totals.push(mean);
    }
    for pair in deviations.windows(2) {
        assert!(pair[1] < pair[0], "{deviations:?}");
    }
    // Borders are repeated, so that energy is kept but for what is steep there.
    for total in &totals {
        assert!((total / totals[0] - 1.0).abs() < 0.1, "{totals:?}");
    }
}

/// Cells of pilots: one that is bright, fed from around a place of the map.
fn lit(at: [u32; 2], spread: u32) -> Vec<Pilots> {
    let mut cells = vec![Pilots::default(); 512];
    for cell in &mut cells {
        cell.count = 2;
        let ends = at.map(|c| [c - spread, c + spread]);
        cell.sum = ends.map(|[a, b]| a + b);
        cell.squares = ends.map(|[a, b]| a * a + b * b);
        cell.radiance = 1.0;
    }
    cells[100].radiance = 50.0;
    cells
}

#[test]
fn the_map_has_a_disc_where_selected_cells_got_their_photons_from() {
    let adaptive = Adaptive {
        edges: 6.0 / 512.0,
        ..EVEN
    };
    let place = |x: f64, y: f64| [(x + 0.5) / 16.0, (y + 0.5) / 16.0];
    // The six neighbours of the bright cell have the gradients.
    let map = importance(&adaptive, &lit([10, 4], 1)).unwrap();
    let middle = map.density(place(10.0, 4.0));
    assert!((map.greatest() - middle).abs() < 1e-9);
    assert!(
        middle > 2.5 && map.density(place(2.0, 12.0)) < 1.0,
        "{middle}"
    );
    // Symmetric around its middle, and wider for a wider spread.
    for (dx, dy) in [(1.0, 0.0), (2.0, 0.0), (3.0, 2.0)] {
        let [a, b] = [(dx, dy), (-dx, -dy)].map(|(dx, dy)| map.density(place(10.0 + dx, 4.0 + dy)));
        assert!((a - b).abs() < 1e-9, "{a} and {b}");
    }
    let wide = importance(&adaptive, &lit([10, 4], 3)).unwrap();
    assert!(wide.density(place(13.0, 4.0)) > 1.5 * map.density(place(13.0, 4.0)));
    // Half of the cells are in shadow, and got their photons from elsewhere.
    let mut cells = lit([3, 12], 1);
    for (cell, dark) in cells.iter_mut().zip(lit([12, 3], 1)).step_by(2) {
        *cell = Pilots {
            radiance: 0.1,
            ..dark
        };
    }
    let half = Adaptive {
        edges: 0.0,
        shadows: 0.5,
        ..EVEN
    };
    let map = importance(&half, &cells).unwrap();
    let [bright, dark] = [place(3.0, 12.0), place(12.0, 3.0)].map(|at| map.density(at));
    assert!(dark > 5.0 * bright, "{dark} and {bright}");
    // Cells in shadow are those with the least light, and a limit is one.
    let shadows = Adaptive {
        edges: 0.0,
        shadows: 1.0,
        ..EVEN
    };
    assert!(importance(&shadows, &lit([10, 4], 1)).unwrap().greatest() > 15.0);
    let limited = Adaptive {
        most_density: 4.0,
        ..shadows
    };
    let limited = importance(&limited, &lit([10, 4], 1)).unwrap().greatest();
    assert!((limited - 4.0).abs() < 0.01, "{limited}");
    // A map and what it leaves of four times as many even photons are those.
    let four = Adaptive {
        most_density: 4.0,
        ..adaptive
    };
    let left = Adaptive {
        complement: 4.0,
        ..four
    };
    let [four, left] = [four, left].map(|one| importance(&one, &lit([10, 4], 1)).unwrap());
    for at in [place(10.0, 4.0), place(11.0, 5.0), place(2.0, 12.0)] {
        let sum = four.density(at) + 3.0 * left.density(at);
        assert!((sum - 4.0).abs() < 0.01, "{sum}");
    }
    let nothing = Adaptive {
        complement: 0.5,
        ..EVEN
    };
    let why = importance(&nothing, &lit([5, 5], 1)).unwrap_err();
    assert!(why.contains("leaves no photons anywhere"), "{why}");
    let odd = Adaptive { pilots: 12, ..EVEN };
    assert!(
        importance(&odd, &lit([5, 5], 1))
            .unwrap_err()
            .contains("power of two")
    );
}

#[test]
fn filters_that_count_are_those_whose_rule_reads_counts() {
    let counting: Vec<&str> = Filter::ALL
        .iter()
        .filter(|filter| filter.counts())
        .map(|filter| filter.name())
        .collect();
    assert_eq!(counting, ["count", "weight", "both"]);
}
