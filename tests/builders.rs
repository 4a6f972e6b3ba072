//! The builders of the binary tree: the same tree for any number of threads, exact hits where
//! triangles are split, a bound on the depth, quality on a real scene, and bad input.

mod support;

use glam::Vec3;
use raystone::accel::tree::{NodeKind, Tree, TreeParameters};
use raystone::accel::triangle::TriangleRecord;
use raystone::accel::{AccelKind, BuildLog, Bvh, BvhParameters, Counters, Hit, Ray, TriangleSoup};
use raystone::geometry::Triangle;
use raystone::params::{ParamRange, ParamValue, Parameters as _, Params, Variant};
use raystone::scene::{LoadOptions, load};
use std::path::Path;
use support::scenes::{self, aimed_rays, lattice_rays, lattice_soup};
use support::{Pcg, assert_same_hits, brute_force, default_params};

const SPONZA: &str = "../shared/scenes/sponza-crytek/sponza.obj";

/// Builders that run on the host; tests/device_builders has the others.
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
        };
    }
    out
}

fn with_builder(name: &str, changes: &[&str]) -> Params {
    let builder = format!("builder={name}");
    params(&[&[builder.as_str()], changes].concat())
}

/// The parameters of the tree among those of `bvh`.
fn tree(params: &Params) -> TreeParameters {
    BvhParameters::from_params(params)
        .expect("parameters of bvh")
        .tree
}

fn build(soup: &TriangleSoup, params: &Params) -> Tree {
    Tree::build(soup, &tree(params), &mut BuildLog::default())
        .unwrap_or_else(|e| panic!("{params:?}: {e}"))
}

