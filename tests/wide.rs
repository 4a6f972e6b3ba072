//! Wide BVHs: every layout of their arrays, every builder below them.

mod common;

use common::{Pcg, assert_same_hits, brute_force, build, default_params, scenes, trace};
use raystone::accel::{AccelKind, AccelRegistry, Counters};
use raystone::config::{ParamValue, Params};

const WIDE: [&str; 2] = ["bvh4", "cwbvh"];

fn kind(name: &str) -> &'static dyn AccelKind {
    let registry = AccelRegistry::default();
    registry
        .get(name)
        .unwrap_or_else(|| panic!("no structure {name}"))
}

fn with(kind: &dyn AccelKind, name: &str, value: ParamValue) -> Params {
    let mut params = default_params(&kind.parameters());
    let before = params.0.insert(name.to_owned(), value);
    assert!(before.is_some(), "{} has no {name}", kind.name());
    params
}

#[test]
fn kernels_read_buffers_and_textures_alike() {
    if !common::is_exact(common::gpu()) {
        return;
    }
    // More triangles than fit into one row of texels.
    let mut rng = Pcg::new(12);
    let soup = scenes::lattice_soup(&mut rng, 6_000, 24);
    let mut rays = scenes::lattice_rays(&mut rng, 1024, 24);
    rays.extend(scenes::aimed_rays(&mut rng, &soup, 1024));
    let expected = brute_force(&soup, &rays);
    for name in WIDE {
        let kind = kind(name);
        for texels in [false, true] {
            let built = build(kind, &soup, &with(kind, "texels", ParamValue::Flag(texels)));
            let twin = built.cpu_twin(&soup).expect("a twin");
            let found = trace(common::gpu(), &*built, &soup, &rays, &["counters"]);
            let what = format!("{name}, texels {texels}");
            assert_same_hits(&what, &rays, &expected, &found.hits);
            for (index, ray) in rays.iter().enumerate() {
                let mut work = Counters::default();
                twin.closest_hit(ray, &mut work);
                assert_eq!(found.work[index], work, "{what}: ray {index}");
            }
        }
    }
}

#[test]
fn wide_nodes_of_eight_and_of_four_are_smaller_than_binary_ones() {
    let mut rng = Pcg::new(5);
    let soup = scenes::lattice_soup(&mut rng, 5_000, 40);
    let bytes = |name: &str| {
        let kind = kind(name);
        let built = build(kind, &soup, &default_params(&kind.parameters()));
        built.stats().bytes - 48 * built.stats().references
    };
    let [eight, four, binary] = ["cwbvh", "bvh4", "bvh"].map(bytes);
    assert!(
        eight < four && 2 * four < binary,
        "{eight}, {four}, {binary}"
    );
}
