//! What WebGPU leaves to a device: reading storage textures, and comparisons with NaN.

use crate::support::*;
use raystone::accel::{Hit, Load, Query, Ray, Traced, Tracer};
use raystone::gpu::{Bindings, Composition, Gpu, KernelLibrary, Player, Recording};

const RAYS: usize = 2000;

/// Hits of rays by a structure that reads textures.
fn hits(gpu: &Gpu, stage: &Stage, traced: &Traced, rays: &[Ray]) -> Vec<Hit> {
    let textures = Load::ALL.iter().find(|load| load.name == "texture");
    let traced = traced.clone().loading(gpu, textures.expect("a load path"));
    let traced = traced.expect("a load path");
    let tracer = Tracer::new(gpu, &stage.buffers.triangles, &traced, Query::Closest);
    let batch = tracer
        .and_then(|tracer| tracer.batch(rays))
        .expect("a tracer");
    batch.trace().expect("traced");
    batch.hits().expect("hits")
}

#[test]
fn sampled_textures_give_the_hits_of_storage_textures() {
    let stage = Stage::builtin(gpu(), "far-corners", &[]);
    let rays = scenes::aimed_rays(&mut Pcg::new(5), &stage.soup, RAYS);
    let other_rows = kernels_with(
        "accel/nodes",
        &[(
            "textureLoad(nodes, texel(at), 0)",
            "textureLoad(nodes, texel(at).yx, 0)",
        )],
    );
    // Nodes and triangles of leaves, records by index, cells.
    for name in ["cwbvh", "bvh", "irregular-grid"] {
        let traced = stage.traced(gpu(), structure(name));
        let expected = hits(gpu(), &stage, &traced, &rays);
        assert!(expected.iter().any(|hit| hit.triangle != u32::MAX));
        let found = hits(&gpu().sampling_texels(), &stage, &traced, &rays);
        assert_same_hits(name, &rays, &expected, &found);
        if name == "cwbvh" {
            let found = hits(
                &open(other_rows.clone()).sampling_texels(),
                &stage,
                &traced,
                &rays,
            );
            assert!(!differences(&expected, &found).is_empty(), "not seen");
        }
    }
}

#[test]
fn sampled_textures_give_the_image_of_storage_textures() {
    let stage = Stage::builtin(gpu(), "foliage", &[]);
    let traced = stage.traced(gpu(), structure("bvh"));
    let (sampler, what) = (sampler("owen-sobol", "none"), path(4));
    let image = |gpu: &Gpu| {
        let renderer = stage.renderer(gpu, &traced, &sampler, &what, [24, 16], false);
        renderer.add_samples(0, 2, 1).expect("samples");
        renderer.image().expect("an image")
    };
    assert_eq!(image(&gpu().sampling_texels()).pixels, image(gpu()).pixels);
}

#[test]
fn positive_numbers_are_told_by_their_bits() {
    const KERNEL: &str = "import package::common::numbers::is_positive;
@group(0) @binding(0) var<storage, read> numbers: array<f32>;
@group(0) @binding(1) var<storage, read_write> found: array<u32>;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x < arrayLength(&numbers)) { found[id.x] = u32(is_positive(numbers[id.x])); }
}";
    let positive = [f32::MIN_POSITIVE, 1e-30, 1.0, f32::MAX];
    let others = [
        0.0,
        -0.0,
        -1.0,
        f32::MIN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::NAN,
        -f32::NAN,
    ];
    let numbers = [&positive[..], &others].concat();
    let gpu = open(KernelLibrary::default().with_sources(&[("test/numbers", KERNEL)]));
    let buffer = |name: &str, words: &[f32]| gpu.storage(name, words).expect("a buffer");
    let found = buffer("found", &vec![-1.0; numbers.len()]);
    let mut bindings = Bindings::new();
    bindings
        .buffer("numbers", &buffer("numbers", &numbers))
        .buffer("found", &found);
    let pipeline = gpu.pipeline(&Composition::new("test/numbers"), true);
    let mut recording = Recording::new();
    recording
        .run(
            "numbers",
            &pipeline.expect("a kernel"),
            &bindings,
            [1, 1, 1],
        )
        .download("found", &found);
    let played = Player::new(&gpu).play(&recording).expect("played");
    let found: Vec<u32> = played.download("found").expect("words");
    let expected = numbers.iter().map(|x| u32::from(*x > 0.0 && x.is_finite()));
    assert!(found.iter().copied().eq(expected), "{found:?}");
}
