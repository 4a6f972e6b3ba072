//! A visitor of the page: models of their own are shown as `raystone render` shows them, what is broken is a sentence, a pixel has
//! the figures that the window finds, the scene moves, and an experiment sets the controls.

use super::{
    MOST_TIES, SWIFTSHADER, check_image, differing, left_image, rendered, text, told_with,
};
use crate::support;
use base64::Engine as _;
use raystone::config::Map;
use raystone::image::{Image, Picture, write_png};
use raystone::program::Program;
use raystone::run::Registries;
use raystone_viewer::{START, Screen, Step, Viewer};
use serde_json::{Value, json};
use std::path::Path;

const SCRIPT: &str = include_str!("visitor.js");
/// Settings of the first screen, and of what is rendered to compare.
const SETTINGS: [&str; 3] = ["run.resolution=[48,36]", "run.seed=7", "run.spp=[4]"];
/// The pixel that is inspected, the sample whose path is drawn, and the dimensions of points.
const PIXEL: ([u32; 2], u32, [u32; 2]) = ([24, 20], 1, [0, 3]);

const OBJ: &str = "mtllib room.mtl
v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nv 1 2 -1\nv -1 2 -1
vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1
usemtl floor\nf 1/1 4/4 3/3 2/2
usemtl wall\nf 1/1 2/2 5/3 6/4
";
const MTL: &str = "newmtl floor\nKd 0.6 0.5 0.4\nnewmtl wall\nKd 1 1 1\nmap_Kd maps/wall.png\n";
const STUDY: &str = "[run]
resolution = [40, 30]
spp = [2]
[axes]
scene = [\"room.obj\"]
accel = [\"bvh\", \"kd-tree\"]
sequence = [\"sobol\"]
[accel.bvh]
leaf_size = 3
[window]
map = \"nodes\"
exposure = 7.3
";

/// A square of two triangles, red, with a camera and a lamp: the host computes nothing for them.
fn glb() -> Vec<u8> {
    let corners: [[f32; 3]; 4] = [
        [-1.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.5],
        [-1.0, 1.0, 0.5],
    ];
    let mut binary: Vec<u8> = corners
        .as_flattened()
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    binary.extend([0_u16, 1, 2, 0, 2, 3].iter().flat_map(|x| x.to_le_bytes()));
    let document = json!({
        "asset": { "version": "2.0" },
        "buffers": [{ "byteLength": binary.len() }],
        "bufferViews": [
            { "buffer": 0, "byteLength": 48 },
            { "buffer": 0, "byteOffset": 48, "byteLength": 12 },
        ],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-1, 0, 0], "max": [1, 1, 0.5] },
            { "bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR" },
        ],
        "materials": [{ "pbrMetallicRoughness": { "baseColorFactor": [0.9, 0.1, 0.1, 1], "metallicFactor": 0 } }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1, "material": 0 }] }],
        "cameras": [{ "type": "perspective", "perspective": { "yfov": 0.7, "znear": 0.1 } }],
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": { "KHR_lights_punctual": { "lights": [{ "type": "point", "intensity": 20 }] } },
        "nodes": [
            { "mesh": 0 },
            { "camera": 0, "translation": [0, 0.5, 3] },
            { "translation": [0.5, 2, 2], "extensions": { "KHR_lights_punctual": { "light": 0 } } },
        ],
        "scenes": [{ "nodes": [0, 1, 2] }],
    });
    let mut chunk = document.to_string().into_bytes();
    chunk.resize(chunk.len().next_multiple_of(4), b' ');
    let word = |value: usize| (value as u32).to_le_bytes();
    let length = 12 + 8 + chunk.len() + 8 + binary.len();
    let head = [*b"glTF", word(2), word(length), word(chunk.len()), *b"JSON"].concat();
    [&head, &chunk, &word(binary.len())[..], b"BIN\0", &binary].concat()
}

/// Writes the files of the visitor, and returns them for the script.
fn files(folder: &Path) -> Value {
    std::fs::create_dir_all(folder.join("room/maps")).expect("a writable folder");
    let checks = [[250, 250, 250], [30, 90, 200]];
    let pixels = (0..64).map(|i| checks[(i + i / 8) % 2]).collect();
    let (width, height) = (8, 8);
    let picture = Picture {
        width,
        height,
        pixels,
    };
    write_png(&folder.join("room/maps/wall.png"), &picture).expect("a picture");
    let missing = r#"{ "asset": { "version": "2.0" }, "buffers": [{ "byteLength": 48, "uri": "away.bin" }],
        "bufferViews": [{ "buffer": 0, "byteLength": 48 }], "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" }],
        "nodes": [{ "mesh": 0 }], "scenes": [{ "nodes": [0] }] }"#;
    let glb = glb();
    for (name, bytes) in [
        ("room/room.obj", OBJ.as_bytes()),
        ("room/room.mtl", MTL.as_bytes()),
        ("quad.glb", &glb),
        ("broken.glb", &glb[..glb.len() - 30]),
        ("missing.gltf", missing.as_bytes()),
        ("notes.txt", b"no model"),
        ("study.toml", STUDY.as_bytes()),
    ] {
        std::fs::write(folder.join(name), bytes).expect("a writable folder");
    }
    let mut all = serde_json::Map::new();
    for name in [
        "room/room.obj",
        "room/room.mtl",
        "room/maps/wall.png",
        "quad.glb",
        "broken.glb",
        "missing.gltf",
        "notes.txt",
        "study.toml",
    ] {
        let bytes = std::fs::read(folder.join(name)).expect("a file");
        let engine = base64::engine::general_purpose::STANDARD;
        all.insert(name.to_owned(), engine.encode(bytes).into());
    }
    all.into()
}

