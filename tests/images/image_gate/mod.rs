//! Correctness check of integrators: kernels match the image oracle per path, faults do not.

mod real;
mod runs;

use crate::support::*;
use raystone::gpu::{Gpu, GpuError};
use raystone::integrator::RayOffset;
use raystone::integrator::{BLOCK_SAMPLES, IntegratorRegistry, RenderJob, Renderer};
use raystone::measure::image_gate::{Choice, Pixels, answers, judge, out_of_bounds, sums};
use raystone::measure::path_oracle::{Estimator, PathOracle, View};
use raystone::measure::record::{Body, PathsRecord, Verdict};
use raystone::measure::trial_scenes::{layers, trial_scenes};
use raystone::params::{ParamValue, Variant};
use raystone::run::Registries;
use raystone::sampling::Sampler;
use raystone::scene::SceneData;

const SIZE: [u32; 2] = [26, 19];

fn verdict(
    gpu: &Gpu,
    scene: &SceneData,
    what: &Variant,
    sampler: &Sampler,
    samples: &[u32],
) -> PathsRecord {
    tried(gpu, scene, what, sampler, samples).expect("images")
}

/// [`verdict`] for kernels that may raise an error or not compile.
fn tried(
    gpu: &Gpu,
    scene: &SceneData,
    what: &Variant,
    sampler: &Sampler,
    samples: &[u32],
) -> Result<PathsRecord, GpuError> {
    judged_by(gpu, scene, scene, what, sampler, samples)
}

/// [`tried`] with the oracle of the expected scene.
fn judged_by(
    gpu: &Gpu,
    scene: &SceneData,
    expected: &SceneData,
    what: &Variant,
    sampler: &Sampler,
    samples: &[u32],
) -> Result<PathsRecord, GpuError> {
    let stage = Stage::new(gpu, scene.clone());
    judged_on(gpu, &stage, expected, what, sampler, samples)
}

/// [`judged_by`] on a stage with its own triangle test.
fn judged_on(
    gpu: &Gpu,
    stage: &raystone::integrator::Stage,
    expected: &SceneData,
    what: &Variant,
    sampler: &Sampler,
    samples: &[u32],
) -> Result<PathsRecord, GpuError> {
    let traced = stage.structure(&Default::default(), "bvh");
    let traced = traced.expect("a structure");
    let camera = stage.scene.view(1.0);
    let integrator = IntegratorRegistry::default().configured(what);
    let integrator = integrator.unwrap_or_else(|e| panic!("{e}"));
    let job = RenderJob {
        size: SIZE,
        camera,
        sampler,
        integrator: &integrator,
        offset: RayOffset::default(),
        runtime_checks: true,
    };
    let renderer = Renderer::new(gpu, &stage.buffers, &traced, &job, false)?;
    let pixels = Pixels {
        size: SIZE,
        choice: Choice::Every(1),
        samples: samples.to_vec(),
        seed: 70_003,
    };
    let answers = answers(&renderer, &pixels)?;
    let oracle = PathOracle::new(expected).expect("known materials");
    let view = View {
        estimator: Estimator::of(&integrator).expect("a known integrator"),
        camera,
        size: SIZE,
        sampler,
    };
    let start = std::time::Instant::now();
    let mut record = judge(&oracle, &view, &answers);
    record.fault = record
        .fault
        .or(sums(&renderer, &pixels, 2 * BLOCK_SAMPLES)?);
    println!(
        "{} {}: {:?} {record:?}",
        stage.scene.name,
        what.name,
        start.elapsed()
    );
    Ok(record)
}

/// A sampler of independent numbers with the required dimensions.
fn independent() -> Sampler {
    sampler_of("pixel-hash", "none", 100_000)
}

/// Checks the trial scenes in a range, split into eight tests for their duration.
fn check_trials(places: std::ops::Range<usize>) {
    let scenes = trial_scenes().expect("scenes");
    assert_eq!(scenes.len(), 32);
    for trial in &scenes[places] {
        for (name, changes) in in_turn("integrators path by path", &trial.trials) {
            let what = integrator_variant(name, changes);
            let record = verdict(gpu(), &trial.scene, &what, &independent(), &[0, 3, 70_000]);
            assert_eq!(record.fault, None, "{} {name}", trial.scene.name);
            assert_eq!(record.verdict(), Verdict::Pass);
        }
    }
}

