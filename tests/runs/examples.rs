//! The examples are as short as the documentation promises, and run.

use std::path::{Path, PathBuf};

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
        lines_of_code("// Text.\n\nuse a;\n    // Why.\nfn b() {}\n"),
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

mod trace_rays {
    include!("../../examples/trace_rays.rs");

    #[test]
    fn it_answers() {
        main().expect("two rays are traced");
    }
}

mod star_discrepancy {
    include!("../../examples/star_discrepancy.rs");

    #[test]
    fn it_answers() {
        main();
    }
}
