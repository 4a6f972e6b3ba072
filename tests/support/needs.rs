//! Needs of tests that not every machine meets: a test without them reports it, and fails if the need is in
//! `RAYSTONE_REQUIRE`.

use std::fmt::Display;

/// Possible needs, by the words that `RAYSTONE_REQUIRE` accepts, separated by blanks.
const KNOWN: [&str; 15] = [
    // Adapter: one that computes as the host does; the very driver of the table of image hashes.
    "exact-adapter",
    "known-driver",
    // Files beside the project: scenes, tables and digests. Of a package: the folder `fuzz`.
    "files",
    "fuzz",
    // Programs.
    "chromium",
    "wasm",
    "npm",
    "slurm",
    "shells",
    "pdflatex",
    "tint",
    "embree",
    "mitsuba",
    // Modules of Python.
    "scipy",
    "python-modules",
];

/// Reports that a test, or a part of it, is skipped for want of something.
///
/// # Panics
/// If it is required, or if a word is none of [`KNOWN`].
pub fn skip(need: &str, why: impl Display) {
    let required = std::env::var("RAYSTONE_REQUIRE").unwrap_or_default();
    if let Err(fault) = refusal(&required, need, &why) {
        panic!("{fault}");
    }
    println!("skipped for want of {need}: {why}");
}

/// Checks that a test may be skipped without its need.
///
/// # Errors
/// The need is required, or a word is none of [`KNOWN`].
pub fn refusal(required: &str, need: &str, why: &dyn Display) -> Result<(), String> {
    for word in required.split_whitespace().chain([need]) {
        if !KNOWN.contains(&word) {
            return Err(format!(
                "RAYSTONE_REQUIRE: nothing is called `{word}`; known: {KNOWN:?}"
            ));
        }
    }
    if required.split_whitespace().any(|word| word == need) {
        Err(format!("RAYSTONE_REQUIRE names {need}, but {why}"))
    } else {
        Ok(())
    }
}
