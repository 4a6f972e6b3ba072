//! Timed answers are checked: a kernel that is right at first and skips work later gets no figure.

use crate::support::{SMALL, records};
use raystone::gpu::KernelLibrary;
use raystone::measure::record::{StructureRecord, all_of};
use std::path::Path;
use std::process::Command;

const KERNEL: &str = "integrator/trace_rays";
/// Kernel line after which the faults are inserted.
const PLACE: &str = "    let index = batch.first + item;\n";
/// Faults of a batch kernel dispatched more often than by the correctness check. Words of `status`
/// from 9 on are unused and persist between dispatches.
const FAULTS: [(&str, &str); 5] = [
    (
        "later turns trace one ray less",
        "if (index == 77u && atomicAdd(&status[15], 1u) >= 2u) { return; }",
    ),
    (
        "every third turn traces one ray less",
        "if (index == 77u && atomicAdd(&status[15], 1u) % 3u == 2u) { return; }",
    ),
    (
        "later turns trace the first slice only",
        "if (index >= 512u && index < 1024u && atomicAdd(&status[15], 1u) >= 1024u) { return; }",
    ),
    (
        "later turns answer one ray with a miss",
        "if (index == 77u && atomicAdd(&status[15], 1u) >= 2u) { hits[index] = vec4<u32>(0u, NO_HIT, 0u, 0u); return; }",
    ),
    (
        "a later turn overflows its stack",
        "if (index == 77u && atomicAdd(&status[15], 1u) == 2u) { atomicOr(&status[0], 2u); }",
    ),
];

fn plant(folder: &Path, fault: &str) {
    let library = KernelLibrary::default();
    let text = library.text(KERNEL).expect("the kernel");
    assert_eq!(text.matches(PLACE).count(), 1);
    let text = text.replace(PLACE, &format!("{PLACE}    @if(!counters) {{ {fault} }}\n"));
    let import = "import package::common::errors::status;\n";
    let file = folder.join(KERNEL).with_extension("wesl");
    std::fs::create_dir_all(file.parent().expect("a folder")).expect("a folder");
    std::fs::write(file, import.to_owned() + &text).expect("a kernel");
}

/// Runs the experiment with the kernels of `folder`; returns the failure and the number of timings.
fn run(folder: &Path) -> (Option<String>, usize) {
    let experiment = folder.join("timed.toml");
    std::fs::write(&experiment, SMALL).expect("an experiment");
    let out = folder.join("out");
    let output = Command::new(env!("CARGO_BIN_EXE_raystone"))
        .arg("run")
        .arg(&experiment)
        .args(["--quiet", "--kernels"])
        .arg(folder.join("kernels"))
        .arg("--out")
        .arg(&out)
        .output()
        .expect("the program starts");
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    let lines = records(&out);
    let structures = all_of::<StructureRecord>(&lines);
    let [structure] = structures.collect::<Vec<_>>().try_into().expect(&words);
    let gate = structure.gate.as_ref().expect("a verdict");
    assert!(gate.passed, "the gate is to pass: {gate:?}");
    (structure.failure.clone(), structure.timings.len())
}

#[test]
fn a_kernel_that_slackens_after_the_gate_gets_no_figure() {
    for (what, fault) in FAULTS {
        let folder = tempfile::tempdir().expect("a temporary folder");
        plant(&folder.path().join("kernels"), fault);
        let (failure, timings) = run(folder.path());
        assert_eq!(timings, 0, "{what}");
        let failure = failure.unwrap_or_else(|| panic!("{what}: not seen"));
        let told = ["timed turn", "stack overflowed"];
        assert!(
            told.iter().any(|t| failure.contains(t)),
            "{what}: {failure}"
        );
    }
}

#[test]
fn a_sound_kernel_is_timed_on_every_class_but_the_hard_one() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    plant(&folder.path().join("kernels"), "");
    assert_eq!(run(folder.path()), (None, 5));
}
