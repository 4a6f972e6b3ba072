//! Packages apart from the workspace have lock files of their own, which follow the crates' dependencies.

use std::collections::BTreeSet;
use std::path::Path;
use toml::{Table, Value};

fn table(file: &str) -> Table {
    let text = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(file));
    text.unwrap_or_else(|e| panic!("{file}: {e}"))
        .parse()
        .unwrap_or_else(|e| panic!("{file}: {e}"))
}

/// What a crate of `src/` or `kernels/` depends on, for any target: all, and those that are not optional.
fn declared(manifest: &Table) -> [BTreeSet<String>; 2] {
    let targets = manifest.get("target").and_then(Value::as_table);
    let sections = targets.into_iter().flat_map(Table::values);
    let sections = sections.filter_map(Value::as_table).chain([manifest]);
    let dependencies: Vec<(&String, &Value)> = sections
        .flat_map(|section| ["dependencies", "build-dependencies"].map(|name| section.get(name)))
        .filter_map(|dependencies| dependencies?.as_table())
        .flatten()
        .collect();
    let is_needed = |value: &Value| value.get("optional") != Some(&Value::Boolean(true));
    let names = |some: fn(bool) -> bool| {
        let chosen = (dependencies.iter()).filter(|(_, value)| some(is_needed(value)));
        chosen.map(|(name, _)| (*name).clone()).collect()
    };
    [names(|_| true), names(|is_needed| is_needed)]
}

/// The crates of this project in a lock file whose dependencies are not those that their manifests declare.
fn stale(lock: &Table) -> Vec<String> {
    let packages = lock["package"].as_array().expect("packages");
    let mut found = Vec::new();
    let mut seen = 0;
    for package in packages {
        let name = package["name"].as_str().expect("a name");
        let manifest = match name.strip_prefix("raystone-") {
            Some("kernels") => "kernels/Cargo.toml".to_owned(),
            Some(name) => format!("src/{name}/Cargo.toml"),
            None => continue,
        };
        if !Path::new(env!("CARGO_MANIFEST_DIR"))
            .join(&manifest)
            .exists()
        {
            continue;
        }
        seen += 1;
        let [all, needed] = declared(&table(&manifest));
        let locked = package.get("dependencies").and_then(Value::as_array);
        // Where there are several versions, one stands behind the name.
        let locked = locked.into_iter().flatten().filter_map(Value::as_str);
        let locked: BTreeSet<String> = locked
            .filter_map(|name| Some(name.split(' ').next()?.to_owned()))
            .collect();
        if !locked.is_subset(&all) || !needed.is_subset(&locked) {
            found.push(name.to_owned());
        }
    }
    assert!(seen > 5, "{seen} crates");
    found
}

#[test]
fn lock_files_of_packages_apart_follow_the_crates() {
    for folder in ["view", "web"] {
        let mut lock = table(&format!("{folder}/Cargo.lock"));
        let found = stale(&lock);
        assert!(
            found.is_empty(),
            "{found:?} have other dependencies now: `cargo update --workspace --manifest-path {folder}/Cargo.toml`"
        );
        // A dependency that is not locked yet is seen.
        let packages = lock["package"].as_array_mut().expect("packages");
        let core = packages
            .iter_mut()
            .find(|package| package["name"].as_str() == Some("raystone-core"));
        let core = core.and_then(|core| core["dependencies"].as_array_mut());
        core.expect("dependencies").pop();
        assert_eq!(stale(&lock), ["raystone-core"]);
    }
}
