//! Text models as found in practice, and files that models name.

use super::*;

const LIT: &str = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl lamp\nf 1 2 3\nusemtl wall\nf 1 3 4\n";
const MTL: &str = "newmtl lamp\nKe 3 2 1\nnewmtl wall\nKd 0.5 0.25 0.75\n";

fn lit(obj: &[u8], mtl: &[u8]) -> SceneData {
    let scene = load_files("a.obj", &[("a.obj", obj), ("m.mtl", mtl)]);
    scene.unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn marks_continuations_and_line_ends_change_nothing() {
    let plain = lit(LIT.as_bytes(), MTL.as_bytes());
    assert_eq!(plain.emitters(), [0]);
    let variants: [fn(&str) -> String; 5] = [
        |text| format!("\u{feff}{text}"),
        |text| text.replace('\n', "\r"),
        |text| text.replace('\n', "\r\n"),
        |text| text.replace(' ', " \\\n"),
        |text| text.replace(' ', " \\\r").replace('\n', "\r"),
    ];
    for change in variants {
        let (obj, mtl) = (change(LIT), change(MTL));
        let scene = lit(obj.as_bytes(), mtl.as_bytes());
        assert_eq!(scene.hash, plain.hash, "{obj:?}");
        assert_eq!(scene.report, plain.report, "{obj:?}");
    }
    assert!(plain.report.lines().is_empty(), "{:?}", plain.report);
}

#[test]
fn a_fault_after_continued_lines_is_told_with_the_line_of_the_file() {
    let error = load_obj("v 0 0 \\\n0\nv 1 0 0\nv 0 1 0\nf 1 \\\n2 9\n").unwrap_err();
    let text = error.to_string();
    assert!(text.contains("line 5") && text.contains('9'), "{text}");
}

#[test]
fn every_obj_that_is_cut_off_in_its_faces_is_an_error_or_says_so() {
    let whole = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\nf 1/1 3/1 4/1\n";
    let told = load_obj(whole).unwrap().report.lines().join("; ");
    assert!(!told.contains("line 7"), "{told}");
    let faces = whole.find("f 1").unwrap() + "f 1/1 2/1 3/1\n".len();
    for end in faces + 1..whole.len() {
        let text = &whole[..end];
        match load_obj(text) {
            Err(error) => assert!(error.to_string().contains("line 7"), "{text:?}: {error}"),
            Ok(scene) => {
                let lines = scene.report.lines().join("; ");
                assert!(lines.contains("line 7"), "{text:?}: {lines}");
            }
        }
    }
}

#[test]
fn faces_without_area_are_counted_with_the_first_line() {
    let scene = load_obj(&format!("{SQUARE}f 1 2\nf 1 2 3\nf 4\n")).unwrap();
    let lines = scene.report.lines().join("; ");
    assert!(
        lines.contains("2 faces") && lines.contains("line 5"),
        "{lines}"
    );
}

#[test]
fn absolute_paths_of_an_obj_model_are_not_read() {
    let folder = tempfile::tempdir().unwrap();
    let mtl = folder.path().join("m.mtl");
    fs::write(&mtl, MTL).unwrap();
    let obj = folder.path().join("models/a.obj");
    fs::create_dir(folder.path().join("models")).unwrap();
    for (name, is_read) in [(mtl.to_str().unwrap(), false), ("../m.mtl", true)] {
        fs::write(&obj, LIT.replace("m.mtl", name)).unwrap();
        let scene = load(&variant(obj.to_str().unwrap()), &LoadOptions::default()).unwrap();
        assert_eq!(scene.emitters().len(), usize::from(is_read), "{name}");
        let told = scene.report.lines().join("; ").contains("--allow-outside");
        assert_eq!(told, !is_read);
    }
    fs::write(&obj, LIT.replace("m.mtl", mtl.to_str().unwrap())).unwrap();
    let options = LoadOptions {
        allow_outside: true,
        ..LoadOptions::default()
    };
    assert_eq!(
        load(&variant(obj.to_str().unwrap()), &options)
            .unwrap()
            .emitters(),
        [0]
    );
}

/// A triangle with its buffer and image at these paths.
fn gltf(buffer: &str, image: &str) -> String {
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_0":1}},"material":0}}]}}],
        "materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}},"metallicFactor":0}}}}],
        "textures":[{{"source":0}}],"images":[{{"uri":"{image}"}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}},
        {{"bufferView":1,"componentType":5126,"count":3,"type":"VEC2"}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}},{{"buffer":0,"byteOffset":36,"byteLength":24}}],
        "buffers":[{{"uri":"{buffer}","byteLength":60}}]}}"#
    )
}

/// A folder `models` with buffers and images inside and beside it, and links both ways.
#[cfg(unix)]
fn models_and_links() -> TempDir {
    use std::os::unix::fs::symlink;
    let folder = tempfile::tempdir().unwrap();
    let inside = folder.path().join("models");
    fs::create_dir_all(inside.join("parts")).unwrap();
    let floats = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]
        .iter()
        .chain(&[0.0; 6]);
    let bytes: Vec<u8> = floats.flat_map(|v| v.to_le_bytes()).collect();
    for place in ["outside.bin", "models/a b.bin", "models/parts/a.bin"] {
        fs::write(folder.path().join(place), &bytes).unwrap();
    }
    for place in ["outside.png", "models/a.png"] {
        fs::write(folder.path().join(place), png()).unwrap();
    }
    symlink("../outside.bin", inside.join("link.bin")).unwrap();
    symlink("parts/a.bin", inside.join("within.bin")).unwrap();
    symlink("..", inside.join("up")).unwrap();
    folder
}

