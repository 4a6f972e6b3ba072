//! A path tracer uses fewer than the eight storage buffers that WebGPU guarantees, and a pass over rays no more.

use crate::support::*;
use raystone::accel::tracer::RayBuffers;
use raystone::accel::{
    AccelKind as _, LiveRays, Load, Query, RayHierarchy, Traced, Tracer, TriangleBuffers,
};
use raystone::gpu::{KernelLibrary, Recording, Storage};
use raystone::params::ParamValue;

const MOST: usize = 6;
/// WebGPU's guarantee.
const GUARANTEED: usize = 8;

fn storage_buffers(kernel: &str) -> usize {
    kernel.matches("var<storage").count()
}

/// A textured square under a lamp.
fn scene() -> raystone::scene::SceneData {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text);
    let picture =
        image::RgbImage::from_fn(4, 4, |x, y| image::Rgb([60 * x as u8, 50 * y as u8, 9]));
    picture
        .save(folder.path().join("picture.png"))
        .expect("a picture");
    write(
        "model.mtl",
        "newmtl square\nmap_Kd picture.png\nnewmtl lamp\nKe 5 5 5\n",
    )
    .expect("written");
    let corners = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
    let faces = "usemtl square\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\nv 0 0 1\nv 1 0 1\nv 1 1 1\nusemtl lamp\nf 5 7 6\n";
    write("model.obj", &format!("mtllib model.mtl\n{corners}{faces}")).expect("written");
    from_file(&folder.path().join("model.obj"))
}

#[test]
fn a_path_tracer_with_textures_emitters_and_counters_binds_at_most_six() {
    let stage = Stage::new(gpu(), scene());
    let features = stage.buffers.features.flags();
    for wanted in ["textures", "lights"] {
        assert!(features.contains(&(wanted, true)), "{features:?}");
    }
    let sampler = sampler("owen-sobol", "none");
    for kind in inline_structures() {
        let traced = stage.traced(gpu(), kind);
        let renderer = stage.renderer(gpu(), &traced, &sampler, &path(4), [8, 8], true);
        let found = storage_buffers(&renderer.kernel_text());
        assert!((2..=MOST).contains(&found), "{}: {found}", kind.name());
    }
}

/// The greatest number of storage buffers of a pass, with the number of rays on the host and on the device.
fn most_of_a_pass(tracer: &Tracer) -> usize {
    let nothing = || Storage::scratch("nothing", 16);
    let buffers = RayBuffers {
        rays: nothing(),
        answers: nothing(),
        status: nothing(),
    };
    let live = LiveRays {
        counts: nothing(),
        word: 0,
        groups: [1, 1, 1].into(),
    };
    tracer
        .record_live(&mut Recording::new(), &buffers, 0..0, Some(live))
        .expect("passes");
    let texts = tracer.kernel_texts();
    texts
        .iter()
        .map(|text| storage_buffers(text))
        .max()
        .expect("passes")
}

#[test]
fn passes_over_rays_bind_at_most_eight() {
    let soup = scenes::lattice_soup(&mut Pcg::new(1), 50, 5);
    let triangles = TriangleBuffers::upload(gpu(), &soup).expect("triangles");
    let mut most = 0;
    for params in param_variants(&RayHierarchy.parameters()) {
        let built = build(&RayHierarchy, &soup, &params);
        let traced = Traced::upload(gpu(), &*built).expect("a structure");
        let traced = traced.loading(gpu(), &Load::ALL[1]).expect("buffers");
        for query in [Query::Closest, Query::Any] {
            let tracer = Tracer::new(gpu(), &triangles, &traced, query).expect("kernels");
            let found = most_of_a_pass(&tracer);
            assert!(found <= GUARANTEED, "{params:?}: {found}");
            most = most.max(found);
        }
    }
    assert!(most > MOST, "{most}: buffers are not counted");
}

/// More than twelve thousand triangles, in four parts where so few bytes can be bound.
#[test]
fn passes_over_rays_take_triangles_in_parts_where_the_adapter_binds_them_and_say_where_not() {
    let mut rng = Pcg::new(2);
    let soup = scenes::lattice_soup(&mut rng, 12_500, 60);
    let rays = scenes::aimed_rays(&mut rng, &soup, 200);
    let mut params = default_params(&RayHierarchy.parameters());
    for (name, value) in [("cluster", 128), ("capacity", 16_384)] {
        params.0.insert(name.to_owned(), ParamValue::Integer(value));
    }
    let built = build(&RayHierarchy, &soup, &params);
    let mut gpu = alone(KernelLibrary::default());
    gpu.limits.max_storage_buffer_binding_size = 12 * soup.records.len() as u64 + 400;
    let triangles = TriangleBuffers::upload(&gpu, &soup).expect("triangles");
    let traced = Traced::upload(&gpu, &*built).expect("a structure");
    let traced = traced.loading(&gpu, &Load::ALL[1]).expect("buffers");
    let offered = gpu.limits.max_storage_buffers_per_shader_stage;
    gpu.limits.max_storage_buffers_per_shader_stage = 9;
    let told = Tracer::new(&gpu, &triangles, &traced, Query::Closest).err();
    let told = told.expect("too many buffers").to_string();
    assert!(told.contains("at most 9") && told.contains("10"), "{told}");
    gpu.limits.max_storage_buffers_per_shader_stage = offered;
    if offered < 10 || !is_exact(&gpu) {
        return;
    }
    let tracer = Tracer::new(&gpu, &triangles, &traced, Query::Closest).expect("kernels");
    let batch = tracer.batch(&rays).expect("rays");
    batch.trace().expect("answers");
    assert!(
        batch
            .tracer()
            .features()
            .contains(&"triangles_3".to_owned())
    );
    assert_same_hits(
        "in four parts",
        &rays,
        &brute_force(&soup, &rays),
        &batch.hits().expect("hits"),
    );
}

#[test]
fn buffers_of_a_kernel_are_counted() {
    let kernel = "var<storage, read> a: u32;\nvar<uniform> b: B;\nvar<storage, read_write> c: u32;";
    assert_eq!(storage_buffers(kernel), 2);
}
