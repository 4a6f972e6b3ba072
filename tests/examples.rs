//! The examples are as short as the documentation says, and answer.

use std::path::{Path, PathBuf};
use std::process::Command;

/// Lines of code that an example may have, comments and empty lines aside.
const LIMITS: [(&str, usize); 2] = [("trace_rays", 20), ("star_discrepancy", 5)];

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("examples/{name}.rs"))
}

/// Lines of code of a text that rustfmt has no wish to change.
fn lines_of_code(text: &str) -> usize {
    let is_code = |line: &&str| !line.trim().is_empty() && !line.trim().starts_with("//");
    text.lines().filter(is_code).count()
}

#[test]
fn examples_are_short() {
    assert_eq!(
        lines_of_code("//! Text.\n\nuse a;\n    // Why.\nfn b() {}\n"),
        2
    );
    for (name, limit) in LIMITS {
        let text = std::fs::read_to_string(file(name)).expect("an example");
        let found = lines_of_code(&text);
        assert!(found <= limit, "{name}: {found} lines, at most {limit}");
        assert!(
            text.lines().all(|line| line.chars().count() <= 100),
            "{name}"
        );
    }
}

#[test]
fn examples_answer() {
    // Cargo builds examples for tests, beside the tests' own folder.
    let me = std::env::current_exe().expect("a path");
    let folder = me.ancestors().nth(2).expect("a folder").join("examples");
    let run = |name: &str| {
        let done = Command::new(folder.join(name)).output();
        let done = done.unwrap_or_else(|e| panic!("{name}: {e}"));
        assert!(done.status.success(), "{name}: {done:?}");
        String::from_utf8(done.stdout).expect("a text")
    };
    assert!(run("star_discrepancy").contains("Some("));
    let hits = run("trace_rays");
    assert_eq!(hits.lines().count(), 2, "{hits}");
    assert!(
        hits.lines().all(|line| line.starts_with("triangle ")),
        "{hits}"
    );
}
