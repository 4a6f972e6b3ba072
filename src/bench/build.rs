//! Hashes the host sources that figures depend on: this crate and the workspace crates below it.
//! Code that only displays or compares records is not included.

use std::collections::BTreeSet;
use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::path::{Path, PathBuf};

fn collect(folder: &Path, out: &mut Vec<PathBuf>) {
    let entries = std::fs::read_dir(folder)
        .unwrap_or_else(|e| panic!("cannot read {}: {e}", folder.display()));
    for entry in entries {
        let path = entry.expect("a readable directory entry").path();
        let ending = path.extension().and_then(|e| e.to_str());
        if path.is_dir() {
            collect(&path, out);
        } else if matches!(ending, Some("rs" | "wgsl" | "toml")) {
            out.push(path);
        }
    }
}

/// Collects the folders of the crates that the manifest in `folder` depends on, recursively.
/// Kernels are excluded, as runs hash them separately.
fn below(folder: &Path, found: &mut BTreeSet<PathBuf>) {
    if !found.insert(folder.to_owned()) {
        return;
    }
    let manifest = std::fs::read_to_string(folder.join("Cargo.toml")).unwrap_or_default();
    let normal = manifest
        .split("[dev-dependencies]")
        .next()
        .unwrap_or_default();
    for line in normal
        .lines()
        .filter_map(|line| line.strip_prefix("raystone-"))
    {
        let name: String = line.chars().take_while(char::is_ascii_lowercase).collect();
        let beside = folder.with_file_name(name);
        if beside.is_dir() {
            below(&beside, found);
        }
    }
}

fn main() {
    let root = PathBuf::from(std::env::var("CARGO_MANIFEST_DIR").expect("set by cargo"));
    let mut crates = BTreeSet::new();
    below(&root, &mut crates);
    let mut files = Vec::new();
    for folder in &crates {
        collect(folder, &mut files);
        println!("cargo::rerun-if-changed={}", folder.display());
    }
    // Workspace files that affect every crate (profiles, versions); absent in a published package.
    for name in ["Cargo.toml", "Cargo.lock"] {
        let file = root.join("../..").join(name);
        if file.exists() {
            println!("cargo::rerun-if-changed={}", file.display());
            files.push(file);
        }
    }
    files.sort();
    // Also changes with the toolchain, as the standard hasher is not fixed.
    let mut hasher = DefaultHasher::new();
    let above = root.parent().unwrap_or(&root);
    for file in files {
        file.strip_prefix(above).unwrap_or(&file).hash(&mut hasher);
        std::fs::read(&file).ok().hash(&mut hasher);
    }
    println!("cargo::rustc-env=RAYSTONE_HOST={:016x}", hasher.finish());
}
