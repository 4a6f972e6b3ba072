//! `ray-hierarchy` as a whole: every parameter against brute force, streams against the scalar twin,
//! sets of rays of every shape, streams that are too short, and faults that must be seen.

use crate::support;
use crate::support::scenes::{self, Case};
use crate::support::{
    Pcg, brute_force, build, default_params, differences, in_turn, param_variants, trace,
};
use crate::together::{answers, assert_right, mixed_rays};
use raystone::accel::{
    AccelKind, Anatomy, NO_HIT, Query, Ray, RayHierarchy, Traced, Tracer, TriangleBuffers,
    TriangleSoup,
};
use raystone::gpu::Gpu;
use raystone::measure::ray_sets::{mirrored, on_mirror, room};
use raystone::params::{ParamValue, Params};

const KIND: &dyn AccelKind = &RayHierarchy;

fn with(changes: &[(&str, ParamValue)]) -> Params {
    let mut params = default_params(&KIND.parameters());
    for (name, value) in changes {
        let known = params.0.insert((*name).to_owned(), value.clone());
        assert!(known.is_some(), "no parameter {name}");
    }
    params
}

fn number(x: i64) -> ParamValue {
    ParamValue::Integer(x)
}

fn name(x: &str) -> ParamValue {
    ParamValue::Name(x.to_owned())
}

#[test]
fn every_parameter_answers_like_brute_force() {
    let gpu = support::gpu();
    if !support::is_exact(gpu) {
        return;
    }
    let mut rng = Pcg::new(41);
    let mut cases = scenes::degenerate_cases();
    let soup = scenes::lattice_soup(&mut rng, 300, 8);
    cases.push(Case {
        name: "lattice",
        soup,
    });
    let mut sets = param_variants(&KIND.parameters());
    sets.extend([
        with(&[
            ("cluster", number(8)),
            ("bundle", number(4)),
            ("bound", name("both")),
        ]),
        with(&[
            ("order", name("morton")),
            ("chunks", number(3)),
            ("branching", number(8)),
        ]),
        with(&[
            ("fused", ParamValue::Flag(false)),
            ("compaction", name("roger")),
            ("start", number(4)),
        ]),
        with(&[
            ("union", name("pairwise")),
            ("bundle", number(3)),
            ("apex", name("linear")),
        ]),
        with(&[
            ("dual", number(3)),
            ("chunks", number(3)),
            ("cluster", number(2)),
            ("start", number(1)),
        ]),
        with(&[
            ("dual", number(12)),
            ("fused", ParamValue::Flag(false)),
            ("branching", number(8)),
        ]),
    ]);
    for case in in_turn("scenes of ray-hierarchy", cases) {
        let rays = mixed_rays(&mut rng, &case.soup, 150);
        for params in &sets {
            assert_right(case.name, gpu, &case.soup, (KIND, params), &rays);
        }
    }
}

/// Pairs of all streams, level by level: those of the device, and those that were answered at once.
fn streams(gpu: &Gpu, soup: &TriangleSoup, params: &Params, rays: &[Ray]) -> Vec<[u32; 2]> {
    let built = build(KIND, soup, params);
    let triangles = TriangleBuffers::upload(gpu, soup).expect("triangles");
    let traced = Traced::upload(gpu, &*built).expect("a structure");
    let tracer = Tracer::new(gpu, &triangles, &traced, Query::Closest).expect("kernels");
    let found = RayHierarchy::streams(gpu, &tracer, rays).expect("counts");
    found
        .iter()
        .map(|level| [level.pairs, level.walked])
        .collect()
}

