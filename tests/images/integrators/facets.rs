//! Coarse balls with vertex normals in the white furnace: no light is sent behind the surface.

use crate::support::*;
use glam::Vec3;
use raystone::geometry::{Camera, Triangle};
use raystone::gpu::Gpu;
use raystone::params::{ParamValue, Variant};
use raystone::scene::{CookTorrance, Fresnel, Masking, Material, SceneData, encode_normal};
use std::f32::consts::{PI, TAU};

const SIZE: [u32; 2] = [32, 32];
/// Maximum path length, with no earlier end.
const DEPTH: i64 = 20;

/// A unit ball under a white sky, with the vertex normals of the sphere.
fn ball([sectors, bands]: [u32; 2], material: Material) -> SceneData {
    let mut scene = builtin("white-furnace", &[]);
    let at = |sector: u32, band: u32| {
        let (theta, phi) = (
            PI * band as f32 / bands as f32,
            TAU * sector as f32 / sectors as f32,
        );
        let ring = theta.sin();
        Vec3::new(ring * phi.cos(), theta.cos(), -ring * phi.sin())
    };
    let mut corners = Vec::new();
    for (sector, band) in (0..sectors).flat_map(|s| (0..bands).map(move |b| (s, b))) {
        let [a, b, c, d] = [
            at(sector, band),
            at(sector, band + 1),
            at(sector + 1, band + 1),
            at(sector + 1, band),
        ];
        corners.extend((band + 1 < bands).then_some([a, b, c]));
        corners.extend((band > 0).then_some([a, c, d]));
    }
    scene.triangles = corners.iter().map(|c| Triangle::from(*c)).collect();
    scene.normals = corners.iter().map(|c| c.map(encode_normal)).collect();
    scene.material_ids = vec![0; corners.len()];
    scene.materials = vec![material];
    scene.camera = Some(Camera::upright(
        3.0 * Vec3::Z + 0.4 * Vec3::Y,
        Vec3::ZERO,
        45.0,
    ));
    scene
}

fn long(depth: i64) -> Variant {
    let none = ParamValue::Name("none".to_owned());
    let changes = [
        ("max_depth", ParamValue::Integer(depth)),
        ("roulette", none),
    ];
    integrator_variant("path", &changes)
}

fn seen(gpu: &Gpu, scene: SceneData, depth: i64, spp: u32) -> [f64; 3] {
    let stage = Stage::new(gpu, scene);
    let traced = stage.traced(gpu, structure("bvh"));
    let sampler = sampler("pixel-hash", "none");
    let renderer = stage.renderer(gpu, &traced, &sampler, &long(depth), SIZE, false);
    let image = renderer
        .render(&[spp], 3)
        .expect("a render")
        .remove(0)
        .image;
    let pixels = || image.pixels.iter().flatten().map(|v| f64::from(*v));
    [
        pixels().fold(f64::INFINITY, f64::min),
        image.mean(),
        pixels().fold(0.0, f64::max),
    ]
}

/// (Nearly) lossless surfaces: rough facets hide each other.
fn shiny() -> Vec<(&'static str, Material)> {
    let of = CookTorrance {
        diffuse: Vec3::ZERO,
        specular: Vec3::ONE,
        roughness: 0.2,
        ior: 100.0,
        masking: Masking::Smith,
        fresnel: Fresnel::Schlick,
    };
    let metal = |roughness| Material::principled("metal", Vec3::ONE, 1.0, roughness, 0.04);
    vec![
        ("mirror", Material::mirror("mirror", Vec3::ONE)),
        ("smooth metal", metal(0.05)),
        ("metal", metal(0.3)),
        (
            "phong",
            Material::phong("phong", Vec3::ZERO, Vec3::ONE, 50.0),
        ),
        (
            "cook-torrance",
            Material::cook_torrance("cook-torrance", &of),
        ),
    ]
}

/// A smooth ball, and the same without its normals.
fn smooth_and_flat(size: [u32; 2], material: Material) -> [SceneData; 2] {
    let smooth = ball(size, material);
    let flat = SceneData {
        normals: Vec::new(),
        ..smooth.clone()
    };
    [smooth, flat]
}

#[test]
fn smooth_balls_of_few_facets_reflect_all_light() {
    for size in [[12, 6], [20, 10]] {
        for (name, material) in in_turn("materials of few facets", shiny()) {
            let [smooth, flat] = smooth_and_flat(size, material);
            let [least, mean, most] = seen(gpu(), smooth, DEPTH, 64);
            let what = format!("{size:?} {name}: {least} {mean} {most}");
            if name == "mirror" {
                assert!(least > 0.9999 && most < 1.0001, "{what}");
                continue;
            }
            // Light lost between microfacets, and in lobes below the horizon, is lost on flat
            // balls, too. The rest is noise.
            let [flat_least, flat_mean, _] = seen(gpu(), flat, DEPTH, 64);
            let what = format!("{what}; flat: {flat_least} {flat_mean}");
            assert!(
                least > flat_least - 0.08 && mean > flat_mean - 0.006,
                "{what}"
            );
            assert!(mean < flat_mean + 0.006, "{what}");
        }
    }
}

/// Minimum of the worst pixel and the mean of a smooth glass ball after [`DEPTH`] bounces. The
/// missing light is trapped beyond the critical angle: flat balls of 12 × 6 facets and more lose
/// two to eighty times as much.
const GLASS: [([u32; 2], f64, f64); 4] = [
    ([6, 4], 0.3, 0.975),
    ([12, 6], 0.82, 0.997),
    ([20, 10], 0.9, 0.998),
    ([48, 24], 0.95, 0.9995),
];

#[test]
fn smooth_balls_of_glass_of_few_facets_let_light_through() {
    for (size, worst, all) in GLASS {
        let [smooth, flat] = smooth_and_flat(size, Material::dielectric("glass", Vec3::ONE, 1.5));
        let [least, mean, most] = seen(gpu(), smooth, DEPTH, 256);
        assert!(
            least > worst && mean > all && most < 1.0001,
            "{size:?}: {least} {mean} {most}"
        );
        if size != [6, 4] {
            let [flat_least, flat_mean, _] = seen(gpu(), flat, DEPTH, 256);
            assert!(least > flat_least && mean > flat_mean, "{size:?}");
        }
        let pane = Material::thin_dielectric("pane", Vec3::ONE, 1.5);
        let [least, _, most] = seen(gpu(), ball(size, pane), DEPTH, 256);
        assert!(
            least > 0.98 && most < 1.0001,
            "pane {size:?}: {least} {most}"
        );
    }
}

#[test]
fn light_that_shading_normals_send_behind_the_surface_would_be_missed() {
    let metal = Material::principled("metal", Vec3::ONE, 1.0, 0.05, 0.04);
    for (from, material, least_seen) in [
        (
            "if (found.is_delta)",
            Material::mirror("mirror", Vec3::ONE),
            0.5,
        ),
        ("if (is_before && is_glossy(surface))", metal, 0.5),
    ] {
        let gpu = open(kernels_with("shading/bsdf", &[(from, "if (false)")]));
        let [least, mean, _] = seen(&gpu, ball([12, 6], material), DEPTH, 64);
        println!("{from}: {least} {mean}");
        assert!(least < least_seen && mean < 0.99, "{from}: {least} {mean}");
    }
}
