//! Grids against brute force, bit by bit, on rays that are hard for grids: along planes, edges and
//! corners of cells, next to the grid, with −0 components, from outside and from its border, with
//! hits beyond the cell that lists them, and in scenes far from the origin. Kernels with planted
//! faults must fail on the same rays.

mod faults;

use crate::support;
use crate::support::scenes::{self, FAR};
use crate::support::{
    Pcg, assert_same_hits, brute_force, build, default_params, param_variants, trace,
};
use glam::Vec3;
use raystone::accel::{
    AccelError, AccelKind, AccelRegistry, BuildLog, BuiltAccel, Counters, Hit, NO_HIT, Ray,
    TriangleSoup,
};
use raystone::params::{ParamValue, Params};

/// The grids; every name is registered.
fn grids() -> Vec<&'static dyn AccelKind> {
    let registry = AccelRegistry::default();
    let grids: Vec<_> = registry
        .iter()
        .filter(|k| k.name().ends_with("-grid"))
        .collect();
    for name in ["uniform-grid", "two-level-grid", "irregular-grid"] {
        assert!(grids.iter().any(|k| k.name() == name), "no {name}");
    }
    grids
}

fn grid(name: &str) -> &'static dyn AccelKind {
    AccelRegistry::default().get(name).expect("a known grid")
}

fn with(kind: &dyn AccelKind, changes: &[(&str, ParamValue)]) -> Params {
    let mut params = default_params(&kind.parameters());
    for (name, value) in changes {
        *params.0.get_mut(*name).expect("a parameter") = value.clone();
    }
    params
}

/// Cell planes of a built grid: low corner, cell size and number of cells along an axis.
fn lattice(built: &dyn BuiltAccel, axis: usize) -> (f32, f32, u32) {
    let buffers = built.buffers();
    let uniform = buffers.uniforms.iter().find(|(name, _)| *name == "grid");
    let (_, values) = uniform.expect("the uniform of a grid");
    let word = |name| values.words(name).expect("a member")[axis];
    let float = |name| f32::from_bits(word(name));
    (float("low"), float("cell"), word("resolution"))
}

/// Rays that start on cell planes of one, two or three axes, and run along axes, cell diagonals and
/// planes; a third starts on the border of the grid or before it.
fn cell_rays(rng: &mut Pcg, built: &dyn BuiltAccel, count: usize) -> Vec<Ray> {
    let ray = |index: usize| {
        let planes = 1 + rng.below(3);
        let mut origin = [0.0; 3];
        let mut direction = [0.0; 3];
        for axis in 0..3 {
            let (low, cell, cells) = lattice(built, axis);
            // Coarse planes as often as fine ones.
            let stride = 1 << rng.below(1 + cells.ilog2());
            let number = match index % 3 {
                0 => [0, cells][rng.below(2) as usize],
                _ => rng.below(cells / stride + 1) * stride,
            };
            origin[axis] = low + number as f32 * cell;
            if axis as u32 >= planes {
                origin[axis] += cell * rng.unit();
            }
            direction[axis] = match rng.below(5) {
                0 => 0.0,
                1 => -0.0,
                2 => cell,
                3 => -cell,
                _ => cell * rng.signed() * 3.0,
            };
        }
        if index.is_multiple_of(6) {
            let back = 0.5 + 3.0 * rng.unit();
            let (_, cell, cells) = lattice(built, 0);
            let far = back * cell * cells as f32;
            let length = Vec3::from(direction).length().max(1e-30);
            origin = std::array::from_fn(|a| origin[a] - far * direction[a] / length);
        }
        let axis = rng.below(3) as usize;
        if direction == [0.0; 3] {
            direction[axis] = 1.0;
        }
        origin.rotate_left(axis);
        direction.rotate_left(axis);
        origin.rotate_right(axis);
        direction.rotate_right(axis);
        Ray {
            origin,
            t_min: 0.0,
            direction,
            t_max: FAR,
        }
    };
    (0..).map(ray).filter(Ray::is_ray).take(count).collect()
}

