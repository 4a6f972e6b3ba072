//! Whole loads: small files written here, real models where they are at hand, and files that were
//! damaged on purpose.

use super::builtin::numeric::Pcg;
use super::*;
use crate::config::Params;
use std::fs;
use std::path::PathBuf;
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

/// Loads `file` from a folder that holds all of `files`.
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

/// A GLB file of this JSON and binary chunk.
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
fn relative_indices_and_polygons_give_the_same_triangles_as_absolute_ones() {
    let absolute = load_obj(&format!("{SQUARE}f 1 2 3 4\n")).unwrap();
    let relative = load_obj(&format!("{SQUARE}f -4 -3 -2 -1\n")).unwrap();
    let triangles = load_obj(&format!("{SQUARE}f 1 2 3\nf 1 3 4\n")).unwrap();
    assert_eq!(absolute.triangles.len(), 2);
    assert_eq!(absolute.hash, relative.hash);
    assert_eq!(absolute.hash, triangles.hash);
    let turned = load_obj(&format!("{SQUARE}f 2 3 4 1\n")).unwrap();
    assert_ne!(absolute.hash, turned.hash);
}

#[test]
fn obj_materials_and_textures_arrive() {
    let mtl = b"newmtl wall\nKd 0.5 0.25 2\nmap_Kd -s 1 1 1 tex.png\nNs 10\nillum 2\n\
        newmtl lamp\nKe 3 2 1\nnewmtl mirror\nillum 5\nKd 0 0 0\nKs 0.9 0.8 0.7\n\
        newmtl glass\nillum 7\nNi 1.5\nd 0.1\n";
    let obj = format!(
        "mtllib m.mtl\n{SQUARE}vt 0 0\nvt 1 0\nvt 1 0.75\nusemtl wall\nf 1/1 2/2 3/3\n\
         usemtl lamp\nf 1 2 3\nusemtl mirror\nf 1 2 3\nusemtl glass\nf 1 2 3\n"
    );
    let image = png();
    let scene = load_files(
        "a.obj",
        &[
            ("a.obj", obj.as_bytes()),
            ("m.mtl", mtl),
            ("tex.png", &image),
        ],
    )
    .unwrap();
    let [wall, lamp, mirror, glass] = &scene.materials[..] else {
        panic!("{:?}", scene.materials);
    };
    assert_eq!(wall.base_color, Vec3::new(0.5, 0.25, 1.0));
    assert_eq!(wall.base_color_texture, Some(0));
    assert_eq!(
        scene.textures[0].texels,
        [[255, 0, 0, 255], [0, 0, 255, 255]]
    );
    let down = |u: f32, v: f32| Vec2::new(u, 1.0 - v);
    assert_eq!(
        scene.uvs[0],
        [down(0.0, 0.0), down(1.0, 0.0), down(1.0, 0.75)]
    );
    assert_eq!(lamp.emission, Vec3::new(3.0, 2.0, 1.0));
    assert_eq!(mirror.kind, MaterialKind::Mirror);
    assert_eq!(mirror.base_color, Vec3::new(0.9, 0.8, 0.7));
    assert_eq!(
        (glass.kind, glass.source.ior),
        (MaterialKind::Diffuse, Some(1.5))
    );
    assert_eq!(scene.report.warnings.len(), 1, "{:?}", scene.report);
    assert!(scene.report.warnings[0].contains("glass"));
    assert_eq!(scene.emitters(), [1]);
}

#[test]
fn a_missing_library_or_texture_is_a_warning() {
    let obj = format!("mtllib none.mtl\n{SQUARE}usemtl a\nf 1 2 3\n");
    let scene = load_obj(&obj).unwrap();
    assert!(scene.report.warnings[0].contains("none.mtl"));
    assert_eq!(scene.materials[0].base_color, Vec3::splat(DEFAULT_ALBEDO));

    let mtl = b"newmtl a\nKd 1 0 0\nmap_Kd none.png\n";
    let obj = obj.replace("none.mtl", "m.mtl");
    let scene = load_files("a.obj", &[("a.obj", obj.as_bytes()), ("m.mtl", mtl)]).unwrap();
    assert!(scene.report.warnings[0].contains("none.png"));
    assert_eq!(scene.materials[0].base_color_texture, None);
    assert!(scene.uvs.is_empty());
}

