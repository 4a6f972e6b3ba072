//! `octree` and `kd-tree` in the hard cases of spatial subdivision: rays in planes, along edges and
//! through corners of cells, needles and grazing rays, segments that end at a hit; guarantees of
//! their parameters; stacks that are too small. Twin and kernel against brute force, bit by bit.

use crate::support;
use crate::support::scenes::{self, FAR};
use crate::support::{Pcg, assert_same_hits, brute_force, build, default_params, trace};
use glam::Vec3;
use raystone::accel::StructureStats;
use raystone::accel::{
    AccelError, AccelKind, AccelRegistry, BuiltAccel, Counters, CpuTwin, GpuBuffers, Hit, NO_HIT,
    Ray, TriangleSoup,
};
use raystone::params::{ParamValue, Params};
use raystone::scene::{self, LoadOptions};

const KINDS: [&str; 2] = ["octree", "kd-tree"];

fn kind(name: &str) -> &'static dyn AccelKind {
    let kind = AccelRegistry::default().get(name);
    kind.unwrap_or_else(|| panic!("no structure {name}"))
}

fn with(name: &str, changes: &[(&str, ParamValue)]) -> Params {
    let mut params = default_params(&kind(name).parameters());
    for (key, value) in changes {
        let slot = params.0.get_mut(*key);
        *slot.unwrap_or_else(|| panic!("{name} has no {key}")) = value.clone();
    }
    params
}

/// Both structures with both ways of listing, fine and coarse.
fn variants() -> Vec<(&'static str, Params)> {
    let mut out = Vec::new();
    for clip in [false, true] {
        let clip = ("clip", ParamValue::Flag(clip));
        for cost in [0.05, 1.0] {
            let cost = ("traversal_cost", ParamValue::Number(cost));
            out.push(("kd-tree", with("kd-tree", &[clip.clone(), cost])));
        }
        for size in [1, 8] {
            let size = ("leaf_size", ParamValue::Integer(size));
            out.push(("octree", with("octree", &[clip.clone(), size])));
        }
    }
    assert_eq!(out.len(), 8);
    out
}

fn twin_hits(built: &dyn BuiltAccel, soup: &TriangleSoup, rays: &[Ray]) -> Vec<Hit> {
    let twin = built.cpu_twin(soup).expect("a twin");
    let mut work = Counters::default();
    let closest = |ray| twin.closest_hit(ray, &mut work);
    rays.iter().map(closest).collect()
}

/// Those that list triangles by their boxes, for which equality is proven for any ray.
fn by_boxes() -> Vec<(&'static str, Params)> {
    let mut out = variants();
    out.retain(|(_, params)| params.0["clip"] == ParamValue::Flag(false));
    assert_eq!(out.len(), 4);
    out
}

/// Checks twin and kernel against brute force, and any hit against closest; returns the hits.
fn check(
    what: &str,
    variants: &[(&str, Params)],
    soup: &TriangleSoup,
    rays: &[Ray],
    on_device: bool,
) -> usize {
    let expected = brute_force(soup, rays);
    let blocked: Vec<bool> = expected.iter().map(|h| h.triangle != NO_HIT).collect();
    for (name, params) in variants {
        let built = build(kind(name), soup, params);
        let what = format!("{what}: {name} {params:?}");
        assert_same_hits(&what, rays, &expected, &twin_hits(&*built, soup, rays));
        let twin = built.cpu_twin(soup).expect("a twin");
        for (ray, blocked) in rays.iter().zip(&blocked) {
            let found = twin.any_hit(ray, &mut Counters::default());
            assert_eq!(found, *blocked, "{what}: any hit of {ray:?}");
        }
        if on_device && support::is_exact(support::gpu()) {
            let hits = trace(support::gpu(), &*built, soup, rays, &[]).hits;
            assert_same_hits(&format!("{what}, kernel"), rays, &expected, &hits);
        }
    }
    blocked.iter().filter(|b| **b).count()
}