fn settings(scene: &Path) -> Vec<String> {
    let scene = format!("axes.scene=[{:?}]", text(scene));
    SETTINGS
        .map(str::to_owned)
        .into_iter()
        .chain([scene])
        .collect()
}

/// What the program says of a model that it cannot load, without the folder.
fn said(model: &Path) -> String {
    let named = settings(model);
    let output = super::super::program(&["render", "-o", "x.pfm", "--set", &named[3]]);
    assert!(!output.status.success(), "{model:?}");
    let folder = format!("{}/", text(model.parent().expect("a folder")));
    String::from_utf8_lossy(&output.stderr).replace(&folder, "")
}

/// Rows of a pixel that no driver rounds, its path and the star discrepancy of its points, by the core of the window.
fn by_the_window(model: &Path) -> (Vec<(String, String)>, Vec<String>, String) {
    let registries = Registries::default();
    let screen = Screen::parse(START, "view", &settings(model), &registries).expect("a screen");
    let mut viewer = Viewer::new(support::gpu(), registries, Program::default(), false);
    viewer.show(screen, &mut |_| ()).expect("a view");
    while viewer.step(&|| false).expect("a step") != Step::Idle {}
    let (pixel, sample, dimensions) = PIXEL;
    let inspection = viewer.inspect(pixel).expect("a device").expect("a pixel");
    let rows = inspection.sides[0].rows().into_iter();
    let rows = rows.filter(|(name, _)| *name != "radiance");
    let path = viewer.path(0, pixel, sample).expect("a path");
    let points = viewer.points(0, pixel, dimensions, 1024).expect("points");
    let star = points.star.expect("points");
    let star = format!("{} points, D* {star:.5}", points.points.len());
    (
        rows.map(|(name, value)| (name.to_owned(), value)).collect(),
        path.text,
        star,
    )
}

/// Means of the maps of bounces and of cycles, by the core of the window.
fn means_by_the_window(model: &Path) -> [f64; 2] {
    let registries = Registries::default();
    let screen = Screen::parse(START, "view", &settings(model), &registries).expect("a screen");
    let mut viewer = Viewer::new(support::gpu(), registries, Program::default(), false);
    [Map::Bounces, Map::Cycles].map(|map| {
        let mut screen = screen.clone();
        screen.window.map = map;
        viewer.show(screen, &mut |_| ()).expect("a view");
        while viewer.step(&|| false).expect("a step") != Step::Idle {}
        viewer.frame().sides[0].figures.map_mean.expect("a map")
    })
}

/// Holds maps against the counted rays and the window, parameters of a model and dragged objects against what must be.
fn check_choices(seen: &Value, model: &Path) {
    let number = |text: &Value| -> f64 {
        let text = text.as_str().expect("a number").replace(',', "");
        text.parse().expect("a number")
    };
    let found = ["bounces", "cycles"].map(|map| number(&seen["maps"][map]));
    for (found, expected) in found.iter().zip(means_by_the_window(model)) {
        // Three digits, and what drivers round.
        assert!((found / expected - 1.0).abs() < 0.02, "{found} {expected}");
    }
    assert_eq!(seen["maps"]["bounces"], seen["maps"]["counted"]);
    let parameters = &seen["parameters"];
    let sentence = parameters[0].as_str().expect("a sentence");
    assert!(sentence.contains("sky.hdr"), "{sentence}");
    let stays = json!(["quad.glb", "3", "8 triangles"]);
    assert_eq!(json!(&parameters.as_array().expect("a list")[1..]), stays);
    let objects = &seen["objects"];
    assert!(objects["count"].as_u64() > Some(1), "{}", objects["count"]);
    assert!(objects["way"] != json!([0, 0, 0]));
    let [still, moved, back, typed] =
        ["still", "moved", "back", "typed"].map(|name| left_image(&objects[name]));
    assert_eq!(differing(&still, &back), [0, 0]);
    assert!(differing(&still, &moved)[1] > 20, "nothing moved");
    // Numbers on the page have six digits.
    assert!(differing(&moved, &typed)[1] <= MOST_TIES);
    assert_eq!(objects["gone"], true);
}

