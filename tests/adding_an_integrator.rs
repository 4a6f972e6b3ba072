//! A sequence, a decorrelation and an integrator from outside the program, with kernels of their own, in a
//! run like any other.

#[path = "adding_an_integrator/facing.rs"]
mod facing;
#[path = "adding_an_integrator/samplers.rs"]
mod samplers;
mod support;

use facing::Facing;
use raystone::measure::record::{Body, Line, axis};
use raystone::params::Registered;
use raystone::run::Registries;
use raystone::sampling::Sequence;
use samplers::{Rotation, Weyl};
use std::path::Path;

fn registries() -> Registries {
    let mut registries = Registries::default();
    let weyl = Registered::sequence::<Weyl>();
    registries.samplers.sequences.add(weyl);
    let rotation = Registered::decorrelation::<Rotation>();
    registries.samplers.decorrelations.add(rotation);
    registries.integrators.register(&Facing);
    registries
}

/// A tiny run, with the kernels of a folder if there is one.
fn records(kernels: Option<&Path>) -> Vec<Line> {
    let text = std::fs::read_to_string("tests/data/tiny.toml").expect("the experiment");
    let folder = kernels.map(|folder| format!("kernels = [{:?}]\n", folder.display().to_string()));
    let axes = folder.unwrap_or_default() + "sequence = [\"weyl\"]\ndecorrelation = [\"rotation\"]";
    let text = text
        .replace("sequence = [\"pixel-hash\"]", &axes)
        .replace("\"path\"", "\"facing\"");
    let text = format!("{text}\n[integrator.facing]\nbrightness = [2]\n");
    let out = tempfile::tempdir().expect("a temporary folder");
    support::run(&text, &registries(), &out.path().join("run"), None).1
}

fn failures(records: &[Line]) -> Vec<String> {
    let reason = |line: &Line| match &line.body {
        Body::Failed(failed) => Some(format!("{}: {}", failed.cell, failed.reason)),
        Body::Time(time) => time.failure.clone(),
        _ => None,
    };
    records.iter().filter_map(reason).collect()
}

#[test]
fn samplers_and_integrators_from_outside_run_like_those_of_the_program() {
    if !support::is_exact(support::gpu()) {
        return;
    }
    let records = records(None);
    assert_eq!(failures(&records), [""; 0]);
    let (mut errors, mut streams, mut times) = (0, 0, 0);
    for line in &records {
        match &line.body {
            Body::Error(_) => {
                let names = [axis::SEQUENCE, axis::DECORRELATION, axis::INTEGRATOR];
                let names = names.map(|axis| line.key.name(axis));
                assert_eq!(names, ["weyl", "rotation", "facing"]);
                errors += 1;
            }
            Body::Time(time) => {
                assert!(time.image_equal, "{time:?}");
                let classes: Vec<_> = time.rays.keys().map(String::as_str).collect();
                assert_eq!(classes, ["primary"]);
                times += 1;
            }
            Body::Stream(_) => {
                assert_eq!(line.key.name(axis::SEQUENCE), "weyl");
                streams += 1;
            }
            _ => {}
        }
    }
    // Replicates, structures, and the pairs of dimensions of the experiment.
    assert_eq!((errors, times), (2, 2));
    assert!(streams > 0);
}

#[test]
fn a_sequence_whose_kernel_is_not_its_twin_is_not_rendered_with() {
    if !support::is_exact(support::gpu()) {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (name, text) = Weyl::default().sources()[0];
    let changed = text.replace("0x9e3779b9u", "0x9e3779bbu");
    assert_ne!(changed, text);
    let file = folder.path().join(name).with_extension("wesl");
    std::fs::create_dir(folder.path().join("sampling")).expect("a folder");
    std::fs::write(file, changed).expect("a written kernel");
    let records = records(Some(folder.path()));
    let failures = failures(&records);
    assert!(!failures.is_empty());
    let words = |failure: &String| failure.contains("weyl") && failure.contains("twin");
    assert!(failures.iter().any(words), "{failures:?}");
    assert!(!records.iter().any(|r| matches!(r.body, Body::Error(_))));
}
