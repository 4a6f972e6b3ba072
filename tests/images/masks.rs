//! Alpha masks: closest and any hits of every structure and triangle test with masked surfaces, the
//! correctness check with planted faults, masked lamps, and a known answer. Surfaces that exist by
//! chance: the share of rays that each of a pile meets, against the product of alphas.

use crate::support::*;
use raystone::accel::{AccelRegistry, Intersection, NO_HIT, Ray, TriangleRegistry, TriangleSoup};
use raystone::gpu::Gpu;
use raystone::measure::gate::{Checks, ReferenceTracer};
use raystone::measure::record::GateVerdict;
use raystone::params::{ParamValue, Variant};
use raystone::scene::SceneData;

const STRUCTURES: usize = 15;

fn few_plants() -> SceneData {
    builtin("foliage", &[("plants", ParamValue::Integer(9))])
}

fn judge(stage: &Stage) -> ReferenceTracer {
    stage.judge(Checks::Repeated, [2048, 4_000_000, 1024])
}

fn wrong(verdict: &GateVerdict) -> usize {
    verdict.classes.iter().map(|class| class.wrong).sum()
}

/// The same, with every masked surface there with the probability of its alpha.
fn blended_plants() -> SceneData {
    let mut scene = few_plants();
    for mask in scene.materials.iter_mut().filter_map(|m| m.mask.as_mut()) {
        (mask.factor, mask.cutoff) = (0.8, None);
    }
    scene
}

/// Rays down from above, whose hits depend on masks.
fn rays_down(count: usize) -> Vec<Ray> {
    let mut rng = Pcg::new(3);
    let ray = |_| Ray {
        origin: [2.0 * rng.signed(), 3.0, 2.0 * rng.signed()],
        t_min: 0.0,
        direction: [0.4 * rng.signed(), -1.0, 0.8 * rng.signed()],
        t_max: 100.0,
    };
    (0..count).map(ray).collect()
}

#[test]
fn every_structure_answers_as_brute_force_does_where_surfaces_are_cut_out() {
    compare_structures(few_plants());
}

#[test]
fn every_structure_answers_as_brute_force_does_where_chance_decides() {
    compare_structures(blended_plants());
}

fn compare_structures(scene: SceneData) {
    let gpu = gpu();
    let rays = rays_down(4000);
    let soup = TriangleSoup::new(&scene);
    let whole = TriangleSoup {
        masks: None,
        ..soup.clone()
    };
    let expected = brute_force(&soup, &rays);
    let ignored = brute_force(&whole, &rays);
    let changed = differences(&expected, &ignored).len();
    assert!(changed > 400, "masks change {changed} of 4000 rays");
    // Instance transforms round differently: they have their own reference.
    let flat = TriangleSoup {
        placed: None,
        ..soup
    };
    let kinds: Vec<_> = AccelRegistry::default().iter().collect();
    assert_eq!(kinds.len(), STRUCTURES);
    for kind in in_turn("structures with masks", kinds) {
        let built = build(kind, &flat, &default_params(&kind.parameters()));
        let closest = trace(gpu, &*built, &flat, &rays, &[]).hits;
        assert_same_hits(kind.name(), &rays, &expected, &closest);
        let any = trace(gpu, &*built, &flat, &rays, &["any"]).found();
        let blocked: Vec<bool> = expected.iter().map(|h| h.triangle != NO_HIT).collect();
        assert_eq!(any, blocked, "any hit of {}", kind.name());
    }
}

#[test]
fn every_triangle_test_has_the_same_masks() {
    let gpu = gpu();
    let scene = few_plants();
    let rays = rays_down(2000);
    let mut tests: Vec<_> = TriangleRegistry::default().iter().collect();
    tests.retain(|test| test.is_exact());
    assert_eq!(tests.len(), 5);
    for triangle in in_turn("triangle tests with masks", tests) {
        let tests = Intersection {
            triangle,
            ..Default::default()
        };
        let flat = TriangleSoup {
            placed: None,
            ..TriangleSoup::new(&scene)
        };
        let soup = flat.intersecting(tests);
        let expected = brute_force(&soup, &rays);
        let kind = structure("bvh");
        let built = build(kind, &soup, &default_params(&kind.parameters()));
        let closest = trace(gpu, &*built, &soup, &rays, &[]).hits;
        assert_same_hits(triangle.name(), &rays, &expected, &closest);
    }
}

