//! Kernel folders replacing the embedded kernels: traces they leave in a run, and refusals.

use crate::support;
use raystone::config::Axis;
use raystone::gpu::{ArithmeticProbe, KernelLibrary};
use raystone::measure::bias::BiasVerdict;
use raystone::measure::record::{Body, Line, axis};
use raystone::run::{Registries, RunOptions};
use std::collections::BTreeSet;
use std::path::Path;
use std::process::{Command, Output};

/// A path tracer with a detectable bias, and a test's changes.
fn experiment(changes: &[&str]) -> String {
    let common = [
        "run.replicates = 8",
        "run.resolution = [32, 24]",
        "run.spp = { pow2 = [4, 6] }",
        "reference.spp = 2048",
        "gate.brute_force_tests = 1_000_000",
        "gate.oracle_rays = 256",
        "discrepancy.points = 64",
        "discrepancy.seeds = 2",
    ];
    support::small_with(&[&common, changes].concat())
}

fn embedded(module: &str) -> String {
    let library = KernelLibrary::default();
    library.text(module).expect("an embedded kernel").to_owned()
}

fn write(folder: &Path, file: &str, text: impl AsRef<[u8]>) {
    let path = folder.join(file);
    std::fs::create_dir_all(path.parent().expect("a parent")).expect("a folder");
    std::fs::write(path, text).expect("a written file");
}

/// Writes the path tracer with one text replaced.
fn changed(folder: &Path, from: &str, to: &str) {
    let text = embedded("integrator/path");
    assert_eq!(text.matches(from).count(), 1);
    write(folder, "integrator/path.wesl", text.replace(from, to));
}

/// The path tracer without the weights of multiple importance sampling: emission counts twice.
fn without_weights(folder: &Path) {
    let weight = "weight = found_weight(density, light_pdf(leaving, surface, hit));";
    changed(folder, weight, "weight = 1.0;");
}

/// The path tracer, rephrased.
fn in_other_words(folder: &Path) {
    let from = "var result = vec3<f32>(0.0);";
    changed(folder, from, "var result = vec3<f32>(0.0, 0.0, 0.0);");
}

fn program(arguments: &[&str]) -> Output {
    let output = Command::new(env!("CARGO_BIN_EXE_raystone"))
        .args(arguments)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output();
    output.expect("the program starts")
}

/// Runs the experiment with these kernels instead of, or next to, the embedded ones.
fn lines(out: &Path, kernels: &[&str]) -> Vec<Line> {
    let kernels: Vec<String> = kernels.iter().map(|name| format!("{name:?}")).collect();
    let text = experiment(&[&format!("axes.kernels = [{}]", kernels.join(", "))]);
    support::run(&text, &Registries::default(), out, None);
    let text = std::fs::read_to_string(out.join("records.jsonl")).expect("records");
    let parse = |line| serde_json::from_str(line).expect("a record");
    text.lines().map(parse).collect()
}

/// A faulty integrator next to the original: it is detected against a reference without the fault,
/// and none of its records look like the original's.
#[test]
fn an_idea_is_compared_with_the_original_and_leaves_a_trace() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let idea = folder.path().join("my-idea");
    in_other_words(&idea);
    let out = folder.path().join("run");
    let lines = lines(&out, &["", idea.to_str().expect("UTF-8")]);
    let mut seen = BTreeSet::new();
    for line in &lines {
        if line.ran.kernel_hash.is_empty() {
            continue;
        }
        assert_eq!(line.ran.kernel_hash.len() % 65, 64, "{line:?}");
        assert_eq!(line.hash.len(), 64, "{line:?}");
        let is_traced = !matches!(line.body, Body::Stream(_) | Body::Measured(_));
        for (name, test) in [
            (axis::TRIANGLE, "watertight"),
            (axis::BOX_TEST, "padded-16"),
            (axis::OFFSET, "error-bound"),
        ] {
            // Structures are the same with every offset.
            let is_free = name == axis::OFFSET && matches!(line.body, Body::Structure(_));
            assert_eq!(
                line.key.label(name) == test,
                is_traced && !is_free,
                "{line:?}"
            );
        }
        let kind = std::mem::discriminant(&line.body);
        seen.insert((format!("{kind:?}"), line.key.label(axis::KERNELS)));
    }
    // Eight kinds with both, and the reference with the embedded kernels alone.
    assert_eq!(seen.len(), 17, "{seen:?}");
    let of = |kernels: &str| {
        let is_it = |line: &&Line| {
            !line.ran.kernel_hash.is_empty() && line.key.label(axis::KERNELS) == kernels
        };
        lines.iter().filter(is_it).collect::<Vec<_>>()
    };
    let (original, changed) = (of(""), of("my-idea"));
    let hashes = |lines: &[&Line]| {
        lines
            .iter()
            .map(|l| l.hash.clone())
            .collect::<BTreeSet<_>>()
    };
    assert!(hashes(&original).is_disjoint(&hashes(&changed)));
    let verdict = |lines: &[&Line]| {
        let mut biases = lines.iter().filter_map(|line| match &line.body {
            Body::Bias(bias) => Some(bias.verdict.clone()),
            _ => None,
        });
        biases.next().expect("a verdict on the bias")
    };
    assert_eq!(verdict(&original), BiasVerdict::NoBiasFound);
    assert_eq!(verdict(&changed), BiasVerdict::NoBiasFound);
    let kernel = |lines: &[&Line], pick: fn(&Body) -> bool| {
        let found = lines
            .iter()
            .find(|line| pick(&line.body))
            .expect("a record");
        found.ran.kernel_hash.clone()
    };
    // The traversal has the same text, the path tracer does not.
    let structure = |r: &Body| matches!(r, Body::Structure(_));
    assert_eq!(kernel(&original, structure), kernel(&changed, structure));
    let time = |r: &Body| matches!(r, Body::Time(_));
    assert_ne!(kernel(&original, time), kernel(&changed, time));
    let Body::Run(run) = &lines[0].body else {
        panic!("{:?}", lines[0]);
    };
    assert_eq!(run.kernels.len(), 1);
    assert_eq!(run.kernels[0].files[0].file, "integrator/path.wesl");
    let page = std::fs::read_to_string(out.join("index.html")).expect("a page");
    for text in ["path.wesl", "bvh @my-idea", "pixel-hash × none @my-idea"] {
        assert!(page.contains(text), "the page lacks {text}");
    }
}

