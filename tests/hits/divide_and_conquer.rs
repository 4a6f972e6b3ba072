//! `divide-and-conquer` as a whole: every parameter against brute force, problems and pairs against the division
//! on the host, sets of rays of every shape, streams that are too short, and faults that must be seen.

use crate::support;
use crate::support::scenes::{self, Case};
use crate::support::{
    Pcg, brute_force, build, default_params, differences, in_turn, param_variants, trace,
};
use crate::together::{answers, assert_right, mixed_rays};
use raystone::accel::{
    AccelKind, BoxTest, DivideAndConquer, Division, DivisionLevel, Intersection, NO_HIT, Query,
    Ray, Traced, Tracer, TriangleBuffers, TriangleSoup,
};
use raystone::gpu::Gpu;
use raystone::params::{ParamValue, Params};

const KIND: &dyn AccelKind = &DivideAndConquer;

fn with(changes: &[(&str, i64)]) -> Params {
    let mut params = default_params(&KIND.parameters());
    for (name, value) in changes {
        let known = params
            .0
            .insert((*name).to_owned(), ParamValue::Integer(*value));
        assert!(known.is_some(), "no parameter {name}");
    }
    params
}

fn counted(
    gpu: &Gpu,
    soup: &TriangleSoup,
    params: &Params,
    query: Query,
    rays: &[Ray],
) -> Vec<DivisionLevel> {
    let built = build(KIND, soup, params);
    let triangles = TriangleBuffers::upload(gpu, soup).expect("triangles");
    let traced = Traced::upload(gpu, &*built).expect("a structure");
    let tracer = Tracer::new(gpu, &triangles, &traced, query).expect("kernels");
    let Some(ParamValue::Integer(levels)) = params.0.get("levels") else {
        panic!("no levels: {params:?}");
    };
    DivideAndConquer::division(gpu, &tracer, rays, *levels as u32).expect("counts")
}

#[test]
fn every_parameter_answers_like_brute_force() {
    let gpu = support::gpu();
    if !support::is_exact(gpu) {
        return;
    }
    let mut rng = Pcg::new(43);
    let mut cases = scenes::degenerate_cases();
    let soup = scenes::lattice_soup(&mut rng, 300, 8);
    cases.push(Case {
        name: "lattice",
        soup,
    });
    let mut sets = param_variants(&KIND.parameters());
    sets.extend([with(&[("naive", 1)]), with(&[("naive", 3), ("levels", 4)])]);
    for case in in_turn("scenes of divide-and-conquer", cases) {
        let rays = mixed_rays(&mut rng, &case.soup, 150);
        for params in &sets {
            assert_right(case.name, gpu, &case.soup, (KIND, params), &rays);
        }
    }
}

#[test]
fn problems_and_pairs_are_those_of_the_division_on_the_host() {
    let gpu = support::gpu();
    if !support::is_exact(gpu) {
        return;
    }
    let mut rng = Pcg::new(8);
    let lattice = scenes::lattice_soup(&mut rng, 500, 16);
    let mut rays = scenes::aimed_rays(&mut rng, &lattice, 1500);
    rays[17].direction = [f32::NAN; 3];
    for name in ["padded-16", "padded-0"] {
        let box_test = BoxTest::ALL.into_iter().find(|test| test.name == name);
        let tests = Intersection {
            box_test: box_test.expect("a box test"),
            ..Default::default()
        };
        let soup = lattice.clone().intersecting(tests);
        for params in [
            with(&[]),
            with(&[("naive", 1)]),
            with(&[("naive", 40), ("levels", 3)]),
        ] {
            for query in [Query::Closest, Query::Any] {
                let host = Division::new(&soup, &params, query, &rays).expect("a division");
                let found = counted(gpu, &soup, &params, query, &rays);
                assert!(host.levels[2].problems > 2, "{:?}", host.levels);
                assert_eq!(found, host.levels, "{name} {params:?}");
            }
        }
    }
}

#[test]
fn batches_and_pairs_without_room_are_counted_and_answered_all_the_same() {
    let gpu = support::gpu();
    if !support::is_exact(gpu) {
        return;
    }
    let mut rng = Pcg::new(9);
    // Triangles across the whole scene: rays enter nearly all problems.
    let soup = scenes::lattice_soup(&mut rng, 120, 6);
    let rays = scenes::lattice_rays(&mut rng, 5000, 6);
    let params = with(&[("capacity", 16_384), ("naive", 1)]);
    let found = counted(gpu, &soup, &params, Query::Closest, &rays);
    let without: u64 = found.iter().map(|level| level.without_room).sum();
    assert!(
        without > 1000,
        "only {without} pairs had no room: the test is blunt"
    );
    assert_right("short streams", gpu, &soup, (KIND, &params), &rays);
    // Three batches with room.
    let rays = scenes::aimed_rays(&mut rng, &soup, 5000);
    let params = with(&[("capacity", 16_384), ("naive", 100)]);
    let host = Division::new(&soup, &params, Query::Closest, &rays).expect("a division");
    assert_eq!(
        counted(gpu, &soup, &params, Query::Closest, &rays),
        host.levels
    );
}

#[test]
fn sets_of_no_ray_one_and_a_million_equal_ones_are_answered() {
    let gpu = support::gpu();
    if !support::is_exact(gpu) {
        return;
    }
    let mut rng = Pcg::new(3);
    let soup = scenes::lattice_soup(&mut rng, 12, 4);
    let rays = scenes::aimed_rays(&mut rng, &soup, 64);
    let hits = brute_force(&soup, &rays);
    let at = hits.iter().position(|h| h.triangle != NO_HIT);
    let at = at.expect("a hit");
    let built = build(KIND, &soup, &with(&[]));
    for count in [1, 1_000_000] {
        let found = trace(gpu, &*built, &soup, &vec![rays[at]; count], &[]).hits;
        assert!(found.len() == count && found.iter().all(|hit| hit.same_bits(&hits[at])));
    }
    let nothing = TriangleSoup::from(Vec::new());
    assert_right("no triangles", gpu, &nothing, (KIND, &with(&[])), &rays);
    let none = Division::new(&soup, &with(&[]), Query::Closest, &[]).expect("a division");
    assert_eq!(none.tests, 0);
}

#[test]
fn faults_of_the_division_are_seen() {
    if !support::is_exact(support::gpu()) {
        return;
    }
    let mut rng = Pcg::new(12);
    let soup = scenes::lattice_soup(&mut rng, 400, 12);
    let rays = scenes::aimed_rays(&mut rng, &soup, 2000);
    let expected = brute_force(&soup, &rays);
    let host = Division::new(&soup, &with(&[]), Query::Closest, &rays).expect("a division");
    for (file, from, to) in [
        (
            "passes/plan",
            "(pairs + LANES - 1u) / LANES",
            "pairs / LANES",
        ),
        ("passes/answer", "slot < end", "slot + 1u < end"),
        (
            "passes/divide",
            "level.level + 1u < LEVELS &&",
            "level.level < 3u &&",
        ),
        ("passes/expand", "nearest(place, ray).t", "ray.t_max"),
    ] {
        let module = format!("accel/divide_and_conquer/{file}");
        let gpu = support::open(support::kernels_with(&module, &[(from, to)]));
        let (hits, _) = answers(&gpu, &soup, (KIND, &with(&[])), &rays);
        let counts = counted(&gpu, &soup, &with(&[]), Query::Closest, &rays);
        let is_seen = !differences(&expected, &hits).is_empty() || counts != host.levels;
        assert!(is_seen, "{to}");
    }
}
