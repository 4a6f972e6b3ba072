//! `raystone render`: pictures, their formats, and the messages about them.

use super::{ABSENT_BACKEND, changed_experiment, error, output, program, run, stdout, text};

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
        "1 triangle, ",
        "16×16",
        "4 spp",
        " rays, ",
        "Mrays/s",
    ] {
        assert!(said.contains(part), "{part}: {said}");
    }
}

#[test]
fn a_test_that_is_not_exact_is_timed_and_neither_ranked_nor_rendered_with() {
    let (folder, file) = changed_experiment(
        "sequence =",
        "triangle = [\"bare\", \"watertight\"]\nsequence =",
    );
    let out = folder.path().join("out");
    let ran = run(&["run", text(&file), "--quiet", "--out", text(&out)]);
    let read = |name: &str| std::fs::read_to_string(out.join(name)).expect("a file of the run");
    // The reference is too noisy for so few samples; nothing else is wrong.
    assert!(ran.status.code().is_some_and(|code| code < 2), "{ran:?}");
    let summary = read("summary.md");
    for part in [
        "What exactness costs",
        "the triangle test bare is not exact",
        "passed up to rounding",
        "0 cells failed",
    ] {
        assert!(summary.contains(part), "no {part} in {summary}");
    }
    let ranked = summary.lines().filter(|line| line.contains("fastest"));
    assert!(
        !ranked.clone().any(|line| line.contains("bare")),
        "{summary}"
    );
    let records = read("records.jsonl");
    let of_bare = records
        .lines()
        .filter(|line| line.contains("\"inexact\":true"));
    assert_eq!(of_bare.count(), 2);
    let rendered = run(&[
        "render",
        "--set",
        "axes.triangle=[\"bare\"]",
        "-o",
        text(&folder.path().join("x.png")),
    ]);
    assert!(error(&rendered, 2).contains("is not exact"));
}
