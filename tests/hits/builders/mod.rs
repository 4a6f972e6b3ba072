//! Builders of the binary tree: the same tree for any number of threads, exact hits where triangles
//! are split, bounded depth, quality on a real scene, and bad input.

mod spatial_splits;

use crate::support;
use crate::support::scenes::{self, lattice_soup};
use crate::support::{Pcg, default_params};
use glam::Vec3;
use raystone::accel::tree::{NodeKind, Tree, TreeParameters};
use raystone::accel::triangle::TriangleRecord;
use raystone::accel::{AccelKind, BuildLog, Bvh, BvhParameters, Counters, Hit, Ray, TriangleSoup};
use raystone::geometry::Triangle;
use raystone::params::{ParamRange, ParamValue, Parameters as _, Params, Variant};
use raystone::scene::{LoadOptions, load};
use std::path::Path;

const SPONZA: &str = "../shared/scenes/sponza-crytek/sponza.obj";

/// Builders that run on the host; tests/device/device_builders has the others.
fn builders() -> Vec<&'static str> {
    let schema = TreeParameters::schema();
    let builder = schema.iter().find(|p| p.name == "builder");
    match builder.map(|p| &p.range) {
        Some(ParamRange::Choice(names)) => {
            let on_host = names.iter().filter(|name| !name.starts_with("device-"));
            let on_host: Vec<_> = on_host.copied().collect();
            assert!(on_host.len() >= 7, "{on_host:?}");
            on_host
        }
        other => panic!("builder is {other:?}"),
    }
}

/// Default parameters with some changed: `name=value`.
fn params(changes: &[&str]) -> Params {
    let mut out = default_params(&Bvh.parameters());
    for change in changes {
        let (name, text) = change.split_once('=').expect("name=value");
        let value = out.0.get_mut(name).expect("a known parameter");
        *value = match value {
            ParamValue::Integer(_) => ParamValue::Integer(text.parse().expect("an integer")),
            ParamValue::Number(_) => ParamValue::Number(text.parse().expect("a number")),
            ParamValue::Flag(_) => ParamValue::Flag(text.parse().expect("a flag")),
            ParamValue::Name(_) => ParamValue::Name(text.to_owned()),
            ParamValue::List(_) => panic!("{name} is a list"),
        };
    }
    out
}

fn with_builder(name: &str, changes: &[&str]) -> Params {
    let builder = format!("builder={name}");
    params(&[&[builder.as_str()], changes].concat())
}

fn tree(params: &Params) -> TreeParameters {
    BvhParameters::from_params(params)
        .expect("parameters of bvh")
        .tree
}

fn build(soup: &TriangleSoup, params: &Params) -> Tree {
    Tree::build(soup, &tree(params), &mut BuildLog::default())
        .unwrap_or_else(|e| panic!("{params:?}: {e}"))
}

/// The triangles of a model, or `None` with a message.
fn model(path: &str) -> Option<TriangleSoup> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
    if !path.exists() {
        support::needs::skip("files", format!("{} is not there", path.display()));
        return None;
    }
    let name = path.display().to_string();
    let variant = Variant {
        name: name.clone(),
        params: Params::default(),
        label: name,
    };
    let options = LoadOptions {
        textures: false,
        ..LoadOptions::default()
    };
    let scene = load(&variant, &options).expect("the model loads");
    Some(TriangleSoup::new(&scene))
}

/// Closest hits of the scalar twin of `bvh`, after validating its structure.
fn hits(soup: &TriangleSoup, params: &Params, rays: &[Ray]) -> Vec<Hit> {
    let built = Bvh
        .build(soup, params, &mut BuildLog::default())
        .unwrap_or_else(|e| panic!("{params:?}: {e}"));
    built
        .validate(soup)
        .unwrap_or_else(|e| panic!("{params:?} is not valid: {e}"));
    let twin = built.cpu_twin(soup).expect("bvh has a twin");
    let mut counters = Counters::default();
    let closest = |ray: &Ray| twin.closest_hit(ray, &mut counters);
    rays.iter().map(closest).collect()
}

/// Long thin axis-aligned triangles, the case for spatial splits; `tilt` rotates them away.
fn sticks(rng: &mut Pcg, count: usize, tilt: f32) -> TriangleSoup {
    let mut random = |size: f32| size * Vec3::new(rng.signed(), rng.signed(), rng.signed());
    let stick = |i: usize| {
        let along = Vec3::AXES[i % 3] * 8.0 + random(tilt);
        let from = random(6.0);
        [from, from + along, from + along + random(0.3)]
    };
    scenes::soup((0..count).map(stick).collect::<Vec<_>>())
}