/// With only other kernels the reference is still that of the embedded ones.
#[test]
fn the_reference_is_that_of_the_embedded_kernels_whatever_runs() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let idea = folder.path().join("my-idea");
    without_weights(&idea);
    let idea = idea.to_str().expect("UTF-8");
    let means = [&["", idea][..], &[idea]].map(|kernels| {
        let out = folder.path().join(format!("run-{}", kernels.len()));
        let lines = lines(&out, kernels);
        let reference = lines.iter().find_map(|line| match &line.body {
            Body::Reference(r) => Some((r.mean, line.key.label(axis::KERNELS).to_owned())),
            _ => None,
        });
        let wrong = |line: &Line| matches!(&line.body, Body::Paths(p) if p.fault.is_some());
        assert!(lines.iter().any(wrong), "{kernels:?}");
        reference.expect("a reference")
    });
    assert_eq!(means[0], means[1]);
    assert_eq!(means[0].1, "");
}

#[test]
fn a_test_that_the_adapter_cannot_keep_is_skipped_with_its_reason() {
    let registries = Registries::default();
    let text = experiment(&["axes.triangle = \"compensated\""]);
    let (experiment, plan) = support::plan(&text, &registries);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let options = RunOptions {
        out: folder.path().to_owned(),
        arithmetic: Some(ArithmeticProbe {
            unfused: true,
            exact_division: true,
            exact_sqrt: true,
            exact_products: false,
            denormals: true,
        }),
        ..RunOptions::default()
    };
    let summary = raystone::run::run(&experiment, &plan, &registries, &options);
    let summary = summary.unwrap_or_else(|e| panic!("{e}"));
    assert_eq!((summary.failed, summary.skipped), (0, 3));
    let records = support::records(folder.path());
    let skipped = records.iter().find_map(|line| match &line.body {
        Body::Skipped(skipped) => Some(skipped.reason.as_str()),
        _ => None,
    });
    let reason = skipped.expect("a skipped cell");
    assert!(
        reason.contains("compensated") && reason.contains("two-products"),
        "{reason}"
    );
    let is_traced = |line: &Line| !line.key.label(axis::TRIANGLE).is_empty();
    assert!(!records.iter().any(is_traced), "something was traced");
    let verified = raystone::run::verify(&experiment, &plan, &registries, &options, 1024, false);
    let verified = verified.unwrap_or_else(|e| panic!("{e}"));
    assert!(
        verified[0]
            .verdict
            .as_ref()
            .is_err_and(|reason| reason.contains("compensated"))
    );
}

/// The answer of every command to a folder, with exit code 2.
fn refusal(folder: &Path) -> String {
    let folder = folder.to_str().expect("UTF-8");
    let mut said = BTreeSet::new();
    for arguments in [
        &[
            "run",
            "tests/data/tiny.toml",
            "--dry-run",
            "--kernels",
            folder,
        ][..],
        &[
            "verify",
            "--scene",
            "single-triangle",
            "--accel",
            "bvh",
            "--kernels",
            folder,
        ],
        &["stress", "--quick", "--kernels", folder],
    ] {
        let output = program(arguments);
        let words = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {words}");
        let error = words.split_once("error: ").expect("an error").1;
        said.insert(error.trim().to_owned());
    }
    assert_eq!(said.len(), 1, "{said:?}");
    said.into_iter().next().unwrap_or_default()
}