#[test]
fn streams_hold_the_pairs_of_the_scalar_twin_level_by_level() {
    let gpu = support::gpu();
    if !support::is_exact(gpu) {
        return;
    }
    let mut rng = Pcg::new(7);
    let soup = scenes::lattice_soup(&mut rng, 200, 8);
    let mut rays = scenes::aimed_rays(&mut rng, &soup, 1000);
    rays[17].direction = [f32::NAN; 3];
    for params in [
        with(&[]),
        with(&[
            ("branching", number(8)),
            ("bundle", number(3)),
            ("cluster", number(5)),
        ]),
        with(&[
            ("union", name("pairwise")),
            ("bound", name("both")),
            ("start", number(1)),
        ]),
        with(&[
            ("apex", name("linear")),
            ("bound", name("box")),
            ("fused", ParamValue::Flag(false)),
        ]),
        // Both sides together; and with a level of the tree over rays that is tested against the lowest primitives.
        with(&[("dual", number(2)), ("start", number(1))]),
        with(&[
            ("dual", number(12)),
            ("branching", number(8)),
            ("cluster", number(3)),
            ("fused", ParamValue::Flag(false)),
        ]),
        // From the level that a sample chooses.
        with(&[("start", number(0))]),
        with(&[
            ("start", number(0)),
            ("bound", name("both")),
            ("branching", number(8)),
            ("cluster", number(16)),
        ]),
        // Two batches of primitives have the same pairs as one.
        with(&[("start", number(1024)), ("capacity", number(131_072))]),
    ] {
        let anatomy = Anatomy::new(&soup, &params, &rays).expect("an anatomy");
        let found = streams(gpu, &soup, &params, &rays);
        let expected: Vec<u64> = anatomy.levels.iter().map(|level| level.pairs).collect();
        let pairs: Vec<u64> = found.iter().map(|[pairs, _]| u64::from(*pairs)).collect();
        assert!(expected.iter().sum::<u64>() > 1000, "{expected:?}");
        assert_eq!(pairs[..expected.len()], expected, "{params:?}");
        let above = &pairs[expected.len()..];
        assert!(above.iter().all(|pairs| *pairs == 0), "{params:?}");
        assert!(found.iter().all(|[_, walked]| *walked == 0), "{params:?}");
        assert_eq!(anatomy.rays, 999);
    }
}

#[test]
fn pairs_without_room_are_counted_and_answered_all_the_same() {
    let gpu = support::gpu();
    if !support::is_exact(gpu) {
        return;
    }
    let mut rng = Pcg::new(9);
    let soup = scenes::lattice_soup(&mut rng, 120, 6);
    let rays = scenes::lattice_rays(&mut rng, 6000, 6);
    for (least, params) in [
        (
            1000,
            with(&[("capacity", number(16_384)), ("branching", number(16))]),
        ),
        (
            300,
            with(&[
                ("capacity", number(16_384)),
                ("branching", number(8)),
                ("dual", number(2)),
            ]),
        ),
    ] {
        let walked: u32 = streams(gpu, &soup, &params, &rays)
            .iter()
            .map(|[_, walked]| walked)
            .sum();
        assert!(
            walked > least,
            "{params:?}: only {walked} pairs had no room: the test is blunt"
        );
        assert_right("short streams", gpu, &soup, (KIND, &params), &rays);
    }
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
    let at = hits
        .iter()
        .position(|h| h.triangle != NO_HIT)
        .expect("a hit");
    let built = build(KIND, &soup, &default_params(&KIND.parameters()));
    for count in [1, 1_000_000] {
        let found = trace(gpu, &*built, &soup, &vec![rays[at]; count], &[]).hits;
        assert!(found.len() == count && found.iter().all(|hit| hit.same_bits(&hits[at])));
    }
    let nothing = TriangleSoup::from(Vec::new());
    assert_right("no triangles", gpu, &nothing, (KIND, &with(&[])), &rays);
    assert!(
        Anatomy::new(&soup, &with(&[]), &[])
            .expect("an anatomy")
            .tests()
            < 500
    );
    for (contradiction, remedy) in [
        (
            with(&[("chunks", number(2)), ("reach", ParamValue::Flag(false))]),
            "reach = true",
        ),
        (
            with(&[("dual", number(1)), ("branching", number(16))]),
            "branching to 8",
        ),
    ] {
        let error = KIND
            .build(&soup, &contradiction, &mut Default::default())
            .err();
        assert!(error.is_some_and(|e| e.to_string().contains(remedy)));
    }
}