fn clutter(rng: &mut Pcg, count: usize) -> TriangleSoup {
    let mut random = |size: f32| size * Vec3::new(rng.signed(), rng.signed(), rng.signed());
    let triangle = |_| {
        let from = random(50.0);
        [from, from + random(1.0), from + random(1.0)]
    };
    scenes::soup((0..count).map(triangle).collect::<Vec<_>>())
}

#[test]
fn every_builder_makes_the_same_tree_on_any_number_of_threads() {
    // Enough to bin and sort in several threads.
    let soup = clutter(&mut Pcg::new(5), 70_000);
    let rounds = ["reinsertion=1", "reinsertion_share=0.02"];
    for name in builders() {
        let params = with_builder(name, &rounds);
        let tree = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.expect("a pool").install(|| build(&soup, &params))
        };
        let one = tree(1);
        for threads in [2, 5] {
            let more = tree(threads);
            assert!(one.nodes == more.nodes, "{name}, {threads} threads: nodes");
            assert!(one.order == more.order, "{name}, {threads} threads: order");
        }
    }
}

#[test]
fn quality_and_spatial_splits_do_not_depend_on_the_number_of_threads() {
    let soup = sticks(&mut Pcg::new(6), 10_000, 0.2);
    let tree = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let params = with_builder("sbvh", &[]);
        pool.expect("a pool").install(|| {
            let mut tree = build(&soup, &params);
            tree.note_epo(&soup);
            tree
        })
    };
    let (one, more) = (tree(1), tree(5));
    assert!(one.has_duplicates(&soup));
    assert!(one.nodes == more.nodes && one.order == more.order);
    assert!(one.epo.is_some_and(|epo| epo > 0.0));
    assert_eq!(one.epo, more.epo);
}

#[test]
fn every_builder_lists_each_triangle_once_unless_it_splits() {
    let mut rng = Pcg::new(6);
    let soup = sticks(&mut rng, 400, 0.2);
    for name in builders() {
        for rounds in ["reinsertion=0", "reinsertion=4"] {
            let tree = build(&soup, &with_builder(name, &[rounds]));
            let mut ids = tree.order.clone();
            ids.sort_unstable();
            let unique = ids.chunk_by(|a, b| a == b).count();
            assert_eq!(unique, 400, "{name} {rounds}");
            assert_eq!(tree.has_duplicates(&soup), ids.len() > 400);
            assert_eq!(tree.has_duplicates(&soup), name == "sbvh", "{name}");
            assert!(ids.len() <= 800, "{name}: {} references", ids.len());
        }
    }
}

#[test]
fn reinsertion_lowers_the_cost_of_every_builder() {
    let mut rng = Pcg::new(8);
    let soup = lattice_soup(&mut rng, 3_000, 30);
    for name in builders() {
        let cost = |rounds: &str| {
            let tree = build(&soup, &with_builder(name, &[rounds]));
            tree.stats().sah_cost.expect("a cost")
        };
        let (before, after) = (cost("reinsertion=0"), cost("reinsertion=8"));
        assert!(after < before, "{name}: {after} after {before}");
    }
}

#[test]
fn leaves_are_chosen_by_cost_within_their_bounds() {
    let mut rng = Pcg::new(10);
    let soup = lattice_soup(&mut rng, 2_000, 12);
    let histogram = |changes: &[&str]| build(&soup, &params(changes)).stats().leaf_histogram;
    assert_eq!(histogram(&["leaf_size=1"]), [0, 2_000]);
    assert!(histogram(&["leaf_size=7"]).len() <= 8);
    let free = histogram(&["leaf_size=31"]);
    let fat = histogram(&["leaf_size=31", "traversal_cost=100"]);
    assert!(fat.len() > free.len(), "{fat:?} {free:?}");
    // Dufay's rule: nodes of six triangles or fewer are not split.
    let dufay = with_builder("longest-axis-sweep", &["leaf_size=31", "min_leaf_size=6"]);
    let tree = build(&soup, &dufay);
    for node in &tree.nodes {
        if let NodeKind::Inner { left, right } = node.kind {
            let count = |child: u32| match tree.nodes[child as usize].kind {
                NodeKind::Leaf { count, .. } => count,
                NodeKind::Inner { .. } => 32,
            };
            assert!(count(left) + count(right) > 6);
        }
    }
}