/// Rays parallel to the faces of the grid, on them, and one step or slightly beside them.
fn rays_beside(rng: &mut Pcg, built: &dyn BuiltAccel, count: usize) -> Vec<Ray> {
    let ray = |_| {
        let across = rng.below(3) as usize;
        let mut origin = [0.0; 3];
        let mut direction = [0.0_f32; 3].map(|z| if rng.below(2) == 0 { z } else { -z });
        for axis in 0..3 {
            let (low, cell, cells) = lattice(built, axis);
            let high = low + cells as f32 * cell;
            if axis == across {
                let face = [low, high][rng.below(2) as usize];
                origin[axis] = match rng.below(4) {
                    0 => face,
                    1 => face.next_down(),
                    2 => face.next_up(),
                    _ => face + 0.01 * cell * rng.signed(),
                };
            } else {
                origin[axis] = low + (high - low) * (3.0 * rng.unit() - 1.0);
                direction[axis] = cell * [1.0, -1.0, 0.37, 0.0][rng.below(4) as usize];
            }
        }
        Ray {
            origin,
            t_min: 0.0,
            direction,
            t_max: FAR,
        }
    };
    (0..).map(ray).filter(Ray::is_ray).take(count).collect()
}

/// All directions of −1, −0, +0 and +1 from points of the scene's box.
fn signed_axis_rays(rng: &mut Pcg, soup: &TriangleSoup) -> Vec<Ray> {
    let bounds = scenes::box_of(soup);
    let choices = [-1.0, -0.0, 0.0, 1.0];
    let directions = (0..64).map(|i| [choices[i & 3], choices[i >> 2 & 3], choices[i >> 4]]);
    let ray = |direction: [f32; 3]| {
        let origin = std::array::from_fn(|a| {
            let [low, high] = [bounds.min[a], bounds.max[a]];
            [
                low,
                high,
                0.5 * (low + high),
                low + (high - low) * rng.unit(),
            ][rng.below(4) as usize]
        });
        Ray {
            origin,
            t_min: 0.0,
            direction,
            t_max: FAR,
        }
    };
    let rays = directions.cycle().map(ray).filter(Ray::is_ray);
    rays.take(640).collect()
}

/// A scene where a cell's first triangle is hit far beyond the cell: long ones, slanted through many cells, in front
/// of and behind small ones.
fn slanted(rng: &mut Pcg, count: usize) -> TriangleSoup {
    let point =
        |rng: &mut Pcg, size: f32| size * Vec3::new(rng.signed(), rng.signed(), rng.signed());
    let triangle = |i: usize| {
        let corner = point(rng, 10.0);
        let size = if i.is_multiple_of(3) { 15.0 } else { 1.0 };
        [corner, corner + point(rng, size), corner + point(rng, size)]
    };
    scenes::soup((0..count).map(triangle))
}

fn moved(soup: &TriangleSoup, scale: f32, shift: Vec3) -> TriangleSoup {
    let corners = soup.records.iter().map(|r| r.triangle().vertices);
    scenes::soup(corners.map(|c| c.map(|v| v * scale + shift)))
}

fn cases(rng: &mut Pcg) -> Vec<(&'static str, TriangleSoup)> {
    let base = slanted(rng, 400);
    let mut cases = vec![
        ("lattice", scenes::lattice_soup(rng, 300, 8)),
        ("huge", moved(&base, 1e6, Vec3::ZERO)),
        ("tiny", moved(&base, 1e-6, Vec3::ZERO)),
        ("far", moved(&base, 1.0, Vec3::new(1e5, -3e4, 2e5))),
        ("flat and far", {
            let flat = scenes::lattice_soup(rng, 200, 9);
            let corners = flat.records.iter().map(|r| r.triangle().vertices);
            scenes::soup(corners.map(|c| c.map(|v| Vec3::new(v.x, 7.0, v.z + 1e4))))
        }),
    ];
    cases.insert(0, ("slanted", base));
    cases
}

/// All rays for a scene in a grid, also truncated at some of their hits.
fn hard_rays(rng: &mut Pcg, soup: &TriangleSoup, built: &dyn BuiltAccel, count: usize) -> Vec<Ray> {
    let mut rays = cell_rays(rng, built, count);
    rays.extend(rays_beside(rng, built, count / 2));
    rays.extend(signed_axis_rays(rng, soup));
    rays.extend(scenes::aimed_rays(rng, soup, count));
    let hits = brute_force(soup, &rays);
    let some = rays.len() / 4;
    rays.extend(scenes::cut_at_hits(&rays[..some], &hits[..some]));
    rays
}

