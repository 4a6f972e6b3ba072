//! The folder of a run through the program: reruns, kills, signals, two runs at once, odd names.

#[cfg(unix)]
#[path = "held.rs"]
mod held;

#[cfg(unix)]
use held::{Held, Place};
use raystone::measure::record::{Body, Line};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

fn program(out: &Path, more: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_raystone"));
    command
        .args(["run", "tests/data/tiny.toml", "--quiet", "--out"])
        .arg(out)
        .args(more)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

fn run(out: &Path, more: &[&str]) -> Output {
    program(out, more).output().expect("the program starts")
}

/// A run into a fresh folder that ends well.
fn whole_run(out: &Path, more: &[&str]) {
    let output = run(out, more);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Every record of a folder, each line whole.
fn records(folder: &Path) -> Vec<Body> {
    let text = std::fs::read_to_string(folder.join("records.jsonl")).expect("records");
    let parse = |line: &str| serde_json::from_str::<Line>(line).map(|line| line.body);
    let records: Result<Vec<_>, _> = text.lines().map(parse).collect();
    records.unwrap_or_else(|e| panic!("{e} in {text}"))
}

/// The pictures that the records name.
fn pictures(folder: &Path) -> Vec<PathBuf> {
    let names = records(folder).into_iter().flat_map(|record| match record {
        Body::Structure(r) => vec![r.heat_map],
        Body::Error(r) => vec![r.image, r.error_map],
        Body::Reference(r) => vec![Some(r.image)],
        _ => Vec::new(),
    });
    names.flatten().map(|name| folder.join(name)).collect()
}

fn report(folder: &Path) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_raystone"));
    let output = command.arg("report").arg(folder).output().expect("a start");
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let words = String::from_utf8_lossy(&output.stdout).into_owned();
    let page = words.trim().trim_start_matches("report: ").to_owned();
    std::fs::read_to_string(&page).unwrap_or_else(|e| panic!("{page}: {e}"))
}

#[test]
fn results_of_another_run_are_kept_unless_force_replaces_them() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("run");
    whole_run(&out, &[]);
    let before = std::fs::read(out.join("records.jsonl")).expect("records");
    let number = pictures(&out).len();
    assert!(number >= 5, "{number} pictures");

    let refused = run(&out, &[]);
    assert_eq!(refused.status.code(), Some(2));
    let words = stderr(&refused);
    assert!(
        ["records.jsonl", "--resume", "--number", "--force"]
            .iter()
            .all(|word| words.contains(word)),
        "{words}"
    );

    whole_run(&out, &["--number"]);
    assert_eq!(pictures(&folder.path().join("run-2")).len(), number);
    whole_run(&out, &["--force"]);
    assert!(std::fs::read(out.join("records.jsonl")).expect("records") != before);
    let replaced = pictures(&out);
    assert!(replaced.len() == number && replaced.iter().all(|picture| picture.is_file()));
    assert!(!out.join("partial").exists() && !out.join("images").exists());
    assert!(!report(&out).contains("is missing"));
}

#[cfg(unix)]
#[test]
fn a_killed_rerun_leaves_the_earlier_results() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path();
    whole_run(out, &[]);
    let before = std::fs::read(out.join("records.jsonl")).expect("records");
    // Before all measurements, while records are written, and after the structures.
    for (place, at, least) in [
        (Place::ReferenceTracer, None, 1),
        (Place::Reference, Some(2), 2),
        (Place::Reference, None, 4),
    ] {
        let mut held = Held::start(out, &["--force"], place);
        match at {
            Some(number) => held.wait_for_records(out, number),
            None => held.wait(),
        }
        held.kill();
        let kept = std::fs::read(out.join("records.jsonl")).expect("records");
        assert!(kept == before, "the records changed");
        assert!(pictures(out).iter().all(|picture| picture.is_file()));
        let written = records(&out.join("partial")).len();
        assert!(written >= least, "{written} records");
    }
    assert!(report(&out.join("partial")).contains("did not finish"));
    whole_run(out, &["--force"]);
    assert!(!out.join("partial").exists());
}

#[cfg(unix)]
#[test]
fn what_a_killed_run_measured_can_be_read_and_is_not_thrown_away() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut held = Held::start(folder.path(), &[], Place::Reference);
    held.wait();
    held.kill();
    assert!(report(folder.path()).contains("did not finish"));
    let refused = run(folder.path(), &[]);
    assert_eq!(refused.status.code(), Some(2), "{}", stderr(&refused));
    assert!(stderr(&refused).contains("partial"), "{}", stderr(&refused));
}

