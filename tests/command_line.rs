//! The program as a user meets it: exit codes, messages, lists.

use raystone::discrepancy::Measure;
use raystone::measure::metrics::METRICS;
use raystone::run::Registries;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// A backend that no Linux machine has, so that no adapter answers.
const ABSENT_BACKEND: (&str, &str) = ("WGPU_BACKEND", "dx12");

fn program(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_raystone"));
    command
        .args(arguments)
        .current_dir(env!("CARGO_MANIFEST_DIR"));
    command
}

fn run(arguments: &[&str]) -> Output {
    output(&mut program(arguments))
}

fn output(command: &mut Command) -> Output {
    command
        .stdin(Stdio::null())
        .output()
        .expect("the program starts")
}

fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// The one `error: …` sentence of a command that ended with `code`.
fn error(output: &Output, code: i32) -> String {
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{text}");
    assert!(!text.contains("panicked"), "{text}");
    let mut errors = text.lines().filter(|line| line.starts_with("error: "));
    let first = errors
        .next()
        .unwrap_or_else(|| panic!("no `error: ` in {text}"));
    assert_eq!(errors.next(), None, "{text}");
    first.to_owned()
}

/// The tiny experiment with one text replaced by another, in a folder of its own.
fn changed_experiment(from: &str, to: &str) -> (tempfile::TempDir, PathBuf) {
    let text = std::fs::read_to_string("tests/data/tiny.toml").expect("a readable experiment");
    assert!(text.contains(from), "nothing to replace: {from}");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("changed.toml");
    std::fs::write(&file, text.replace(from, to)).expect("a writable folder");
    (folder, file)
}

fn text(path: &Path) -> &str {
    path.to_str().expect("a path in UTF-8")
}

#[test]
fn an_unknown_key_ends_with_2_and_names_file_line_and_the_nearest_key() {
    let (_folder, file) = changed_experiment("replicates = 2", "replicate = 2");
    let message = error(&run(&["run", text(&file), "--dry-run"]), 2);
    assert!(message.contains("changed.toml:5"), "{message}");
    assert!(message.contains("`replicates`"), "{message}");
}

#[test]
fn an_unknown_structure_or_scene_ends_with_2_and_the_nearest_name() {
    let (_folder, file) = changed_experiment("\"bvh\"", "\"bhv\"");
    let message = error(&run(&["run", text(&file), "--dry-run"]), 2);
    assert!(
        message.contains("changed.toml:11") && message.contains("`bvh`"),
        "{message}"
    );
    for command in ["render", "verify"] {
        let message = error(&run(&[command, "--scene", "cornel-box"]), 2);
        assert!(
            message.contains("did you mean `cornell-box`"),
            "{command}: {message}"
        );
    }
}

#[test]
fn a_missing_file_ends_with_2_and_its_name() {
    let message = error(&run(&["run", "no/such.toml"]), 2);
    assert!(message.contains("no/such.toml"), "{message}");
    assert_eq!(message.matches("No such file").count(), 1, "{message}");
}

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

/// Models that cannot be loaded, by what is wrong with them.
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

#[test]
fn a_folder_that_cannot_be_written_ends_with_2_and_its_name() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("in-the-way");
    std::fs::write(&file, "").expect("a writable folder");
    let out = file.join("results");
    let message = error(
        &run(&["run", "tests/data/tiny.toml", "--out", text(&out)]),
        2,
    );
    assert!(message.contains("in-the-way"), "{message}");
}

#[test]
fn bad_usage_ends_with_2() {
    for arguments in [
        &["run"][..],
        &["dance"],
        &["render", "--spp", "12"],
        &["render", "--size", "big"],
        &["list", "colours"],
        &[
            "run",
            "tests/data/tiny.toml",
            "--dry-run",
            "--only",
            "accel=bhv",
        ],
        &["render", "--set", "axes.accel=bvh,roped-bvh"],
    ] {
        let message = error(&run(arguments), 2);
        assert!(message.len() > "error: ".len(), "{arguments:?}: {message}");
    }
}

#[test]
fn an_unknown_adapter_ends_with_3() {
    for arguments in [
        &["doctor", "--adapter", "no such adapter"][..],
        &["verify", "--adapter", "no such adapter"],
    ] {
        let message = error(&run(arguments), 3);
        assert!(message.contains("adapter"), "{message}");
    }
}

