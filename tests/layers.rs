//! Modules import downwards only. The order stands here once; the sources are read for every
//! `crate::…` path, in `use` lines and elsewhere.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Layers from the bottom: a module may use those above its own line here, and those of the same line
/// that stand together in [`TOGETHER`].
const LAYERS: [&[&str]; 14] = [
    &["atomic", "text", "geometry", "params", "random"],
    &["image"],
    &["gpu", "sampling", "discrepancy", "oracle"],
    &["config", "compaction"],
    &["scene"],
    &["accel"],
    &["integrator", "peers"],
    &["measure"],
    &["coherence"],
    &["run"],
    &["report"],
    &["export"],
    &["history"],
    &["repro"],
];
/// What stands above all layers and may use each of them; the last may use those before.
const ABOVE: [&str; 3] = ["compare", "stress", "commands"];
/// Pairs within a layer, of which the first may use the second.
const TOGETHER: [(&str, &str); 1] = [("params", "text")];

/// Macros, which stand at the root whatever module declares them: that of parameters.
const MACROS: [&str; 2] = ["parameters", "__parameter"];

/// Whether `user` may import `used`.
fn allowed(user: &str, used: &str) -> bool {
    if user == used || TOGETHER.contains(&(user, used)) {
        return true;
    }
    let layer = |name: &str| LAYERS.iter().position(|l| l.contains(&name));
    match (layer(user), layer(used)) {
        (Some(user), Some(used)) => used < user,
        (None, Some(_)) => ABOVE.contains(&user),
        (None, None) => user == "commands" && ABOVE.contains(&used),
        (Some(_), None) => false,
    }
}

/// The modules that a source names behind `crate::` (`raystone::` in the program); comments and unit
/// tests, which may look anywhere, are left out.
fn imported(source: &str, root: &str) -> BTreeSet<String> {
    let mut out = BTreeSet::new();
    let code = source
        .split("#[cfg(test)]\nmod tests {")
        .next()
        .unwrap_or_default();
    let code = code.lines().filter(|l| !l.trim_start().starts_with("//"));
    for line in code {
        for (at, _) in line.match_indices(root) {
            let rest = &line[at + root.len()..];
            let is_path = !line[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_');
            let name: String = rest
                .chars()
                .take_while(|c| c.is_ascii_lowercase() || *c == '_')
                .collect();
            assert!(
                !rest.starts_with('{'),
                "one module a line, so that this test can read it: {line}"
            );
            // What the root itself exports are macros.
            let is_module = !name.is_empty() && !MACROS.contains(&name.as_str());
            if is_path && is_module {
                out.insert(name);
            }
        }
    }
    out
}

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

#[test]
fn every_import_goes_downwards() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    sources(&src, &mut files);
    let (mut upward, mut seen) = (Vec::new(), BTreeSet::new());
    for file in &files {
        let relative = file.strip_prefix(&src).expect("below src");
        let module = relative.components().next().expect("a name").as_os_str();
        let module = module.to_string_lossy().trim_end_matches(".rs").to_owned();
        if ["lib", "main"].contains(&module.as_str()) {
            continue;
        }
        let root = if module == "commands" {
            "raystone::"
        } else {
            "crate::"
        };
        for used in imported(&fs::read_to_string(file).expect("a source"), root) {
            if !allowed(&module, &used) {
                upward.push(format!("{}: {module} uses {used}", relative.display()));
            }
        }
        seen.insert(module);
    }
    let known: BTreeSet<String> = LAYERS
        .iter()
        .copied()
        .flatten()
        .chain(&ABOVE)
        .map(|m| (*m).to_owned())
        .collect();
    assert_eq!(seen, known, "modules of src, and those of the order above");
    assert!(
        upward.is_empty(),
        "imports against the order:\n{}",
        upward.join("\n")
    );
}

#[test]
fn imports_against_the_order_are_seen() {
    assert!(allowed("measure", "accel") && !allowed("accel", "measure"));
    assert!(allowed("report", "run") && !allowed("run", "report"));
    assert!(!allowed("gpu", "sampling") && !allowed("gpu", "accel"));
    assert!(allowed("commands", "stress") && !allowed("stress", "commands"));
    assert!(!allowed("report", "stress") && allowed("stress", "report"));
    assert!(!allowed("scene", "nowhere"));
    let source = "use crate::gpu::Gpu;\n// crate::report\nlet x = crate::measure::f();\n\
        #[cfg(test)]\nmod tests {\n    use crate::run;\n}\n";
    let found: Vec<String> = imported(source, "crate::").into_iter().collect();
    assert_eq!(found, ["gpu", "measure"]);
}
