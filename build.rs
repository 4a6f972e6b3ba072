//! Embeds every kernel under `kernels/` and notes the commit the program is built from.

use std::fmt::Write as _;
use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::path::{Path, PathBuf};
use std::process::Command;

fn collect(folder: &Path, ending: &str, out: &mut Vec<PathBuf>) {
    let entries = std::fs::read_dir(folder)
        .unwrap_or_else(|e| panic!("cannot read {}: {e}", folder.display()));
    for entry in entries {
        let path = entry.expect("a readable directory entry").path();
        if path.is_dir() {
            collect(&path, ending, out);
        } else if path.extension().is_some_and(|e| e == ending) {
            out.push(path);
        }
    }
}

fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    output
        .status
        .success()
        .then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

/// Folders of `src` that only show and judge what was measured: no figure depends on them.
const SHOWING: [&str; 7] = [
    "commands", "compare", "export", "history", "report", "repro", "stress",
];

/// Hash of the sources on the host that figures depend on, so that cells of an earlier program are measured again. It
/// changes with the toolchain, too, as the hasher of the standard library is not fixed.
fn host_hash(root: &Path) -> u64 {
    let mut files = vec![root.join("Cargo.toml"), root.join("Cargo.lock")];
    collect(&root.join("src"), "rs", &mut files);
    collect(&root.join("src"), "wgsl", &mut files);
    files.sort();
    let mut hasher = DefaultHasher::new();
    for file in files {
        let name = file.strip_prefix(root).unwrap_or(&file);
        let folder = name.iter().nth(1).and_then(|part| part.to_str());
        if folder.is_some_and(|folder| SHOWING.contains(&folder)) {
            continue;
        }
        name.hash(&mut hasher);
        // A published package may lack its lock file.
        std::fs::read(&file).ok().hash(&mut hasher);
    }
    hasher.finish()
}

fn main() {
    let root = PathBuf::from(std::env::var("CARGO_MANIFEST_DIR").expect("set by cargo"));
    let kernels = root.join("kernels");
    let mut files = Vec::new();
    collect(&kernels, "wesl", &mut files);
    files.sort();
    let mut text = String::from("pub(crate) const EMBEDDED: &[(&str, &str)] = &[\n");
    for file in &files {
        let name = file
            .strip_prefix(&kernels)
            .expect("under kernels/")
            .with_extension("");
        let name = name
            .components()
            .map(|c| c.as_os_str().to_string_lossy())
            .collect::<Vec<_>>()
            .join("/");
        writeln!(
            text,
            "    ({name:?}, include_str!({:?})),",
            file.display().to_string()
        )
        .expect("writing to a String");
    }
    text.push_str("];\n");
    let out =
        PathBuf::from(std::env::var("OUT_DIR").expect("set by cargo")).join("embedded_kernels.rs");
    std::fs::write(&out, text).unwrap_or_else(|e| panic!("cannot write {}: {e}", out.display()));
    println!("cargo::rerun-if-changed=kernels");
    println!("cargo::rerun-if-changed=src");
    println!("cargo::rustc-env=RAYSTONE_HOST={:016x}", host_hash(&root));
    // Grows with every commit; absent outside a repository.
    if root.join(".git/logs/HEAD").exists() {
        println!("cargo::rerun-if-changed=.git/logs/HEAD");
    }
    if let Some(commit) = git(&["rev-parse", "--short=12", "HEAD"]) {
        println!("cargo::rustc-env=RAYSTONE_COMMIT={commit}");
    }
    if let Some(status) = git(&["status", "--porcelain", "--untracked-files=no"]) {
        println!("cargo::rustc-env=RAYSTONE_DIRTY={}", !status.is_empty());
    }
}
