//! `raystone stress --mutants` hands over to cargo, and advises where it cannot.

use std::path::Path;
use std::process::{Command, Output};

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// The command in `folder`, with the programs of `path`.
fn plant(folder: &Path, path: &Path, out: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_raystone"))
        .args(["stress", "--mutants", "--adapter", "an adapter", "--out"])
        .arg(out)
        .current_dir(folder)
        .env("PATH", path)
        .output()
        .expect("the program starts")
}

fn said(output: &Output, code: i32) -> String {
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{text}");
    text
}

#[test]
fn outside_a_checkout_and_without_cargo_it_says_what_to_do() {
    let elsewhere = tempfile::tempdir().expect("a temporary folder");
    let folder = elsewhere.path();
    let text = said(&plant(folder, folder, folder), 2);
    assert!(
        text.contains("error: --mutants plants faults in the project's sources"),
        "{text}"
    );
    let text = said(&plant(Path::new(ROOT), folder, folder), 2);
    assert!(text.contains("error: cannot run cargo"), "{text}");
}

/// A `cargo` that notes how it was called, writes a table if it has one, and ends with `code`.
#[cfg(unix)]
fn stand_in(folder: &Path, table: Option<&str>, code: i32) {
    use std::os::unix::fs::PermissionsExt as _;
    let table = table.map(|t| format!("echo '{t}' >\"$RAYSTONE_MUTANTS_OUT/mutants.txt\"\n"));
    let script = format!(
        "#!/bin/sh\necho \"$* for $RAYSTONE_MUTANTS_ADAPTER\" >\"$RAYSTONE_MUTANTS_OUT/called\"\necho noise\n{}exit {code}\n",
        table.unwrap_or_default()
    );
    let file = folder.join("cargo");
    std::fs::write(&file, script).expect("a writable folder");
    std::fs::set_permissions(&file, std::fs::Permissions::from_mode(0o755)).expect("its own file");
}

#[cfg(unix)]
#[test]
fn in_a_checkout_it_runs_the_ignored_test_and_keeps_its_table_and_verdict() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let bin = folder.path();
    let out = bin.join("out");
    for (table, cargo, code) in [
        (Some("all killed"), 0, 0),
        (Some("one survivor"), 101, 1),
        // Sources that do not compile, or no test of this name: a table of an earlier run counts nothing.
        (None, 101, 2),
        (None, 0, 2),
    ] {
        stand_in(bin, table, cargo);
        let output = plant(&Path::new(ROOT).join("src/gpu"), bin, &out);
        let errors = said(&output, code);
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        match table {
            Some(table) => assert!(
                text.starts_with(table) && text.contains("mutants.jsonl"),
                "{text}"
            ),
            None => assert!(errors.contains("did not run to their end"), "{errors}"),
        }
        assert!(!text.contains("noise"), "{text}");
    }
    let called = std::fs::read_to_string(out.join("called")).expect("it was called");
    let test = "every_fault_of_the_table_is_seen_or_explained";
    assert!(
        called.contains(&format!("--exact --nocapture {test} for an adapter")),
        "{called}"
    );
    let tests = include_str!("main.rs");
    assert!(tests.contains(&format!("#[ignore = \"some minutes: all faults; `raystone stress --mutants` runs this\"]\nfn {test}()")));
}
