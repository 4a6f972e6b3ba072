//! A structure that answers rays in its own passes goes through check, timing, counters, a run and
//! its report like any other, without special treatment.

mod sorted_rays;

use crate::adding_an_integrator::piped::PipedBvh;
use crate::support;
use crate::support::{Pcg, assert_same_hits, brute_force, build, default_params, scenes, trace};
use raystone::accel::tracer::RayBuffers;
use raystone::accel::{AccelKind, Bvh, LiveRays, Query};
use raystone::config::Axis;
use raystone::config::{Experiment, Plan};
use raystone::gpu::{Gpu, Groups, KernelLibrary, Recording, Storage};
use raystone::measure::record::GateVerdict;
use raystone::run::{Registries, RunOptions, RunSummary, run, verify};
use sorted_rays::SortedRays;
use std::path::{Path, PathBuf};

static SORTED: SortedRays = SortedRays {
    name: "sorted-rays",
    counts_work: true,
};
static UNCOUNTED: SortedRays = SortedRays {
    name: "uncounted-rays",
    counts_work: false,
};

fn kernel_folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/device/pipelines/kernels")
}

/// The registries and plan of the experiment with the kernels of a folder.
fn planned(kernels: &Path) -> (Experiment, Plan, Registries) {
    let mut registries = Registries::default();
    registries.accel.register(&SORTED);
    registries.accel.register(&UNCOUNTED);
    let kernels = [format!(
        "axes.kernels=[{:?}]",
        kernels.display().to_string()
    )];
    let structures = r#"["bvh", "sorted-rays", "uncounted-rays"]"#;
    let text = support::SMALL.replace(r#"["bvh"]"#, structures);
    let experiment = Experiment::parse(&text, "experiment", &kernels, &registries.catalogue());
    let experiment = experiment.unwrap_or_else(|e| panic!("{e}"));
    let plan = Plan::new(&experiment, &[], |s, d| registries.is_randomised(s, d));
    (
        experiment,
        plan.unwrap_or_else(|e| panic!("{e}")),
        registries,
    )
}

fn verdicts(kernels: &Path) -> Vec<(String, GateVerdict)> {
    let (experiment, plan, registries) = planned(kernels);
    let verified = verify(
        &experiment,
        &plan,
        &registries,
        &RunOptions::default(),
        2000,
        false,
    );
    let verified = verified.unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(verified.len(), 3);
    let verdict = |v: raystone::run::Verified| {
        (
            v.cell[Axis::Accel].name.clone(),
            v.verdict.expect("a verdict"),
        )
    };
    verified.into_iter().map(verdict).collect()
}

#[test]
fn rays_in_another_order_get_the_same_answers_and_counters() {
    let library = KernelLibrary::default().with_folder(&kernel_folder());
    let gpu = support::open(library.expect("the kernels of this test"));
    if !support::is_exact(&gpu) {
        return;
    }
    let mut random = Pcg::new(5);
    for case in scenes::degenerate_cases() {
        let mut rays = scenes::aimed_rays(&mut random, &case.soup, 700);
        // An invalid ray has no key, but still an answer.
        rays[3].origin[1] = f32::NAN;
        rays[4].direction = [f32::INFINITY, 0.0, f32::NAN];
        let params = default_params(&Bvh.parameters());
        let [sorted, plain] = [&SORTED as &dyn AccelKind, &Bvh].map(|kind| {
            let built = build(kind, &case.soup, &params);
            ["counters", "any"].map(|feature| trace(&gpu, &*built, &case.soup, &rays, &[feature]))
        });
        let expected = brute_force(&case.soup, &rays);
        assert_same_hits(case.name, &rays, &expected, &sorted[0].hits);
        assert_eq!(sorted[0].work, plain[0].work, "{}", case.name);
        assert_eq!(sorted[1].found(), plain[1].found(), "{}", case.name);
    }
}

#[test]
fn the_gate_passes_it_and_sees_a_scatter_that_drops_or_misplaces_a_ray() {
    if !support::is_exact(support::gpu()) {
        return;
    }
    for (name, verdict) in verdicts(&kernel_folder()) {
        assert!(verdict.passed, "{name}: {verdict:?}");
    }
    let faults = [
        (
            "restore",
            "let ray = batch.first",
            "if (place == 5u) { return; }\n    let ray = batch.first",
        ),
        (
            "restore",
            "origins[place];",
            "origins[place ^ u32(batch.count > 64u)];",
        ),
        (
            "sort",
            "place + 1u] = rays[ray + 1u]",
            "place + 1u] = rays[2u * batch.first + 1u]",
        ),
        (
            "starts",
            "sum += count;",
            "sum += count - u32(key == 77u && count > 0u);",
        ),
    ];
    for (pass, from, to) in faults {
        let folder = tempfile::tempdir().expect("a folder");
        let target = folder.path().join("accel/sorted_rays");
        std::fs::create_dir_all(&target).expect("a folder");
        let kernels = kernel_folder().join("accel/sorted_rays");
        for file in std::fs::read_dir(kernels).expect("the kernels") {
            let file = file.expect("a kernel").path();
            let name = file.file_name().expect("a name");
            let mut text = std::fs::read_to_string(&file).expect("a kernel");
            if file.file_stem().is_some_and(|stem| stem == pass) {
                assert_eq!(text.matches(from).count(), 1, "`{from}` in {pass}");
                text = text.replace(from, to);
            }
            std::fs::write(target.join(name), text).expect("a kernel");
        }
        for (name, verdict) in verdicts(folder.path()) {
            let wrong: usize = verdict.classes.iter().map(|class| class.wrong).sum();
            assert_eq!(wrong == 0, name == "bvh", "{name} with `{to}`: {verdict:?}");
            assert_eq!(verdict.passed, name == "bvh", "{name} with `{to}`");
        }
    }
}

#[test]
fn a_run_times_counts_and_reports_it_and_leaves_out_single_kernel_integrators() {
    let (experiment, plan, registries) = planned(&kernel_folder());
    let folder = tempfile::tempdir().expect("a folder");
    let options = RunOptions {
        out: folder.path().join("out"),
        ..RunOptions::default()
    };
    let summary: RunSummary =
        run(&experiment, &plan, &registries, &options).unwrap_or_else(|e| panic!("{e}"));
    let records = std::fs::read_to_string(options.out.join("records.jsonl")).expect("records");
    let lines: Vec<serde_json::Value> = records
        .lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect();
    let says = |words: &[&str]| {
        let with = |line: &&serde_json::Value| {
            let text = line.to_string();
            words.iter().all(|word| text.contains(word))
        };
        lines.iter().filter(with).count()
    };
    assert_eq!(summary.failed, 0, "{records}");
    for name in ["bvh", "sorted-rays", "uncounted-rays"] {
        let found = says(&["\"timings\"", "mrays_s", &format!("\"{name}\"")]);
        assert!(found >= 1, "{name}: {records}");
    }
    // Images use the structure that kernels can import, and the others are skipped.
    for name in ["sorted-rays", "uncounted-rays"] {
        assert_eq!(
            says(&["\"skipped\"", "answers buffers of rays", name]),
            1,
            "{name}: {records}"
        );
    }
    let report = raystone::report::write_report(&options.out).expect("a report");
    let page = std::fs::read_to_string(report.html).expect("the page");
    assert!(page.contains("sorted-rays") && page.contains("uncounted-rays"));
}

const NO_ANSWER: [u32; 4] = [0xffff_dead; 4];
/// Rays in a buffer, and how many of them are live.
const RAYS: u32 = 900;
const RANGE: std::ops::Range<u32> = 100..800;
const LIVE: u32 = 300;

/// Answers of a buffer through a structure, with the number of rays determined on the device.
fn live_answers(gpu: &Gpu, kind: &dyn AccelKind, query: Query) -> Vec<[u32; 4]> {
    let stage = support::Stage::builtin(gpu, "cornell-box", &[]);
    let tracer = stage.tracer(&stage.traced(gpu, kind), query);
    let mut random = Pcg::new(3);
    let rays = scenes::aimed_rays(&mut random, &stage.soup, RAYS as usize);
    let stored = |words: &[u32]| Storage::Own(gpu.storage("words", words).expect("a buffer"));
    let answers = stored([NO_ANSWER; RAYS as usize].as_flattened());
    let buffers = RayBuffers {
        rays: Storage::Own(gpu.storage("rays", &rays).expect("a buffer")),
        answers: answers.clone(),
        status: stored(&[0; 16]),
    };
    // Another number is next to it.
    let live = LiveRays {
        counts: stored(&[7, LIVE]),
        word: 1,
        groups: Groups::Indirect(stored(&[LIVE.div_ceil(64), 1, 1]), 0),
    };
    let mut recording = Recording::new();
    let tracer = tracer.expect("kernels");
    let recorded = tracer.record_live(&mut recording, &buffers, RANGE, Some(live));
    recorded.expect("it records");
    recording.download("answers", &answers);
    let played = gpu.play(&recording).expect("it plays");
    let words: Vec<u32> = played.download("answers").expect("answers");
    words.as_chunks::<4>().0.to_vec()
}

/// True if live rays have the answers of the plain BVH, and the others none.
fn only_live_rays_are_answered(gpu: &Gpu, kind: &dyn AccelKind) -> bool {
    [Query::Closest, Query::Any].into_iter().all(|query| {
        let expected = live_answers(support::gpu(), &Bvh, query);
        let found = live_answers(gpu, kind, query);
        let (first, last) = (RANGE.start as usize, (RANGE.start + LIVE) as usize);
        let (live, others) = (
            &found[first..last],
            [&found[..first], &found[last..]].concat(),
        );
        assert!(!expected[first..last].contains(&NO_ANSWER));
        live == &expected[first..last] && others.iter().all(|answer| *answer == NO_ANSWER)
    })
}

#[test]
fn of_rays_that_the_device_counts_the_live_ones_alone_are_answered_by_structures_of_both_kinds() {
    let library = KernelLibrary::default().with_folder(&kernel_folder());
    let gpu = support::open(library.expect("the kernels of this test"));
    let kinds: [&dyn AccelKind; 3] = [&Bvh, &PipedBvh, &SORTED];
    for kind in kinds {
        assert!(only_live_rays_are_answered(&gpu, kind), "{}", kind.name());
    }
    for (from, to) in [
        // All that fit, one too few, the number of others, beyond the end of the range.
        ("min(batch.count, live[batch.word])", "batch.count"),
        (
            "min(batch.count, live[batch.word])",
            "live[batch.word] - 1u",
        ),
        ("live[batch.word]", "live[0u]"),
        ("let index = batch.first + item;", "let index = item;"),
    ] {
        let gpu = support::open(support::kernels_with(
            "integrator/trace_rays",
            &[(from, to)],
        ));
        assert!(!only_live_rays_are_answered(&gpu, &PipedBvh), "{to}");
    }
}
