//! `raystone stress --mutants`: the planted faults are a test program of the project, which cargo builds and
//! runs in a checkout.

use super::failure::ended;
use super::output::print;
use anyhow::{Context as _, Result, anyhow};
use raystone::gpu::AdapterChoice;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};

/// The test that plants all faults, and the variables that it reads.
const TEST: &str = "every_fault_of_the_table_is_seen_or_explained";
const OUT: &str = "RAYSTONE_MUTANTS_OUT";
const ADAPTER: &str = "RAYSTONE_MUTANTS_ADAPTER";

/// Has cargo plant the faults, prints their table and leaves `mutants.jsonl` in `out`.
pub fn plant_faults(out: &Path, adapter: Option<&AdapterChoice>) -> Result<ExitCode> {
    let root = checkout().ok_or_else(|| {
        anyhow!(
            "--mutants plants faults in the project's sources: type it in a folder of a checkout of Raystone"
        )
    })?;
    let out = prepared(out)?;
    let table = out.join("mutants.txt");
    let mut cargo = Command::new("cargo");
    cargo
        .args(["test", "--release", "--test", "mutants", "--manifest-path"])
        .arg(root.join("Cargo.toml"))
        .args(["--", "--ignored", "--exact", "--nocapture", TEST])
        .env(OUT, &out)
        .stdout(Stdio::null());
    match adapter {
        Some(AdapterChoice::Index(index)) => cargo.env(ADAPTER, index.to_string()),
        Some(AdapterChoice::Name(name)) => cargo.env(ADAPTER, name),
        Some(AdapterChoice::Best) | None => cargo.env_remove(ADAPTER),
    };
    let status = cargo.status().context(
        "cannot run cargo, which --mutants needs; install Rust (https://rustup.rs) or correct PATH",
    )?;
    let text = std::fs::read_to_string(&table).with_context(|| {
        format!("the planted faults did not run to their end ({status}); cargo says why above")
    })?;
    let records = out.join("mutants.jsonl");
    print(&format!("{text}records: {}\n", records.display()))?;
    Ok(ended(status.success()))
}

/// Returns the folder of the checkout that the current folder is in.
fn checkout() -> Option<PathBuf> {
    let here = std::env::current_dir().ok()?;
    let is_checkout = |folder: &&Path| {
        let manifest = std::fs::read_to_string(folder.join("Cargo.toml")).unwrap_or_default();
        manifest.lines().any(|line| line == "name = \"raystone\"")
            && folder.join("tests/mutants").is_dir()
    };
    here.ancestors().find(is_checkout).map(Path::to_owned)
}

/// Returns `out` as an absolute path, since the test runs elsewhere, without the table of an earlier run.
fn prepared(out: &Path) -> Result<PathBuf> {
    let out = std::path::absolute(out)?;
    std::fs::create_dir_all(&out).with_context(|| format!("cannot make {}", out.display()))?;
    let table = out.join("mutants.txt");
    if table.exists() {
        std::fs::remove_file(&table)
            .with_context(|| format!("cannot remove {}", table.display()))?;
    }
    Ok(out)
}
