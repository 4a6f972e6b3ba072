//! Wide BVHs: every array layout, and every underlying builder.

use crate::support;
use crate::support::{Pcg, assert_same_hits, brute_force, build, default_params, scenes, trace};
use raystone::accel::{AccelKind, AccelRegistry, Counters, TriangleSoup, brute_force_hits};
use raystone::config::Axis;
use raystone::params::{ParamValue, Params};

const WIDE: [&str; 2] = ["bvh4", "cwbvh"];

fn kind(name: &str) -> &'static dyn AccelKind {
    let registry = AccelRegistry::default();
    registry
        .get(name)
        .unwrap_or_else(|| panic!("no structure {name}"))
}

fn with(kind: &dyn AccelKind, name: &str, value: ParamValue) -> Params {
    let mut params = default_params(&kind.parameters());
    let before = params.0.insert(name.to_owned(), value);
    assert!(before.is_some(), "{} has no {name}", kind.name());
    params
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
    for name in WIDE {
        let kind = kind(name);
        for texels in [false, true] {
            let built = build(kind, &soup, &with(kind, "texels", ParamValue::Flag(texels)));
            let twin = built.cpu_twin(&soup).expect("a twin");
            let found = trace(support::gpu(), &*built, &soup, &rays, &["counters"]);
            let what = format!("{name}, texels {texels}");
            assert_same_hits(&what, &rays, &expected, &found.hits);
            for (index, ray) in rays.iter().enumerate() {
                let mut work = Counters::default();
                twin.closest_hit(ray, &mut work);
                assert_eq!(found.work[index], work, "{what}: ray {index}");
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
    // The canonical triangles are split into parts; those of leaves are in one texture.
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
        let in_buffers = build(kind, &soup, &with(kind, "texels", ParamValue::Flag(false)));
        let told = refused(&gpu, &*in_buffers);
        assert!(told.contains(&(bytes / 3).to_string()), "{told}");
    }
}