#[test]
fn single_paths_of_lamps_points_and_glass_are_those_of_the_oracle() {
    check_trials(0..3);
}

#[test]
fn single_paths_of_gloss_textures_and_instances_are_those_of_the_oracle() {
    check_trials(3..6);
}

#[test]
fn single_paths_of_maps_luminaires_and_many_lamps_are_those_of_the_oracle() {
    check_trials(6..10);
}

#[test]
fn single_paths_of_placed_textures_skies_and_panes_are_those_of_the_oracle() {
    check_trials(10..13);
}

#[test]
fn single_paths_of_layers_mirrored_balls_and_thin_triangles_are_those_of_the_oracle() {
    check_trials(13..16);
}

#[test]
fn single_paths_of_fences_veils_every_pair_and_rooms_of_other_sizes_are_those_of_the_oracle() {
    check_trials(16..23);
}

#[test]
fn single_paths_through_media_are_those_of_the_oracle() {
    check_trials(23..29);
}

#[test]
fn single_paths_through_several_media_are_those_of_the_oracle() {
    check_trials(29..32);
}

/// The verdict of one scene's oracle on another scene's paths, of a kernel with this change.
fn of_another(rendered: &SceneData, expected: &SceneData, change: &[(&str, &str)]) -> PathsRecord {
    let gpu = open(kernels_with("integrator/path", change));
    let what = [
        ("max_depth", ParamValue::Integer(3)),
        ("roulette_depth", ParamValue::Integer(1)),
    ];
    let what = integrator_variant("path", &what);
    judged_by(&gpu, rendered, expected, &what, &independent(), &[0, 3]).expect("images")
}

#[test]
fn surfaces_within_rounding_are_told_apart_from_faults() {
    let [coincident, apart] = [0.0, 2e-3].map(|apart| layers(apart).expect("a built-in scene"));
    let right = of_another(&coincident, &coincident, &[]);
    assert_eq!(right.fault, None);
    assert!(right.surfaces > right.paths / 20, "{right:?}");
    assert!(
        right.layered > right.paths / 2 && right.surfaces <= right.layered,
        "{right:?}"
    );
    // Layers that rounding cannot exchange; and a half-percent fault in ones that it can.
    assert_eq!(of_another(&apart, &apart, &[]).surfaces, 0);
    assert!(of_another(&coincident, &apart, &[]).wrong > 0);
    let weight = "throughput *= next.weight;";
    let faulty = [(weight, "throughput *= 1.005 * next.weight;")];
    assert!(of_another(&coincident, &coincident, &faulty).wrong > 0);
}

#[test]
fn faults_do_not_hide_in_edges_decisions_and_textures() {
    let scene = layers(2e-3).expect("a built-in scene");
    // A lamp displaced: camera rays see the same except at its edges.
    let room = builtin("cornell-box", &[]);
    let mut aside = room.clone();
    let shines = |id: &u32| room.materials[*id as usize].emission != glam::Vec3::ZERO;
    let bounds = room.bounds();
    let by = 0.03 * (bounds.max - bounds.min) * glam::Vec3::X;
    let lamp = aside.triangles.iter_mut().zip(&room.material_ids);
    for (triangle, _) in lamp.filter(|(_, id)| shines(id)) {
        triangle.vertices = triangle.vertices.map(|v| v + by);
    }
    let what = integrator_variant("primary", &[]);
    let record = judged_by(gpu(), &aside, &room, &what, &independent(), &[0, 3]);
    let record = record.expect("images");
    assert!((1..100).contains(&record.wrong), "{record:?}");
    // One more in thirty ends.
    let survives = "sample_1d(sampler) >= survival";
    let fewer = [(survives, "sample_1d(sampler) >= survival - 0.03")];
    let record = of_another(&scene, &scene, &fewer);
    assert!((1..100).contains(&record.wrong), "{record:?}");
    // Textures displaced by a thousandth of their width.
    let textured = trial_scenes().expect("scenes").swap_remove(4).scene;
    let mut aside = textured.clone();
    assert!(!aside.uvs.is_empty());
    for corners in &mut aside.uvs {
        *corners = corners.map(|uv| uv + glam::Vec2::splat(1e-3));
    }
    let record = of_another(&aside, &textured, &[]);
    assert!(record.fault.is_some() && record.wrong > 0, "{record:?}");
}