#[test]
fn no_adapter_ends_with_3_and_doctor_says_what_to_do() {
    if !cfg!(target_os = "linux") {
        println!("skipped: {ABSENT_BACKEND:?} may exist here");
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = text(folder.path());
    for arguments in [
        &["doctor"][..],
        &["run", "tests/data/tiny.toml", "--out", out],
    ] {
        let mut command = program(arguments);
        let output = output(command.env(ABSENT_BACKEND.0, ABSENT_BACKEND.1));
        let message = error(&output, 3);
        assert!(message.contains("no GPU adapter"), "{message}");
        if arguments == ["doctor"] {
            let words = stdout(&output);
            assert!(
                words.contains("WGPU_BACKEND=dx12 narrows the search"),
                "{words}"
            );
        }
    }
}

#[test]
fn list_mentions_every_entry_of_every_registry() {
    let listed = run(&["list"]);
    assert_eq!(listed.status.code(), Some(0));
    let words = stdout(&listed);
    let catalogue = Registries::default().catalogue();
    let axes = [
        ("scene", &catalogue.scene),
        ("accel", &catalogue.accel),
        ("sequence", &catalogue.sequence),
        ("decorrelation", &catalogue.decorrelation),
        ("integrator", &catalogue.integrator),
    ];
    for (axis, entries) in axes {
        let one_axis = stdout(&run(&["list", axis]));
        assert!(!entries.is_empty(), "{axis}");
        assert!(words.contains(&one_axis), "{axis}");
        for entry in entries {
            let line = one_axis
                .lines()
                .find(|line| line.trim_start().starts_with(&entry.name));
            let line = line.unwrap_or_else(|| panic!("no {} in {one_axis}", entry.name));
            assert!(line.contains(&entry.description), "{line}");
            for parameter in &entry.schema {
                let set = format!("{} = {}: ", parameter.name, parameter.default);
                assert!(one_axis.contains(&set), "{set} is not in {one_axis}");
            }
        }
    }
    for metric in METRICS {
        assert!(words.contains(metric.id), "{}", metric.id);
    }
    for measure in Measure::ALL {
        assert!(words.contains(measure.description()), "{measure:?}");
    }
}

#[test]
fn a_dry_run_prints_the_cells_and_needs_no_adapter() {
    let mut command = program(&["run", "tests/data/tiny.toml", "--dry-run"]);
    let output = output(command.env(ABSENT_BACKEND.0, ABSENT_BACKEND.1));
    assert_eq!(output.status.code(), Some(0));
    let words = stdout(&output);
    for expected in [
        "cornell-box: bvh, uniform-grid",
        "pixel-hash × none",
        "estimate: about",
    ] {
        assert!(words.contains(expected), "{expected} is not in {words}");
    }
    assert!(!words.contains("roped-bvh"), "{words}");
}

#[test]
fn a_report_of_a_folder_without_records_ends_with_2() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let message = error(&run(&["report", text(folder.path())]), 2);
    assert!(message.contains("records.jsonl"), "{message}");
    std::fs::write(folder.path().join("records.jsonl"), "").expect("a writable folder");
    error(&run(&["report", text(folder.path())]), 2);
}

#[test]
fn the_version_names_the_package_and_help_the_exit_codes() {
    let version = stdout(&run(&["--version"]));
    let expected = concat!("raystone ", env!("CARGO_PKG_VERSION"));
    assert!(version.starts_with(expected), "{version}");
    for arguments in [&["--help"][..], &["run", "--help"], &["verify", "-h"]] {
        let help = stdout(&run(arguments));
        assert!(help.contains("3  no usable adapter"), "{help}");
    }
}

#[test]
fn a_reader_that_goes_away_is_no_failure_but_a_full_disk_is() {
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    let output = output(program(&["list", "accel"]).stdout(writer));
    let gone = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!((output.status.code(), gone.as_str()), (Some(0), ""));
    let Ok(full) = std::fs::OpenOptions::new().write(true).open("/dev/full") else {
        println!("skipped: no /dev/full here");
        return;
    };
    let output = program(&["list", "accel"])
        .stdout(full)
        .stderr(Stdio::piped())
        .spawn();
    let output = output
        .and_then(std::process::Child::wait_with_output)
        .expect("it starts");
    assert!(error(&output, 2).contains("standard output"));
}

#[test]
fn verify_ends_with_0_where_hits_are_right_and_with_1_where_a_kernel_skips_a_triangle() {
    let arguments = [
        "verify",
        "--scene",
        "cornell-box",
        "--accel",
        "brute-force",
        "--rays",
        "256",
    ];
    let right = run(&arguments);
    assert_eq!(right.status.code(), Some(0), "{}", stdout(&right));
    assert!(stdout(&right).contains("1 of 1 structures passed"));
    let kernel = include_str!("../kernels/accel/brute_force.wesl");
    assert!(kernel.contains("var i = 0u"));
    let folder = tempfile::tempdir().expect("a temporary folder");
    let accel = folder.path().join("accel");
    std::fs::create_dir(&accel).expect("a writable folder");
    let faulty = kernel.replace("var i = 0u", "var i = 1u");
    std::fs::write(accel.join("brute_force.wesl"), faulty).expect("a writable folder");
    let wrong = output(program(&arguments).arg("--kernels").arg(folder.path()));
    let words = stdout(&wrong);
    assert_eq!(wrong.status.code(), Some(1), "{words}");
    assert!(
        words.contains("FAILED") && words.contains("0 of 1 structures passed"),
        "{words}"
    );
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
}