#[test]
fn the_gate_passes_what_is_right() {
    let gpu = gpu();
    let stage = Stage::new(gpu, few_plants());
    let reference = judge(&stage);
    for name in ["bvh", "cwbvh", "object-list", "meta-bvh"] {
        let verdict = stage.verdict(gpu, &stage.traced(gpu, structure(name)), &reference);
        let verdict = verdict.expect("a verdict");
        assert!(verdict.passed, "{name}: {verdict:?}");
        let oracle = &verdict.oracle;
        // Rounding only matters near the outlines of holes.
        assert!(
            oracle.ambiguous - oracle.hard_ambiguous < oracle.rays / 50,
            "{oracle:?}"
        );
    }
    let unsound = reference.first_wrong();
    assert_eq!(unsound, None);
}

const ALPHAS: [f32; 4] = [0.25, 0.5, 0.75, 1.0];

/// Squares above each other, each there with its alpha, and rays down through all of them.
fn pile(count: usize) -> (SceneData, Vec<Ray>) {
    let square = |y: f32| {
        format!("v -9 {y} -9\nv 9 {y} -9\nv 9 {y} 9\nv -9 {y} 9\nusemtl of{y}\nf -4 -3 -2 -1\n")
    };
    let levels = [3.0, 2.0, 1.0, 0.0];
    let obj: String = levels.map(square).concat();
    let material = |(y, alpha): (f32, f32)| format!("newmtl of{y}\nKd 1 1 1\nd {alpha}\n");
    let mtl: String = levels.into_iter().zip(ALPHAS).map(material).collect();
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("pile.obj");
    std::fs::write(folder.path().join("m.mtl"), mtl).expect("a writable folder");
    std::fs::write(&path, format!("mtllib m.mtl\n{obj}")).expect("a writable folder");
    let scene = from_file(&path);
    let mut rng = Pcg::new(11);
    // Half from one point, half in one direction.
    let ray = |turn| {
        let [x, z] = [rng.signed(), rng.signed()];
        let (origin, direction) = match turn % 2 {
            0 => ([0.0, 4.0, 0.0], [x, -1.0, z]),
            _ => ([x, 4.0, z], [0.0, -1.0, 0.0]),
        };
        Ray {
            origin,
            t_min: 0.0,
            direction,
            t_max: 100.0,
        }
    };
    let rays = (0..count).map(ray).collect();
    (scene, rays)
}

/// The share of rays that meet each square of the pile first, in standard errors from the closed form
/// α_k Π (1 − α_i) over those above; and the share of those that meet nothing of the first two, by any hit.
fn off_the_closed_form(gpu: &Gpu) -> Vec<f64> {
    let (scene, rays) = pile(40_000);
    let soup = TriangleSoup::new(&scene);
    let kind = structure("bvh");
    let built = build(kind, &soup, &default_params(&kind.parameters()));
    let hits = trace(gpu, &*built, &soup, &rays, &[]).hits;
    let n = rays.len() as f64;
    let off = |share: f64, expected: f64| {
        let error = (expected * (1.0 - expected) / n).sqrt();
        (share - expected) / error.max(1.0 / n)
    };
    let mut left = 1.0;
    let mut found = Vec::new();
    for (level, alpha) in ALPHAS.map(f64::from).into_iter().enumerate() {
        let met = hits.iter().filter(|h| h.triangle / 2 == level as u32);
        found.push(off(met.count() as f64 / n, left * alpha));
        left *= 1.0 - alpha;
    }
    let short: Vec<Ray> = rays.iter().map(|ray| Ray { t_max: 2.5, ..*ray }).collect();
    let any = trace(gpu, &*built, &soup, &short, &["any"]).found();
    let free = any.iter().filter(|found| !**found).count() as f64 / n;
    found.push(off(free, (1.0 - 0.25) * (1.0 - 0.5)));
    found
}

#[test]
fn rays_meet_surfaces_as_often_as_their_alphas_say() {
    let off = off_the_closed_form(gpu());
    assert!(off.iter().all(|off| off.abs() < 4.5), "{off:?}");
    // The same decision for all rays from a point, in a direction, for all surfaces; alphas that are not the probability.
    for (from, to) in [
        ("bitcast<vec3<u32>>(ray.direction);", "vec3<u32>();"),
        (
            "bitcast<vec3<u32>>(ray.origin) == zero);",
            "vec3<bool>(true));",
        ),
        ("mixed(place, o.x)", "mixed(0u, o.x)"),
        (
            "<= chance(ray, own) * OPAQUE",
            "> chance(ray, own) * OPAQUE",
        ),
        ("(alpha >> 8u) * image.w <=", "(alpha >> 9u) * image.w <="),
        ("d.z) >> 16u;", "d.z) >> 17u;"),
        ("(alpha >> 8u) * image.w", "(alpha >> 8u) * 65536u"),
    ] {
        let off = off_the_closed_form(&open(kernels_with("accel/mask", &[(from, to)])));
        assert!(off.iter().any(|off| off.abs() > 20.0), "{from}: {off:?}");
    }
}

