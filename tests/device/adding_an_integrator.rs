//! A sequence, a decorrelation and integrators from outside the program, with their own kernels, in
//! an ordinary run; and a multi-pass integrator bit-identical to a single kernel.

mod deferred;
mod facing;
pub(crate) mod piped;
mod samplers;

use crate::support;
use crate::support::Stage;
use deferred::Deferred;
use facing::Facing;
use piped::PipedBvh;
use raystone::accel::{AccelKind, Traced};
use raystone::gpu::{Gpu, KernelLibrary};
use raystone::image::Image;
use raystone::integrator::RayOffset;
use raystone::integrator::{ConfiguredIntegrator, Integrator, RenderJob, Renderer};
use raystone::measure::record::{Body, Line, axis};
use raystone::params::{ParamValue, Variant};
use raystone::run::Registries;
use raystone::sampling::{Sequence, decorrelation_kind, sequence_kind};
use samplers::{Rotation, Weyl};
use std::path::Path;

fn registries() -> Registries {
    let mut registries = Registries::default();
    let weyl = sequence_kind::<Weyl>("weyl");
    registries.samplers.sequences.add(weyl);
    let rotation = decorrelation_kind::<Rotation>("rotation");
    registries.samplers.decorrelations.add(rotation);
    registries.integrators.register(&Facing);
    registries.integrators.register(&Deferred);
    registries.accel.register(&PipedBvh);
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

fn configured(kind: &'static dyn Integrator) -> ConfiguredIntegrator {
    ConfiguredIntegrator::new(kind, &Variant::default()).expect("default parameters")
}

fn renderer<'a>(
    gpu: &'a Gpu,
    stage: &'a Stage,
    traced: &Traced,
    kind: &'static dyn Integrator,
    size: [u32; 2],
) -> Renderer<'a> {
    let job = RenderJob {
        size,
        camera: stage.camera,
        sampler: &support::sampler("sobol", "cranley-patterson"),
        integrator: &configured(kind),
        offset: RayOffset::default(),
        runtime_checks: true,
    };
    Renderer::new(gpu, &stage.buffers, traced, &job, true).unwrap_or_else(|e| panic!("{e}"))
}

fn bits(image: &Image) -> Vec<[u32; 3]> {
    image.pixels.iter().map(|p| p.map(f32::to_bits)).collect()
}

fn last(renderer: &Renderer, spps: &[u32]) -> Vec<[u32; 3]> {
    let shots = renderer.render(spps, 9).expect("a render");
    bits(&shots.last().expect("a snapshot").image)
}

fn primary() -> &'static dyn Integrator {
    let found = Registries::default().integrators.get("primary");
    found.expect("it is registered")
}

#[test]
fn passes_give_the_image_of_a_single_kernel_through_every_structure() {
    let gpu = support::open(KernelLibrary::default().with_sources(Deferred.sources()));
    if !support::is_exact(&gpu) {
        return;
    }
    let sphere = [("triangles", ParamValue::Integer(2000))];
    let scenes: [(_, &[_]); 2] = [("cornell-box", &[]), ("displaced-sphere", &sphere)];
    for (scene, changes) in scenes {
        let stage = Stage::builtin(&gpu, scene, changes);
        let bvh = stage.traced(&gpu, support::structure("bvh"));
        let one = renderer(&gpu, &stage, &bvh, primary(), [24, 16]);
        let expected = last(&one, &[4]);
        let kinds = support::structures().into_iter();
        for kind in kinds.chain([&PipedBvh as &dyn AccelKind]) {
            let traced = stage.traced(&gpu, kind);
            let passes = renderer(&gpu, &stage, &traced, &Deferred, [24, 16]);
            let what = format!("{scene} through {}", kind.name());
            assert!(last(&passes, &[1, 3, 4]) == expected, "{what}");
            let counts = passes.ray_counts().expect("counts");
            assert_eq!(counts, [24 * 16 * 4, 0, 0, 0, 0], "{what}");
        }
        let job = renderer(&gpu, &stage, &bvh, &Deferred, [24, 16]);
        assert_ne!(job.kernel_hash(), one.kernel_hash());
        assert!(last(&job, &[3]) != expected, "a sample less");
    }
}