#[test]
fn faults_of_the_descent_are_seen() {
    if !support::is_exact(support::gpu()) {
        return;
    }
    let mut rng = Pcg::new(12);
    let soup = scenes::lattice_soup(&mut rng, 150, 8);
    let rays = scenes::aimed_rays(&mut rng, &soup, 2000);
    let expected = brute_force(&soup, &rays);
    // Only what begins two levels above the leaves comes to a next node of a level between.
    for (file, from, to, params) in [
        (
            "tree",
            "node = ((node - 1u) >> BRANCHING_BITS) + 1u;",
            "node = ((node - 1u) >> BRANCHING_BITS) + 2u;",
            with(&[("capacity", number(16_384)), ("branching", number(8))]),
        ),
        (
            "passes/expand",
            "walk(pair.x, pair.y);",
            "return;",
            with(&[("capacity", number(16_384)), ("branching", number(64))]),
        ),
        (
            "passes/plan",
            "(count + LANES - 1u) / LANES",
            "count / LANES",
            with(&[]),
        ),
        (
            "passes/choose",
            "place == best",
            "false",
            with(&[("start", number(0))]),
        ),
    ] {
        let module = format!("accel/ray_hierarchy/{file}");
        let gpu = support::open(support::kernels_with(&module, &[(from, to)]));
        let (hits, _) = answers(&gpu, &soup, (KIND, &params), &rays);
        assert!(!differences(&expected, &hits).is_empty(), "{to}");
    }
}

/// What is nearest to the thesis.
fn as_published() -> Params {
    with(&[
        ("start", number(4)),
        ("union", name("pairwise")),
        ("reach", ParamValue::Flag(false)),
    ])
}

/// Tests in millions, pairs per ray, and the longest stream in millions.
fn counted(soup: &TriangleSoup, params: &Params, rays: &[Ray]) -> [f64; 3] {
    let anatomy = Anatomy::new(soup, params, rays).expect("an anatomy");
    let per_ray = anatomy.levels[0].pairs as f64 / anatomy.rays as f64;
    let [tests, peak] = [anatomy.tests(), anatomy.peak()].map(|count| count as f64 / 1e6);
    [tests, per_ray, peak]
}

#[test]
fn pairs_of_a_mirror_ball_in_a_room_are_as_many_as_published() {
    // Squares of a wall, width, waves, the three counts, and how far the first and last may be off: where the
    // balls are is not published, and a smooth mirror sees few of them.
    let mut published = vec![
        (48, 128, 0.0, [7.06, 5.04, 0.39], 0.2),
        (48, 128, 60.0, [12.5, 5.04, 0.83], 0.1),
        (12, 512, 60.0, [3.73, 4.96, 0.39], 0.1),
    ];
    if support::is_full() {
        published.extend([
            (48, 256, 0.0, [9.96, 5.02, 0.47], 0.2),
            (48, 512, 0.0, [13.9, 5.09, 0.56], 0.2),
            (48, 512, 12.0, [15.8, 5.07, 0.68], 0.1),
            (48, 512, 60.0, [40.6, 5.11, 2.81], 0.1),
        ]);
    }
    for (n, width, waves, published, margin) in published {
        let soup = room(n);
        let found = counted(&soup, &as_published(), &mirrored(&on_mirror(width, waves)));
        let triangles = soup.records.len();
        println!("{triangles} triangles, {width}², {waves} waves: {found:.2?}");
        assert_eq!(triangles as u32, 36 * n * n - 48 * n);
        for (found, published) in found.iter().zip(published) {
            let off = (found / published - 1.0).abs();
            assert!(off < margin, "{n} {width} {waves}: {found} for {published}");
        }
    }
}

#[test]
fn boxes_refuse_pairs_that_balls_let_through_and_clusters_save_tests() {
    let soup = room(48);
    let rays = mirrored(&on_mirror(if support::is_full() { 512 } else { 128 }, 0.0));
    let of = |params: Params| {
        let found = counted(&soup, &params, &rays);
        println!("{} rays, {params:?}: {found:.2?}", rays.len());
        found
    };
    of(as_published());
    let [balls, boxes, both] =
        ["sphere", "box", "both"].map(|bound| of(with(&[("bound", name(bound))])));
    let clusters = of(with(&[("cluster", number(32)), ("bound", name("both"))]));
    assert!(boxes[1] == both[1] && both[1] < 0.7 * balls[1]);
    assert!(both[0] < balls[0] && balls[0] < boxes[0]);
    assert!(clusters[0] < 0.25 * both[0], "{clusters:?} of {both:?}");
}
