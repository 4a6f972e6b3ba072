//! Every ray-triangle test and ray offset: kernel and twin bit-identical, structures equal to brute
//! force, and closed surfaces from inside.

mod closed;

use crate::support;
use crate::support::{Pcg, assert_same_hits, build, default_params, in_turn, scenes};
use closed::{ORDINARY, inner_rays, sphere};
use glam::Vec3;
use raystone::accel::triangle::{
    AnyTriangleTest, BaldwinWeber, TriangleRecord, TriangleTest as _, Watertight,
    intersect_triangle,
};
use raystone::accel::{
    AccelRegistry, Ask, BoxTest, BuildLog, BuiltBvh, BvhParameters, Counters, DivideAndConquer,
    Hit, Intersection, NO_HIT, Ray, Structure as _, Traced, Tracer, TriangleBuffers,
    TriangleRegistry, TriangleSoup,
};
use raystone::config::Gate;
use raystone::geometry::Triangle;
use raystone::gpu::{Bindings, Composition, Gpu, KernelLibrary, Recording, groups_for};
use raystone::integrator::{OffsetRegistry, offset};
use raystone::measure::rays::record_rays;
use raystone::params::{Params, Variant};
use raystone::scene::{self, LoadOptions};
use std::path::Path;
use std::sync::OnceLock;

fn gpu() -> &'static Gpu {
    static GPU: OnceLock<Gpu> = OnceLock::new();
    GPU.get_or_init(|| {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/hits/intersectors/kernels");
        let library = KernelLibrary::default().with_folder(&folder);
        support::open(library.expect("the kernels of this test"))
    })
}

fn tests_of(triangle: AnyTriangleTest) -> Intersection {
    Intersection {
        triangle,
        ..Default::default()
    }
}

fn ray(origin: Vec3, direction: Vec3) -> Ray {
    Ray {
        origin: origin.to_array(),
        t_min: 0.0,
        direction: direction.to_array(),
        t_max: scenes::FAR,
    }
}

/// A target at a triangle: a vertex, on an edge, inside, or outside.
fn target([a, b, c]: [Vec3; 3], rng: &mut Pcg) -> Vec3 {
    let (u, v) = (rng.unit(), rng.unit());
    match rng.below(6) {
        0 => [a, b, c][rng.below(3) as usize],
        1 => a + u * (b - a),
        2 => b + u * (c - b),
        3 => a + 2.0 * (u - 0.5) * (b - a) + 2.0 * v * (c - a),
        _ => a + u.min(1.0 - v) * (b - a) + v.min(1.0 - u) * (c - a),
    }
}

/// Rays and triangles of many scales and shapes, each ray aimed at its triangle.
fn pairs(count: usize) -> (Vec<[Vec3; 3]>, Vec<Ray>) {
    let mut rng = Pcg::new(17);
    let mut triangles = Vec::new();
    let mut rays = Vec::new();
    for index in 0..count {
        let scale = 10.0_f32.powi(rng.between(-6, 6));
        let far = scale * 10.0_f32.powi(rng.between(-2, 4));
        let point = |rng: &mut Pcg| Vec3::new(rng.signed(), rng.signed(), rng.signed());
        let centre = far * point(&mut rng);
        let mut triangle = [0, 1, 2].map(|_| centre + scale * point(&mut rng));
        match index % 8 {
            // Needles, triangles in coordinate planes, without area, on a lattice.
            0 => triangle[2] = triangle[1] + 1e-5 * scale * point(&mut rng),
            1 => {
                let axis = rng.below(3) as usize;
                let plane = triangle[0][axis];
                triangle.iter_mut().for_each(|v| v[axis] = plane);
            }
            2 if rng.below(4) == 0 => triangle[1] = triangle[0],
            3 => triangle = triangle.map(|v| (4.0 * v / scale).round() * scale * 0.25),
            _ => {}
        }
        let aim = target(triangle, &mut rng);
        let mut direction = scale * point(&mut rng);
        let mut origin = aim - direction * rng.unit() * 8.0;
        match rng.below(8) {
            0 => {
                let axis = rng.below(3) as usize;
                direction = Vec3::ZERO * direction;
                direction[axis] = if rng.below(2) == 0 { 1.0 } else { -1.0 };
                origin = aim - direction * scale * rng.unit();
            }
            1 => direction[rng.below(3) as usize] = -0.0,
            2 => origin = target(triangle, &mut rng),
            3 => direction *= 1e-9,
            _ => {}
        }
        triangles.push(triangle);
        rays.push(ray(origin, direction));
    }
    (triangles, rays)
}

