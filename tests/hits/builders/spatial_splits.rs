//! Spatial splits: exact hits on clipped triangles in every structure over such a tree; expected
//! tree costs; contents of a triangle's leaves, and detection of lost pieces.

use super::{SPONZA, build, hits, model, params, sticks, with_builder};
use crate::support::scenes::{self, aimed_rays, lattice_rays, lattice_soup};
use crate::support::{self, Pcg, Stage, assert_same_hits, brute_force, default_params};
use glam::{DVec3, Vec3, Vec3Swizzles as _};
use raystone::accel::bounds::Bounds;
use raystone::accel::tree::{NodeKind, Tree};
use raystone::accel::triangle::TriangleRecord;
use raystone::accel::{Hit, Ray, TriangleSoup};
use raystone::integrator::Traced;
use raystone::measure::gate::Checks;
use raystone::params::{ParamValue, Params};

/// Rays nearly in the plane of a triangle: rounding may hit anywhere in its box.
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

/// SBVH that splits whenever possible.
fn eager_sbvh(changes: &[&str]) -> Params {
    with_builder(
        "sbvh",
        &[&["spatial_alpha=0", "leaf_size=2"], changes].concat(),
    )
}

/// Rays towards points of triangles, at a cosine of at least 1/16 to their planes: clipped
/// triangles guarantee nothing below 1/32.
fn steep_rays(rng: &mut Pcg, soup: &TriangleSoup, count: usize) -> Vec<Ray> {
    let ray = |_| {
        let record = &soup.records[rng.below(soup.records.len() as u32) as usize];
        let [a, b, c] = record.triangle().vertices;
        let (u, v) = (rng.unit(), rng.unit());
        let target = a + u * (b - a) + v * u * (c - b);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let along = (b - a) * rng.signed() + (c - b) * rng.signed();
        let lift = [1.0, -0.3, 0.07][rng.below(3) as usize];
        let direction = along + lift * along.length() * normal;
        Ray {
            origin: (target - direction * rng.between(1, 3) as f32).to_array(),
            t_min: 0.0,
            direction: direction.to_array(),
            t_max: scenes::FAR,
        }
    };
    (0..).map(ray).filter(Ray::is_ray).take(count).collect()
}

fn split_soup(rng: &mut Pcg, seed: u64) -> TriangleSoup {
    match seed % 3 {
        0 => lattice_soup(rng, 80, 6),
        1 => sticks(rng, 80, 0.2),
        _ => sticks(rng, 80, 8.0),
    }
}

/// Split modes: clip the triangle, or its box.
const WAYS: [&str; 2] = ["spatial_clip=true", "spatial_clip=false"];

#[test]
fn hits_are_exact_where_triangles_are_split() {
    let mut clipped = 0;
    for seed in 0..30 {
        let mut rng = Pcg::new(seed);
        let soup = split_soup(&mut rng, seed);
        let mut rays = aimed_rays(&mut rng, &soup, 300);
        rays.extend(lattice_rays(&mut rng, 300, 8));
        rays.extend(steep_rays(&mut rng, &soup, 600));
        let first = brute_force(&soup, &rays);
        rays.extend(scenes::cut_at_hits(&rays, &first));
        let expected = brute_force(&soup, &rays);
        // If boxes are clipped, all rays are proven.
        let grazing = grazing_rays(&mut rng, &soup, 600);
        let expected_grazing = brute_force(&soup, &grazing);
        for changes in [&[][..], &["reinsertion=5"], &["spatial_bins=3", "bins=2"]] {
            for way in WAYS {
                let params = eager_sbvh(&[&[way], changes].concat());
                let what = format!("seed {seed} {changes:?} {way}");
                let found = hits(&soup, &params, &rays);
                assert_same_hits(&what, &rays, &expected, &found);
                let found = hits(&soup, &params, &grazing);
                if way == WAYS[1] {
                    assert_same_hits(&what, &grazing, &expected_grazing, &found);
                } else {
                    clipped += support::differences(&expected_grazing, &found).len();
                }
            }
        }
    }
    println!("{clipped} of 54,000 grazing rays see something else where triangles are clipped");
    assert!(clipped < 5);
}