/// The triangles of a model, or `None` with a word on the terminal.
fn model(path: &str) -> Option<TriangleSoup> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
    if !path.exists() {
        println!("skipped: {} is not there", path.display());
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

/// Closest hits of the scalar twin of `bvh`, whose structure is valid.
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

/// Rays within rounding of the plane of some triangle, through its box: by rounding they may be
/// given a hit anywhere in the box.
fn grazing_rays(rng: &mut Pcg, soup: &TriangleSoup, count: usize) -> Vec<Ray> {
    let ray = |_| {
        let record = &soup.records[rng.below(soup.records.len() as u32) as usize];
        let [a, b, c] = record.triangle().vertices;
        let mut point = |spread: f32| {
            let (u, v) = (spread * rng.signed(), spread * rng.signed());
            a + u * (b - a) + v * (c - a)
        };
        let (origin, through) = (point(8.0), point(1.0));
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let tilt = rng.signed() * [0.0, 1e-7, 1e-5, 1e-3][rng.below(4) as usize];
        Ray {
            origin: origin.to_array(),
            t_min: 0.0,
            direction: (through + tilt * (b - a).length() * normal - origin).to_array(),
            t_max: scenes::FAR,
        }
    };
    (0..).map(ray).filter(Ray::is_ray).take(count).collect()
}

/// Long thin triangles along the axes, the case for spatial splits; `tilt` turns them away.
fn sticks(rng: &mut Pcg, count: usize, tilt: f32) -> TriangleSoup {
    let mut random = |size: f32| size * Vec3::new(rng.signed(), rng.signed(), rng.signed());
    let stick = |i: usize| {
        let along = Vec3::AXES[i % 3] * 8.0 + random(tilt);
        let from = random(6.0);
        [from, from + along, from + along + random(0.3)]
    };
    scenes::soup((0..count).map(stick).collect::<Vec<_>>())
}

/// Small triangles all over a cube.
fn clutter(rng: &mut Pcg, count: usize) -> TriangleSoup {
    let mut random = |size: f32| size * Vec3::new(rng.signed(), rng.signed(), rng.signed());
    let triangle = |_| {
        let from = random(50.0);
        [from, from + random(1.0), from + random(1.0)]
    };
    scenes::soup((0..count).map(triangle).collect::<Vec<_>>())
}

/// SBVH that splits whenever it can.
fn eager_sbvh(changes: &[&str]) -> Params {
    with_builder(
        "sbvh",
        &[&["spatial_alpha=0", "leaf_size=2"], changes].concat(),
    )
}

#[test]
fn every_builder_makes_the_same_tree_on_any_number_of_threads() {
    // More than one thread bins and sorts.
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
fn hits_are_exact_where_triangles_are_split() {
    for seed in 0..30 {
        let mut rng = Pcg::new(seed);
        let soup = match seed % 3 {
            0 => lattice_soup(&mut rng, 80, 6),
            1 => sticks(&mut rng, 80, 0.2),
            _ => sticks(&mut rng, 80, 8.0),
        };
        let mut rays = aimed_rays(&mut rng, &soup, 300);
        rays.extend(lattice_rays(&mut rng, 300, 8));
        rays.extend(grazing_rays(&mut rng, &soup, 600));
        let expected = brute_force(&soup, &rays);
        for changes in [&[][..], &["reinsertion=5"], &["spatial_bins=3", "bins=2"]] {
            let params = eager_sbvh(changes);
            let found = hits(&soup, &params, &rays);
            assert_same_hits(
                &format!("seed {seed} {changes:?}"),
                &rays,
                &expected,
                &found,
            );
        }
    }
}

#[test]
fn grazing_rays_are_given_hits_outside_the_triangle() {
    // Why spatial splits cut the box and not the triangle: see `src/accel/tree/sbvh.rs`.
    let mut rng = Pcg::new(9);
    let soup = sticks(&mut rng, 200, 8.0);
    let rays = grazing_rays(&mut rng, &soup, 20_000);
    let expected = brute_force(&soup, &rays);
    let far = expected.iter().zip(&rays).filter(|(hit, ray)| {
        let Some(record) = soup.records.get(hit.triangle as usize) else {
            return false;
        };
        let [a, b, c] = record.triangle().vertices.map(Vec3::as_dvec3);
        let point = Vec3::from(ray.origin).as_dvec3()
            + f64::from(hit.t) * Vec3::from(ray.direction).as_dvec3();
        // Barycentric coordinates of the point's foot in the plane.
        let (e1, e2, p) = (b - a, c - a, point - a);
        let n = e1.cross(e2);
        let u = p.cross(e2).dot(n) / n.length_squared();
        let v = e1.cross(p).dot(n) / n.length_squared();
        u.min(v).min(1.0 - u - v) < -0.01
    });
    let far = far.count();
    println!("{far} of 20,000 hits lie outside by more than 1 % of the triangle");
    assert!(far > 0);
}

#[test]
fn spatial_splits_lower_the_cost_of_long_triangles() {
    let mut rng = Pcg::new(7);
    let soup = sticks(&mut rng, 3_000, 0.2);
    let cost = |p: &Params| build(&soup, p).stats().sah_cost.expect("a cost");
    let (object, spatial) = (cost(&params(&[])), cost(&with_builder("sbvh", &[])));
    assert!(spatial < 0.9 * object, "{spatial} against {object}");
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
    // Dufay's rule: nodes of six triangles or fewer are not divided.
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
    // Boxes that halve in size towards the origin make every greedy split cut one off.
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
        let phases: Vec<&str> = log.phases.iter().map(|p| p.name.as_str()).collect();
        assert_eq!(phases, ["boxes", name, "reinsertion", "leaves"]);
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
    let quick = ["reinsertion=2", "reinsertion_share=0.1"];
    assert!(cost("sbvh", &quick) <= 64.4);
    assert!(cost("ploc", &["reinsertion=20"]) < 59.9);
}

/// Compares spatial splits with the plain tree on rays through a real scene.
fn check_sponza(rays_of_each_kind: usize) {
    let Some(soup) = model(SPONZA) else { return };
    let mut rng = Pcg::new(12);
    let mut rays = aimed_rays(&mut rng, &soup, rays_of_each_kind);
    rays.extend(grazing_rays(&mut rng, &soup, rays_of_each_kind));
    let expected = hits(&soup, &params(&[]), &rays);
    let sbvh = with_builder("sbvh", &["spatial_alpha=0.00001", "reinsertion=1"]);
    assert_same_hits("sbvh", &rays, &expected, &hits(&soup, &sbvh, &rays));
    // The plain tree is judged by brute force on a few of them.
    let step = rays.len() / 40;
    let few: Vec<Ray> = rays.iter().step_by(step).copied().collect();
    let judged: Vec<Hit> = expected.iter().step_by(step).copied().collect();
    assert_same_hits("binned", &few, &brute_force(&soup, &few), &judged);
}

/// Twice this many rays: RAYSTONE_REAL_RAYS (500,000 make a million, and a minute), or 20,000.
fn real_rays() -> usize {
    let set = std::env::var("RAYSTONE_REAL_RAYS").ok();
    let parse = |text: String| text.parse().expect("RAYSTONE_REAL_RAYS is a number");
    set.map_or(20_000, parse)
}

#[test]
fn spatial_splits_are_exact_on_sponza() {
    check_sponza(real_rays());
}

#[test]
fn a_tree_that_loses_a_piece_of_a_split_triangle_is_found_wrong() {
    let mut rng = Pcg::new(13);
    let soup = sticks(&mut rng, 60, 0.2);
    let tree = build(&soup, &eager_sbvh(&[]));
    assert!(tree.has_duplicates(&soup));
    let check = |lost: Option<usize>| {
        let mut coverage = raystone::accel::tree::Coverage::new(&soup, 0);
        for node in &tree.nodes {
            if let NodeKind::Leaf { first, count } = node.kind {
                let entries = first as usize..(first + count) as usize;
                let kept = entries.filter(|e| Some(*e) != lost);
                let records: Vec<TriangleRecord> =
                    kept.map(|e| soup.records[tree.order[e] as usize]).collect();
                coverage.leaf(Some(&records), &node.bounds)?;
            }
        }
        coverage.is_complete()
    };
    assert_eq!(check(None), Ok(()));
    let found = (0..tree.order.len())
        .filter(|e| check(Some(*e)).is_err())
        .count();
    // A piece may be covered by chance by other leaves of the same triangle; most are not.
    assert!(
        10 * found > 9 * tree.order.len(),
        "{found} of {}",
        tree.order.len()
    );
}

#[test]
fn triangles_are_built_from_the_vertices_that_kernels_see() {
    // Edges that round: the box of the file's vertices is not that of the record.
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