fn pairs_on_device(soup: &TriangleSoup, rays: &[Ray]) -> Vec<Hit> {
    let gpu = gpu();
    let kernel = soup
        .intersection
        .activate(Composition::new("intersectors/pairs"));
    let pipeline = gpu.pipeline(&kernel, true).expect("a sound kernel");
    let output = gpu.zeroed("hits", rays.len() as u64 * 16).expect("fits");
    let mut bindings = Bindings::new();
    let words = soup.words();
    bindings
        .buffer(
            "triangles",
            &gpu.storage("triangles", &words).expect("fits"),
        )
        .buffer("rays", &gpu.storage("rays", rays).expect("fits"))
        .buffer("hits", &output);
    let mut recording = Recording::new();
    recording
        .run("pairs", &pipeline, &bindings, groups_for(rays.len() as u32))
        .download("hits", &output);
    let played = gpu.play(&recording).expect("runs");
    played.download("hits").expect("hits")
}

#[test]
fn kernel_and_twin_of_every_test_agree_to_the_bit_on_pairs() {
    if !support::is_exact(gpu()) {
        return;
    }
    let (triangles, rays) = pairs(120_000);
    for triangle in TriangleRegistry::default().iter() {
        let soup = scenes::soup(triangles.iter().copied()).intersecting(tests_of(triangle));
        let closest = |(ray, record): (&Ray, &TriangleRecord)| {
            let mut hit = Hit::miss(ray);
            let ray = &soup.intersection.raised(ray);
            let inverse = soup.intersection.inverse(ray.direction);
            intersect_triangle((record, None), ray, inverse, &mut hit);
            hit
        };
        let expected: Vec<Hit> = rays.iter().zip(&soup.records).map(closest).collect();
        let found = pairs_on_device(&soup, &rays);
        assert_same_hits(triangle.name(), &rays, &expected, &found);
        let hits = expected.iter().filter(|h| h.triangle != NO_HIT).count();
        assert!(hits > 30_000, "{}: only {hits} hits", triangle.name());
        // Negative control: the tests are not all the same.
        if triangle != Intersection::default().triangle {
            let soup =
                scenes::soup(triangles.iter().copied()).intersecting(Intersection::default());
            let other = pairs_on_device(&soup, &rays);
            let different = support::differences(&expected, &other).len();
            assert!(different > 0, "{} is the default", triangle.name());
        }
    }
}

#[test]
fn kernel_and_twin_of_every_offset_agree_to_the_bit() {
    if !support::is_exact(gpu()) {
        return;
    }
    let mut rng = Pcg::new(5);
    let mut points = Vec::new();
    for _ in 0..100_000 {
        let scale = 10.0_f32.powi(rng.between(-6, 6));
        let mut vector = |scale: f32| [rng.signed(), rng.signed(), rng.signed()].map(|x| x * scale);
        let (p, n) = (vector(scale), Vec3::from(vector(1.0)).normalize_or(Vec3::X));
        let error = vector(1e-6 * scale).map(f32::abs);
        points.push([p, n.to_array(), error]);
    }
    let pad = |v: [f32; 3]| [v[0], v[1], v[2], 0.0];
    let words: Vec<[f32; 4]> = points.iter().flatten().copied().map(pad).collect();
    let gpu = gpu();
    for offset in OffsetRegistry::default().iter() {
        let kernel = offset.activate(Composition::new("intersectors/offsets"));
        let pipeline = gpu.pipeline(&kernel, true).expect("a sound kernel");
        let output = gpu.zeroed("hits", points.len() as u64 * 16).expect("fits");
        let mut bindings = Bindings::new();
        bindings
            .buffer("rays", &gpu.storage("rays", &words).expect("fits"))
            .buffer("hits", &output);
        let mut recording = Recording::new();
        recording
            .run(
                "offsets",
                &pipeline,
                &bindings,
                groups_for(points.len() as u32),
            )
            .download("hits", &output);
        let played = gpu.play(&recording).expect("runs");
        let found: Vec<[f32; 4]> = played.download("hits").expect("hits");
        let mut moved = 0;
        for ([p, n, error], found) in points.iter().zip(&found) {
            let expected = (offset.offset_point)(*p, *n, *error);
            let same = (0..3).all(|a| expected[a].to_bits() == found[a].to_bits());
            assert!(same, "{}: {p:?} {n:?}: {expected:?} {found:?}", offset.name);
            moved += usize::from(expected != *p);
        }
        assert_eq!(*offset == offset::NONE, moved == 0, "{}", offset.name);
    }
}

