//! A sequence, a decorrelation and an integrator from outside the program, with kernels of their own, in a
//! run like any other.

#[path = "adding_an_integrator/facing.rs"]
mod facing;
#[path = "adding_an_integrator/samplers.rs"]
mod samplers;
mod support;

use facing::Facing;
use raystone::measure::record::Record;
use raystone::run::Registries;
use samplers::{Rotation, Weyl};
use std::path::{Path, PathBuf};

fn kernel_folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/adding_an_integrator/kernels")
}

fn registries() -> Registries {
    let mut registries = Registries::default();
    registries.samplers.register_sequence(&Weyl);
    registries.samplers.register_decorrelation(&Rotation);
    registries.integrators.register(&Facing);
    registries
}

/// A tiny run with these kernels.
fn records(kernels: &Path) -> Vec<Record> {
    let text = std::fs::read_to_string("tests/data/tiny.toml").expect("the experiment");
    let axes = format!(
        "kernels = [{:?}]\ndecorrelation = [\"rotation\"]\nsequence = [\"weyl\"]",
        kernels.display().to_string()
    );
    let text = text
        .replace("sequence = [\"pixel-hash\"]", &axes)
        .replace("\"path\"", "\"facing\"");
    let text = format!("{text}\n[integrator.facing]\nbrightness = [2]\n");
    let out = tempfile::tempdir().expect("a temporary folder");
    support::run(&text, &registries(), &out.path().join("run"), None).1
}

fn failures(records: &[Record]) -> Vec<String> {
    let reason = |record: &Record| match record {
        Record::Failed(failed) => Some(format!("{}: {}", failed.cell, failed.reason)),
        Record::Time(time) => time.failure.clone(),
        _ => None,
    };
    records.iter().filter_map(reason).collect()
}

#[test]
fn samplers_and_integrators_from_outside_run_like_those_of_the_program() {
    if !support::is_exact(support::gpu()) {
        return;
    }
    let records = records(&kernel_folder());
    assert_eq!(failures(&records), [""; 0]);
    let (mut errors, mut streams, mut times) = (0, 0, 0);
    for record in &records {
        match record {
            Record::Error(error) => {
                let names = [&error.sequence, &error.decorrelation, &error.integrator];
                let names = names.map(|variant| variant.name.as_str());
                assert_eq!(names, ["weyl", "rotation", "facing"]);
                errors += 1;
            }
            Record::Time(time) => {
                assert!(time.image_equal, "{time:?}");
                let classes: Vec<_> = time.rays.keys().map(String::as_str).collect();
                assert_eq!(classes, ["primary"]);
                times += 1;
            }
            Record::Stream(stream) => {
                assert_eq!(stream.sequence.name, "weyl");
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
    for name in ["sampling/weyl", "sampling/rotation", "integrator/facing"] {
        let from = kernel_folder().join(name).with_extension("wesl");
        let text = std::fs::read_to_string(&from).expect("a kernel");
        let changed = text.replace("0x9e3779b9u", "0x9e3779bbu");
        assert_eq!(changed != text, name == "sampling/weyl", "{name}");
        let to = folder.path().join(name).with_extension("wesl");
        std::fs::create_dir_all(to.parent().expect("a folder")).expect("a folder");
        std::fs::write(to, changed).expect("a written kernel");
    }
    let records = records(folder.path());
    let failures = failures(&records);
    assert!(!failures.is_empty());
    let words = |failure: &String| failure.contains("weyl") && failure.contains("twin");
    assert!(failures.iter().any(words), "{failures:?}");
    assert!(!records.iter().any(|r| matches!(r, Record::Error(_))));
}
