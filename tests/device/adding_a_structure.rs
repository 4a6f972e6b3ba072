//! Verifies `docs/adding-a-structure.md`: the structure that it adds passes through the public
//! interface and the whole correctness check, and every quoted file is quoted correctly.

mod device_slabs;
mod sorted_slabs;

use crate::support;
use crate::support::{
    Pcg, assert_same_hits, brute_force, build, default_params, param_variants, scenes, trace,
};
use device_slabs::DeviceSlabs;
use raystone::accel::{AccelKind, BuildLog, Counters};
use raystone::config::{Experiment, Plan};
use raystone::gpu::KernelLibrary;
use raystone::measure::record::GateVerdict;
use raystone::run::{Registries, RunOptions, verify};
use sorted_slabs::SortedSlabs;
use std::path::Path;

const KERNEL: &str = "accel/sorted_slabs.wesl";

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// An experiment that names the new structure and one of its parameters.
const EXPERIMENT: &str = r#"
[run]
name = "sorted-slabs"
replicates = 1
seed = 1
resolution = [32, 24]
spp = { pow2 = [0, 0] }

[axes]
scene = ["cornell-box", "displaced-sphere"]
accel = ["sorted-slabs"]
sequence = ["sobol"]
decorrelation = ["cranley-patterson"]
integrator = ["path"]

[accel.sorted-slabs]
run_length = [8, 64]

[scene.displaced-sphere]
triangles = 1000

[reference]
spp = 2
sequence = "pixel-hash"
seed = 2
"#;

/// Verdicts on every cell of the experiment, with its own kernels or those of a folder.
fn verdicts(kernels: Option<&Path>) -> Vec<GateVerdict> {
    let mut registries = Registries::default();
    registries.accel.register(&SortedSlabs);
    let axis = |folder: &Path| format!("axes.kernels=[{:?}]", folder.display().to_string());
    let kernels: Vec<String> = kernels.map(axis).into_iter().collect();
    let experiment = Experiment::parse(EXPERIMENT, "experiment", &kernels, &registries.catalogue());
    let experiment = experiment.unwrap_or_else(|e| panic!("{e}"));
    let plan = Plan::new(&experiment, &[], |s, d| registries.is_randomised(s, d));
    let plan = plan.unwrap_or_else(|e| panic!("{e}"));
    let options = RunOptions::default();
    let verified = verify(&experiment, &plan, &registries, &options, 2000, false);
    let verified = verified.unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(verified.len(), 4, "two scenes with two lengths");
    let verdict = |v: raystone::run::Verified| v.verdict.unwrap_or_else(|e| panic!("{e}"));
    verified.into_iter().map(verdict).collect()
}

#[test]
fn the_structure_passes_the_whole_gate_through_the_public_interface() {
    if !support::is_exact(support::gpu()) {
        return;
    }
    for verdict in verdicts(None) {
        assert!(verdict.passed, "{verdict:?}");
        assert!(verdict.classes.len() >= 4, "{verdict:?}");
        assert!(verdict.classes.iter().all(|class| class.rays >= 1000));
        assert!(verdict.brute_force.rays > 0 && verdict.oracle.rays > 0);
    }
}

#[test]
fn the_gate_refuses_a_kernel_that_forgets_the_last_triangle_of_a_run() {
    let [(_, text)] = SortedSlabs.sources() else {
        panic!("one kernel")
    };
    let faulty = text.replace("place < b.w", "place + 1u < b.w");
    assert_ne!(*text, faulty);
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::create_dir(folder.path().join("accel")).expect("a folder");
    std::fs::write(folder.path().join(KERNEL), faulty).expect("a written kernel");
    for verdict in verdicts(Some(folder.path())) {
        assert!(!verdict.passed, "{verdict:?}");
        let wrong: usize = verdict.classes.iter().map(|class| class.wrong).sum();
        assert!(wrong > 0, "{verdict:?}");
    }
}

#[test]
fn kernel_and_twin_equal_brute_force_on_hard_scenes() {
    let gpu = support::open(KernelLibrary::default().with_sources(SortedSlabs.sources()));
    if !support::is_exact(&gpu) {
        return;
    }
    let mut rng = Pcg::new(31);
    let variants = param_variants(&SortedSlabs.parameters());
    assert!(variants.len() > 1);
    for case in scenes::degenerate_cases() {
        let mut rays = scenes::aimed_rays(&mut rng, &case.soup, 300);
        rays.extend(scenes::lattice_plane_rays(&mut rng, &case.soup, 300));
        let expected = brute_force(&case.soup, &rays);
        for params in &variants {
            let what = format!("{} {params:?}", case.name);
            let built = build(&SortedSlabs, &case.soup, params);
            let batch = trace(&gpu, &*built, &case.soup, &rays, &["counters"]);
            assert_same_hits(&what, &rays, &expected, &batch.hits);
            let twin = built.cpu_twin(&case.soup).expect("it has a twin");
            for ((ray, hit), work) in rays.iter().zip(&expected).zip(&batch.work) {
                let mut counters = Counters::default();
                assert!(
                    hit.same_bits(&twin.closest_hit(ray, &mut counters)),
                    "{what}: {ray:?}"
                );
                assert_eq!(*work, counters, "{what}: {ray:?}");
            }
        }
    }
}

/// Kernels of `device-slabs`, with a change in the building one.
fn building(from: &str, to: &str) -> KernelLibrary {
    let changed = |(name, text): &(&'static str, &'static str)| match *name {
        "accel/device_slabs" => (*name, text.replace(from, to)),
        _ => (*name, (*text).to_owned()),
    };
    let texts: Vec<_> = DeviceSlabs.sources().iter().map(changed).collect();
    let sources: Vec<(&str, &str)> = texts.iter().map(|(n, t)| (*n, t.as_str())).collect();
    KernelLibrary::default().with_sources(&sources)
}