/// Walls, floors and tilted panels with integer corners in 0..16, where cell planes lie.
fn halls(rng: &mut Pcg, count: usize) -> TriangleSoup {
    let mut triangles = vec![
        [Vec3::ZERO, Vec3::X * 16.0, Vec3::Y * 16.0],
        [
            Vec3::splat(16.0),
            Vec3::new(16.0, 16.0, 0.0),
            Vec3::new(0.0, 16.0, 16.0),
        ],
    ];
    while triangles.len() < count {
        let mut at = || rng.below(17) as f32;
        let low = Vec3::new(at(), at(), at());
        let mut high = Vec3::new(at(), at(), at());
        if rng.below(4) > 0 {
            let axis = rng.below(3) as usize;
            high[axis] = low[axis];
        }
        let side = Vec3::new(
            low.x,
            high.y,
            if rng.below(2) == 0 { low.z } else { high.z },
        );
        triangles.push([low, high, side]);
    }
    scenes::soup(triangles)
}

/// Rays from lattice points around the box 0..16, along axes and diagonals, zeros of both signs.
fn rays_in_planes(rng: &mut Pcg, count: usize) -> Vec<Ray> {
    let ray = |_| {
        let origin = [0; 3].map(|_| rng.between(-4, 36) as f32 * 0.5);
        let direction = [0; 3].map(|_| [0.0, -0.0, 1.0, -1.0, 0.0, -0.0][rng.below(6) as usize]);
        Ray {
            origin,
            t_min: 0.0,
            direction,
            t_max: FAR,
        }
    };
    let mut rays: Vec<Ray> = (0..).map(ray).filter(Ray::is_ray).take(count).collect();
    rays.retain(|r| r.direction.iter().any(|d| *d != 0.0));
    rays
}

#[test]
fn rays_in_planes_along_edges_and_through_corners_of_cells_see_what_brute_force_sees() {
    let mut rng = Pcg::new(11);
    let mut hits = 0;
    for round in 0..6 {
        let soup = halls(&mut rng, 40 << round);
        let mut rays = rays_in_planes(&mut rng, 1500);
        let first = brute_force(&soup, &rays);
        rays.extend(scenes::cut_at_hits(&rays, &first));
        let what = format!("halls {round}");
        hits += check(&what, &variants(), &soup, &rays, round % 3 == 0);
    }
    assert!(hits > 5_000, "only {hits} hits: the test is blunt");
}

/// Rays towards points of needles; the sine of the angle to their planes is about `lift`.
fn rays_at(rng: &mut Pcg, needles: &[[Vec3; 3]], lifts: &[f32], count: usize) -> Vec<Ray> {
    let ray = |_| {
        let [a, b, c] = needles[rng.below(needles.len() as u32) as usize];
        let (u, v) = (rng.unit(), rng.unit());
        let target = a + u * (b - a) + v * u * (c - b);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let mut along = (b - a) * rng.signed() + (c - b).normalize_or_zero() * rng.signed() * 8.0;
        let lift = lifts[rng.below(lifts.len() as u32) as usize];
        along += lift * along.length() * normal;
        Ray {
            origin: (target - along * rng.between(1, 3) as f32).to_array(),
            t_min: 0.0,
            direction: along.to_array(),
            t_max: FAR,
        }
    };
    (0..).map(ray).filter(Ray::is_ray).take(count).collect()
}

#[test]
fn needles_and_grazing_rays_see_what_brute_force_sees() {
    let mut rng = Pcg::new(12);
    let mut hits = 0;
    for exponent in [1, 2, 3, 4, 6] {
        let width = 10.0_f32.powi(-exponent);
        let mut point = || 8.0 * Vec3::new(rng.signed(), rng.signed(), rng.signed());
        let needle = |_| {
            let (a, b) = (point(), point());
            [a, b, b + width * point()]
        };
        let needles: Vec<[Vec3; 3]> = (0..150).map(needle).collect();
        let soup = scenes::soup(needles.iter().copied());
        // Clipped lists guarantee nothing below an angle of 1/32.
        let steep = (
            variants(),
            rays_at(&mut rng, &needles, &[-1.0, 0.2, 0.05], 1500),
        );
        let lifts = [1e-2, -1e-3, 1e-4, -1e-6, 0.0];
        let grazing = (by_boxes(), rays_at(&mut rng, &needles, &lifts, 1500));
        for (variants, mut rays) in [steep, grazing] {
            let first = brute_force(&soup, &rays);
            rays.extend(scenes::cut_at_hits(&rays, &first));
            let what = format!("needles 1e-{exponent}");
            hits += check(&what, &variants, &soup, &rays, exponent == 3);
        }
    }
    assert!(hits > 10_000, "only {hits} hits: the test is blunt");
}

