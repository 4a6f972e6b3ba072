//! Textures and maps beyond the adapter's binding limit are reduced to the same light.

use super::variant;
use raystone::params::ParamValue;
use raystone::scene::{LEAST_BINDING, Light, LoadOptions, SceneData, load};
use std::fs;
use std::path::Path;

const WHITE: [u8; 4] = [255; 4];
const BLACK: [u8; 4] = [0, 0, 0, 255];

/// An image whose texels alternate along x and y.
fn checker(file: &Path, size: u32, [a, b]: [[u8; 4]; 2]) {
    let texel = |x, y| image::Rgba(if (x + y) % 2 == 0 { a } else { b });
    image::RgbaImage::from_fn(size, size, texel)
        .save(file)
        .unwrap();
}

/// A triangle with a colour, numbers, a normal map and emission.
fn model(folder: &Path, size: u32, colours: [[u8; 4]; 2]) -> std::path::PathBuf {
    checker(&folder.join("colour.png"), size, colours);
    checker(&folder.join("numbers.png"), size, [WHITE, BLACK]);
    checker(&folder.join("light.png"), size, [WHITE, BLACK]);
    // ±45 degrees about y.
    let tilted = [[218, 128, 218, 255], [38, 128, 218, 255]];
    checker(&folder.join("normal.png"), size, tilted);
    let floats = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]
        .iter()
        .chain(&[0.0; 6]);
    let bytes: Vec<u8> = floats.flat_map(|v| v.to_le_bytes()).collect();
    fs::write(folder.join("a.bin"), bytes).unwrap();
    let text = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":1},"material":0}]}],
        "materials":[{"alphaMode":"MASK","pbrMetallicRoughness":{"baseColorTexture":{"index":0},"metallicRoughnessTexture":{"index":1}},
        "normalTexture":{"index":2},"emissiveTexture":{"index":3},"emissiveFactor":[1,1,1]}],
        "textures":[{"source":0},{"source":1},{"source":2},{"source":3}],
        "images":[{"uri":"colour.png"},{"uri":"numbers.png"},{"uri":"normal.png"},{"uri":"light.png"}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},
        {"bufferView":1,"componentType":5126,"count":3,"type":"VEC2"}],
        "bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":24}],
        "buffers":[{"uri":"a.bin","byteLength":60}]}"#;
    let file = folder.join("a.gltf");
    fs::write(&file, text).unwrap();
    file
}

fn loaded(file: &Path, max_texture_size: u32, table_bytes: u64) -> SceneData {
    let options = LoadOptions {
        max_texture_size,
        table_bytes,
        ..LoadOptions::default()
    };
    load(&variant(file.to_str().unwrap()), &options).unwrap()
}

/// Linear light of an sRGB byte (IEC 61966-2-1).
fn light(byte: u8) -> f64 {
    let c = f64::from(byte) / 255.0;
    if c <= 0.04045 {
        c / 12.92
    } else {
        ((c + 0.055) / 1.055).powf(2.4)
    }
}

#[test]
fn a_checker_keeps_half_its_light_numbers_their_mean_and_normals_their_length() {
    let folder = tempfile::tempdir().unwrap();
    let file = model(folder.path(), 8, [WHITE, BLACK]);
    let scene = loaded(&file, 4, LEAST_BINDING);
    assert_eq!(scene.textures.len(), 4);
    for texture in &scene.textures {
        assert_eq!([texture.width, texture.height], [4, 4]);
        for [r, g, b, a] in &texture.texels {
            assert_eq!(*a, 255);
            match &*texture.name {
                name if name.contains("numbers") => assert_eq!([*r, *g, *b], [128; 3]),
                name if name.contains("normal") => {
                    assert!(r.abs_diff(128) <= 1 && g.abs_diff(128) <= 1 && *b >= 254);
                }
                name => assert!((light(*r) - 0.5).abs() < 0.004, "{name}: {r}"),
            }
        }
    }
}

#[test]
fn what_is_cut_out_lends_no_colour() {
    let folder = tempfile::tempdir().unwrap();
    let file = model(folder.path(), 8, [[255, 255, 0, 255], [0, 0, 0, 0]]);
    let scene = loaded(&file, 4, LEAST_BINDING);
    let colour = &scene.textures[0];
    assert!(colour.texels.iter().all(|t| *t == [255, 255, 0, 128]));
}

#[test]
fn textures_and_maps_are_as_large_as_the_adapter_binds() {
    let folder = tempfile::tempdir().unwrap();
    let file = model(folder.path(), 64, [WHITE, BLACK]);
    // Next to 8 MiB for materials and lights: at most four 64 × 64 images and a triangle.
    let needed = (8 << 20) + 4 * (4 * 64 * 64 + 9);
    let sizes = |bytes| {
        let scene = loaded(&file, 1024, bytes);
        scene.textures.iter().map(|t| t.width).collect::<Vec<_>>()
    };
    assert_eq!(sizes(needed), [64; 4]);
    assert_eq!(sizes(needed - 4), [32; 4]);
    let map = folder.path().join("sky.hdr");
    let picture = raystone::image::Image::new(4096, 8, vec![[1.0; 3]; 8 * 4096]).unwrap();
    let format = raystone::image::FileFormat::of(&map).unwrap();
    format.write(&map, &picture, &[]).unwrap();
    let width = |bytes| {
        let mut scene = variant("single-triangle");
        let name = ParamValue::Name(map.display().to_string());
        scene.params.0.insert("environment".to_owned(), name);
        let options = LoadOptions {
            table_bytes: bytes,
            ..LoadOptions::default()
        };
        let scene = load(&scene, &options).unwrap();
        let Some(Light::Environment { map, .. }) = scene.lights.last() else {
            panic!("no map");
        };
        map.width
    };
    assert_eq!(width(LEAST_BINDING), 4096);
    assert_eq!(width((8 << 20) + 24 * 4096 * 8), 2048);
}