#[cfg(unix)]
#[test]
fn of_two_runs_into_one_folder_the_second_ends_at_once() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut first = Held::start(folder.path(), &[], Place::Reference);
    first.wait();
    for more in [&[][..], &["--force"]] {
        let second = run(folder.path(), more);
        assert_eq!(second.status.code(), Some(2));
        let words = stderr(&second);
        assert!(words.contains("another run is writing"), "{words}");
    }
    first.let_go();
    let (code, words) = first.end();
    assert_eq!(code, Some(0), "{words}");
    let lines = records(folder.path());
    let ends = lines.iter().filter(|r| matches!(r, Body::Finished(_)));
    assert_eq!(ends.count(), 1);
    assert!(matches!(lines.last(), Some(Body::Finished(_))));
}

#[cfg(unix)]
#[test]
fn signals_end_a_run_with_its_records_and_a_report() {
    for (signal, code) in [("INT", 130), ("TERM", 143)] {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut held = Held::start(folder.path(), &[], Place::Reference);
        held.wait();
        held.send(signal);
        if signal == "INT" {
            // It ends after the cell that is being measured, and no sooner.
            held.hear("SIGINT: the run ends behind the cell");
            assert!(!folder.path().join("records.jsonl").exists());
            held.let_go();
        }
        let (ended, words) = held.end();
        assert_eq!(ended, Some(code), "{words}");
        assert!(words.contains("report so far"), "{words}");
        match records(folder.path()).last() {
            Some(Body::Interrupted(end)) => assert_eq!(end.reason, format!("SIG{signal}")),
            other => panic!("the last record is {other:?}"),
        }
        let page = std::fs::read_to_string(folder.path().join("index.html")).expect("a page");
        assert!(page.contains("The run was interrupted"));
        assert!(!folder.path().join("partial").exists());
    }
}

#[cfg(unix)]
#[test]
fn an_interrupted_rerun_leaves_the_earlier_results() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    whole_run(folder.path(), &["--set", "axes.accel=bvh"]);
    let before = std::fs::read(folder.path().join("records.jsonl")).expect("records");
    let mut held = Held::start(folder.path(), &["--force"], Place::Reference);
    held.wait();
    held.send("INT");
    // Two signals that come at once count as one.
    held.hear("SIGINT: the run ends behind the cell");
    held.send("INT");
    let (code, words) = held.end();
    assert_eq!(code, Some(130), "{words}");
    let after = std::fs::read(folder.path().join("records.jsonl")).expect("records");
    assert!(before == after);
    assert!(!records(&folder.path().join("partial")).is_empty());
}

/// A model below folders with long names, as `tests/data/tiny.toml` needs it.
fn model(path: &Path) -> String {
    std::fs::create_dir_all(path.parent().expect("a folder")).expect("folders");
    std::fs::write(path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").expect("a model");
    format!("axes.scene=['{}']", path.display())
}

#[test]
fn long_labels_and_names_that_differ_in_case_have_pictures_of_their_own() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let deep = folder.path().join("x".repeat(200)).join("y".repeat(200));
    let [upper, lower] = ["Scene.obj", "scene.obj"].map(|name| deep.join(name));
    model(&upper);
    let scenes = model(&lower).replace("=[", &format!("=['{}', ", upper.display()));
    let out = folder.path().join("run");
    whole_run(&out, &["--set", &scenes]);
    let names = pictures(&out);
    let distinct: std::collections::BTreeSet<String> = names
        .iter()
        .map(|name| name.to_string_lossy().to_lowercase())
        .collect();
    assert!(
        names.len() >= 10 && distinct.len() == names.len(),
        "{names:?}"
    );
    assert!(names.iter().all(|picture| picture.is_file()));
}

#[cfg(unix)]
#[test]
fn a_picture_that_cannot_be_written_is_a_warning() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut held = Held::start(folder.path(), &[], Place::ReferenceTracer);
    held.wait();
    let images = folder.path().join("partial/images");
    std::fs::remove_dir(&images).expect("an empty folder");
    std::fs::write(&images, "in the way").expect("a file");
    held.let_go();
    let (code, words) = held.end();
    assert_eq!(code, Some(0), "{words}");
    assert!(
        words.contains("warning: ") && words.contains("heat"),
        "{words}"
    );
    let lines = records(folder.path());
    let warnings = lines.iter().filter(|r| matches!(r, Body::Warning(_)));
    assert!(warnings.count() >= 5);
    assert!(
        lines
            .iter()
            .any(|r| matches!(r, Body::Time(t) if t.failure.is_none()))
    );
    let page = std::fs::read_to_string(folder.path().join("index.html")).expect("a page");
    assert!(page.contains("warning"));
}