#[test]
fn each_kind_of_difference_has_a_bound() {
    let paths = PathsRecord {
        paths: 3952,
        layered: 100,
        ..PathsRecord::default()
    };
    let said = |record: &PathsRecord| out_of_bounds(record, 1e-3, 0).unwrap_or_default();
    // 0.1 % and 2 % of 3952 paths, and six standard deviations.
    for (few, many, part) in [
        (
            PathsRecord {
                flips: 17,
                edges: 10,
                ..paths.clone()
            },
            PathsRecord {
                flips: 18,
                edges: 10,
                ..paths.clone()
            },
            "take another branch",
        ),
        (
            PathsRecord {
                flips: 117,
                surfaces: 117,
                ..paths.clone()
            },
            PathsRecord {
                flips: 118,
                surfaces: 118,
                ..paths.clone()
            },
            "100 have one within rounding",
        ),
        (
            PathsRecord {
                ill_conditioned: 134,
                ..paths.clone()
            },
            PathsRecord {
                ill_conditioned: 135,
                ..paths.clone()
            },
            "are ill-conditioned",
        ),
        (
            PathsRecord {
                median: 2e-5,
                ..paths.clone()
            },
            PathsRecord {
                median: 2.1e-5,
                ..paths
            },
            "half of the paths",
        ),
    ] {
        assert_eq!(said(&few), "");
        assert!(said(&many).contains(part), "{}", said(&many));
    }
}

#[test]
fn a_scene_without_light_is_right_if_it_is_black() {
    let dark = || {
        let mut scene = layers(2e-3).expect("a built-in scene");
        scene.environment = glam::Vec3::ZERO;
        scene
            .materials
            .iter_mut()
            .for_each(|m| m.emission = glam::Vec3::ZERO);
        scene
    };
    let record = of_another(&dark(), &dark(), &[]);
    assert_eq!(
        (record.fault.as_deref(), record.wrong),
        (None, 0),
        "{record:?}"
    );
    assert_eq!(record.verdict(), Verdict::Pass);
    let glowing = [(
        "var result = vec3<f32>(0.0);",
        "var result = vec3<f32>(0.0, 1e-9, 0.0);",
    )];
    assert!(of_another(&dark(), &dark(), &glowing).wrong > 0);
}

#[test]
fn every_kind_of_sampler_is_judged_by_its_words() {
    let scene = builtin("cornell-box", &[]);
    for sampler in [
        ("sobol", "none"),
        ("halton", "cranley-patterson"),
        ("rank1-lattice", "cranley-patterson"),
    ] {
        let sampler = sampler_of(sampler.0, sampler.1, 64);
        let record = verdict(gpu(), &scene, &path(6), &sampler, &[0, 1, 63]);
        assert_eq!(record.fault, None, "{}", sampler.label());
    }
}

/// A fault in a kernel, and the resulting message.
fn fault(module: &str, from: &str, to: &str) -> Option<String> {
    let gpu = open(kernels_with(module, &[(from, to)]));
    let scene = builtin("cornell-box", &[]);
    verdict(&gpu, &scene, &path(4), &independent(), &[0, 1]).fault
}

#[test]
fn a_half_percent_and_a_wrong_dimension_are_seen_with_the_path_told() {
    let weight = "throughput *= next.weight;";
    let found = fault(
        "integrator/path",
        weight,
        "throughput *= 1.005 * next.weight;",
    );
    let found = found.expect("a fault of half a percent");
    for part in [
        "pixel (",
        "sample 0, seed 70003",
        "kernel (",
        "oracle (",
        "vertex 0: ",
        "throughput",
    ] {
        assert!(found.contains(part), "{part} in {found}");
    }
    let found = fault(
        "sampling/dimensions",
        "const LIGHT_POINT: u32 = 2u;",
        "const LIGHT_POINT: u32 = 3u;",
    );
    assert!(found.is_some());
}