#[cfg(unix)]
#[test]
fn gltf_reads_files_of_its_own_folder_only() {
    let folder = models_and_links();
    let inside = folder.path().join("models");
    let model = inside.join("a.gltf");
    let load_with = |buffer: &str, image: &str, allow_outside| {
        fs::write(&model, gltf(buffer, image)).unwrap();
        let options = LoadOptions {
            allow_outside,
            ..LoadOptions::default()
        };
        load(&variant(model.to_str().unwrap()), &options)
    };
    let absolute = folder.path().join("outside.bin").display().to_string();
    let file_uri = format!("file://{absolute}");
    for outside in [
        "../outside.bin",
        "%2e%2e/outside.bin",
        "..%2Foutside.bin",
        "parts/../../outside.bin",
        "link.bin",
        "up/outside.bin",
        &absolute,
        &file_uri,
        "../missing.bin",
        "/etc/hostname",
        "/dev/zero",
    ] {
        let error = load_with(outside, "a.png", false).unwrap_err().to_string();
        assert!(
            error.contains("outside the model's folder"),
            "{outside}: {error}"
        );
    }
    for allowed in ["../outside.bin", "link.bin", &absolute, &file_uri] {
        assert!(load_with(allowed, "a.png", true).is_ok(), "{allowed}");
    }
    for within in [
        "a%20b.bin",
        "parts/a.bin",
        "./parts/../a b.bin",
        "within.bin",
    ] {
        let scene = load_with(within, "a.png", false).unwrap_or_else(|e| panic!("{within}: {e}"));
        assert_eq!(scene.textures.len(), 1);
    }
    let missing = load_with("./missing.bin", "a.png", false)
        .unwrap_err()
        .to_string();
    assert!(!missing.contains("outside the model's"), "{missing}");
    let scene = load_with("parts/a.bin", "../outside.png", false).unwrap();
    assert!(scene.textures.is_empty());
    assert!(
        scene
            .report
            .lines()
            .join("; ")
            .contains("outside the model's folder")
    );
    assert_eq!(
        load_with("parts/a.bin", "../outside.png", true)
            .unwrap()
            .textures
            .len(),
        1
    );
}

/// A square with red corners, compressed by glTF Transform 4.5.
const DRACO: &str = "RFJBQ08CAgEBAAAABAIBAgAAAR//ARH/AREC/wAAAAAAAQAJAwAAAgECCQQAAQIBAQEAAwMBMAEQAwAogpgAAAAAAP8/AAAAAAAAAAAAAAAAAAAAAIA/DgEBAQEBAQFAAQAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAgD8AAIA/CA==";

/// The command that a message recommends, between backticks.
fn recommended(message: &str) -> Vec<&str> {
    let command = message.split('`').find(|part| part.contains(" IN OUT"));
    command.expect(message).split(' ').collect()
}

#[test]
fn the_command_recommended_for_draco_makes_a_model_that_can_be_read() {
    let text = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "extensionsUsed":["KHR_draco_mesh_compression"],"extensionsRequired":["KHR_draco_mesh_compression"],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":1,"COLOR_0":2}},"indices":0,"extensions":
        {{"KHR_draco_mesh_compression":{{"bufferView":0,"attributes":{{"POSITION":0,"COLOR_0":1}}}}}}}}]}}],
        "accessors":[{{"componentType":5123,"count":6,"type":"SCALAR"}},
        {{"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}},
        {{"componentType":5126,"count":4,"type":"VEC4"}}],"bufferViews":[{{"buffer":0,"byteLength":127}}],
        "buffers":[{{"byteLength":127,"uri":"data:application/octet-stream;base64,{DRACO}"}}]}}"#
    );
    let folder = TempDir::new().unwrap();
    let (model, plain) = (
        folder.path().join("a.gltf"),
        folder.path().join("plain.glb"),
    );
    fs::write(&model, text).unwrap();
    let message = failure(load_path(&model));
    assert!(message.contains("mesh 0, primitive 0"), "{message}");
    let [npx, package, rest @ ..] = &recommended(&message)[..] else {
        panic!("{message}");
    };
    let run = |words: &[&str]| {
        let mut command = std::process::Command::new(npx);
        command.args(["--yes", package]).args(words);
        command.output().is_ok_and(|output| output.status.success())
    };
    if !run(&["--version"]) {
        needs::skip("npm", format!("it does not give {package}"));
        return;
    }
    let place = |word: &&str| match *word {
        "IN" => model.to_str().unwrap().to_owned(),
        "OUT" => plain.to_str().unwrap().to_owned(),
        word => word.to_owned(),
    };
    let words: Vec<String> = rest.iter().map(place).collect();
    assert!(
        run(&words.iter().map(String::as_str).collect::<Vec<_>>()),
        "{message}"
    );
    let scene = load_path(&plain).unwrap();
    assert_eq!((scene.triangles.len(), scene.report.zero_area), (2, 0));
    assert_eq!(scene.colors.len(), 2);
}
