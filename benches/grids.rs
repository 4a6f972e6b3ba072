//! Building grids: every grid with default parameters, on Sponza (where it is present) and a built-in
//! scene. `cargo bench -p raystone-benches --bench grids`.

use criterion::{BatchSize, Criterion, SamplingMode, criterion_group, criterion_main};
use raystone::accel::{AccelKind, AccelRegistry, BuildLog, TriangleSoup};
use raystone::params::{Params, Variant};
use raystone::scene::{LoadOptions, builtin_scenes, load};
use std::path::Path;
use std::time::Duration;

/// Sponza, 262,267 triangles, below the folder of shared scenes.
const SPONZA: &str = "../../shared/scenes/sponza-crytek/sponza.obj";

fn defaults(schema: raystone::params::ParameterSchema) -> Params {
    Params(
        schema
            .into_iter()
            .map(|p| (p.name.to_owned(), p.default))
            .collect(),
    )
}

/// The triangles of a built-in scene or a file.
fn triangles(name: &str, params: Params) -> TriangleSoup {
    let variant = Variant {
        name: name.to_owned(),
        params,
        label: name.to_owned(),
    };
    let scene = load(&variant, &LoadOptions::default());
    TriangleSoup::new(&scene.unwrap_or_else(|e| panic!("{name}: {e}")))
}

fn scenes() -> Vec<(&'static str, TriangleSoup)> {
    let mut scenes = Vec::new();
    let name = "teapot-in-a-stadium";
    if let Some(entry) = builtin_scenes().into_iter().find(|e| e.name == name) {
        scenes.push((name, triangles(name, defaults(entry.schema))));
    }
    let sponza = Path::new(env!("CARGO_MANIFEST_DIR")).join(SPONZA);
    if sponza.exists() {
        scenes.push((
            "sponza",
            triangles(&sponza.display().to_string(), Params::default()),
        ));
    } else {
        println!("skipped: {} is not there", sponza.display());
    }
    scenes
}

fn build(criterion: &mut Criterion) {
    let registry = AccelRegistry::default();
    let grids: Vec<&dyn AccelKind> = registry
        .iter()
        .filter(|k| k.name().ends_with("-grid") || k.name() == "bvh")
        .collect();
    for (scene, soup) in scenes() {
        let mut group = criterion.benchmark_group(format!("build/{scene}"));
        group
            .sampling_mode(SamplingMode::Flat)
            .sample_size(10)
            .measurement_time(Duration::from_secs(5));
        for kind in &grids {
            let params = defaults(kind.parameters());
            group.bench_function(kind.name(), |bencher| {
                bencher.iter_batched(
                    BuildLog::default,
                    |mut log| kind.build(&soup, &params, &mut log).map(|_| log),
                    BatchSize::PerIteration,
                );
            });
        }
        group.finish();
    }
}

criterion_group!(benches, build);
criterion_main!(benches);