#[test]
fn twins_answer_the_rays_at_which_grids_went_wrong() {
    let mut rng = Pcg::new(2011);
    let mut hit = 0;
    for (name, soup) in cases(&mut rng) {
        for kind in grids() {
            for params in param_variants(&kind.parameters()) {
                let built = build(kind, &soup, &params);
                let rays = hard_rays(&mut rng, &soup, &*built, 600);
                let expected = brute_force(&soup, &rays);
                hit += expected.iter().filter(|h| h.triangle != NO_HIT).count();
                let twin = built.cpu_twin(&soup).expect("grids have twins");
                let mut work = Counters::default();
                let closest = |r| twin.closest_hit(r, &mut work);
                let found: Vec<Hit> = rays.iter().map(closest).collect();
                let what = format!("{name}: {} {params:?}", kind.name());
                assert_same_hits(&what, &rays, &expected, &found);
            }
        }
    }
    assert!(hit > 20_000, "only {hit} rays hit anything");
}

#[test]
fn kernels_answer_the_rays_at_which_grids_went_wrong_and_count_like_their_twins() {
    let gpu = support::gpu();
    if !support::is_exact(gpu) {
        return;
    }
    let mut rng = Pcg::new(2017);
    for (name, soup) in cases(&mut rng) {
        for kind in grids() {
            for params in kernel_variants(kind) {
                let built = build(kind, &soup, &params);
                let rays = hard_rays(&mut rng, &soup, &*built, 2000);
                let expected = brute_force(&soup, &rays);
                let what = format!("{name}: kernel of {} {params:?}", kind.name());
                let run = |features: &[&str]| trace(gpu, &*built, &soup, &rays, features);
                assert_same_hits(&what, &rays, &expected, &run(&[]).hits);
                let blocked: Vec<bool> = expected.iter().map(|h| h.triangle != NO_HIT).collect();
                assert_eq!(run(&["any"]).found(), blocked, "{what}: any hit");
                let counted = run(&["counters"]);
                let twin = built.cpu_twin(&soup).expect("grids have twins");
                for (ray, found) in rays.iter().zip(&counted.work) {
                    let mut work = Counters::default();
                    twin.closest_hit(ray, &mut work);
                    assert_eq!(*found, work, "{what}: work of {ray:?}");
                }
            }
        }
    }
}

/// Parameters that select another kernel, besides the defaults.
fn kernel_variants(kind: &dyn AccelKind) -> Vec<Params> {
    let mut variants = vec![default_params(&kind.parameters())];
    if kind.name() == "uniform-grid" {
        let skip = ParamValue::Name("chebyshev".into());
        variants.push(with(kind, &[("skip", skip)]));
    }
    variants
}

/// Number of cells visited by all rays.
fn visits(kind: &dyn AccelKind, params: &Params, soup: &TriangleSoup, rays: &[Ray]) -> u32 {
    let built = build(kind, soup, params);
    let twin = built.cpu_twin(soup).expect("grids have twins");
    let mut work = Counters::default();
    rays.iter().for_each(|ray| {
        twin.closest_hit(ray, &mut work);
    });
    work.nodes
}

#[test]
fn skipping_merging_and_expanding_save_visits() {
    let mut rng = Pcg::new(9);
    let case = scenes::degenerate_cases()
        .into_iter()
        .find(|c| c.name == "a sphere of crumbs");
    let soup = case.expect("a case of that name").soup;
    let rays = scenes::aimed_rays(&mut rng, &soup, 500);
    let count = |name: &str, changes: &[(&str, ParamValue)]| {
        let kind = grid(name);
        visits(kind, &with(kind, changes), &soup, &rays)
    };
    let lambda = ("lambda", ParamValue::Number(300.0));
    let walked = count("uniform-grid", std::slice::from_ref(&lambda));
    let skip = ("skip", ParamValue::Name("chebyshev".into()));
    let skipped = count("uniform-grid", &[lambda, skip]);
    assert!(
        2 * skipped < walked,
        "{walked} cells, {skipped} with skipping"
    );

    let none = ("expansions", ParamValue::Integer(0));
    let cut = count(
        "irregular-grid",
        &[("alpha", ParamValue::Number(0.0)), none.clone()],
    );
    let merged = count("irregular-grid", &[none]);
    let expanded = count("irregular-grid", &[]);
    assert!(merged < cut, "{cut} cells, {merged} after merging");
    assert!(
        expanded < merged,
        "{merged} cells, {expanded} after expansion"
    );
}

