//! Models and scenes that cannot be loaded, and the parts that a loader leaves out.

use super::{ABSENT_BACKEND, error, output, program, run, stdout, text};
use crate::support::in_turn;
use std::path::Path;

#[test]
fn a_missing_model_ends_with_2_before_anything_is_run() {
    let set = "axes.scene=no/such.obj";
    for arguments in [
        &["run", "tests/data/tiny.toml", "--dry-run", "--set", set][..],
        &["render", "--scene", "no/such.obj"],
        &["verify", "--scene", "no/such.obj"],
    ] {
        let mut command = program(arguments);
        let message = error(&output(command.env(ABSENT_BACKEND.0, ABSENT_BACKEND.1)), 2);
        assert!(message.contains("no/such.obj"), "{arguments:?}: {message}");
    }
}

/// Models that cannot be loaded, named by their faults.
fn bad_models(folder: &Path) -> Vec<String> {
    std::fs::create_dir(folder.join("folder.obj")).expect("a folder");
    let truncated = "ply\nformat ascii 1.0\nelement vertex 3\n";
    for (name, text) in [
        ("empty.obj", ""),
        ("broken.obj", "v 0 0 0\nv 1 0 x\n"),
        ("no-faces.obj", "v 0 0 0\n"),
        ("broken.gltf", "{\"asset\":"),
        ("truncated.ply", truncated),
        ("model.xyz", "1 2 3\n"),
    ] {
        std::fs::write(folder.join(name), text).expect("a model");
    }
    let names = std::fs::read_dir(folder).expect("the folder");
    let paths = names.map(|entry| entry.expect("a name").path().display().to_string());
    let missing = folder.join("missing.obj").display().to_string();
    paths.chain([missing]).collect()
}

#[test]
fn a_model_that_cannot_be_loaded_ends_every_command_with_2_and_its_name() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let models = bad_models(folder.path());
    assert_eq!(models.len(), 8);
    for model in &models {
        let ray = "0 0 1 0 0 -1";
        for arguments in [
            &["verify", "--accel", "bvh", "--scene", model][..],
            &["render", "--spp", "1", "--size", "16x16", "--scene", model],
            &["trace", "--ray", ray, "--scene", model],
            &["stress", "--quick", "--model", model],
        ] {
            let output = run(arguments);
            let words = [
                stdout(&output),
                String::from_utf8_lossy(&output.stderr).into(),
            ]
            .concat();
            assert_eq!(output.status.code(), Some(2), "{arguments:?}: {words}");
            let name = Path::new(model).file_name().expect("a name");
            assert!(
                words.contains(text(Path::new(name))),
                "{arguments:?}: {words}"
            );
            assert!(!words.contains("panicked"), "{words}");
        }
    }
}

#[test]
fn what_a_loader_left_out_is_a_warning_of_verify_trace_and_run() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let model = folder.path().join("model.obj");
    std::fs::write(
        &model,
        "mtllib no-such.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    )
    .expect("a model");
    let (scene, out) = (text(&model), folder.path().join("run"));
    let set = format!("axes.scene='{scene}'");
    for arguments in [
        &[
            "verify", "--accel", "bvh", "--rays", "256", "--scene", scene,
        ][..],
        &["trace", "--ray", "0 0 1 0 0 -1", "--scene", scene],
        &[
            "run",
            "tests/data/tiny.toml",
            "--set",
            &set,
            "--out",
            text(&out),
        ],
    ] {
        let output = run(arguments);
        let words = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(0), "{words}");
        let mut lines = words.lines();
        assert!(
            lines.any(|line| line.starts_with("warning: ") && line.contains("no-such.mtl")),
            "{arguments:?}: {words}"
        );
    }
    let page = std::fs::read_to_string(out.join("index.html")).expect("a page");
    assert!(page.contains("no-such.mtl"));
}

/// Triangles of an OBJ file without shared vertices.
fn triangles_of(corners: impl IntoIterator<Item = [[f32; 3]; 3]>) -> String {
    let vertex = |[x, y, z]: [f32; 3]| format!("v {x:e} {y:e} {z:e}\n");
    let mut count = 0;
    let triangle = |corners: [[f32; 3]; 3]| {
        count += 3;
        let vertices = corners.map(vertex).concat();
        format!("{vertices}f {} {} {}\n", count - 2, count - 1, count)
    };
    corners.into_iter().map(triangle).collect()
}