#[test]
fn every_structure_equals_brute_force_with_every_exact_test() {
    let gpu = gpu();
    let exact = support::is_exact(gpu);
    let mut rng = Pcg::new(3);
    let lattice = scenes::lattice_soup(&mut rng, 60, 6);
    let rays = scenes::lattice_rays(&mut rng, 400, 6);
    let tests = TriangleRegistry::default();
    for triangle in tests.iter().filter(|test| test.is_exact()) {
        let soup = lattice.clone().intersecting(tests_of(triangle));
        let expected = support::brute_force(&soup, &rays);
        assert!(expected.iter().any(|h| h.triangle != NO_HIT));
        assert_same_hits(
            "brute force in blocks",
            &rays,
            &expected,
            &raystone::accel::brute_force_hits(&soup, &rays),
        );
        let kinds = AccelRegistry::default();
        for kind in in_turn("structures with every triangle test", kinds.iter()) {
            let what = format!("{} with {}", kind.name(), triangle.name());
            let built = build(kind, &soup, &default_params(&kind.parameters()));
            let twin = built
                .cpu_twin(&soup)
                .expect("a structure of the program has a twin");
            let mut counters = Counters::default();
            let found: Vec<Hit> = rays
                .iter()
                .map(|ray| twin.closest_hit(ray, &mut counters))
                .collect();
            assert_same_hits(&format!("twin of {what}"), &rays, &expected, &found);
            if exact {
                let found = support::trace(gpu, &*built, &soup, &rays, &[]).hits;
                assert_same_hits(&what, &rays, &expected, &found);
            }
        }
    }
}

#[test]
fn less_padded_boxes_are_another_kernel_and_the_twins_follow() {
    let gpu = gpu();
    if !support::is_exact(gpu) {
        return;
    }
    let triangles = sphere(8, ORDINARY);
    let rays = inner_rays(&triangles, ORDINARY, 4000);
    for box_test in BoxTest::ALL {
        let name = box_test.name;
        let tests = Intersection {
            box_test,
            ..Default::default()
        };
        let soup = scenes::soup(triangles.iter().copied()).intersecting(tests);
        let kinds = AccelRegistry::default();
        for kind in in_turn("structures with every box test", kinds.iter()) {
            // WGSL guarantees nothing for 0 · ∞.
            if !box_test.finite {
                continue;
            }
            // Its twin of a single ray has no boxes; `divide_and_conquer` compares pairs with boxes without pad.
            if kind.name() == DivideAndConquer::NAME {
                continue;
            }
            let built = build(kind, &soup, &default_params(&kind.parameters()));
            let twin = built
                .cpu_twin(&soup)
                .expect("a structure of the program has a twin");
            let mut counters = Counters::default();
            let closest = |ray| twin.closest_hit(ray, &mut counters);
            let expected: Vec<Hit> = rays.iter().map(closest).collect();
            let found = support::trace(gpu, &*built, &soup, &rays, &[]).hits;
            assert_same_hits(
                &format!("{} with {name}", kind.name()),
                &rays,
                &expected,
                &found,
            );
        }
    }
}

#[test]
fn baldwin_and_weber_read_three_more_vectors_a_triangle() {
    let soup = scenes::soup([[Vec3::ZERO, Vec3::X, Vec3::Y]; 2]);
    assert_eq!(soup.words().len(), 6);
    let soup = soup.intersecting(tests_of(&BaldwinWeber));
    assert_eq!(soup.words().len(), 12);
    assert_eq!(soup.records[1].transformed, 9);
    let record = TriangleRecord::new(
        &Triangle {
            vertices: [Vec3::ZERO, Vec3::X, Vec3::Y],
        },
        0,
        0,
    );
    assert_eq!(record.transformed, 0);
    assert_eq!(BaldwinWeber.bytes(), 96);
    assert_eq!(Watertight.bytes(), 48);
}