#[test]
fn structures_over_clipped_triangles_pass_the_gate() {
    let gpu = support::gpu();
    let count = |n: i64| [("triangles", ParamValue::Integer(n))];
    let (sphere, soup) = (count(3_000), count(600));
    for (scene, changes) in [
        ("cornell-box", &[][..]),
        ("displaced-sphere", &sphere),
        ("triangle-soup", &soup),
        ("teapot-in-a-stadium", &[]),
    ] {
        let stage = Stage::builtin(gpu, scene, changes);
        let reference = stage.judge(Checks::Repeated, [2_048, 4_000_000, 256]);
        assert!(reference.is_sound(), "{:?}", reference.first_wrong());
        let names = ["bvh", "roped-bvh", "bvh4", "cwbvh", "meta-bvh"];
        for name in support::in_turn("structures over clipped triangles", names) {
            let kind = support::structure(name);
            let mut params = default_params(&kind.parameters());
            let set = [
                ("builder", ParamValue::Name("sbvh".to_owned())),
                ("spatial_alpha", ParamValue::Number(0.0)),
            ];
            for (key, value) in set {
                *params.0.get_mut(key).expect("a parameter") = value;
            }
            let built = support::build(kind, &stage.soup, &params);
            let listed = built.stats().references;
            let traced = Traced::upload(gpu, &*built).expect("buffers that fit");
            let verdict = stage.verdict(gpu, &traced, &reference).expect("a verdict");
            let triangles = stage.soup.records.len();
            println!("{scene}, {name}: {listed} references to {triangles} triangles");
            assert!(listed > triangles as u64, "{scene}, {name}");
            assert!(verdict.passed, "{scene}, {name}: {verdict:?}");
        }
    }
}

