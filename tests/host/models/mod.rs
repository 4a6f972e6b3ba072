//! Complete loads of small files written here, valid and damaged, and of real models if available.

mod gltf;
mod obj;
mod ply;
mod real;
mod reduced;
mod said;
mod text;

use crate::support::needs;
use glam::{DVec3, Vec2, Vec3};
use raystone::params::{Params, Variant};
use raystone::random::Pcg32;
use raystone::scene::{
    AlphaChannel, AlphaMask, DEFAULT_ALBEDO, DIELECTRIC, DIFFUSE, GEOMETRIC, LoadOptions, MIRROR,
    Material, PHONG, PRINCIPLED, SceneData, SceneError, TextureUse, Wrap, decode_normal, load,
};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

fn variant(name: &str) -> Variant {
    Variant {
        name: name.to_owned(),
        params: Params::default(),
        label: name.to_owned(),
    }
}

fn load_path(path: &Path) -> Result<SceneData, SceneError> {
    load(&variant(path.to_str().unwrap()), &LoadOptions::default())
}

fn load_files(file: &str, files: &[(&str, &[u8])]) -> Result<SceneData, SceneError> {
    let folder = TempDir::new().unwrap();
    for (name, bytes) in files {
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    load_path(&folder.path().join(file))
}

fn load_obj(text: &str) -> Result<SceneData, SceneError> {
    load_files("model.OBJ", &[("model.OBJ", text.as_bytes())])
}

fn failure(result: Result<SceneData, SceneError>) -> String {
    result.unwrap_err().to_string()
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

/// A 2 x 1 image: red, then blue.
fn png() -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let pixels = image::RgbImage::from_raw(2, 1, vec![255, 0, 0, 0, 0, 255]).unwrap();
    pixels
        .write_to(&mut bytes, image::ImageFormat::Png)
        .unwrap();
    bytes.into_inner()
}

fn glb(json: &str, bin: &[u8]) -> Vec<u8> {
    let chunk = |kind: &[u8; 4], data: &[u8], pad: u8| {
        let mut data = data.to_vec();
        data.resize(data.len().next_multiple_of(4), pad);
        let mut chunk = (data.len() as u32).to_le_bytes().to_vec();
        chunk.extend_from_slice(kind);
        chunk.extend(data);
        chunk
    };
    let body = [
        chunk(b"JSON", json.as_bytes(), b' '),
        chunk(b"BIN\0", bin, 0),
    ]
    .concat();
    let mut file = b"glTF\x02\0\0\0".to_vec();
    file.extend((body.len() as u32 + 12).to_le_bytes());
    file.extend(body);
    file
}

/// The vertices, texture coordinates and indices of the unit square, then `image`.
fn square_bin(image: &[u8]) -> Vec<u8> {
    let corners = [[0.0_f32, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let positions = corners.iter().flat_map(|[x, y]| [*x, *y, 0.0]);
    let floats = positions.chain(corners.iter().flatten().copied());
    let mut bin: Vec<u8> = floats.flat_map(f32::to_le_bytes).collect();
    let indices = [0_u16, 1, 2, 0, 2, 3];
    bin.extend(indices.into_iter().flat_map(u16::to_le_bytes));
    bin.extend_from_slice(image);
    bin
}

/// Two instances of a textured square, the second twice as large and moved, and a camera.
fn square_json(image_bytes: usize) -> String {
    r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,1,3]}],
    "nodes":[{"mesh":0},{"children":[2],"translation":[5,0,0]},{"mesh":0,"scale":[2,2,2]},
      {"camera":0,"translation":[0,0,7]}],
    "cameras":[{"type":"perspective","perspective":{"yfov":0.8,"znear":0.1}}],
    "meshes":[{"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":1},"indices":2,
      "material":0}]}],
    "materials":[{"name":"lamp","emissiveFactor":[1,0.5,0],
      "extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":4}},
      "pbrMetallicRoughness":{"baseColorFactor":[0.5,0.6,0.7,1],"metallicFactor":0,
      "baseColorTexture":{"index":0,
        "extensions":{"KHR_texture_transform":{"scale":[2,1],"offset":[0.25,0]}}}}}],
    "textures":[{"source":0}],"images":[{"bufferView":3,"mimeType":"image/png"}],
    "accessors":[
      {"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},
      {"bufferView":1,"componentType":5126,"count":4,"type":"VEC2"},
      {"bufferView":2,"componentType":5123,"count":6,"type":"SCALAR"}],
    "bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":48},
      {"buffer":0,"byteOffset":48,"byteLength":32},
      {"buffer":0,"byteOffset":80,"byteLength":12},
      {"buffer":0,"byteOffset":92,"byteLength":IMAGE}],
    "buffers":[{"byteLength":TOTAL}]}"#
        .replace("IMAGE", &image_bytes.to_string())
        .replace("TOTAL", &(92 + image_bytes).to_string())
}

fn square_glb() -> Vec<u8> {
    let image = png();
    glb(&square_json(image.len()), &square_bin(&image))
}

#[test]
fn missing_empty_and_foreign_files_are_told_apart() {
    let message = failure(load(&variant("no/such.obj"), &LoadOptions::default()));
    assert!(message.contains("no/such.obj") && message.contains("check the path"));
    for file in ["a.obj", "a.ply", "a.glb", "a.gltf"] {
        let message = failure(load_files(file, &[(file, b"")]));
        assert!(message.contains("is empty"), "{message}");
    }
    let message = failure(load_files("a.stl", &[("a.stl", b"solid")]));
    assert!(message.contains("unknown model format"), "{message}");
    let message = failure(load(&variant("cornell-bx"), &LoadOptions::default()));
    assert!(message.contains("did you mean `cornell-box`"), "{message}");
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("folder.obj");
    fs::create_dir(&path).unwrap();
    assert!(matches!(load_path(&path), Err(SceneError::Read { .. })));
}

/// Damaged models are tested in `tests/mutated_files`, which has no textures in files.
#[test]
fn a_damaged_texture_never_panics() {
    let model = format!("mtllib m.mtl\nusemtl a\n{SQUARE}vt 0 0\nf 1/1 2/1 3/1\n");
    let image = png();
    let mut pcg = Pcg32::with_stream(1, Pcg32::DEFAULT_STREAM);
    let mut outcomes = [0, 0];
    for round in 0..150 {
        let mut damaged = image.clone();
        if round % 3 == 0 {
            damaged.truncate(1 + pcg.next_u32() as usize % (image.len() - 1));
        }
        for _ in 0..round % 4 {
            let at = pcg.next_u32() as usize % damaged.len();
            damaged[at] = pcg.next_u32() as u8;
        }
        let files: [(&str, &[u8]); 3] = [
            ("a.obj", model.as_bytes()),
            ("m.mtl", b"newmtl a\nmap_Kd tex.png\n"),
            ("tex.png", &damaged),
        ];
        let scene = load_files("a.obj", &files).expect("a model without its texture");
        outcomes[scene.textures.len()] += 1;
    }
    // Both occur, or the test damages too much or too little.
    assert!(outcomes.iter().all(|n| *n > 20), "{outcomes:?}");
}
