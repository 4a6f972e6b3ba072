//! Maps of bounces and of modelled cycles: against the path oracle, the counters of rays, and what is known in closed form.

use super::{finish, screen, show, viewer};
use crate::support;
use raystone::config::{Axis, Follow, Map};
use raystone::image::viridis;
use raystone::integrator::CountedRays;
use raystone::measure::path_oracle::{Estimator as Rules, PathId, PathOracle, Rounding, View};
use raystone::run::{Estimator, Registries};
use raystone_viewer::{Frame, Screen};

/// Upper end of the scale: every colour belongs to one mean of five samples.
const SCALE: f32 = 10.0;

fn mapped(map: Map, overrides: &[&str]) -> (Frame, Screen) {
    let mut viewer = viewer();
    let mut now = screen(overrides);
    (now.window.map, now.window.scale) = (map, SCALE);
    show(&mut viewer, now.clone());
    finish(&mut viewer);
    (viewer.frame(), now)
}

fn mean(frame: &Frame, side: usize) -> f64 {
    let side = &frame.sides[side];
    assert_eq!(side.fault, None);
    side.figures.map_mean.unwrap()
}

/// Bounces of a pixel's samples by the path oracle, their mean.
fn by_the_oracle(screen: &Screen) -> Vec<f32> {
    let (registries, cell) = (Registries::default(), &screen.cells[0]);
    let scene = support::builtin(&cell[Axis::Scene].name, &[]);
    let oracle = PathOracle::knowing(&scene, &registries.kinds).unwrap();
    let estimator = Estimator::of(&registries, cell, screen.spp, screen.size[0]).unwrap();
    let view = View {
        estimator: Rules::of(&estimator.integrator).unwrap(),
        camera: scene.view(screen.aspect()),
        size: screen.size,
        sampler: &estimator.sampler,
    };
    let [width, height] = screen.size;
    let bounces = |pixel: u32| {
        let samples = (0..screen.spp).map(|sample| {
            let id = PathId {
                pixel: [pixel % width, pixel / width],
                sample,
                seed: screen.seed,
            };
            let path = oracle.trace(&view, id, Rounding::none());
            let bounced = path
                .rays
                .iter()
                .filter(|ray| ray.class == CountedRays::Bounce);
            bounced.count() as f32
        });
        samples.sum::<f32>() / screen.spp as f32
    };
    (0..width * height).map(bounces).collect()
}

#[test]
fn the_map_of_bounces_is_that_of_the_path_oracle_pixel_by_pixel() {
    let (frame, now) = mapped(Map::Bounces, &[]);
    let picture = frame.sides[0].picture.as_ref().unwrap();
    let expected = by_the_oracle(&now);
    let differing = |expected: &[f32]| {
        let colors = expected.iter().map(|mean| viridis(mean / SCALE));
        colors.zip(&picture.pixels).filter(|(a, b)| a != *b).count()
    };
    // Where light grazes, a path goes another way.
    let most = picture.pixels.len() / 100;
    assert!(differing(&expected) <= most, "{}", differing(&expected));
    // The comparison can fail: one bounce more or less.
    let other: Vec<f32> = expected.iter().map(|mean| mean + 0.2).collect();
    assert!(differing(&other) > picture.pixels.len() / 2);
}

#[test]
fn the_mean_of_bounces_is_that_of_the_counters_whatever_organises_the_paths() {
    let set = ["axes.organisation=[\"single-kernel\", \"wavefront\"]"];
    let (frame, now) = mapped(Map::Bounces, &set);
    assert_eq!(now.cells.len(), 2);
    for (side, of) in frame.sides.iter().enumerate() {
        let rays = of.figures.rays.iter().find(|rays| rays.class == "bounce");
        let counted = rays.unwrap().per_sample;
        let found = mean(&frame, side);
        assert!((found / counted - 1.0).abs() < 1e-6, "{found} {counted}");
    }
}

#[test]
fn bounces_are_known_in_a_closed_room_and_where_nothing_bounces() {
    let room = ["axes.scene=furnace-box", "integrator.path.max_depth=3"];
    let (frame, _) = mapped(
        Map::Bounces,
        &[&room[..], &["integrator.path.roulette=none"]].concat(),
    );
    assert_eq!(mean(&frame, 0), 3.0);
    let picture = frame.sides[0].picture.as_ref().unwrap();
    assert!(
        picture
            .pixels
            .iter()
            .all(|color| *color == viridis(3.0 / SCALE))
    );
    let (frame, _) = mapped(Map::Bounces, &["axes.integrator=primary"]);
    assert_eq!(mean(&frame, 0), 0.0);
    // A structure that answers buffers of rays alone cannot be called by the kernel that counts.
    let set = [
        "axes.accel=divide-and-conquer",
        "axes.organisation=wavefront",
    ];
    let (frame, _) = mapped(Map::Bounces, &set);
    let fault = frame.sides[0].fault.clone().unwrap();
    assert!(fault.contains("there is no map"), "{fault}");
}

/// Brute force tests triangle after triangle in lock step, so that nothing diverges: a warp issues as often as there are triangles, 48
/// bytes each, every group reads each line once, and the image each from memory once.
#[test]
fn modelled_cycles_of_brute_force_are_those_of_paper_and_pencil() {
    let (frame, now) = mapped(Map::Cycles, &["axes.accel=brute-force"]);
    let triangles = frame.triangles as u64;
    let lines: u64 = (0..triangles)
        .map(|i| (48 * i + 47) / 128 - 48 * i / 128 + 1)
        .sum();
    let distinct = (48 * triangles).div_ceil(128);
    assert_eq!(now.size, [40, 32]);
    // Four bands of five workgroups, each of two warps; eight warps are a group.
    let (warps, groups) = (4 * 5 * 2, 4 * 2);
    let cycles = warps * (25 * triangles + lines) + groups * 5 * distinct + 9 * distinct;
    let expected = cycles as f64 / f64::from(now.size[0] * now.size[1]);
    let found = mean(&frame, 0);
    assert!((found / expected - 1.0).abs() < 1e-6, "{found} {expected}");
    // Warps of the first group pay for memory; the last ones find all of it.
    let (bvh, _) = mapped(Map::Cycles, &["axes.accel=cwbvh"]);
    assert!(mean(&bvh, 0) < 0.5 * found);
}

#[test]
fn cycles_are_not_modelled_of_a_structure_that_was_refitted() {
    let moving = [
        "axes.scene=instances",
        "animation.motion=instances",
        "window.frame=2",
    ];
    let (frame, mut now) = mapped(Map::Cycles, &moving);
    let fault = frame.sides[0].fault.clone().unwrap();
    assert!(fault.contains("refitted"), "{fault}");
    now.window.follow = Follow::Rebuild;
    let mut viewer = viewer();
    show(&mut viewer, now);
    finish(&mut viewer);
    assert!(mean(&viewer.frame(), 0) > 0.0);
}
