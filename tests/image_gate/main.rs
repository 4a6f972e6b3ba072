//! The gate of integrators: kernels agree with the oracle for images path by path, and planted faults do not.

#[path = "../support/mod.rs"]
mod support;

use raystone::gpu::Gpu;
use raystone::integrator::{IntegratorRegistry, RenderJob, Renderer};
use raystone::integrator::RayOffset;
use raystone::measure::image_gate::{answers, judge};
use raystone::measure::path_oracle::{Estimator, PathOracle, View};
use raystone::measure::record::PathsRecord;
use raystone::params::{ParamValue, Variant};
use raystone::sampling::Sampler;
use raystone::scene::SceneData;
use support::*;

/// The verdict on an integrator on a scene.
fn verdict(gpu: &Gpu, scene: SceneData, what: &Variant, sampler: &Sampler, samples: &[u32]) -> PathsRecord {
    let stage = Stage::new(gpu, scene);
    let traced = stage.traced(gpu, structure("bvh"));
    let size = [24, 18];
    let integrator = IntegratorRegistry::default().configured(what).expect("an integrator");
    let job = RenderJob {
        size,
        camera: stage.camera,
        sampler,
        integrator: &integrator,
        offset: RayOffset::default(),
        runtime_checks: true,
    };
    let renderer = Renderer::new(gpu, &stage.buffers, &traced, &job, false).expect("a kernel");
    let answers = answers(&renderer, size, samples, (70_003, 1)).expect("an image");
    let oracle = PathOracle::new(&stage.scene).expect("known materials");
    let view = View {
        estimator: Estimator::of(&integrator).expect("a known integrator"),
        camera: stage.camera,
        size,
        sampler,
    };
    let start = std::time::Instant::now();
    let record = judge(&oracle, &view, &answers);
    println!("judged in {:?}", start.elapsed());
    record
}

#[test]
#[ignore = "measurement"]
fn measure_scenes() {
    let sampler = sampler("pixel-hash", "none");
    let names = std::env::var("SCENES").unwrap_or("cornell-box,displaced-sphere,white-furnace,furnace-box,instances,teapot-in-a-stadium".into());
    for name in names.split(',') {
        let scene = || if name.contains('/') { from_file(name.as_ref()) } else { builtin(name, &[]) };
        for what in [integrator_variant("primary", &[]), integrator_variant("ao", &[("radius", ParamValue::Number(0.2))]), path(6)] {
            let record = verdict(gpu(), scene(), &what, &sampler, &[0, 1, 2, 3, 4, 5, 6, 7]);
            println!("{name} {}: {record:#?}", what.name);
        }
    }
}
