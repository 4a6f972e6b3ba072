//! Every builder of the binary tree, on one thread and on two: the built-in displaced sphere, and
//! Crytek Sponza where it is present.
//!
//! `cargo bench -p raystone-benches --bench builders -- sponza/binned` runs one of them.

use criterion::{Criterion, criterion_group, criterion_main};
use raystone::accel::tree::{Tree, TreeParameters};
use raystone::accel::{BuildLog, TriangleSoup};
use raystone::params::{ParamRange, ParamValue, Parameters as _, Params, Variant};
use raystone::scene::{LoadOptions, builtin_scenes, load};
use std::hint::black_box;
use std::path::Path;

/// Variants beside the builders themselves.
const COMBINATIONS: [(&str, &str, i64); 3] = [
    ("binned+reinsertion", "binned", 4),
    ("sbvh+reinsertion", "sbvh", 4),
    ("ploc+reinsertion-20", "ploc", 20),
];

fn params(builder: &str, reinsertion: i64) -> Params {
    let schema = TreeParameters::schema();
    let defaults = schema
        .iter()
        .map(|p| (p.name.to_owned(), p.default.clone()));
    let mut params = Params(defaults.collect());
    let set = &mut params.0;
    set.insert("builder".into(), ParamValue::Name(builder.into()));
    set.insert("reinsertion".into(), ParamValue::Integer(reinsertion));
    params
}

fn variants() -> Vec<(String, Params)> {
    let schema = TreeParameters::schema();
    let builder = schema.iter().find(|p| p.name == "builder");
    let Some(ParamRange::Choice(names)) = builder.map(|p| &p.range) else {
        panic!("builder is no choice of names");
    };
    let on_host = names.iter().filter(|n| !n.starts_with("device-"));
    let plain = on_host.map(|n| ((*n).to_owned(), params(n, 0)));
    let combined = COMBINATIONS
        .iter()
        .map(|(name, builder, rounds)| ((*name).to_owned(), params(builder, *rounds)));
    plain.chain(combined).collect()
}

/// Triangles of a built-in scene or of a model.
fn soup(name: &str) -> TriangleSoup {
    let entries = builtin_scenes();
    let variant = match entries.iter().find(|entry| entry.name == name) {
        Some(entry) => entry.default_variant(),
        None => Variant {
            name: name.to_owned(),
            params: Params::default(),
            label: name.to_owned(),
        },
    };
    let options = LoadOptions {
        textures: false,
        ..LoadOptions::default()
    };
    let scene = load(&variant, &options).unwrap_or_else(|e| panic!("{name}: {e}"));
    TriangleSoup::new(&scene)
}

fn bench_scene(criterion: &mut Criterion, label: &str, soup: &TriangleSoup) {
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.expect("a pool of threads");
        let mut group = criterion.benchmark_group(label);
        group.sample_size(10);
        for (name, params) in variants() {
            let params = TreeParameters::from_params(&params).expect("parameters");
            let build = || Tree::build(black_box(soup), &params, &mut BuildLog::default());
            group.bench_function(format!("{name}/{threads}T"), |bencher| {
                bencher.iter(|| pool.install(build));
            });
        }
        group.finish();
    }
}

fn builders(criterion: &mut Criterion) {
    bench_scene(criterion, "displaced-sphere", &soup("displaced-sphere"));
    let sponza =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/scenes/sponza-crytek/sponza.obj");
    if sponza.exists() {
        bench_scene(criterion, "sponza", &soup(&sponza.display().to_string()));
    } else {
        println!("skipped: {} is not there", sponza.display());
    }
}

criterion_group!(benches, builders);
criterion_main!(benches);