/// Faults, each with the structure whose check must fail.
const FAULTS: [(&str, &str, &str, &str, &str); 10] = [
    (
        "masks ignored in any hit",
        "accel/triangle",
        "@if(alpha_masks) if (is_cut_out",
        "@if(alpha_masks && !any) if (is_cut_out",
        "bvh",
    ),
    (
        "cutoff inverted",
        "accel/mask",
        "return alpha < image.w;",
        "return alpha >= image.w;",
        "bvh",
    ),
    (
        "corners exchanged",
        "accel/mask",
        "part_of(a.z, second) + part_of(bitcast<i32>(b.x), third)",
        "part_of(a.z, third) + part_of(bitcast<i32>(b.x), second)",
        "bvh",
    ),
    (
        "mirrored images repeat",
        "accel/mask",
        "return bitcast<u32>(min(there, 2 * size - 1 - there));",
        "return bitcast<u32>(there % size);",
        "bvh",
    ),
    (
        "clamped images repeat",
        "accel/mask",
        "if (wrap == CLAMPED) {",
        "if (wrap == 7u) {",
        "bvh",
    ),
    (
        "the nearest texel decides",
        "accel/mask",
        "let fx = bitcast<u32>(x & 255);",
        "let fx = 0u;",
        "bvh",
    ),
    (
        "half a texel off",
        "accel/mask",
        "let column = x >> 8u;",
        "let column = (x + 128) >> 8u;",
        "bvh",
    ),
    (
        "holes shorten rays",
        "accel/triangle",
        "found.v) / found.area)) { return; }",
        "found.v) / found.area)) { (*hit).t = t; return; }",
        "bvh",
    ),
    (
        "texels in another order",
        "accel/mask",
        "(word >> (8u * (at & 3u)))",
        "(word >> (8u * (3u - (at & 3u))))",
        "cwbvh",
    ),
    (
        "instances read the words of the triangle before",
        "accel/instance",
        "record.v0.w += first_id;",
        "record.v0.w += first_id;\n        if (record.v1.w > 2147483648u) { record.v1.w -= 2u; }",
        "object-list",
    ),
];

#[test]
fn planted_faults_turn_the_gate_red() {
    let right = Stage::new(gpu(), few_plants());
    let reference = judge(&right);
    assert!(reference.is_sound(), "{:?}", reference.first_wrong());
    for (what, module, from, to, name) in faults_in_turn("faults of masks", FAULTS) {
        let gpu = open(kernels_with(module, &[(from, to)]));
        let stage = Stage::new(&gpu, few_plants());
        let verdict = stage.verdict(&gpu, &stage.traced(&gpu, structure(name)), &reference);
        let verdict = verdict.expect("a verdict");
        assert!(
            !verdict.passed && wrong(&verdict) > 0,
            "{what}: {verdict:?}"
        );
    }
}

/// Mean radiance of an image of `foliage` with few plants.
fn light_of(gpu: &Gpu, strategy: &str, spp: u32) -> Estimate {
    let stage = Stage::new(gpu, few_plants());
    let traced = stage.traced(gpu, structure("bvh"));
    let what: Variant = integrator_variant(
        "path",
        &[
            ("max_depth", ParamValue::Integer(2)),
            ("strategy", ParamValue::Name(strategy.to_owned())),
        ],
    );
    let sampler = sampler("pixel-hash", "none");
    let renderer = stage.renderer(gpu, &traced, &sampler, &what, [24, 24], false);
    Estimate::of(&replicate_means(&renderer, spp, 16))
}

#[test]
fn all_strategies_find_the_same_light_of_a_lamp_that_is_cut_out() {
    let both = light_of(gpu(), "mis-balance", 128);
    for (strategy, spp) in [("bsdf", 256), ("light", 128)] {
        let ours = light_of(gpu(), strategy, spp);
        let difference = ours.minus(&both);
        assert!(
            difference.agrees_with(0.0),
            "{strategy}: {ours:?}, not {both:?}"
        );
        assert!(
            difference.error < 0.015 * both.mean,
            "{difference:?} proves too little"
        );
    }
    // A light sample that shines where there is no lamp.
    let fault = (", u, v)) { return dark(); }", ", u, v)) { }");
    let faulty = open(kernels_with("shading/light/flat", &[fault]));
    let ours = light_of(&faulty, "light", 128);
    assert!(!ours.minus(&both).agrees_with(0.0), "{ours:?} and {both:?}");
}
