//! Lists every `*.wesl` file below this folder.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

fn collect(folder: &Path, out: &mut Vec<PathBuf>) {
    let entries = std::fs::read_dir(folder)
        .unwrap_or_else(|e| panic!("cannot read {}: {e}", folder.display()));
    for entry in entries {
        let path = entry.expect("a readable directory entry").path();
        if path.is_dir() {
            collect(&path, out);
        } else if path.extension().is_some_and(|e| e == "wesl") {
            out.push(path);
        }
    }
}

fn main() {
    let root = PathBuf::from(std::env::var("CARGO_MANIFEST_DIR").expect("set by cargo"));
    let mut files = Vec::new();
    collect(&root, &mut files);
    files.sort();
    let mut text = String::from(
        "/// Module path with slashes (`accel/bvh`) and text of every kernel, sorted by path.\n\
        pub const EMBEDDED: &[(&str, &str)] = &[\n",
    );
    for file in &files {
        let name = file
            .strip_prefix(&root)
            .expect("below the folder")
            .with_extension("");
        let parts = name.components().map(|c| c.as_os_str().to_string_lossy());
        let name = parts.collect::<Vec<_>>().join("/");
        let file = file.display().to_string();
        writeln!(text, "    ({name:?}, include_str!({file:?})),").expect("writing to a String");
    }
    text.push_str("];\n");
    let out = PathBuf::from(std::env::var("OUT_DIR").expect("set by cargo")).join("embedded.rs");
    std::fs::write(&out, text).unwrap_or_else(|e| panic!("cannot write {}: {e}", out.display()));
    println!("cargo::rerun-if-changed=.");
}