#[test]
fn verify_passes_models_of_awkward_shapes() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let unit = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let square = |k: u8| {
        let [x, y] = [k % 16, k / 16].map(f32::from);
        [
            [[x, y, 0.0], [x + 1.0, y, 0.0], [x, y + 1.0, 0.0]],
            [
                [x, y + 1.0, 0.0],
                [x + 1.0, y, 0.0],
                [x + 1.0, y + 1.0, 0.0],
            ],
        ]
    };
    let needle = [[-1e6, 8.0, 0.001], [1e6, 8.0, 0.001], [0.0, 8.0001, 0.001]];
    let flat = (0..=255).flat_map(square).chain([needle]);
    let turned = |k: u8| {
        let (sin, cos) = (0.1 * f32::from(k)).sin_cos();
        // All have the same middle.
        [[cos, sin, 0.0], [-cos, -sin, 1.0], [0.0, 0.0, -1.0]]
    };
    let sized = |size: f32| [[0.0; 3], [size, 0.0, 0.0], [0.0, size, 0.0]];
    // Edges of one unit, at which coordinates have 128 steps.
    let hilly = |k: u16| {
        let at = |x: u16, z: u16| {
            let height = (1.3 * f32::from(x)).sin() * (1.7 * f32::from(z)).sin();
            [1e5 + f32::from(x), height - 1e5, f32::from(z)]
        };
        let (x, z) = (k % 40, k / 40);
        [
            [at(x, z), at(x, z + 1), at(x + 1, z)],
            [at(x, z + 1), at(x + 1, z + 1), at(x + 1, z)],
        ]
    };
    let models = [
        ("hills far away", triangles_of((0..1600).flat_map(hilly))),
        (
            "1e-30",
            triangles_of([unit, turned(7)].map(|t| t.map(|v| v.map(|x| 1e-30 * x)))),
        ),
        (
            "two units at 1e7",
            triangles_of((0..9).map(|k| turned(k).map(|[x, y, z]| [1e7 + x, y, z]))),
        ),
        ("flat, and a needle of 2e6 units", triangles_of(flat)),
        ("sixty times one triangle", triangles_of([unit; 60])),
        ("one middle", triangles_of((0..60).map(turned))),
        (
            "1e-39 to 1e9",
            triangles_of([1e-39, 1e-20, 1.0, 1e9].map(sized)),
        ),
        ("one", triangles_of([unit])),
        ("a point", triangles_of([unit, [[0.5; 3]; 3]])),
        (
            "a line",
            triangles_of([unit, [[0.5; 3], [2.0; 3], [3.0; 3]]]),
        ),
    ];
    for (name, model) in in_turn("models of awkward shapes", models) {
        let path = folder.path().join("model.obj");
        std::fs::write(&path, model).expect("a writable folder");
        let output = run(&[
            "verify",
            "--accel",
            "bvh",
            "--rays",
            "256",
            "--scene",
            text(&path),
        ]);
        let words = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{name}: {words}");
    }
}

#[test]
fn a_dry_run_refuses_models_that_cannot_be_one() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (file, content, says) in [
        ("model.xyz", &b"v 0 0 0"[..], "unknown model format"),
        ("empty.obj", b"", "empty"),
        ("picture.obj", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "not text"),
        ("text.ply", b"v 0 0 0", "`ply`"),
        ("text.glb", b"v 0 0 0", "`glTF`"),
        ("folder.obj/inner", b"v 0 0 0", "directory"),
    ] {
        let path = folder.path().join(file);
        std::fs::create_dir_all(path.parent().expect("a parent")).expect("a folder");
        std::fs::write(&path, content).expect("a writable folder");
        let named = match file.split_once('/') {
            Some((first, _)) => folder.path().join(first),
            None => path,
        };
        let scene = format!("axes.scene=['{}']", named.display());
        let output = run(&["run", "tests/data/tiny.toml", "--dry-run", "--set", &scene]);
        let words = error(&output, 2);
        assert!(words.contains(says), "{file}: {words}");
    }
}

#[test]
fn a_scene_that_cannot_be_loaded_ends_with_2_and_the_rest_goes_on() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let model = folder.path().join("hollow.obj");
    std::fs::write(&model, "v 0 0 0\n").expect("a writable folder");
    let scenes = format!("axes.scene=['{}', 'cornell-box']", model.display());
    let out = folder.path().join("run");
    let output = run(&[
        "run",
        "tests/data/tiny.toml",
        "--set",
        &scenes,
        "--set",
        "axes.accel=bvh",
        "--out",
        text(&out),
    ]);
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{words}");
    assert!(
        words.contains("failed: ") && words.contains("hollow.obj"),
        "{words}"
    );
    let records = std::fs::read_to_string(out.join("records.jsonl")).expect("records");
    assert!(records.contains(r#""kind":"structure""#) && records.contains(r#""passed":true"#));
    assert!(out.join("index.html").is_file());
    // A lenient run forgives what fails, and no input that cannot be read.
    let again = folder.path().join("lenient");
    let tiny = ["run", "tests/data/tiny.toml", "--lenient", "--out"];
    let again = run(&[&tiny[..], &[text(&again), "--set", &scenes]].concat());
    assert_eq!(again.status.code(), Some(2), "{again:?}");
}

#[test]
fn a_lamp_or_an_environment_that_cannot_be_read_ends_with_2_and_its_place() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let short = folder.path().join("short.ies");
    let lines =
        "IESNA:LM-63-2002\nTILT=NONE\n1 1000 1 3 1 1 2 0 0 0\n1 1 40\n0 45 90\n0\n100 100\n";
    std::fs::write(&short, lines).expect("a file");
    let missing = folder.path().join("missing.ies");
    let sky = folder.path().join("sky.hdr");
    std::fs::write(&sky, "#?RADIANCE\n").expect("a file");
    for (scene, key, file, place) in [
        ("luminaire", "file", &short, "line 7"),
        ("luminaire", "file", &missing, "check the path"),
        ("white-furnace", "environment", &sky, "sky.hdr"),
    ] {
        let set = format!("scene.{scene}.{key}=\"{}\"", text(file));
        let arguments = [
            "render", "--spp", "1", "--size", "16x16", "--scene", scene, "--set", &set,
        ];
        let message = error(&run(&arguments), 2);
        let name = text(file);
        assert!(
            message.contains(name) && message.contains(place),
            "{message}"
        );
    }
}
