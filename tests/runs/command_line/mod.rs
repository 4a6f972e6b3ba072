//! The program as a user meets it: exit codes, messages, lists.

mod models;
mod pictures;
mod points;
mod references;

use raystone::config::Axis;
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
        .env("RAYSTONE_CACHE", "")
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
fn a_value_that_is_refused_is_named_as_it_was_typed() {
    let trace = |scene: &'static str| ["trace", "--ray", "0 0 1 0 0 1", "--scene", scene];
    let (family, label) = (trace("stress:needle:x:1"), trace("stress:needles:x:1"));
    let cases: [(&[&str], &str); 9] = [
        (
            &["verify", "--rays", "1"],
            "error: --rays: `gate.rays` = 1 ",
        ),
        (
            &["verify", "tests/data/tiny.toml", "--rays", "1"],
            "error: --rays: `gate.rays` = 1 ",
        ),
        (
            &["stress", "--rays", "0"],
            "error: --rays: `stress.rays` = 0 ",
        ),
        (&["advise", "cornel-box"], "error: unknown scene "),
        (
            &["advise", "cornell-box", "--rays", "-3"],
            "error: --rays -3: ",
        ),
        (
            &[
                "points",
                "--sequence",
                "sobol",
                "--count",
                "4",
                "--seed",
                "-1",
            ],
            "error: invalid value '-1' ",
        ),
        (
            &[
                "render",
                "--order",
                "blocks",
                "-o",
                "one.png",
                "--preview",
                "one.png",
            ],
            "error: --preview one.png: ",
        ),
        // What there is follows: `raystone stress` would run it all.
        (
            &family,
            "error: --scene: there is no family `needle`; did you mean `needles`?",
        ),
        (
            &label,
            "error: --scene: family needles has no case `x`; known: `scattered, ",
        ),
    ];
    for (arguments, expected) in cases {
        let message = error(&run(arguments), 2);
        assert!(message.starts_with(expected), "{arguments:?}: {message}");
    }
}

