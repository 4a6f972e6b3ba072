//! Wide BVHs: every array layout, and every underlying builder.

use crate::support;
use crate::support::tier::in_turn;
use crate::support::{Pcg, assert_same_hits, brute_force, build, default_params, scenes, trace_by};
use raystone::accel::{AccelKind, AccelRegistry, Counters, Load, TriangleSoup, brute_force_hits};
use raystone::config::Axis;

const WIDE: [&str; 2] = ["bvh4", "cwbvh"];

fn kind(name: &str) -> &'static dyn AccelKind {
    let registry = AccelRegistry::default();
    registry
        .get(name)
        .unwrap_or_else(|| panic!("no structure {name}"))
}

#[test]
fn kernels_read_buffers_and_textures_alike() {
    if !support::is_exact(support::gpu()) {
        return;
    }
    // More triangles than fit into one row of texels.
    let mut rng = Pcg::new(12);
    let soup = scenes::lattice_soup(&mut rng, 6_000, 24);
    let mut rays = scenes::lattice_rays(&mut rng, 1024, 24);
    rays.extend(scenes::aimed_rays(&mut rng, &soup, 1024));
    let expected = brute_force(&soup, &rays);
    for kind in in_turn("structures by load path", support::inline_structures()) {
        let built = build(kind, &soup, &default_params(&kind.parameters()));
        let twin = built.cpu_twin(&soup);
        for load in &Load::ALL[1..] {
            let found = trace_by(load, support::gpu(), &*built, &soup, &rays, &["counters"]);
            let what = format!("{}, load {}", kind.name(), load.name);
            assert_same_hits(&what, &rays, &expected, &found.hits);
            let counted = rays.iter().zip(&found.work).enumerate();
            for (index, (ray, found)) in counted.filter(|_| twin.is_some()) {
                let mut work = Counters::default();
                twin.iter().for_each(|twin| {
                    twin.closest_hit(ray, &mut work);
                });
                assert_eq!(*found, work, "{what}: ray {index}");
            }
        }
    }
}

#[test]
fn wide_nodes_of_eight_and_of_four_are_smaller_than_binary_ones() {
    let mut rng = Pcg::new(5);
    let soup = scenes::lattice_soup(&mut rng, 5_000, 40);
    let bytes = |name: &str| {
        let kind = kind(name);
        let built = build(kind, &soup, &default_params(&kind.parameters()));
        built.stats().bytes - 48 * built.stats().references
    };
    let [eight, four, binary] = ["cwbvh", "bvh4", "bvh"].map(bytes);
    assert!(
        eight < four && 2 * four < binary,
        "{eight}, {four}, {binary}"
    );
}

#[test]
fn triangles_in_a_texture_are_not_bound_by_the_limit_of_buffers() {
    use raystone::accel::{Query, Traced, Tracer, TriangleBuffers};
    let catalogue = raystone::run::Registries::default().catalogue();
    let mut entries = catalogue[Axis::Scene].iter();
    let sphere = entries.find(|e| e.name == "displaced-sphere");
    let variant = sphere.expect("a built-in scene").default_variant();
    let scene = raystone::scene::load(&variant, &Default::default()).expect("a scene");
    let soup = TriangleSoup::new(&scene);
    let rays = scenes::aimed_rays(&mut Pcg::new(4), &soup, 1000);
    let mut gpu = support::alone(raystone::gpu::KernelLibrary::default());
    if !support::is_exact(&gpu) {
        return;
    }
    // Buffers of nodes and triangles are split into parts, which are one texture together.
    let bytes = 48 * soup.records.len() as u64;
    gpu.limits.max_storage_buffer_binding_size = bytes / 3;
    let buffers = TriangleBuffers::upload(&gpu, &soup).expect("triangles");
    for name in WIDE {
        let kind = kind(name);
        let built = build(kind, &soup, &default_params(&kind.parameters()));
        let expected = brute_force_hits(&soup, &rays);
        let traced = Traced::upload(&gpu, &*built).expect("a texture");
        let tracer = Tracer::new(&gpu, &buffers, &traced, Query::Closest).expect(name);
        let batch = tracer.batch(&rays).expect(name);
        batch.trace().expect(name);
        assert_eq!(batch.error_word().expect("the error word"), 0, "{name}");
        assert_same_hits(name, &rays, &expected, &batch.hits().expect("hits"));

        // If they fit into neither, the error has both numbers.
        let refused = |gpu: &raystone::gpu::Gpu, built: &dyn raystone::accel::BuiltAccel| {
            let traced = Traced::upload(gpu, built).expect("it is uploaded");
            let tracer = Tracer::new(gpu, &buffers, &traced, Query::Closest);
            let batch = tracer.and_then(|tracer| tracer.batch(&rays));
            let traced = batch.and_then(|batch| batch.trace());
            traced.expect_err("it is bound").to_string()
        };
        let dimension = gpu.limits.max_texture_dimension_2d;
        gpu.limits.max_texture_dimension_2d = 8191;
        let told = refused(&gpu, &*built);
        gpu.limits.max_texture_dimension_2d = dimension;
        assert!(
            told.contains("texture") && told.contains(&(8191_u64 << 17).to_string()),
            "{told}"
        );
    }
}
