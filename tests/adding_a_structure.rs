//! Keeps `docs/adding-a-structure.md` true: the structure that it adds goes through the public
//! interface and the whole gate, and every file that it quotes is quoted rightly.

#[path = "adding_a_structure/sorted_slabs.rs"]
mod sorted_slabs;
mod support;

use raystone::accel::{AccelKind, Counters};
use raystone::config::{Experiment, Plan};
use raystone::gpu::KernelLibrary;
use raystone::measure::record::GateVerdict;
use raystone::run::{Registries, RunOptions, verify};
use sorted_slabs::SortedSlabs;
use std::path::{Path, PathBuf};
use support::{Pcg, assert_same_hits, brute_force, build, param_variants, scenes, trace};

const KERNEL: &str = "accel/sorted_slabs.wesl";

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn kernel_folder() -> PathBuf {
    root().join("tests/adding_a_structure/kernels")
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

/// The gate of every cell of the experiment.
fn verdicts(kernels: &Path) -> Vec<GateVerdict> {
    let mut registries = Registries::default();
    registries.accel.register(&SortedSlabs);
    let kernels = [format!(
        "axes.kernels=[{:?}]",
        kernels.display().to_string()
    )];
    let experiment = Experiment::parse(EXPERIMENT, "experiment", &kernels, &registries.catalogue());
    let experiment = experiment.unwrap_or_else(|e| panic!("{e}"));
    let plan = Plan::new(&experiment, &[], |s, d| registries.is_randomised(s, d));
    let plan = plan.unwrap_or_else(|e| panic!("{e}"));
    let options = RunOptions::default();
    let verified = verify(&experiment, &plan, &registries, &options, 2000);
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
    for verdict in verdicts(&kernel_folder()) {
        assert!(verdict.passed, "{verdict:?}");
        assert!(verdict.classes.len() >= 4, "{verdict:?}");
        assert!(verdict.classes.iter().all(|class| class.rays >= 1000));
        assert!(verdict.brute_force.rays > 0 && verdict.oracle.rays > 0);
    }
}

#[test]
fn the_gate_refuses_a_kernel_that_forgets_the_last_triangle_of_a_run() {
    let text = std::fs::read_to_string(kernel_folder().join(KERNEL)).expect("the kernel");
    let faulty = text.replace("place < b.w", "place + 1u < b.w");
    assert_ne!(text, faulty);
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::create_dir(folder.path().join("accel")).expect("a folder");
    std::fs::write(folder.path().join(KERNEL), faulty).expect("a written kernel");
    for verdict in verdicts(folder.path()) {
        assert!(!verdict.passed, "{verdict:?}");
        let wrong: usize = verdict.classes.iter().map(|class| class.wrong).sum();
        assert!(wrong > 0, "{verdict:?}");
    }
}

#[test]
fn kernel_and_twin_equal_brute_force_on_hard_scenes() {
    let gpu = support::open(
        KernelLibrary::default()
            .with_folder(&kernel_folder())
            .expect("the folder"),
    );
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