/// Holds an image that the host framed and lit against that of the program: sines of WebAssembly are rounded otherwise than those of
/// the machine, and the camera and the daylight with them.
fn check_framed(image: &Image, settings: &[String]) {
    let driver = Path::new(SWIFTSHADER);
    if driver.exists() {
        let [bits, beyond] = differing(image, &rendered(settings, Some(driver)));
        assert_eq!(beyond, 0, "{bits} pixels differ");
    }
}

/// Holds what was seen of a pixel against the window, the program and the image.
fn check_pixel(seen: &Value, model: &Path, image: &Image) {
    let (rows, path, star) = by_the_window(model);
    assert!(rows.len() >= 7, "{rows:?}");
    for (name, value) in &rows {
        assert_eq!(seen["pixel"][name][0], value.as_str(), "{name}: {seen:#}");
    }
    let ([x, y], ..) = PIXEL;
    let [r, g, b] = image.pixels[(y * image.width + x) as usize];
    assert_eq!(
        seen["pixel"]["radiance"][0],
        format!("{r:.4} {g:.4} {b:.4}")
    );
    assert_eq!(seen["path"], json!(path));
    assert!(path.len() > 1, "{path:?}");
    assert_eq!(seen["dots"], path.len());
    assert_eq!(seen["star"], star.as_str());
    assert_eq!(seen["clicked"], true, "a click keeps the samples");
    let ray = seen["ray"].as_str().expect("a ray");
    let trace = super::super::done(&[
        "trace",
        "--scene",
        text(model),
        "--accel",
        "cwbvh",
        "--ray",
        ray,
    ]);
    let told = seen["trace"].as_str().expect("a trace");
    let (_, told) = told.split_once('\n').expect("lines");
    assert!(
        trace.contains(told) && told.contains("equal to the bit"),
        "{trace}\n{told}"
    );
}

#[test]
fn the_web_page_shows_what_a_visitor_opens_and_inspects() {
    let folder = tempfile::tempdir().expect("a folder");
    let files = files(folder.path());
    let script = format!("const FILES = {files};\n{SCRIPT}");
    let query: String = SETTINGS
        .map(|s| format!("&set={}", s.replace('=', "%3D")))
        .concat();
    let Some(seen) = told_with(&format!("view{query}"), &script) else {
        return;
    };
    let [obj, glb, still, refitted, rebuilt] =
        ["obj", "glb", "still", "refitted", "rebuilt"].map(|name| left_image(&seen[name]));
    let model = folder.path().join("room/room.obj");
    check_image(&glb, &settings(&folder.path().join("quad.glb")));
    check_framed(&obj, &settings(&model));
    assert_eq!(seen["scenes"], json!(["room.obj", "room.obj"]));
    check_pixel(&seen, &model, &obj);
    // The comparison can fail: without its picture, the wall is another one.
    std::fs::remove_file(folder.path().join("room/maps/wall.png")).expect("a file");
    let bare = rendered(&settings(&model), None);
    assert!(differing(&obj, &bare)[1] > 4 * MOST_TIES);
    // What cannot be loaded is the loader's sentence, and what was there stays.
    let [broken, missing, unknown] = ["broken", "missing", "unknown"].map(|name| {
        assert_eq!(
            [&seen[name][1], &seen[name][2]],
            ["2 triangles", "quad.glb"]
        );
        seen[name][0].as_str().expect("a sentence").to_owned()
    });
    let absent = "away.bin: No such file or directory (os error 2)";
    let missing = missing.replace("./away.bin: it is not among the opened files", absent);
    for (sentence, file) in [(broken, "broken.glb"), (missing, "missing.gltf")] {
        let native = said(&folder.path().join(file));
        assert!(
            sentence.starts_with(file) && native.contains(&sentence),
            "{sentence}\n{native}"
        );
    }
    assert!(
        unknown.starts_with("notes.txt: unknown model format"),
        "{unknown}"
    );
    // A structure that follows the scene gives the image of one that is built over it.
    assert_eq!(differing(&still, &glb), [0, 0]);
    assert_eq!(differing(&refitted, &rebuilt), [0, 0]);
    assert!(seen["frame"].as_u64() >= Some(2) && differing(&refitted, &still)[1] > 0);
    // The exposure lies beyond the slider, and between two of its steps.
    let controls = json!([
        "room.obj", "bvh", "3", "kd-tree", "40,30", "2", "nodes", "7.3"
    ]);
    assert_eq!(seen["controls"], controls);
    assert_eq!(seen["faults"], "");
    check_choices(&seen, &folder.path().join("quad.glb"));
    check_waits(&seen);
}

/// Another exposure does not wait for the sample at hand.
fn check_waits(seen: &Value) {
    let waits: Vec<f64> = serde_json::from_value(seen["waits"].clone()).expect("times");
    let sample = seen["sample"].as_f64().expect("a time");
    let longest = waits.iter().copied().fold(0.0, f64::max);
    println!("exposure after {waits:.0?} ms, a sample takes {sample:.0} ms");
    // A fast adapter has nothing to wait for.
    assert!(
        sample < 200.0 || longest < 0.5 * sample,
        "{waits:?} {sample}"
    );
}
