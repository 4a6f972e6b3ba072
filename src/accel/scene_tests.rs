//! Structures on built-in scenes.

use crate::{AccelRegistry, BuildLog, TriangleSoup};
use raystone_core::params::ParamValue;
use raystone_scene::{LoadOptions, builtin_scenes, load, named};

#[test]
fn trees_over_it_are_deep_and_tables_take_more_than_one_row_of_texels() {
    let scene = named("far-corners").unwrap();
    assert!(scene.triangles.len() < 12_000);
    let soup = TriangleSoup::new(&scene);
    let registry = AccelRegistry::default();
    let built = |name: &str| {
        let kind = registry.get(name).expect("a structure");
        let variants = registry.entries();
        let entry = variants.iter().find(|e| e.name == name).expect("an entry");
        let params = entry.default_variant().params;
        let built = kind.build(&soup, &params, &mut BuildLog::default());
        built.unwrap_or_else(|e| panic!("{name}: {e}"))
    };
    let row = 8192 * 16;
    for name in ["bvh", "bvh4", "cwbvh"] {
        assert!(built(name).stats().bytes > row, "{name}");
    }
    let depth = built("bvh").stats().depth.expect("a depth");
    assert!(depth > 24, "{depth}");
}

#[test]
fn plants_fence_and_lamp_are_cut_out_and_copies_stay_copies() {
    let scene = named("foliage").unwrap();
    let masked = scene.materials.iter().filter(|m| m.mask.is_some());
    assert_eq!(masked.count(), 3);
    let soup = TriangleSoup::new(&scene);
    assert!(soup.masks.is_some());
    let placed = soup.placed.unwrap();
    assert_eq!(placed.instances.len(), 51);
    assert!(placed.objects.iter().all(|object| object.masks.is_some()));
}

#[test]
fn without_masks_no_kernel_has_any() {
    let scenes = builtin_scenes();
    let foliage = scenes.iter().find(|entry| entry.name == "foliage").unwrap();
    let variant = foliage.variant(&[("masked", ParamValue::Flag(false))]);
    let scene = load(&variant, &LoadOptions::default()).unwrap();
    assert!(TriangleSoup::new(&scene).masks.is_none());
}