#[test]
fn textures_are_reduced_aloud_or_left_out_as_the_options_say() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("a.glb");
    fs::write(&path, square_glb()).unwrap();
    let load_with = |textures, max_texture_size| {
        let options = LoadOptions {
            textures,
            max_texture_size,
        };
        load(&variant(path.to_str().unwrap()), &options).unwrap()
    };
    let reduced = load_with(true, 1);
    assert_eq!(reduced.textures[0].texels.len(), 1);
    assert!(reduced.report.warnings[0].contains("from 2x1 to 1x1"));
    let plain = load_with(false, 1024);
    assert!(plain.textures.is_empty() && plain.uvs.is_empty());
    assert_eq!(plain.materials[0].base_color_texture, None);
    assert!(plain.report.warnings.is_empty());
}

#[test]
fn broken_obj_files_say_the_line_and_what_is_wrong() {
    for (body, expected) in [
        (
            "f 1 2 9\n",
            "(line 5): the face refers to vertex 9, but there are 4",
        ),
        ("f 1 2 -5\n", "(line 5): the face refers to vertex -5"),
        ("f 1 2 0\n", "(line 5): the face refers to vertex 0"),
        ("f 1 2 x\n", "(line 5): `x` is not a face corner"),
        ("f 1/7 2/7 3/7\nvt 0 0\n", "texture coordinate 7"),
        ("v 1 2\nf 1 2 3\n", "(line 5): `v` with 2 numbers"),
        ("v 1 2 x\nf 1 2 3\n", "(line 5): `x` is not a number"),
        ("", "no triangles"),
        ("p 1\nl 1 2\n", "no triangles"),
    ] {
        let message = failure(load_obj(&format!("{SQUARE}{body}")));
        assert!(message.contains(expected), "{message} lacks {expected}");
        assert!(message.contains("model.OBJ"), "{message}");
    }
}

#[test]
fn non_finite_triangles_are_dropped_and_flat_ones_kept_and_both_are_counted() {
    let body = "v nan 0 0\nv inf 0 0\nf 1 2 3\nf 1 2 5\nf 1 2 6\nf 1 1 2\n";
    let scene = load_obj(&format!("{SQUARE}{body}")).unwrap();
    assert_eq!(scene.triangles.len(), 2);
    assert_eq!(scene.report.dropped_non_finite, 2);
    assert_eq!(scene.report.zero_area, 1);
    let message = failure(load_obj("v nan 0 0\nf 1 1 1\n"));
    assert!(message.contains("all 1 have a NaN"), "{message}");
}

#[test]
fn coordinates_that_would_overflow_are_refused() {
    assert!(load_obj("v 9e15 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\n").is_ok());
    let message = failure(load_obj("v 2e16 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\n"));
    assert!(message.contains("2e16"), "{message}");
}

#[test]
fn names_in_latin_1_do_not_stop_a_model() {
    let mut bytes = SQUARE.as_bytes().to_vec();
    bytes.extend(b"o T\xfcr\nf 1 2 3\n");
    let scene = load_files("a.obj", &[("a.obj", &bytes)]).unwrap();
    assert_eq!(scene.triangles.len(), 1);
}

#[test]
fn glb_nodes_are_flattened_with_their_transforms() {
    let scene = load_files("a.GLB", &[("a.GLB", &square_glb())]).unwrap();
    assert_eq!(scene.triangles.len(), 4);
    let far = scene.triangles[2].vertices[2];
    assert_eq!(far, Vec3::new(7.0, 2.0, 0.0));
    let camera = scene.camera.unwrap();
    assert_eq!(camera.eye, Vec3::new(0.0, 0.0, 7.0));
    assert!(
        (camera.target - camera.eye)
            .normalize()
            .distance(Vec3::NEG_Z)
            < 1e-6
    );
    assert!((camera.vertical_fov_degrees - 0.8_f32.to_degrees()).abs() < 1e-4);
    let lamp = &scene.materials[0];
    assert_eq!(lamp.emission, Vec3::new(4.0, 2.0, 0.0));
    assert_eq!(lamp.base_color, Vec3::new(0.5, 0.6, 0.7));
    assert_eq!(scene.uvs[0][1], Vec2::new(2.25, 0.0));
    assert_eq!(scene.textures[0].width, 2);
}