#[test]
fn an_image_in_passes_does_not_depend_on_slices_and_a_fault_in_a_pass_is_seen() {
    let gpu = support::open(KernelLibrary::default().with_sources(Deferred.sources()));
    if !support::is_exact(&gpu) {
        return;
    }
    let stage = Stage::builtin(&gpu, "cornell-box", &[]);
    let traced = stage.traced(&gpu, support::structure("bvh"));
    // The first slice of an unknown kernel is 512 samples: this image needs more.
    let size = [200, 144];
    let expected = last(&renderer(&gpu, &stage, &traced, primary(), size), &[3]);
    let passes = renderer(&gpu, &stage, &traced, &Deferred, size);
    assert!(last(&passes, &[3]) == expected);
    passes.reset().expect("a device");
    for sample in 0..3 {
        passes.add_samples(sample, 1, 9).expect("samples");
    }
    assert!(bits(&passes.image().expect("an image")) == expected);
    // The hit of the neighbour.
    let faulty = Deferred.sources().iter().map(|&(name, text)| {
        let changed = text.replace("hits[place(id.xy, i)]", "hits[place(id.xy, i) ^ 1u]");
        assert_eq!(changed != text, name == "deferred/shade");
        (name, changed)
    });
    let faulty: Vec<(&str, String)> = faulty.collect();
    let sources: Vec<(&str, &str)> = faulty.iter().map(|(n, t)| (*n, t.as_str())).collect();
    let gpu = gpu.with_kernels(KernelLibrary::default().with_sources(&sources));
    assert!(last(&renderer(&gpu, &stage, &traced, &Deferred, size), &[3]) != expected);
}

#[test]
fn passes_run_where_a_single_kernel_cannot_which_is_skipped_with_its_reason() {
    if !support::is_exact(support::gpu()) {
        return;
    }
    let text = std::fs::read_to_string("tests/data/tiny.toml").expect("the experiment");
    let text = text
        .replace("\"uniform-grid\"", "\"piped-bvh\"")
        .replace("\"path\"", "\"primary\", \"deferred\"");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("run");
    let records = support::run(&text, &registries(), &out, None).1;
    assert_eq!(failures(&records), [""; 0]);
    let pairs = |body: fn(&Body) -> bool| -> Vec<String> {
        let lines = records.iter().filter(|line| body(&line.body));
        let pair = |line: &Line| {
            let names = [axis::ACCEL, axis::INTEGRATOR].map(|axis| line.key.name(axis));
            names.join(" ").trim().to_owned()
        };
        lines.map(pair).collect()
    };
    let mut gated = pairs(|body| matches!(body, Body::Structure(_)));
    gated.sort();
    assert_eq!(gated, ["bvh", "piped-bvh"]);
    let mut timed = pairs(|body| matches!(body, Body::Time(_)));
    timed.sort();
    assert_eq!(timed, ["bvh deferred", "bvh primary", "piped-bvh deferred"]);
    let skipped = records.iter().filter_map(|line| match &line.body {
        Body::Skipped(skipped) => Some(format!("{}: {}", skipped.cell, skipped.reason)),
        _ => None,
    });
    let skipped: Vec<String> = skipped.collect();
    assert_eq!(skipped.len(), 1, "{skipped:?}");
    for word in ["piped-bvh", "primary", "buffers of rays alone"] {
        assert!(skipped[0].contains(word), "{skipped:?}");
    }
    let image = |integrator: &str| {
        let of = records
            .iter()
            .filter(|l| l.key.name(axis::INTEGRATOR) == integrator);
        let hashes = of.filter_map(|line| match &line.body {
            Body::Error(error) => Some(error.image_hash.clone()),
            _ => None,
        });
        hashes.collect::<Vec<_>>()
    };
    assert_eq!(image("deferred").len(), 2);
    assert_eq!(image("deferred"), image("primary"));
    raystone::report::write_report(&out).expect("a report");
    let page = std::fs::read_to_string(out.join("index.html")).expect("the page");
    assert!(page.contains("deferred") && page.contains("piped-bvh"));
    assert!(
        page.contains("buffers of rays alone"),
        "the reason is shown"
    );
}
