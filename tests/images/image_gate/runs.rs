//! Faults that small images and right answers do not show fail the cells of a run.

use crate::support::*;
use raystone::measure::record::{Body, Line};
use raystone::run::Registries;
use std::path::Path;

/// The failures of a small run whose second set of kernels has this fault, by a word for their cell.
fn failures(module: &str, from: &str, to: &str) -> Vec<(&'static str, String)> {
    let folder = tempfile::tempdir().expect("a folder");
    let library = raystone::gpu::KernelLibrary::default();
    let text = library.text(module).expect("a kernel");
    assert_eq!(text.matches(from).count(), 1, "{from}");
    let file = folder
        .path()
        .join("mine")
        .join(module)
        .with_extension("wesl");
    std::fs::create_dir_all(file.parent().unwrap_or(Path::new(""))).expect("a folder");
    std::fs::write(&file, text.replace(from, to)).expect("a file");
    let mine = folder.path().join("mine").display().to_string();
    let text = SMALL.replace("[axes]", &format!("[axes]\nkernels = [\"\", \"{mine}\"]"));
    let out = folder.path().join("out");
    let (_, lines) = run(&text, &Registries::default(), &out, None);
    let is_mine = |line: &&Line| !line.key.label("kernels").is_empty();
    let of_sound = lines
        .iter()
        .filter(|line| !is_mine(line))
        .filter_map(failure);
    let of_sound: Vec<_> = of_sound.filter(|(cell, _)| *cell != "cell").collect();
    assert!(of_sound.is_empty(), "{of_sound:?}");
    lines.iter().filter_map(failure).collect()
}

fn failure(line: &Line) -> Option<(&'static str, String)> {
    match &line.body {
        Body::Structure(record) => Some(("structure", record.failure.clone()?)),
        Body::Time(record) => Some(("time", record.failure.clone()?)),
        Body::Failed(record) => Some(("cell", record.reason.clone())),
        _ => None,
    }
}

#[track_caller]
fn assert_seen(failures: &[(&str, String)], cell: &str, part: &str) {
    let seen = failures
        .iter()
        .any(|(of, reason)| *of == cell && reason.contains(part));
    assert!(seen, "{cell}: {part} in {failures:?}");
}

#[test]
fn a_pixel_beyond_those_of_the_run_is_seen() {
    let value = "radiance(vec2<u32>(x, y), &sampler)";
    let darker = format!("{value} * select(1.0, 0.99, pixel >= 32768u)");
    let found = failures("integrator/render", value, &darker);
    assert_seen(&found, "cell", "failed the gate: pixel (");
}

#[test]
fn doubled_counts_of_rays_and_of_work_are_seen() {
    let once = "ray_counts[kind]++;";
    let found = failures("common/ray_counts", once, "ray_counts[kind] += 2u;");
    assert_seen(&found, "time", "its counted rays are wrong: ");
    let found = failures(
        "common/counters",
        "counters.nodes++;",
        "counters.nodes += 2u;",
    );
    assert_seen(&found, "structure", "is not that of the structure's twin");
}
