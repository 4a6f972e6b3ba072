//! A path tracer uses fewer than the eight storage buffers that WebGPU guarantees.

use crate::support::*;

const MOST: usize = 6;

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

#[test]
fn buffers_of_a_kernel_are_counted() {
    let kernel = "var<storage, read> a: u32;\nvar<uniform> b: B;\nvar<storage, read_write> c: u32;";
    assert_eq!(storage_buffers(kernel), 2);
}
