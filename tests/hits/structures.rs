//! Every registered structure against brute force, bit by bit: scalar twin, kernel, counters,
//! any-hit queries, and builds. New structures are tested without a new line here.

use crate::support;
use crate::support::scenes::{self, Case};
use crate::support::{
    Pcg, assert_same_hits, brute_force, build, default_params, in_turn, one_of, param_variants,
    so_many, trace,
};

use rayon::prelude::*;
use raystone::accel::triangle::TriangleRecord;
use raystone::accel::{
    AccelKind, AccelRegistry, BuildLog, Counters, Hit, NO_HIT, Ray, TriangleSoup,
};
use raystone::params::Params;
use std::sync::atomic::{AtomicUsize, Ordering};

fn kinds() -> Vec<&'static dyn AccelKind> {
    let kinds: Vec<_> = AccelRegistry::default().iter().collect();
    assert!(kinds.len() >= 4, "the registry lists {} kinds", kinds.len());
    kinds
}

/// Checks closest and any hit of the scalar twin.
fn check_twin(
    what: &str,
    kind: &dyn AccelKind,
    params: &Params,
    soup: &TriangleSoup,
    rays: &[Ray],
    expected: &[Hit],
) {
    let built = build(kind, soup, params);
    let twin = built
        .cpu_twin(soup)
        .expect("a structure of the program has a twin");
    let mut counters = Counters::default();
    let found: Vec<Hit> = rays
        .iter()
        .map(|r| twin.closest_hit(r, &mut counters))
        .collect();
    let what = format!("{what}: twin of {} {params:?}", kind.name());
    assert_same_hits(&what, rays, expected, &found);
    for (ray, hit) in rays.iter().zip(expected) {
        let any = twin.any_hit(ray, &mut counters);
        assert_eq!(
            any,
            hit.triangle != NO_HIT,
            "{what}: any hit of {ray:?}, closest is {hit:?}"
        );
    }
}

/// Checks closest and any hit of the kernel, and its counters against the twin's.
fn check_kernel(
    what: &str,
    kind: &dyn AccelKind,
    params: &Params,
    soup: &TriangleSoup,
    rays: &[Ray],
    expected: &[Hit],
) {
    let gpu = support::gpu();
    let built = build(kind, soup, params);
    let what = format!("{what}: kernel of {} {params:?}", kind.name());
    let run = |features: &[&str]| trace(gpu, &*built, soup, rays, features);
    assert_same_hits(&what, rays, expected, &run(&[]).hits);
    let blocked: Vec<bool> = expected.iter().map(|h| h.triangle != NO_HIT).collect();
    assert_eq!(run(&["any"]).found(), blocked, "{what}: any hit");

    if !support::counts_work(&*built) {
        return;
    }
    let twin = built
        .cpu_twin(soup)
        .expect("a structure of the program has a twin");
    let (closest, any) = (run(&["counters"]), run(&["any", "counters"]));
    assert_same_hits(&what, rays, expected, &closest.hits);
    assert_eq!(any.found(), blocked, "{what}: any hit while counting");
    for (index, ray) in rays.iter().enumerate() {
        let [mut work, mut any_work] = [Counters::default(); 2];
        twin.closest_hit(ray, &mut work);
        twin.any_hit(ray, &mut any_work);
        assert_eq!(
            closest.work[index], work,
            "{what}: work of closest hit, ray {index} {ray:?}"
        );
        assert_eq!(
            any.work[index], any_work,
            "{what}: work of any hit, ray {index} {ray:?}"
        );
    }
}

/// The default parameters, and one set for each other kernel of the structure whose turn it is.
fn kernel_variants(kind: &dyn AccelKind) -> Vec<Params> {
    let soup = scenes::lattice_soup(&mut Pcg::new(2), 40, 5);
    let mut kernels = Vec::new();
    let mut out = param_variants(&kind.parameters());
    out.retain(|params| {
        let built = build(kind, &soup, params);
        let buffers = built.buffers();
        let kernel = (buffers.kernel, buffers.features);
        let is_new = !kernels.contains(&kernel);
        kernels.push(kernel);
        is_new
    });
    let others = out.split_off(1);
    out.extend(in_turn("other kernels of a structure", others));
    out
}

/// Number of random scenes: RAYSTONE_FUZZ_SCENES, or 2,000, and 100,000 in a full run.
fn fuzz_scenes() -> u64 {
    let set = std::env::var("RAYSTONE_FUZZ_SCENES").ok();
    let parse = |text: String| text.parse().expect("RAYSTONE_FUZZ_SCENES is a number");
    set.map_or_else(|| so_many("random lattice scenes", 2_000, 100_000), parse)
}