#[test]
fn render_writes_a_picture_of_the_size_asked_for() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let picture = folder.path().join("picture.png");
    let small = ["render", "--spp", "1", "--size", "24x16", "-o"];
    let rendered = output(program(&small).arg(&picture));
    assert_eq!(rendered.status.code(), Some(0));
    assert_eq!(stdout(&rendered).trim(), text(&picture));
    let decoded = image::open(&picture)
        .expect("a readable picture")
        .into_rgb8();
    assert_eq!(decoded.dimensions(), (24, 16));
    assert!(
        decoded
            .pixels()
            .any(|pixel| pixel != decoded.get_pixel(0, 0)),
        "one colour only"
    );
    let nowhere = output(program(&small).arg(folder.path().join("no/such/folder.png")));
    assert!(error(&nowhere, 2).contains("folder.png"));
}

#[test]
fn the_ending_of_a_picture_chooses_its_format() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let small = ["render", "--spp", "2", "--size", "24x16", "-o"];
    let bytes = |name: &str| {
        let picture = folder.path().join(name);
        let rendered = output(program(&small).arg(&picture));
        assert_eq!(rendered.status.code(), Some(0), "{name}");
        std::fs::read(&picture).expect("a picture")
    };
    for (name, signature) in [
        ("a.exr", &b"\x76\x2f\x31\x01"[..]),
        ("a.hdr", b"#?RADIANCE"),
        ("a.npy", b"\x93NUMPY"),
    ] {
        assert!(bytes(name).starts_with(signature), "{name}");
    }
    // The last of the file is the first row, so linear radiance is there, the right way up.
    let (pfm, npy) = (bytes("a.PFM"), bytes("b.npy"));
    let row = 24 * 12;
    assert_eq!(pfm[pfm.len() - row..], npy[npy.len() - 16 * row..][..row]);
}

#[test]
fn an_unknown_ending_ends_with_2_before_an_adapter_is_looked_for() {
    for name in ["picture.jpg", "picture", "picture.png.bak"] {
        let mut command = program(&["render", "-o", name]);
        let message = error(&output(command.env(ABSENT_BACKEND.0, ABSENT_BACKEND.1)), 2);
        assert!(message.contains(name), "{message}");
        assert!(
            message.contains(".png, .exr, .hdr, .pfm, .npy"),
            "{message}"
        );
    }
}

#[test]
fn render_says_what_was_approximated_and_how_long_it_took() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let model = folder.path().join("model.obj");
    let text =
        "mtllib model.mtl\nusemtl red\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv nan 0 0\nf 1 2 3\nf 1 2 4\n";
    std::fs::write(&model, text).expect("a model");
    let material = "newmtl red\nKd 1 0 0\nmap_Kd missing.png\n";
    std::fs::write(folder.path().join("model.mtl"), material).expect("a material");
    let picture = folder.path().join("picture.png");
    let arguments = ["render", "--spp", "4", "--size", "16x16", "--scene"];
    let rendered = output(program(&arguments).arg(&model).arg("-o").arg(&picture));
    assert_eq!(rendered.status.code(), Some(0));
    let said = String::from_utf8_lossy(&rendered.stderr).into_owned();
    for part in [
        "note: 1 triangle dropped",
        "missing.png",
        "no light",
        "1 triangles",
        "16×16",
        "4 spp",
        "Mrays/s",
    ] {
        assert!(said.contains(part), "{part}: {said}");
    }
}

#[test]
fn points_are_the_same_bytes_from_host_and_adapter() {
    let arguments = "points --sequence sobol --decorrelation owen-hash --count 100 --dims 0,3,2 --pixel 5,7 --seed 9";
    let arguments: Vec<&str> = arguments.split(' ').collect();
    let host = run(&arguments);
    let adapter = run(&[&arguments[..], &["--gpu"]].concat());
    assert_eq!(
        (host.status.code(), adapter.status.code()),
        (Some(0), Some(0))
    );
    assert_eq!(stdout(&host).lines().count(), 100);
    assert_eq!(stdout(&host), stdout(&adapter));
    let other = run(&[&arguments[..], &["--width", "200"]].concat());
    assert_ne!(
        stdout(&host),
        stdout(&other),
        "another width is another pixel"
    );

    let corput = run(&[
        "points",
        "--sequence",
        "van-der-corput",
        "--count",
        "3",
        "--dims",
        "0",
    ]);
    let expected = "0.0000000000000000e0\n5.0000000000000000e-1\n2.5000000000000000e-1\n";
    assert_eq!(stdout(&corput), expected);
    let third = [
        "points",
        "--sequence",
        "van-der-corput",
        "--count",
        "2",
        "--dims",
        "0",
        "--param",
        "base=3",
    ];
    assert!(stdout(&run(&third)).ends_with("3.3333333325572312e-1\n"));
}