#[test]
fn a_grid_over_its_cap_says_so_with_both_numbers() {
    let mut rng = Pcg::new(12);
    let crumbs = |rng: &mut Pcg, count: usize| {
        scenes::soup((0..count).map(|_| {
            let at = Vec3::new(rng.unit(), rng.unit(), rng.unit());
            [at, at + 1e-4 * Vec3::X, at + 1e-4 * Vec3::Y]
        }))
    };
    let many = crumbs(&mut rng, 100_000);
    // A thousand triangles whose boxes are the whole box.
    let across = scenes::soup((0..1000).map(|i| {
        let x = i as f32 * 1e-3;
        [Vec3::ZERO, Vec3::new(1.0, x, 1.0), Vec3::new(x, 1.0, 1.0)]
    }));
    let number = |x: f64| ParamValue::Number(x);
    type Changes = Vec<(&'static str, ParamValue)>;
    let cases: [(&str, &str, &TriangleSoup, Changes); 4] = [
        (
            "uniform-grid",
            "cells",
            &many,
            vec![("lambda", number(1000.0))],
        ),
        (
            "uniform-grid",
            "references",
            &across,
            vec![
                ("lambda", number(1000.0)),
                ("exact_overlap", ParamValue::Flag(false)),
            ],
        ),
        (
            "two-level-grid",
            "cells",
            &many,
            vec![("lambda2", number(1000.0))],
        ),
        (
            "irregular-grid",
            "voxels",
            &many,
            vec![("lambda2", number(100.0))],
        ),
    ];
    for (name, what, soup, changes) in cases {
        let kind = grid(name);
        let params = with(kind, &changes);
        match kind.build(soup, &params, &mut BuildLog::default()) {
            Err(AccelError::Limit {
                what: said,
                needed,
                limit,
                remedy,
            }) => {
                assert!(remedy.contains("lambda"), "{name}: {remedy}");
                assert!(said.contains(what), "{name}: {said}");
                assert!(
                    needed > limit && limit == (1 << 25) - 1,
                    "{needed} of {limit}"
                );
                println!("{name}: {said}: {needed} of {limit}");
            }
            Err(other) => panic!("{name}: {other}"),
            Ok(_) => panic!("{name}: {what} are not capped"),
        }
    }
}

#[test]
fn a_grid_may_have_what_the_adapter_binds() {
    let soup = slanted(&mut Pcg::new(34), 2000);
    for kind in grids() {
        let params = default_params(&kind.parameters());
        let with = |bytes: u64| {
            let mut log = BuildLog::default().binding(bytes);
            kind.build(&soup, &params, &mut log)
        };
        let built = with(1 << 33).expect("more than every adapter binds");
        let arrays = built.buffers().arrays;
        let largest = arrays.iter().map(|array| array.words.len() as u64 * 4);
        let largest = largest.max().expect("an array");
        match with(largest / 2) {
            Err(AccelError::Limit { needed, limit, .. }) => {
                assert!(needed > limit && limit < largest / 8);
            }
            other => panic!("{}: {:?}", kind.name(), other.err()),
        }
        assert!(with(64 * largest).is_ok(), "{}", kind.name());
    }
}

#[test]
fn every_grid_tells_its_phases_and_counts_add_up() {
    let mut rng = Pcg::new(33);
    let soup = slanted(&mut rng, 2000);
    for kind in grids() {
        let mut log = BuildLog::default();
        let built = kind
            .build(&soup, &default_params(&kind.parameters()), &mut log)
            .expect("a small scene");
        let names: Vec<&str> = log.phases.iter().map(|p| p.name.as_str()).collect();
        let stats = built.stats();
        assert!(names.contains(&"insert"), "{}: {names:?}", kind.name());
        if kind.name() == "irregular-grid" {
            assert_eq!(names[3..], ["build", "merge", "expand", "compress"]);
        }
        let listed: u64 = stats.leaf_histogram[1..].iter().sum();
        assert_eq!(listed, stats.leaves, "{}", kind.name());
        assert!(stats.references >= stats.leaves && stats.nodes > stats.leaves);
        assert_eq!(stats.bytes, built.buffers().bytes());
    }
}