#[test]
fn a_leaf_that_lost_a_triangle_is_seen_by_the_same_rays() {
    let mut rng = Pcg::new(13);
    let soup = halls(&mut rng, 160);
    let rays = rays_in_planes(&mut rng, 1500);
    let expected = brute_force(&soup, &rays);
    let struck = expected
        .iter()
        .find(|h| h.triangle != NO_HIT)
        .expect("a hit");
    // As if every leaf had lost it: a copy of triangle 0 replaces it.
    let mut without = soup.clone();
    let lost = &mut without.records[struck.triangle as usize];
    (lost.v0, lost.v1, lost.v2) = (soup.records[0].v0, soup.records[0].v1, soup.records[0].v2);
    for (name, params) in variants() {
        let built = build(kind(name), &without, &params);
        let found = twin_hits(&*built, &soup, &rays);
        let different = support::differences(&expected, &found).len();
        assert!(different > 0, "{name} {params:?}: not seen");
        assert!(built.validate(&soup).is_err(), "{name} {params:?}: valid");
    }
}

fn stats(name: &str, soup: &TriangleSoup, changes: &[(&str, ParamValue)]) -> StructureStats {
    let stats = build(kind(name), soup, &with(name, changes)).stats();
    let counted: u64 = stats.leaf_histogram.iter().sum();
    assert!(counted >= stats.leaves && stats.leaves > 0);
    assert!(stats.nodes >= stats.leaves && stats.bytes >= 4 * stats.references);
    stats
}

/// Long thin slanted triangles, whose boxes are nearly empty.
fn slanted(count: usize) -> TriangleSoup {
    let mut rng = Pcg::new(14);
    let mut point = || 10.0 * Vec3::new(rng.signed(), rng.signed(), rng.signed());
    let triangle = |_| {
        let (a, along, across) = (point(), point(), 0.03 * point());
        [a, a + 0.4 * along, a + 0.4 * along + across]
    };
    scenes::soup((0..count).map(triangle).collect::<Vec<_>>())
}

#[test]
fn clipping_shortens_lists_and_lowers_the_cost_where_triangles_are_slanted() {
    let soup = slanted(4000);
    for name in KINDS {
        let by = |clip| stats(name, &soup, &[("clip", ParamValue::Flag(clip))]);
        let (boxes, clipped) = (by(false), by(true));
        let cost = |s: &StructureStats| s.sah_cost.expect("a cost");
        println!("{name}: {boxes:?} {clipped:?}");
        assert!(cost(&clipped) < 0.8 * cost(&boxes), "{name}");
        let per_leaf = |s: &StructureStats| s.references as f64 / s.leaves as f64;
        assert!(per_leaf(&clipped) < per_leaf(&boxes), "{name}");
    }
}

#[test]
fn depth_and_leaf_size_are_what_the_parameters_say() {
    let soup = slanted(1000);
    for name in KINDS {
        for depth in [1, 3, 5] {
            let stats = stats(name, &soup, &[("max_depth", ParamValue::Integer(depth))]);
            assert_eq!(stats.depth, Some(depth as u32), "{name}");
        }
        let most = [8 + (1.3 * 1000_f64.log2()) as u32, 2 + 5][usize::from(name == "octree")];
        let depth = stats(name, &soup, &[]).depth.expect("a depth");
        assert!(depth > 4 && depth <= most, "{name}: depth {depth}");
    }
    let leaves = |size| {
        let size = ("leaf_size", ParamValue::Integer(size));
        stats("octree", &soup, &[size]).leaves
    };
    assert!(leaves(1) > leaves(8) && leaves(8) > leaves(64));
}

#[test]
fn one_triangle_is_a_leaf_of_known_figures() {
    let soup = scenes::soup([[Vec3::ZERO, Vec3::X, Vec3::Y]]);
    for (name, nodes) in [("octree", 1), ("kd-tree", 1)] {
        let stats = stats(name, &soup, &[]);
        assert_eq!(
            (stats.nodes, stats.leaves, stats.references),
            (nodes, 1, 1),
            "{name}"
        );
        assert_eq!(stats.leaf_histogram, [0, 1], "{name}");
        assert_eq!(
            (stats.depth, stats.sah_cost),
            (Some(0), Some(1.0)),
            "{name}"
        );
    }
}