#[test]
fn a_run_gives_no_error_figure_for_an_integrator_whose_paths_are_wrong() {
    let folder = tempfile::tempdir().expect("a folder");
    let kernels = folder.path().join("mine/integrator");
    std::fs::create_dir_all(&kernels).expect("a folder");
    let library = raystone::gpu::KernelLibrary::default();
    let text = library.text("integrator/path").expect("a kernel");
    let changed = text.replace(
        "throughput *= next.weight;",
        "throughput *= 1.01 * next.weight;",
    );
    assert_ne!(changed, text);
    std::fs::write(kernels.join("path.wesl"), changed).expect("a file");
    let mine = folder.path().join("mine").display().to_string();
    let out = folder.path().join("out");
    let text = SMALL.replace("[axes]", &format!("[axes]\nkernels = [\"\", \"{mine}\"]"));
    let (summary, lines) = run(&text, &Registries::default(), &out, None);
    assert_eq!(summary.failed, 1);
    let judged: Vec<_> = lines
        .iter()
        .filter(|l| matches!(l.body, Body::Paths(_)))
        .collect();
    assert_eq!(judged.len(), 2);
    let errors = lines.iter().filter(|l| matches!(l.body, Body::Error(_)));
    let kernels = |l: &raystone::measure::record::Line| l.key.label("kernels").to_owned();
    assert!(errors.clone().count() > 0 && errors.clone().all(|l| kernels(l).is_empty()));
    let failed = lines.iter().find_map(|l| match &l.body {
        Body::Failed(f) => Some(f.reason.clone()),
        _ => None,
    });
    assert!(
        failed
            .expect("a failure")
            .contains("failed the gate: pixel (")
    );
    let report = std::fs::read_to_string(out.join("index.html")).expect("a report");
    assert!(report.contains("Integrators path by path"));
}

/// Prints figures of the oracle on the scenes named by the variable `SCENES`.
#[test]
#[ignore = "no check but a measurement: `cargo test --release --test images -- --ignored --nocapture image_gate`"]
fn measure_scenes() {
    let names = std::env::var("SCENES").unwrap_or_else(|_| "cornell-box".to_owned());
    for name in names.split(',') {
        let scene = if name.contains('/') {
            from_file(name.as_ref())
        } else {
            builtin(name, &[])
        };
        let occlusion = integrator_variant("ao", &[("radius", ParamValue::Number(0.2))]);
        for what in [integrator_variant("primary", &[]), occlusion, path(6)] {
            verdict(
                gpu(),
                &scene,
                &what,
                &independent(),
                &[0, 1, 2, 3, 4, 5, 6, 7],
            );
        }
    }
}

/// Finds the faults of a list that the trial scenes reveal: lines `name | module | text |
/// replacement` of the file named by the variable `FAULTS`, to test guesses without a build.
#[test]
#[ignore = "no check but a measurement: `FAULTS=list cargo test --release --test images -- --ignored --nocapture hunt`"]
fn hunt_faults() {
    let Ok(list) = std::env::var("FAULTS") else {
        return println!("skipped: the variable FAULTS names no list of faults");
    };
    let list = std::fs::read_to_string(list).expect("a list");
    let scenes = trial_scenes().expect("scenes");
    for line in list.lines().filter(|line| !line.is_empty()) {
        let parts: Vec<&str> = line.split(" | ").collect();
        let [name, module, from, to] = parts[..] else {
            panic!("{line}");
        };
        let gpu = open(kernels_with(module, &[(from, to)]));
        let found = scenes.iter().find_map(|trial| {
            trial.trials.iter().find_map(|(name, changes)| {
                let what = integrator_variant(name, changes);
                let fault = match tried(&gpu, &trial.scene, &what, &independent(), &[0, 70_000]) {
                    Ok(record) => record.fault?,
                    Err(error) => error.to_string(),
                };
                Some(format!(
                    "{} {what}: {}",
                    trial.scene.name,
                    &fault[..fault.len().min(120)]
                ))
            })
        });
        match found {
            Some(found) => println!("SEEN {name}: {found}"),
            None => println!("UNSEEN {name}"),
        }
    }
}