#[test]
fn files_that_no_kernel_could_be_made_with_are_refused_before_anything_runs() {
    let stack = embedded("accel/bvh/stack");
    let broken = stack.replacen("fn ", "fn fn ", 1);
    let line = 1 + stack[..stack.find("fn ").expect("a function")]
        .matches('\n')
        .count();
    let broken_at = format!("stack.wesl:{line}: ");
    for (what, file, text, says) in [
        (
            "in the wrong folder",
            "kernels/accel/bvh/stack.wesl",
            stack.as_bytes(),
            "`accel/bvh/stack.wesl`",
        ),
        (
            "in no folder",
            "stack.wesl",
            stack.as_bytes(),
            "replaces no kernel",
        ),
        (
            "by upper case",
            "accel/BVH/stack.wesl",
            stack.as_bytes(),
            "`accel/bvh/stack.wesl`",
        ),
        (
            "by a slip",
            "integrator/paht.wesl",
            stack.as_bytes(),
            "`integrator/path.wesl`",
        ),
        (
            "by its ending",
            "accel/bvh/stack.wgsl",
            stack.as_bytes(),
            "`.wesl`",
        ),
        (
            "by an upper-case ending",
            "accel/bvh/stack.WESL",
            stack.as_bytes(),
            "`.wesl`",
        ),
        (
            "by its syntax",
            "accel/bvh/stack.wesl",
            broken.as_bytes(),
            &broken_at,
        ),
        (
            "by its bytes",
            "accel/bvh/stack.wesl",
            b"fn \xff".as_slice(),
            "UTF-8",
        ),
        (
            "by being nothing",
            "README.md",
            b"no kernel".as_slice(),
            "no *.wesl file",
        ),
    ] {
        let folder = tempfile::tempdir().expect("a temporary folder");
        write(folder.path(), file, text);
        let said = refusal(folder.path());
        assert!(said.contains(says), "{what}: {said}");
    }
}

#[test]
fn a_new_module_that_a_replaced_one_imports_is_no_stray() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = embedded("integrator/path");
    write(
        folder.path(),
        "integrator/path.wesl",
        format!("import package::ideas::first::{{one, two}};\n{path}"),
    );
    let first = "import super::second::deep;\nfn one() {}\nfn two() {}\n";
    write(folder.path(), "ideas/first.wesl", first);
    write(folder.path(), "ideas/second.wesl", "fn deep() {}\n");
    write(folder.path(), ".git/accel/bvh.wesl", "not looked at");
    let library = KernelLibrary::default().with_folder(folder.path());
    let library = library.unwrap_or_else(|e| panic!("{e}"));
    library.check(&[]).unwrap_or_else(|e| panic!("{e}"));
    write(folder.path(), "ideas/third.wesl", "fn lost() {}\n");
    let library = KernelLibrary::default().with_folder(folder.path());
    let library = library.unwrap_or_else(|e| panic!("{e}"));
    let said = library.check(&[]).expect_err("a stray file").to_string();
    assert!(said.contains("third.wesl"), "{said}");
    library
        .check(&["ideas/third".to_owned()])
        .unwrap_or_else(|e| panic!("{e}"));
}

#[test]
fn patterns_choose_among_kernels() {
    let registries = Registries::default();
    let text = experiment(&["axes.kernels = [\"\", \"some/idea\"]"]);
    let plan = |only: &[&str], more: &str| {
        let only: Vec<String> = only.iter().map(|text| (*text).to_owned()).collect();
        let text = format!("{text}{more}");
        let experiment =
            raystone::config::Experiment::parse(&text, "test", &[], &registries.catalogue());
        let experiment = experiment.unwrap_or_else(|e| panic!("{e}"));
        let randomised = |s: &_, d: &_| registries.is_randomised(s, d);
        let plan = raystone::config::Plan::new(&experiment, &only, randomised);
        let plan = plan.unwrap_or_else(|e| panic!("{e}"));
        let labels = plan
            .structures
            .iter()
            .map(|cell| cell.labels(&[Axis::Accel]).join(" "));
        labels.collect::<Vec<_>>()
    };
    assert_eq!(plan(&[], ""), ["bvh", "bvh @idea"]);
    assert_eq!(plan(&["kernels=idea"], ""), ["bvh @idea"]);
    assert_eq!(plan(&["kernels=some/*"], ""), ["bvh @idea"]);
    assert_eq!(plan(&["kernels=embedded"], ""), ["bvh"]);
    assert_eq!(plan(&["kernels="], ""), ["bvh"]);
    assert_eq!(plan(&[], "[[exclude]]\nkernels = \"\"\n"), ["bvh @idea"]);
}
