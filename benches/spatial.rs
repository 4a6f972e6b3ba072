//! Speed of the builders of `octree` and `kd-tree`, and of the plain `bvh` beside them:
//! `cargo bench -p raystone-benches --bench spatial`. Goals on Crytek's Sponza: octree 1 s, kd-tree 2 to 3 s of CPU time.

use criterion::{Criterion, criterion_group, criterion_main};
use raystone::accel::{AccelRegistry, BuildLog, TriangleSoup};
use raystone::config::Axis;
use raystone::params::{ParamValue, Params, Variant};
use raystone::scene::{self, LoadOptions};

/// Crytek's Sponza where it is at hand, else a built-in sphere.
fn soup() -> (&'static str, TriangleSoup) {
    let sponza = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../shared/scenes/sponza-crytek/sponza.obj"
    );
    let options = LoadOptions {
        textures: false,
        ..LoadOptions::default()
    };
    let load = |name: &str| {
        let registries = raystone::run::Registries::default();
        let catalogue = registries.catalogue();
        let built_in = catalogue[Axis::Scene]
            .iter()
            .find(|entry| entry.name == name);
        let file = || Variant {
            name: name.to_owned(),
            params: Params::default(),
            label: name.to_owned(),
        };
        let variant = built_in.map_or_else(file, |entry| entry.default_variant());
        scene::load(&variant, &options).map(|scene| TriangleSoup::new(&scene))
    };
    match load(sponza) {
        Ok(soup) => ("sponza", soup),
        Err(error) => {
            println!("skipped: {error}");
            let sphere = load("displaced-sphere").expect("a built-in scene");
            ("displaced-sphere", sphere)
        }
    }
}

fn builders(criterion: &mut Criterion) {
    let (scene, soup) = soup();
    let mut group = criterion.benchmark_group(scene);
    group.sample_size(10);
    let registry = AccelRegistry::default();
    let variants = [
        ("bvh", None),
        ("octree", Some(true)),
        ("octree", Some(false)),
        ("kd-tree", Some(true)),
        ("kd-tree", Some(false)),
    ];
    for (name, clip) in variants {
        let kind = registry.get(name).expect("a registered structure");
        let declared = kind.parameters().into_iter();
        let mut params = Params(declared.map(|p| (p.name.to_owned(), p.default)).collect());
        let mut label = name.to_owned();
        if let Some(clip) = clip {
            params.0.insert("clip".to_owned(), ParamValue::Flag(clip));
            label += if clip { " clipped" } else { " by boxes" };
        }
        group.bench_function(label, |b| {
            b.iter(|| {
                kind.build(&soup, &params, &mut BuildLog::default())
                    .map(|_| ())
            });
        });
    }
    group.finish();
}

criterion_group!(benches, builders);
criterion_main!(benches);