#[test]
fn a_structure_built_on_the_device_stays_there_and_equals_brute_force() {
    let gpu = support::open(building("", ""));
    if !support::is_exact(&gpu) {
        return;
    }
    let mut rng = Pcg::new(41);
    for case in scenes::degenerate_cases() {
        let params = default_params(&DeviceSlabs.parameters());
        let mut log = BuildLog::with_gpu(&gpu);
        let built = DeviceSlabs.build(&case.soup, &params, &mut log);
        let built = built.unwrap_or_else(|e| panic!("{}: {e}", case.name));
        assert_eq!(built.validate(&case.soup), Ok(()), "{}", case.name);
        let phases: Vec<&str> = log.phases.iter().map(|p| p.name.as_str()).collect();
        assert_eq!(phases, ["sort", "boxes"]);
        assert!(log.phases.iter().all(|p| p.ms >= 0.0) && log.total_ms() > 0.0);
        let on_host: Vec<_> = built.buffers().arrays.iter().map(|a| a.name).collect();
        assert_eq!(on_host, ["order"]);
        let rays = scenes::aimed_rays(&mut rng, &case.soup, 300);
        let batch = trace(&gpu, &*built, &case.soup, &rays, &[]);
        assert_same_hits(
            case.name,
            &rays,
            &brute_force(&case.soup, &rays),
            &batch.hits,
        );
    }
}

#[test]
fn a_fault_of_a_build_on_the_device_and_a_missing_device_are_seen() {
    let soup = scenes::lattice_soup(&mut Pcg::new(5), 200, 6);
    let params = default_params(&DeviceSlabs.parameters());
    let alone = DeviceSlabs.build(&soup, &params, &mut BuildLog::default());
    let told = alone.err().expect("no device").to_string();
    assert!(told.contains("built on the device"), "{told}");
    let faults = [("order[place]", "order[first]"), ("low = min", "low = max")];
    for (from, to) in faults {
        let gpu = support::open(building(from, to));
        let built = DeviceSlabs.build(&soup, &params, &mut BuildLog::with_gpu(&gpu));
        let built = built.unwrap_or_else(|e| panic!("{e}"));
        assert!(built.validate(&soup).is_err(), "{to}");
        let rays = scenes::lattice_rays(&mut Pcg::new(6), 2000, 6);
        let batch = trace(&gpu, &*built, &soup, &rays, &[]);
        let wrong = support::differences(&brute_force(&soup, &rays), &batch.hits);
        assert!(!wrong.is_empty(), "{to}");
    }
}

#[test]
fn the_pass_of_a_build_on_the_device_is_a_phase_of_the_record() {
    if !support::is_exact(support::gpu()) {
        return;
    }
    let mut registries = Registries::default();
    registries.accel.register(&DeviceSlabs);
    let text = support::SMALL.replace("[\"bvh\"]", "[\"device-slabs\"]");
    let folder = tempfile::tempdir().expect("a folder");
    let (summary, _) = support::run(&text, &registries, folder.path(), None);
    let records = std::fs::read_to_string(folder.path().join("records.jsonl")).expect("records");
    assert_eq!(summary.failed, 0, "{records}");
    let built = records
        .lines()
        .find(|l| l.contains("\"sort\"") && l.contains("\"boxes\""));
    let built = built.expect("a record with both phases");
    let line: serde_json::Value = serde_json::from_str(built).expect("JSON");
    let phases = line["body"]["build"].as_array().expect("phases");
    let names: Vec<_> = phases.iter().filter_map(|p| p["name"].as_str()).collect();
    assert_eq!(names, ["sort", "boxes"], "{built}");
    let sum: f64 = phases.iter().filter_map(|p| p["ms"].as_f64()).sum();
    assert!((line["body"]["build_ms"].as_f64().expect("ms") - sum).abs() < 1e-9);
}

/// Fenced blocks of a page whose info string names a file: (file, text).
fn quotes(page: &str) -> Vec<(String, String)> {
    let mut out = Vec::new();
    let mut open: Option<(String, String)> = None;
    for line in page.lines() {
        match (line.strip_prefix("```"), &mut open) {
            (Some(_), Some(_)) => out.extend(open.take()),
            (Some(info), None) => {
                let file = info.split_whitespace().nth(1).unwrap_or_default();
                open = Some((file.to_owned(), String::new()));
            }
            (None, Some((_, text))) => {
                text.push_str(line);
                text.push('\n');
            }
            (None, None) => {}
        }
    }
    out.retain(|(file, _)| !file.is_empty());
    out
}

#[test]
fn the_pages_quote_files_as_they_are() {
    let pages = [("adding-a-structure", 5), ("adding-an-integrator", 3)];
    for (page, least) in pages {
        let file = root().join("docs").join(page).with_extension("md");
        let page = std::fs::read_to_string(file).expect("the page");
        let quotes = quotes(&page);
        assert!(quotes.len() >= least, "only {} quotes", quotes.len());
        check_quotes(&quotes);
    }
}

fn check_quotes(quotes: &[(String, String)]) {
    for (file, quoted) in quotes {
        let text = std::fs::read_to_string(root().join(file));
        let text = text.unwrap_or_else(|e| panic!("{file}: {e}"));
        assert!(
            text.contains(quoted.as_str()),
            "{file} does not hold:\n{quoted}"
        );
        let changed = quoted.replacen(' ', "  ", 1);
        assert!(!text.contains(&changed), "any text passes for {file}");
    }
}