#[test]
fn gltf_buffers_and_images_may_lie_in_files_or_data_uris() {
    use base64::Engine;
    let image = png();
    let bin = square_bin(&[]);
    let encoded = base64::engine::general_purpose::STANDARD.encode(&image);
    let json = square_json(0)
        .replace(
            "{\"byteLength\":92}",
            "{\"byteLength\":92,\"uri\":\"a%20b.bin\"}",
        )
        .replace(
            ",\n      {\"buffer\":0,\"byteOffset\":92,\"byteLength\":0}",
            "",
        )
        .replace(
            "{\"bufferView\":3,\"mimeType\":\"image/png\"}",
            &format!("{{\"uri\":\"data:image/png;base64,{encoded}\"}}"),
        );
    let files: &[(&str, &[u8])] = &[("a.gltf", json.as_bytes()), ("a b.bin", &bin)];
    let apart = load_files("a.gltf", files).unwrap();
    let whole = load_files("a.glb", &[("a.glb", &square_glb())]).unwrap();
    assert_eq!(apart.hash, whole.hash);
    let message = failure(load_files("a.gltf", &files[..1]));
    assert!(
        message.contains("buffer 0") && message.contains("a b.bin"),
        "{message}"
    );
}

#[test]
fn broken_gltf_files_say_which_part() {
    let image = png();
    let bin = square_bin(&image);
    let json = square_json(image.len());
    for (from, to, expected) in [
        ("\"nodes\":[0,1,3]", "\"nodes\":[0,1,1]", "node 1"),
        ("\"children\":[2]", "\"children\":[1]", "node 1"),
        (
            "\"count\":4,\"type\":\"VEC3\"",
            "\"count\":3,\"type\":\"VEC3\"",
            "vertex 3",
        ),
        ("\"count\":6", "\"count\":600", "mesh 0"),
        (
            "\"count\":4,\"type\":\"VEC3\"",
            "\"count\":4,\"type\":\"VEC2\"",
            "mesh 0",
        ),
        ("{\"mesh\":0}", "{}", ""),
        (
            "\"asset\"",
            "\"extensionsRequired\":[\"X_none\"],\"asset\"",
            "extensionsRequired",
        ),
        ("\"material\":0", "\"material\":9", "material"),
    ] {
        assert!(json.contains(from), "{from}");
        let result = load_files("a.glb", &[("a.glb", &glb(&json.replace(from, to), &bin))]);
        match result {
            Ok(scene) => assert!(expected.is_empty() && scene.triangles.len() == 2, "{to}"),
            Err(error) => {
                let message = error.to_string();
                assert!(
                    !expected.is_empty() && message.contains(expected),
                    "{to}: {message}"
                );
            }
        }
    }
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

#[test]
fn damaged_files_never_panic() {
    let obj =
        format!("mtllib m.mtl\no a\n{SQUARE}vt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3//1 4\nf -1 -2 -3\n");
    let mtl = b"newmtl a\nKd 1 0 0\nKs 0 0 0\nillum 5\nmap_Kd tex.png\nd 1\nNs 3\n".to_vec();
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
        property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
        0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    let mut binary_ply = ply
        .split_inclusive("end_header\n")
        .next()
        .unwrap()
        .replace("ascii", "binary_little_endian")
        .into_bytes();
    binary_ply.extend(
        [0_u8; 36]
            .iter()
            .chain(&[3, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0]),
    );
    let image = png();
    let cases = [
        ("a.obj", obj.clone().into_bytes()),
        ("m.mtl", mtl.clone()),
        ("tex.png", image.clone()),
        ("a.ply", ply.as_bytes().to_vec()),
        ("b.ply", binary_ply),
        ("a.glb", square_glb()),
        ("a.gltf", square_json(0).into_bytes()),
    ];
    let folder = TempDir::new().unwrap();
    let mut pcg = Pcg::new(1);
    let mut outcomes = [0, 0];
    for (file, bytes) in &cases {
        // The library and the texture are seen through the OBJ file.
        let model = if file.starts_with('a') || file.starts_with('b') {
            file
        } else {
            "a.obj"
        };
        fs::write(folder.path().join("a.obj"), &obj).unwrap();
        fs::write(folder.path().join("m.mtl"), &mtl).unwrap();
        fs::write(folder.path().join("tex.png"), &image).unwrap();
        for round in 0..150 {
            let mut damaged = bytes.clone();
            if round % 3 == 0 {
                damaged.truncate(pcg.next_u32() as usize % bytes.len());
            }
            for _ in 0..round % 4 {
                if !damaged.is_empty() {
                    let at = pcg.next_u32() as usize % damaged.len();
                    damaged[at] = pcg.next_u32() as u8;
                }
            }
            fs::write(folder.path().join(file), &damaged).unwrap();
            outcomes[usize::from(load_path(&folder.path().join(model)).is_ok())] += 1;
        }
    }
    // Both happen, or the test damages too much or too little.
    assert!(outcomes.iter().all(|n| *n > 100), "{outcomes:?}");
}

fn real_scene(file: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../shared/scenes")
        .join(file);
    if !path.exists() {
        println!("skipped: {} is absent", path.display());
        return None;
    }
    Some(path)
}

#[test]
fn real_models_have_their_published_triangle_counts() {
    // File, triangles, of which zero area.
    for (file, triangles, zero_area) in [
        ("sponza-crytek/sponza.obj", 262_267, 0),
        ("country-kitchen/kitchen.glb", 1_021_815, 219),
        ("stanford-dragon/dragon_100k.obj", 100_000, 0),
        ("fireplace-room/fireplace_room.glb", 105_299, 190),
        (
            "japanese-bridge-garden/japanese_bridge_garden.glb",
            21_883,
            0,
        ),
        ("flight-helmet/FlightHelmet.gltf", 94_722, 0),
        ("sheen-chair/MixedLightingExample.gltf", 40_898, 0),
        ("cornell-box/CornellBox-Empty-CO.obj", 12, 0),
        ("cornell-box/CornellBox-Empty-RG.obj", 10, 0),
        ("cornell-box/CornellBox-Empty-Squashed.obj", 12, 0),
        ("cornell-box/CornellBox-Empty-White.obj", 12, 0),
        ("cornell-box/CornellBox-Glossy-Floor.obj", 1_112, 0),
        ("cornell-box/CornellBox-Glossy.obj", 1_112, 0),
        ("cornell-box/CornellBox-Mirror.obj", 34, 0),
        ("cornell-box/CornellBox-Original.obj", 36, 0),
        ("cornell-box/CornellBox-Sphere.obj", 2_186, 0),
        ("cornell-box/CornellBox-Water.obj", 7_089, 1),
        ("water-caustic/water.ply", 102_938, 0),
    ] {
        let Some(path) = real_scene(file) else {
            continue;
        };
        let options = LoadOptions {
            textures: false,
            ..LoadOptions::default()
        };
        let scene = load(&variant(path.to_str().unwrap()), &options).unwrap();
        assert_eq!(scene.triangles.len(), triangles, "{file}");
        assert_eq!(scene.report.zero_area, zero_area, "{file}");
        assert_eq!(scene.report.dropped_non_finite, 0, "{file}");
    }
}

#[test]
fn the_textures_and_lights_of_real_models_arrive() {
    if let Some(path) = real_scene("sponza-crytek/sponza.obj") {
        let scene = load_path(&path).unwrap();
        assert_eq!(scene.textures.len(), 24, "{:?}", scene.report);
        assert_eq!(scene.uvs.len(), scene.triangles.len());
        let extent = scene.bounds().max - scene.bounds().min;
        assert!(
            (extent - Vec3::new(3721.0, 1555.4, 2288.0))
                .abs()
                .max_element()
                < 1.0
        );
    }
    if let Some(path) = real_scene("country-kitchen/kitchen.glb") {
        let scene = load_path(&path).unwrap();
        assert!(scene.camera.is_some());
        assert!(!scene.textures.is_empty());
    }
    for (file, mirrors) in [("Original", 0), ("Sphere", 1)] {
        if let Some(path) = real_scene(&format!("cornell-box/CornellBox-{file}.obj")) {
            let scene = load_path(&path).unwrap();
            let lit = file == "Original";
            assert_eq!(!scene.emitters().is_empty(), lit, "{file}");
            assert_eq!(scene.environment == Vec3::ZERO, lit, "{file}");
            let is_mirror = |m: &&Material| m.kind == MaterialKind::Mirror;
            assert_eq!(
                scene.materials.iter().filter(is_mirror).count(),
                mirrors,
                "{file}"
            );
        }
    }
}