#[test]
fn grazing_rays_are_given_hits_outside_the_triangle() {
    // The reason why clipped triangles guarantee nothing for such rays: see `src/accel/tree/sbvh.rs`.
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
        // Barycentric coordinates of the point's projection onto the plane.
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

/// Boxes of the leaves that list a triangle.
fn leaves_of(tree: &Tree, id: u32) -> Vec<Bounds> {
    let lists = |node: &&raystone::accel::tree::TreeNode| match node.kind {
        NodeKind::Leaf { first, count } => {
            tree.order[first as usize..(first + count) as usize].contains(&id)
        }
        NodeKind::Inner { .. } => false,
    };
    let leaves = tree.nodes.iter().filter(lists);
    leaves.map(|node| node.bounds).collect()
}

#[test]
fn the_leaves_of_a_triangle_hold_what_hits_may_be_given() {
    // Error of a hit at a cosine of 1/32: 2 · 2⁻²⁰ · 32 times the diagonal, and more for slivers,
    // whose normal is a small difference of large products.
    let margin = |soup: &TriangleSoup, e1: DVec3, e2: DVec3| {
        let bounds = scenes::box_of(soup);
        let [low, high] = [bounds.min, bounds.max].map(|v| Vec3::from(v).as_dvec3());
        let products = (e1.yzx() * e2.zxy()).abs() + (e1.zxy() * e2.yzx()).abs();
        let length = products.length() / e1.cross(e2).length();
        (2.0_f64.powi(-14) * (high - low).length() * length).min(1e30)
    };
    for seed in 0..12 {
        let mut rng = Pcg::new(seed);
        let soup = split_soup(&mut rng, seed);
        let trees = WAYS.map(|way| build(&soup, &eager_sbvh(&[way])));
        let mut missed = [0, 0];
        for record in &soup.records {
            let [a, b, c] = record.triangle().vertices.map(Vec3::as_dvec3);
            let own = record.bounds();
            let reach = margin(&soup, b - a, c - a);
            let leaves = [0, 1].map(|way: usize| leaves_of(&trees[way], record.id));
            for _ in 0..200 {
                // A point of the triangle, moved by at most the margin, within its box.
                let (u, v) = (f64::from(rng.unit()), f64::from(rng.unit()));
                let near = a + u * (b - a) + v * u * (c - b);
                let mut any = || Vec3::new(rng.signed(), rng.signed(), rng.signed()).as_dvec3();
                let (moved, within) = (near + reach * any(), 0.5 * (any() + 1.0));
                let (low, high) = (
                    Vec3::from(own.min).as_dvec3(),
                    Vec3::from(own.max).as_dvec3(),
                );
                let in_some = |way: usize, p: DVec3| {
                    leaves[way].iter().any(|leaf| {
                        let (min, max) = (Vec3::from(leaf.min), Vec3::from(leaf.max));
                        p.cmpge(min.as_dvec3()).all() && p.cmple(max.as_dvec3()).all()
                    })
                };
                let moved = moved.clamp(low, high);
                assert!(in_some(0, moved), "seed {seed}: {moved} near {record:?}");
                let anywhere = low + within * (high - low);
                assert!(
                    in_some(1, anywhere),
                    "seed {seed}: {anywhere} in the box of {record:?}"
                );
                missed[0] += u32::from(!in_some(0, anywhere));
            }
            missed[1] += u32::from(leaves[0].len() > 1);
        }
        println!("seed {seed}: {missed:?}");
        assert!(missed[0] > 0 && missed[1] > 0, "nothing was clipped");
    }
}

/// Four copies of this triangle, in the plane x = z, whose box is the cube of side 8.
const DIAGONAL: [Vec3; 3] = [Vec3::ZERO, Vec3::splat(8.0), Vec3::new(8.0, 6.0, 8.0)];

#[test]
fn a_diagonal_triangle_costs_what_its_parts_cost() {
    // Cut at x = 4, where the sum of both areas is smallest: the parts have the boxes [0, 4]³ and
    // [4, 8] × [3, 8] × [4, 8], of half areas 48 and 56; that of the whole is 192. Clipped boxes
    // have 128 each, and no cut pays. The margin is 0.01.
    let soup = scenes::soup([DIAGONAL; 4]);
    let tree = build(&soup, &with_builder("sbvh", &[]));
    let cost = tree.stats().sah_cost.expect("a cost");
    let expected = 1.0 + 4.0 * (48.0 + 56.0) / 192.0;
    assert!(
        (cost / expected - 1.0).abs() < 0.01,
        "{cost} for {expected}"
    );
    assert_eq!(tree.order.len(), 8);
    for (leaf, low, high) in [
        (&tree.nodes[1], [0.0; 3], [4.0; 3]),
        (&tree.nodes[2], [4.0, 3.0, 4.0], [8.0; 3]),
    ] {
        let inner = Bounds {
            min: low,
            max: high,
        };
        assert!(leaf.bounds.contains(&inner), "{leaf:?}");
        let grown = Bounds {
            min: low.map(|x| x - 0.02),
            max: high.map(|x| x + 0.02),
        };
        assert!(grown.contains(&leaf.bounds), "{leaf:?}");
    }
    let boxes = build(&soup, &with_builder("sbvh", &["spatial_clip=false"]));
    assert_eq!((boxes.nodes.len(), boxes.stats().sah_cost), (1, Some(4.0)));
}

#[test]
fn the_corners_that_diagonal_triangles_miss_are_nobody_elses() {
    // A small triangle on either side of their plane, outside every part's box.
    let small = |at: Vec3| [at, at + Vec3::X, at + Vec3::Y];
    let corners = [Vec3::new(6.0, 4.0, 1.0), Vec3::new(1.0, 4.0, 6.0)].map(small);
    let soup = scenes::soup([DIAGONAL; 4].into_iter().chain(corners));
    let figures = |changes: &[&str]| {
        let mut tree = build(&soup, &with_builder("sbvh", changes));
        tree.note_epo(&soup);
        (
            tree.epo.expect("an overlap"),
            tree.stats().sah_cost.expect("a cost"),
        )
    };
    let ((clipped, cost), (boxes, whole)) = (figures(&[]), figures(&["spatial_clip=false"]));
    // The leaf of the four has the small ones in its box: surface fraction 1, for four tests; so
    // has the node that contains one of them.
    let area = 4.0 * 0.5 * 512.0_f64.sqrt() + 1.0;
    println!(
        "EPO {clipped} and {boxes} (4 / area: {}), SAH {cost} and {whole}",
        4.0 / area
    );
    assert_eq!(clipped, 0.0);
    assert!(boxes >= 4.0 / area - 1e-12);
    assert!(cost < whole);
}

#[test]
fn spatial_splits_are_tried_where_object_splits_overlap_by_alpha() {
    let soup = sticks(&mut Pcg::new(3), 500, 0.2);
    let listed = |alpha: &str| {
        let changes = [format!("spatial_alpha={alpha}")];
        build(&soup, &with_builder("sbvh", &[&changes[0]]))
            .order
            .len()
    };
    let [all, some, few] = ["0", "0.001", "0.1"].map(listed);
    assert!(
        all >= some && some > few && few >= 500,
        "{all} {some} {few}"
    );
    assert_eq!(listed("1"), 500);
}

#[test]
fn spatial_splits_lower_the_cost_of_long_triangles() {
    let mut rng = Pcg::new(7);
    let soup = sticks(&mut rng, 3_000, 0.2);
    let cost = |p: &Params| build(&soup, p).stats().sah_cost.expect("a cost");
    let (object, spatial) = (cost(&params(&[])), cost(&with_builder("sbvh", &[])));
    assert!(spatial < 0.9 * object, "{spatial} against {object}");
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
    // The plain tree is checked by brute force on a few of them.
    let step = rays.len() / 40;
    let few: Vec<Ray> = rays.iter().step_by(step).copied().collect();
    let judged: Vec<Hit> = expected.iter().step_by(step).copied().collect();
    assert_same_hits("binned", &few, &brute_force(&soup, &few), &judged);
}

/// Rays of each kind: RAYSTONE_REAL_RAYS (500,000 make a million, and a minute), or 20,000.
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
    // Other leaves of the same triangle may cover a piece by chance; most are not covered.
    assert!(
        10 * found > 9 * tree.order.len(),
        "{found} of {}",
        tree.order.len()
    );
}