#[test]
fn the_depth_is_bounded_whatever_the_input() {
    // Boxes that halve in size towards the origin make every greedy split cut off one.
    let shrinking = |i: i32| {
        let size = 2.0_f32.powf(50.0 - 0.1 * i as f32);
        let corner = Vec3::splat(size);
        [corner, corner + Vec3::X * size, corner + Vec3::Y * size]
    };
    let soup = scenes::soup((0..1_200).map(shrinking));
    for name in builders() {
        for rounds in ["reinsertion=0", "reinsertion=8"] {
            let depth = build(&soup, &with_builder(name, &[rounds, "leaf_size=1"])).depth();
            let limit = 48 + 1_200_u32.ilog2() + 2;
            assert!(depth <= limit, "{name} {rounds}: depth {depth} > {limit}");
        }
    }
}

#[test]
fn coordinates_that_are_no_numbers_neither_hang_nor_panic() {
    let mut rng = Pcg::new(11);
    for bad in [
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        3.0e38,
        -3.0e38,
        1.0e-44,
    ] {
        for share in [1, 7, 40] {
            let mut soup = lattice_soup(&mut rng, 40, 6);
            for record in &mut soup.records[..share] {
                let component = rng.below(3) as usize;
                match rng.below(3) {
                    0 => record.v0[component] = bad,
                    1 => record.v1 = [bad; 3],
                    _ => record.v2[component] = bad,
                }
            }
            for name in builders() {
                let params = with_builder(name, &["reinsertion=3"]);
                let tree = Tree::build(&soup, &tree(&params), &mut BuildLog::default());
                match tree {
                    Ok(mut tree) => {
                        tree.note_epo(&soup);
                        assert!(tree.order.len() >= 40, "{name}: {bad}");
                    }
                    Err(e) => {
                        let text = e.to_string();
                        assert!(
                            name.contains("ploc") || name.contains("lbvh"),
                            "{name}: {text}"
                        );
                        assert!(text.contains("triangle") && text.contains("1e18"), "{text}");
                    }
                }
            }
        }
    }
}

#[test]
fn every_phase_of_a_build_is_timed_under_the_name_of_its_builder() {
    let soup = lattice_soup(&mut Pcg::new(1), 50, 6);
    for name in builders() {
        let mut log = BuildLog::default();
        Tree::build(
            &soup,
            &tree(&with_builder(name, &["reinsertion=1"])),
            &mut log,
        )
        .expect("a tree");
        let mut phases: Vec<&str> = log.phases.iter().map(|p| p.name.as_str()).collect();
        let mut builder = name;
        if name == "auto" {
            builder = phases.remove(0).strip_prefix("chosen: ").expect("a choice");
        }
        assert_eq!(phases, ["boxes", builder, "reinsertion", "leaves"]);
    }
    let mut log = BuildLog::default();
    let empty =
        Tree::build(&TriangleSoup::default(), &tree(&params(&[])), &mut log).expect("a tree");
    assert!(empty.nodes.is_empty() && empty.stats().sah_cost.is_none());
}

#[test]
fn the_trees_of_sponza_are_as_good_as_promised() {
    let Some(soup) = model(SPONZA) else { return };
    let cost = |name: &str, changes: &[&str]| {
        let tree = build(&soup, &with_builder(name, changes));
        let cost = tree.stats().sah_cost.expect("a cost");
        println!("{name} {changes:?}: SAH {cost:.3}");
        cost
    };
    let binned = cost("binned", &[]);
    assert!(binned <= 70.6);
    assert!(cost("sweep", &[]) <= binned);
    // As good as the spatial splits of tinybvh.
    assert!(cost("sbvh", &[]) <= 64.4);
    assert!(cost("sbvh", &["spatial_clip=false"]) > 67.0);
    assert!(cost("sbvh", &["reinsertion=2", "reinsertion_share=0.1"]) <= 61.0);
    assert!(cost("ploc", &["reinsertion=20"]) < 59.9);
}

#[test]
fn triangles_are_built_from_the_vertices_that_kernels_see() {
    // Edges that round: the box of the file's vertices differs from that of the record.
    let vertices = [
        Vec3::new(1.0e6, 0.1, 0.3),
        Vec3::new(1.0e-3, 0.2, 0.7),
        Vec3::new(0.7, 1.0e5, 0.9),
    ];
    let record = TriangleRecord::new(&Triangle { vertices }, 0, 0);
    let soup = TriangleSoup {
        records: vec![record],
        ..Default::default()
    };
    for name in builders() {
        let tree = build(&soup, &with_builder(name, &[]));
        assert_eq!(tree.nodes[0].bounds, record.bounds(), "{name}");
    }
}