/// Processor seconds of this program on all threads, including the software driver's.
#[cfg(target_os = "linux")]
fn processor_seconds() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields = text.rsplit(") ").next().unwrap_or_default();
    let ticks = fields.split(' ').skip(11).take(2);
    ticks.filter_map(|t| t.parse::<f64>().ok()).sum::<f64>() / 100.0
}

/// Not a check: processor time of every test in the plain BVH on a software adapter, per ray class,
/// relative to the first test. Rounds alternate, so that external load affects all alike.
#[test]
#[ignore = "no check but a measurement of minutes, by hand: `cargo test --release --test hits -- --ignored --nocapture intersectors` (docs/performance.md)"]
#[cfg(target_os = "linux")]
fn what_tests_cost_in_a_whole_traversal() {
    const ROUNDS: usize = 7;
    for name in [
        "stanford-dragon/dragon_100k.obj",
        "sponza-crytek/sponza.obj",
    ] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../shared/scenes")
            .join(name);
        let variant = Variant {
            name: path.display().to_string(),
            params: Params::default(),
            label: name.to_owned(),
        };
        let Ok(scene) = scene::load(&variant, &LoadOptions::default()) else {
            support::needs::skip("files", format!("{} is not there", path.display()));
            continue;
        };
        let camera = scene.view(1.0);
        let settings = Gate {
            rays: 1 << 18,
            brute_force_tests: 0,
            oracle_rays: 0,
            ao_length: 0.0,
            offset: 0.0,
            shadow_orders: false,
        };
        let params = BvhParameters::default();
        let soup = TriangleSoup::new(&scene);
        let tree = BuiltBvh::build(&soup, &params, &mut BuildLog::default()).expect("a BVH");
        let sets = record_rays(&scene, &soup, camera, &tree.twin(&soup), &settings, 1);
        let prepare = |test: AnyTriangleTest| {
            let soup = soup.clone().intersecting(tests_of(test));
            let tree = BuiltBvh::build(&soup, &params, &mut BuildLog::default()).expect("a BVH");
            let buffers = TriangleBuffers::upload(gpu(), &soup).expect("fits");
            (buffers, Traced::upload(gpu(), &tree).expect("fits"))
        };
        let prepared: Vec<_> = TriangleRegistry::default().iter().map(prepare).collect();
        for set in &sets {
            let batches = prepared.iter().map(|(buffers, traced)| {
                let ask = Ask {
                    runtime_checks: false,
                    ..set.query().into()
                };
                let tracer = Tracer::new(gpu(), buffers, traced, ask).expect("compiles");
                tracer.batch(&set.rays).expect("fits")
            });
            let batches: Vec<_> = batches.collect();
            for batch in &batches {
                batch.trace().expect("traces");
            }
            let mut ratios = vec![Vec::new(); prepared.len()];
            let mut first_ns = Vec::new();
            for _ in 0..ROUNDS {
                let seconds = batches.iter().map(|batch| {
                    let start = processor_seconds();
                    for _ in 0..2 {
                        batch.trace().expect("traces");
                    }
                    processor_seconds() - start
                });
                let seconds: Vec<f64> = seconds.collect();
                first_ns.push(seconds[0] * 5e8 / set.rays.len() as f64);
                for (ratios, seconds_of_one) in ratios.iter_mut().zip(&seconds) {
                    ratios.push(seconds_of_one / seconds[0]);
                }
            }
            first_ns.sort_by(f64::total_cmp);
            print!("{name} {:?}: {:.0} ns;", set.class, first_ns[ROUNDS / 2]);
            for (test, ratios) in TriangleRegistry::default().iter().zip(&mut ratios) {
                ratios.sort_by(f64::total_cmp);
                let [low, middle, high] = [1, ROUNDS / 2, ROUNDS - 2].map(|i| ratios[i]);
                print!(" {} {middle:.3} [{low:.3}, {high:.3}]", test.name());
            }
            println!();
        }
    }
}