#[test]
fn pictures_of_points_are_the_same_bytes_from_host_and_adapter() {
    let arguments = "points --sequence halton --decorrelation cranley-patterson --count 64 --dims 0,1,4 --seed 9 --copies 7";
    let arguments: Vec<&str> = arguments.split(' ').collect();
    let folder = tempfile::tempdir().expect("a temporary folder");
    let draw = |name: &str, more: &[&str]| {
        let to = folder.path().join("new").join(name);
        let drawn = run(&[&arguments[..], &["--plot", text(&to)], more].concat());
        assert_eq!(drawn.status.code(), Some(0), "{drawn:?}");
        assert!(
            stdout(&drawn).starts_with("page: "),
            "points are not printed"
        );
        to
    };
    let (host, adapter) = (draw("host", &[]), draw("adapter", &["--gpu"]));
    let page = std::fs::read_to_string(host.join("index.html")).expect("a page");
    for part in ["halton × cranley-patterson", "64 of 64 each", "7 pixels"] {
        assert!(page.contains(part), "{part}");
    }
    for name in [
        "point-set",
        "elementary-intervals",
        "projections",
        "pair-discrepancy",
        "pixels",
        "spectrum",
    ] {
        let [own, other] = [&host, &adapter].map(|folder| {
            let file = folder.join("plots").join(format!("{name}.svg"));
            std::fs::read(&file).expect("a picture")
        });
        assert!(own == other, "{name} differs");
        let png = image::open(host.join("plots").join(format!("{name}.png")));
        assert!(png.is_ok_and(|png| png.width() > 100), "{name}");
    }
}

#[test]
fn pictures_of_points_that_cannot_be_made_end_with_2_and_the_reason() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("file");
    std::fs::write(&file, "").expect("a writable folder");
    let below = file.join("folder");
    for (arguments, piece) in [
        ("--count 4 --copies 0", "--copies"),
        ("--count 4 --dims 1", "2 to 16 dimensions"),
        ("--count 1048577", "1048576"),
        ("--count 4 --pixel 0,22369621 --copies 200", "fewer pixels"),
        ("--count 4", "cannot make the folder"),
    ] {
        let arguments: Vec<&str> = ["points", "--sequence", "sobol", "--plot", text(&below)]
            .into_iter()
            .chain(arguments.split(' '))
            .collect();
        let message = error(&run(&arguments), 2);
        assert!(message.contains(piece), "no `{piece}` in {message}");
    }
    let message = error(
        &run(&[
            "points",
            "--sequence",
            "sobol",
            "--count",
            "4",
            "--copies",
            "9",
        ]),
        2,
    );
    assert!(message.contains("required"), "{message}");
}

#[test]
fn points_beyond_a_limit_or_without_sense_end_with_2_and_the_limit_or_reason() {
    for (arguments, pieces) in [
        ("--sequence sobl --count 4", &["did you mean `sobol`"][..]),
        (
            "--sequence sobol --count 4 --decorrelation owen-hsh",
            &["`owen-hash`"],
        ),
        ("--sequence owen-sobol --count 65537", &["65537", "65536"]),
        ("--sequence halton --count 4 --dims 0,256", &["257", "256"]),
        (
            "--sequence halton --count 4 --decorrelation owen-hash",
            &["base 2"],
        ),
        (
            "--sequence halton --count 4 --param digit=faure",
            &["did you mean `digits`"],
        ),
        (
            "--sequence halton --count 4 --param digits=fore",
            &["`faure`"],
        ),
        (
            "--sequence halton --count 4 --param digits=faure,plain",
            &["one value"],
        ),
        (
            "--sequence halton --count 4 --pixel 192,0",
            &["192 pixels wide"],
        ),
        (
            "--sequence hammersley --count 4 --decorrelation index-offset",
            &["moves the index"],
        ),
    ] {
        let arguments: Vec<&str> = std::iter::once("points")
            .chain(arguments.split(' '))
            .collect();
        let message = error(&run(&arguments), 2);
        for piece in pieces {
            assert!(
                message.contains(piece),
                "{arguments:?}: no `{piece}` in {message}"
            );
        }
    }
}