/// Hard scenes with all kinds of rays, and the answers of brute force.
fn hard_cases(seed: u64, rays_per_kind: usize) -> Vec<(Case, Vec<Ray>, Vec<Hit>)> {
    let mut rng = Pcg::new(seed);
    let mut cases = scenes::degenerate_cases();
    for (name, count, extent) in [
        ("sparse lattice", 60, 8),
        ("dense lattice", 300, 5),
        ("tiny lattice", 40, 1),
    ] {
        let soup = scenes::lattice_soup(&mut rng, count, extent);
        cases.push(Case { name, soup });
    }
    let with_rays = |case: Case| {
        let mut rays = scenes::aimed_rays(&mut rng, &case.soup, rays_per_kind);
        rays.extend(scenes::lattice_plane_rays(
            &mut rng,
            &case.soup,
            rays_per_kind,
        ));
        rays.extend(scenes::lattice_rays(&mut rng, rays_per_kind, 16));
        let hits = brute_force(&case.soup, &rays);
        rays.extend(scenes::cut_at_hits(&rays, &hits));
        let hits = brute_force(&case.soup, &rays);
        let library = raystone::accel::brute_force_hits(&case.soup, &rays);
        assert_same_hits("the library's brute force", &rays, &hits, &library);
        (case, rays, hits)
    };
    cases.into_iter().map(with_rays).collect()
}

#[test]
fn twins_equal_brute_force_on_random_lattice_scenes() {
    let kinds = kinds();
    let hits = AtomicUsize::new(0);
    (0..fuzz_scenes()).into_par_iter().for_each(|seed| {
        let mut rng = Pcg::new(seed);
        let extent = rng.between(1, 8);
        let count = 1 + rng.below(48) as usize;
        let soup = scenes::lattice_soup(&mut rng, count, extent);
        let rays = scenes::lattice_rays(&mut rng, 32, extent);
        let expected = brute_force(&soup, &rays);
        let struck = expected.iter().filter(|h| h.triangle != NO_HIT).count();
        hits.fetch_add(struck, Ordering::Relaxed);
        for kind in &kinds {
            let params = default_params(&kind.parameters());
            check_twin(
                &format!("seed {seed}"),
                *kind,
                &params,
                &soup,
                &rays,
                &expected,
            );
        }
    });
    let hits = hits.into_inner();
    assert!(
        hits > 3 * fuzz_scenes() as usize,
        "only {hits} rays hit anything: the test is blunt"
    );
}

#[test]
fn twins_equal_brute_force_from_far_outside_the_scene() {
    let mut rng = Pcg::new(77);
    for case in scenes::degenerate_cases() {
        let mut rays = scenes::aimed_rays(&mut rng, &case.soup, 600);
        let extent = glam::Vec3::from(scenes::box_of(&case.soup).extent());
        for ray in &mut rays {
            let back = glam::Vec3::from(ray.direction).normalize_or_zero() * 15.0 * extent.length();
            ray.origin = (glam::Vec3::from(ray.origin) - back).to_array();
            ray.t_max = scenes::FAR;
        }
        let expected = brute_force(&case.soup, &rays);
        for kind in kinds() {
            let params = default_params(&kind.parameters());
            check_twin(case.name, kind, &params, &case.soup, &rays, &expected);
        }
    }
}

#[test]
fn twins_equal_brute_force_on_hard_scenes_with_every_parameter() {
    for (case, rays, expected) in hard_cases(5, 300) {
        for kind in kinds() {
            let variants = param_variants(&kind.parameters());
            for params in one_of(9, "parameters of a twin", variants) {
                check_twin(case.name, kind, &params, &case.soup, &rays, &expected);
            }
        }
    }
}

#[test]
fn kernels_equal_brute_force_and_count_like_their_twins_on_random_lattice_scenes() {
    if !support::is_exact(support::gpu()) {
        return;
    }
    for seed in 0..20 {
        let mut rng = Pcg::new(1000 + seed);
        let extent = rng.between(2, 12);
        let count = rng.between(50, 300) as usize;
        let soup = scenes::lattice_soup(&mut rng, count, extent);
        let rays = scenes::lattice_rays(&mut rng, 4096, extent);
        let expected = brute_force(&soup, &rays);
        let what = format!("seed {}", 1000 + seed);
        for kind in kinds() {
            let variants = kernel_variants(kind);
            // Kernels share most of their text: the defaults get all scenes, the others some.
            let checked = if seed < 4 { variants.len() } else { 1 };
            for params in &variants[..checked] {
                check_kernel(&what, kind, params, &soup, &rays, &expected);
            }
        }
    }
}