#[test]
fn a_missing_file_ends_with_2_and_its_name() {
    let message = error(&run(&["run", "no/such.toml"]), 2);
    assert!(message.contains("no/such.toml"), "{message}");
    assert_eq!(message.matches("No such file").count(), 1, "{message}");
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
        &["render", "--spp", "0"],
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
fn an_unknown_family_of_the_stress_suite_is_named_by_its_flag() {
    let message = error(&run(&["stress", "--quick", "--family", "edges,nedles"]), 2);
    assert!(
        message.contains("--family: unknown family `nedles`"),
        "{message}"
    );
    assert!(!message.contains("--set"), "{message}");
}

#[test]
fn pages_of_a_folder_without_tables_end_with_2_and_leave_it_empty() {
    let folder = tempfile::tempdir().expect("a folder");
    let message = error(&run(&["repro", "--pages", "--out", text(folder.path())]), 2);
    assert!(
        message.contains("holds no whole records of a table"),
        "{message}"
    );
    let left = std::fs::read_dir(folder.path()).expect("a folder").count();
    assert_eq!(left, 0, "a page of nothing was written");
}

#[test]
fn a_scene_is_exported_by_its_old_name_too_and_flags_of_something_else_are_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = text(folder.path());
    let new = [
        "export",
        "cornell-box",
        "--to",
        "mitsuba",
        "--size",
        "64x48",
    ];
    let old = ["export-mitsuba", "cornell-box", "--size", "64x48"];
    let scene = |arguments: &[&str]| {
        let output = run(&[arguments, &["--out", out]].concat());
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(0), "{told}");
        let file = std::fs::read_to_string(stdout(&output).trim()).expect("a scene");
        (file, told)
    };
    let (written, told) = scene(&new);
    assert!(
        written.contains("64") && !told.contains("is `raystone"),
        "{told}"
    );
    let (again, told) = scene(&old);
    assert!(
        again == written && told.contains("`raystone export --to mitsuba`"),
        "{told}"
    );
    for (arguments, says) in [
        (
            &[&new[..], &["-o", out, "--figure", "nodes"]].concat()[..],
            "--figure",
        ),
        (&new, "give their folder"),
        (&["export", out, "--to", "csv", "--size", "64x48"], "--size"),
        (
            &["export", out, "--to", "mitsubi"],
            "did you mean `mitsuba`",
        ),
        (&["points", "a.txt", "--count", "4"], "cannot be used"),
        (
            &["points", "a.txt", "--sequence", "sobol", "--count", "4"],
            "cannot be used",
        ),
        (&["help", "rum"], "did you mean `run`"),
    ] {
        let message = error(&run(arguments), 2);
        assert!(message.contains(says), "{arguments:?}: {message}");
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
#[cfg(target_os = "linux")] // Elsewhere there may be such a backend.
fn no_adapter_ends_with_3_and_doctor_says_what_to_do() {
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
        ("scene", &catalogue[Axis::Scene]),
        ("accel", &catalogue[Axis::Accel]),
        ("sequence", &catalogue[Axis::Sequence]),
        ("decorrelation", &catalogue[Axis::Decorrelation]),
        ("integrator", &catalogue[Axis::Integrator]),
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
    let settings = stdout(&run(&["list", "setting"]));
    for section in catalogue.sections() {
        assert!(settings.contains(&section.entry.description), "{settings}");
        for key in &section.entry.schema {
            let line = format!("{} ({})", key.description, key.range);
            assert!(settings.contains(&line) && words.contains(&line), "{line}");
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
#[cfg(unix)]
fn view_starts_the_window_beside_it_and_says_what_builds_one_that_is_missing() {
    use std::os::unix::fs::PermissionsExt as _;
    // Elsewhere, for a window may lie beside the program under test.
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [copy, window] = ["raystone", "raystone-view"].map(|name| folder.path().join(name));
    std::fs::copy(env!("CARGO_BIN_EXE_raystone"), &copy).expect("a writable folder");
    let view = || {
        let mut command = Command::new(&copy);
        command.args(["view", "--help", "--accel", "bvh,cwbvh"]);
        output(command.env("PATH", folder.path().join("no-such-folder")))
    };
    let message = error(&view(), 2);
    assert!(message.contains("`scripts/view` builds"), "{message}");
    std::fs::write(&window, "#!/bin/sh\necho \"$@\"\nexit 7\n").expect("a writable folder");
    let executable = std::fs::Permissions::from_mode(0o755);
    std::fs::set_permissions(&window, executable).expect("a file of mine");
    let ended = view();
    assert_eq!(ended.status.code(), Some(7));
    assert_eq!(stdout(&ended), "--help --accel bvh,cwbvh\n");
}

#[test]
fn a_reader_that_goes_away_is_no_failure() {
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    let output = output(program(&["list", "accel"]).stdout(writer));
    let gone = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!((output.status.code(), gone.as_str()), (Some(0), ""));
}

#[test]
#[cfg(target_os = "linux")] // Others need not have this device.
fn a_full_disk_is_told_and_ends_with_2() {
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full");
    let full = full.expect("a device that takes nothing");
    let output = program(&["list", "accel"])
        .stdout(full)
        .stderr(Stdio::piped())
        .spawn();
    let output = output
        .and_then(std::process::Child::wait_with_output)
        .expect("it starts");
    // The failure, and its cause.
    let message = error(&output, 2);
    assert!(message.contains("standard output: No space"), "{message}");
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
    let kernel = include_str!("../../../kernels/accel/brute_force.wesl");
    assert!(kernel.contains("var i = 0u"));
    let folder = tempfile::tempdir().expect("a temporary folder");
    let accel = folder.path().join("accel");
    std::fs::create_dir(&accel).expect("a writable folder");
    let faulty = kernel.replace("var i = 0u", "var i = 1u");
    std::fs::write(accel.join("brute_force.wesl"), faulty).expect("a writable folder");
    let wrong = output(program(&arguments).arg("--kernels").arg(folder.path()));
    let words = stdout(&wrong);
    assert_eq!(wrong.status.code(), Some(1), "{words}");
    for expected in [
        "FAILED",
        "0 of 1 structures passed",
        "first wrong primary ray: ",
    ] {
        assert!(words.contains(expected), "{expected} is not in {words}");
        assert!(!stdout(&right).contains(expected), "{expected}");
    }
}

#[test]
fn the_command_of_each_shard_plans_the_cells_that_were_divided() {
    let chosen = [
        "inspect",
        "tests/data/tiny.toml",
        "--set",
        "axes.decorrelation=none,cranley-patterson",
        "--only",
        "accel=bvh",
        "--only",
        "decorrelation=none",
    ];
    let inspected = |more: &[&str]| stdout(&run(&[&chosen[..], more].concat()));
    let told = inspected(&["--shards", "5"]);
    let words = told.split_once("raystone run ").and_then(|(_, rest)| {
        let (words, rest) = rest.split_once(" --shard K/5 --resume --out ")?;
        rest.starts_with("DIR/K\n").then_some(words)
    });
    let words: Vec<&str> = words.expect("a command").split_whitespace().collect();
    let again = run(&[&["inspect"], &words[..], &["--cells", "--shards", "5"]].concat());
    let cells = inspected(&["--cells", "--shards", "5"]);
    assert_eq!(stdout(&again), cells);
    assert_eq!(cells.lines().count(), 4, "{cells}");
    // Cells that are timed together leave others nothing.
    for (shards, said) in [
        ("4", "\n1 shard has nothing"),
        ("7", "\n3 shards have nothing"),
    ] {
        let told = stdout(&run(&[
            "inspect",
            "tests/data/tiny.toml",
            "--shards",
            shards,
        ]));
        assert!(told.contains(said), "{told}");
    }
}