#[test]
fn coincident_triangles_do_not_fill_the_memory() {
    let one = [
        Vec3::ZERO,
        Vec3::new(5.0, 1.0, 0.3),
        Vec3::new(1.0, 4.0, 2.0),
    ];
    let soup = scenes::soup(vec![one; 300]);
    for (name, fine) in [("octree", "leaf_size"), ("kd-tree", "max_depth")] {
        let finest = [ParamValue::Integer(1), ParamValue::Integer(64)]
            [usize::from(name == "kd-tree")]
        .clone();
        let mut changes = vec![(fine, finest), ("traversal_cost", ParamValue::Number(0.01))];
        if name == "octree" {
            changes.push(("max_depth", ParamValue::Integer(20)));
        }
        let stats = stats(name, &soup, &changes);
        assert!(stats.references <= 16 * 300, "{name}: {stats:?}");
    }
}

/// A structure whose kernel gets a stack of one entry.
struct SmallStack<'a>(&'a dyn BuiltAccel);

impl BuiltAccel for SmallStack<'_> {
    fn validate(&self, soup: &TriangleSoup) -> Result<(), AccelError> {
        self.0.validate(soup)
    }

    fn buffers(&self) -> GpuBuffers<'_> {
        let mut buffers = self.0.buffers();
        assert_eq!(buffers.constants.len(), 1);
        buffers.constants[0].1 = 1;
        buffers
    }

    fn stats(&self) -> StructureStats {
        self.0.stats()
    }

    fn cpu_twin<'a>(&'a self, soup: &'a TriangleSoup) -> Option<Box<dyn CpuTwin + 'a>> {
        self.0.cpu_twin(soup)
    }
}

#[test]
fn a_stack_that_overflows_raises_the_error_word_and_one_of_the_right_size_does_not() {
    let soup = slanted(1000);
    let rays = scenes::aimed_rays(&mut Pcg::new(15), &soup, 500);
    for name in KINDS {
        let built = build(kind(name), &soup, &with(name, &[]));
        trace(support::gpu(), &*built, &soup, &rays, &[]);
        let outcome = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            trace(support::gpu(), &SmallStack(&*built), &soup, &rays, &[]);
        }));
        let panic = outcome.expect_err("the error word is raised");
        let text = panic.downcast_ref::<String>().expect("a text");
        assert!(text.contains("stack overflowed"), "{name}: {text}");
    }
}

#[test]
fn real_scenes_are_seen_as_the_judge_sees_them() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/scenes");
    let models = ["sponza-crytek/sponza.obj", "utah-teapot/teapot.obj"];
    let mut seen = 0;
    for model in models {
        let path = format!("{folder}/{model}");
        if !std::path::Path::new(&path).exists() {
            support::needs::skip("files", format!("{path} is not there"));
            continue;
        }
        seen += 1;
        let variant = raystone::params::Variant {
            name: path.clone(),
            params: Params::default(),
            label: model.to_owned(),
        };
        let options = LoadOptions {
            textures: false,
            ..LoadOptions::default()
        };
        let scene = scene::load(&variant, &options).unwrap_or_else(|e| panic!("{path}: {e}"));
        let soup = TriangleSoup::new(&scene);
        let mut rays = scenes::aimed_rays(&mut Pcg::new(16), &soup, 3000);
        let reference = build(kind("bvh"), &soup, &with("bvh", &[]));
        let first = twin_hits(&*reference, &soup, &rays);
        rays.extend(scenes::cut_at_hits(&rays, &first));
        let expected = twin_hits(&*reference, &soup, &rays);
        let hits = expected.iter().filter(|h| h.triangle != NO_HIT).count();
        assert!(hits > 1000, "{model}: {hits} hits");
        for name in KINDS {
            let built = build(kind(name), &soup, &with(name, &[]));
            let found = twin_hits(&*built, &soup, &rays);
            assert_same_hits(&format!("{model}: {name}"), &rays, &expected, &found);
        }
    }
    println!("{seen} of {} models", models.len());
}

#[test]
fn an_empty_scene_is_traced_and_missed() {
    let nothing = TriangleSoup::default();
    let rays = rays_in_planes(&mut Pcg::new(18), 100);
    for name in KINDS {
        let empty = build(kind(name), &nothing, &with(name, &[]));
        let hits = trace(support::gpu(), &*empty, &nothing, &rays, &[]).hits;
        assert!(hits.iter().all(|h| h.triangle == NO_HIT), "{name}");
    }
}