#[test]
fn kernels_equal_brute_force_and_count_like_their_twins_on_hard_scenes() {
    if !support::is_exact(support::gpu()) {
        return;
    }
    for (case, rays, expected) in hard_cases(6, 400) {
        for kind in kinds() {
            for params in kernel_variants(kind) {
                check_kernel(case.name, kind, &params, &case.soup, &rays, &expected);
            }
        }
    }
}

#[test]
fn hits_at_the_ends_of_a_segment_count_and_ties_go_to_the_lowest_index() {
    let wall = scenes::degenerate_cases()
        .into_iter()
        .find(|c| c.name == "two coincident planes")
        .expect("a case of that name");
    let ray = |t_min, t_max| Ray {
        origin: [3.25, 4.25, 0.0],
        t_min,
        direction: [0.0, -0.0, 1.0],
        t_max,
    };
    let id = 4 * 16 + 3;
    let rays = [ray(2.0, 2.0), ray(0.0, 2.0), ray(2.0, scenes::FAR)];
    let misses = [
        ray(0.0, 2.0_f32.next_down()),
        ray(2.0_f32.next_up(), scenes::FAR),
    ];
    for kind in kinds() {
        let built = build(kind, &wall.soup, &default_params(&kind.parameters()));
        let answers = |rays: &[Ray]| trace(support::gpu(), &*built, &wall.soup, rays, &[]);
        for hit in answers(&rays).hits {
            assert_eq!((hit.t, hit.triangle), (2.0, id), "{}", kind.name());
        }
        for hit in answers(&misses).hits {
            assert_eq!(hit.triangle, NO_HIT, "{}", kind.name());
        }
    }
}

#[test]
fn a_single_wrong_bit_in_a_hit_is_seen() {
    let mut rng = Pcg::new(3);
    let soup = scenes::lattice_soup(&mut rng, 100, 6);
    let rays = scenes::lattice_rays(&mut rng, 500, 6);
    let expected = brute_force(&soup, &rays);
    let struck = expected
        .iter()
        .position(|h| h.triangle != NO_HIT)
        .expect("a hit");
    let faults: [fn(&mut Hit); 4] = [
        |h| h.t = h.t.next_up(),
        |h| h.triangle ^= 1,
        |h| h.u = f32::from_bits(h.u.to_bits() ^ 1),
        |h| h.v = -h.v,
    ];
    for fault in faults {
        let mut found = expected.clone();
        fault(&mut found[struck]);
        assert_eq!(support::differences(&expected, &found), [struck]);
    }
}

#[test]
fn validation_refuses_structures_that_were_built_for_other_triangles() {
    let mut rng = Pcg::new(8);
    let soup = scenes::lattice_soup(&mut rng, 120, 9);
    let without_last = TriangleSoup::from(soup.records[..119].to_vec());
    let mut with_more = soup.clone();
    with_more.records.push(TriangleRecord {
        id: 120,
        ..soup.records[0]
    });
    let mut one_moved = soup.clone();
    one_moved.records[77].v0[1] += 40.0;
    for kind in kinds() {
        let name = kind.name();
        let built = build(kind, &soup, &default_params(&kind.parameters()));
        assert!(
            built.validate(&without_last).is_err(),
            "{name} accepts fewer triangles"
        );
        assert!(
            built.validate(&with_more).is_err(),
            "{name} accepts more triangles"
        );
        if !built.buffers().arrays.is_empty() {
            assert!(
                built.validate(&one_moved).is_err(),
                "{name} accepts a moved triangle"
            );
        }
    }
}

#[test]
fn builds_do_not_depend_on_the_number_of_threads() {
    let mut rng = Pcg::new(21);
    let soup = scenes::lattice_soup(&mut rng, 30_000, 64);
    for kind in in_turn("structures built by threads", kinds()) {
        let params = default_params(&kind.parameters());
        let words = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .expect("a thread pool");
            pool.install(|| {
                let built = kind.build(&soup, &params, &mut BuildLog::default());
                let built = built.unwrap_or_else(|e| panic!("{}: {e}", kind.name()));
                let buffers = built.buffers();
                let arrays = buffers.arrays.iter().map(|a| (a.name, a.words.to_vec()));
                let arrays: Vec<_> = arrays.collect();
                (arrays, buffers.uniforms, buffers.constants)
            })
        };
        let one = words(1);
        for threads in [2, 3] {
            assert!(
                one == words(threads),
                "{}: the build with {threads} threads differs",
                kind.name()
            );
        }
    }
}
