//! Trees built on the device: bit-identical to the host twin's, valid, and passing the correctness
//! check in every structure over a binary tree; and faults that these checks detect.

mod collapse;
mod soups;

use crate::support;
use crate::support::scenes::{self, lattice_soup};
use crate::support::{
    Pcg, Stage, default_params, faults_in_turn, gpu, in_turn, is_exact, kernels_with, open,
    structures,
};
use raystone::accel::bounds::Bounds;
use raystone::accel::tree::parallel::{LEAF, LinkedTree, Method, Settings, build, device};
use raystone::accel::tree::{NodeKind, Tree, TreeParameters};
use raystone::accel::{AccelKind, BuildLog, BuiltAccel, Cwbvh, Traced, TriangleSoup};
use raystone::gpu::Gpu;
use raystone::measure::gate::Checks;
use raystone::params::{ParamValue, Parameters as _, Params};
use raystone::scene::builtin_scenes;
use soups::{clusters, equal_positions, shrinking};
use std::path::Path;

const SPONZA: &str = "../shared/scenes/sponza-crytek/sponza.obj";
const METHODS: [(&str, Method); 2] = [
    ("lbvh", Method::Lbvh),
    ("ploc", Method::Ploc { radius: 14 }),
];

/// Every method with codes of both lengths.
fn settings() -> Vec<Settings> {
    let both = |(_, method): (&str, Method)| {
        [false, true].map(|long_codes| Settings { method, long_codes })
    };
    METHODS.into_iter().flat_map(both).collect()
}

fn on_device(gpu: &Gpu, soup: &TriangleSoup, settings: &Settings) -> Result<LinkedTree, String> {
    device::build(soup, settings, &mut BuildLog::with_gpu(gpu)).map_err(|e| e.to_string())
}

/// Compares node by node; reports the first difference.
fn difference(host: &LinkedTree, device: &LinkedTree) -> Option<String> {
    if host.root != device.root || host.nodes.len() != device.nodes.len() {
        let size = |tree: &LinkedTree| (tree.root, tree.nodes.len());
        return Some(format!(
            "root and nodes: {:?} and {:?}",
            size(host),
            size(device)
        ));
    }
    let mut pairs = host.nodes.iter().zip(&device.nodes).enumerate();
    let (index, (host, device)) = pairs.find(|(_, (host, device))| host != device)?;
    Some(format!(
        "node {index}: {host:?} on the host, {device:?} on the device"
    ))
}

/// Checks that each inner node's box bounds its children, and each leaf's its triangles.
fn check_boxes(tree: &LinkedTree, soup: &TriangleSoup) {
    for (index, node) in tree.nodes.iter().enumerate() {
        let around = Bounds::from(node.around());
        let expected = match node.right {
            LEAF => soup.records[node.left as usize].bounds(),
            _ => {
                let child = |c: u32| Bounds::from(tree.nodes[c as usize].around());
                let [a, b] = node.children().map(child);
                a.union(&b)
            }
        };
        assert_eq!(around, expected, "node {index}");
    }
}

fn check(what: &str, soup: &TriangleSoup) {
    for settings in settings() {
        let host = build(soup, &settings).unwrap_or_else(|e| panic!("{what}: {e}"));
        host.check(soup.records.len())
            .unwrap_or_else(|e| panic!("{what}: {e}"));
        check_boxes(&host, soup);
        let device = on_device(gpu(), soup, &settings);
        let device = device.unwrap_or_else(|e| panic!("{what}: {e}"));
        let count = soup.records.len();
        assert_eq!(
            difference(&host, &device),
            None,
            "{what}, {count} triangles, {settings:?}"
        );
    }
}

#[test]
fn trees_equal_the_host_twin_to_the_bit() {
    if !is_exact(gpu()) {
        return;
    }
    let mut random = Pcg::new(3);
    for case in scenes::degenerate_cases() {
        check(case.name, &case.soup);
    }
    let counts = [
        1, 2, 3, 7, 8, 9, 63, 64, 65, 511, 512, 513, 4095, 4096, 4097,
    ];
    for count in in_turn("sizes of trees", counts) {
        check("lattice", &lattice_soup(&mut random, count, 30));
        check("clusters", &clusters(&mut random, count));
        check("equal positions", &equal_positions(count));
    }
    check("lattice", &lattice_soup(&mut random, 70_001, 200));
    check("shrinking", &shrinking(1200));
}

#[test]
fn clustering_equals_the_host_twin_whatever_its_radius() {
    if !is_exact(gpu()) {
        return;
    }
    let soup = clusters(&mut Pcg::new(13), 1500);
    for radius in [1, 2, 31, 32] {
        let method = Method::Ploc { radius };
        let long_codes = false;
        let settings = Settings { method, long_codes };
        let host = build(&soup, &settings).expect("a tree");
        let device = on_device(gpu(), &soup, &settings).expect("a tree");
        assert_eq!(difference(&host, &device), None, "radius {radius}");
    }
}

#[test]
fn clusters_of_equal_boxes_are_joined_in_few_rounds() {
    // If ties went to the first neighbour, a round would join one pair.
    let settings = Settings {
        method: Method::Ploc { radius: 14 },
        long_codes: false,
    };
    let tree = build(&equal_positions(1 << 12), &settings).expect("a tree");
    assert_eq!(Tree::from(tree).depth(), 12);
}

#[test]
fn trees_of_built_in_scenes_equal_the_host_twin_to_the_bit() {
    if !is_exact(gpu()) {
        return;
    }
    let entries = builtin_scenes();
    assert!(entries.len() > 5);
    for entry in in_turn("built-in scenes of trees", entries) {
        let scene = support::builtin(&entry.name, &[]);
        if scene.triangles.len() < 200_000 {
            check(&entry.name, &TriangleSoup::new(&scene));
        }
    }
}

#[test]
fn the_tree_of_sponza_equals_the_host_twin_to_the_bit() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(SPONZA);
    if !path.exists() {
        support::needs::skip("files", format!("{} is not there", path.display()));
        return;
    }
    if is_exact(gpu()) {
        check("sponza", &TriangleSoup::new(&support::from_file(&path)));
    }
}

/// The default parameters of a structure with this builder, if it has builders.
fn with_builder(kind: &dyn AccelKind, builder: &str) -> Option<Params> {
    let mut params = default_params(&kind.parameters());
    *params.0.get_mut("builder")? = ParamValue::Name(builder.to_owned());
    Some(params)
}

fn built(
    gpu: &Gpu,
    kind: &dyn AccelKind,
    soup: &TriangleSoup,
    builder: &str,
) -> Result<Box<dyn BuiltAccel>, String> {
    let params = with_builder(kind, builder).expect("a parameter `builder`");
    let built = kind.build(soup, &params, &mut BuildLog::with_gpu(gpu));
    built.map_err(|e| e.to_string())
}

#[test]
fn every_structure_over_a_binary_tree_is_the_same_with_either_twin() {
    if !is_exact(gpu()) {
        return;
    }
    let soup = lattice_soup(&mut Pcg::new(8), 700, 20);
    let instanced = TriangleSoup::new(&support::builtin("instances", &[]));
    let mut compared = 0;
    for kind in structures() {
        if with_builder(kind, "device-lbvh").is_none() {
            continue;
        }
        for (soup, (method, _)) in [&soup, &instanced]
            .into_iter()
            .flat_map(|s| METHODS.map(|m| (s, m)))
        {
            let [device, host] = ["device", "host"].map(|place| {
                let built = built(gpu(), kind, soup, &format!("{place}-{method}"));
                let built = built.unwrap_or_else(|e| panic!("{}: {e}", kind.name()));
                built
                    .validate(soup)
                    .unwrap_or_else(|e| panic!("{}: {e}", kind.name()));
                built
            });
            let words = |built: &dyn BuiltAccel| {
                let arrays = built.buffers().arrays;
                arrays.iter().map(|a| a.words.to_vec()).collect::<Vec<_>>()
            };
            assert!(words(&*device) == words(&*host), "{} {method}", kind.name());
            assert_eq!(device.stats(), host.stats(), "{} {method}", kind.name());
            compared += 1;
        }
    }
    assert!(compared >= 12, "{compared}");
}

#[test]
fn the_gate_passes_compressed_wide_trees_built_on_the_device() {
    let stage = Stage::builtin(gpu(), "cornell-box", &[]);
    let reference = stage.judge(Checks::Repeated, [4000, 1_000_000, 64]);
    for (method, _) in METHODS {
        let built = built(gpu(), &Cwbvh, &stage.soup, &format!("device-{method}"));
        let built = built.unwrap_or_else(|e| panic!("{e}"));
        let traced = Traced::upload(gpu(), &*built).expect("buffers that fit");
        let verdict = stage
            .verdict(gpu(), &traced, &reference)
            .expect("a verdict");
        assert!(verdict.passed, "{method}: {verdict:?}");
    }
}

#[test]
fn clusters_may_be_more_than_a_row_of_workgroups_has_lanes() {
    // Rows of three workgroups instead of 256, which is 16,384 clusters, and 65,536 of tiles.
    let state = "accel/tree/parallel/device/state";
    let rows = ("ROW: u32 = 256u", "ROW: u32 = 3u");
    let gpu = open(kernels_with(state, &[rows]));
    let soup = clusters(&mut Pcg::new(13), 5000);
    for settings in settings() {
        let host = build(&soup, &settings).expect("a tree");
        let device = on_device(&gpu, &soup, &settings).expect("a tree");
        assert_eq!(difference(&host, &device), None, "{settings:?}");
    }
}

#[test]
fn passes_are_timed_by_name_with_the_transfer_apart() {
    let soup = lattice_soup(&mut Pcg::new(9), 3000, 20);
    let mut log = BuildLog::with_gpu(gpu());
    device::build(&soup, &settings()[0], &mut log).expect("a tree");
    let names: Vec<&str> = log.phases.iter().map(|p| p.name.as_str()).collect();
    if gpu().timestamp_period.is_some() {
        for name in [
            "upload",
            "boxes",
            "codes",
            "sort count",
            "sort offsets",
            "sort scatter",
            "links",
            "blocks",
            "inner",
            "transfer",
        ] {
            assert_eq!(
                names.iter().filter(|n| **n == name).count(),
                1,
                "{name}: {names:?}"
            );
        }
    }
    assert!(log.phases.iter().all(|p| p.ms >= 0.0) && log.total_ms() > 0.0);
}

#[test]
fn what_cannot_be_built_says_why() {
    let mut soup = lattice_soup(&mut Pcg::new(10), 300, 20);
    let settings = settings()[0];
    let alone = device::build(&soup, &settings, &mut BuildLog::default());
    assert!(alone.is_err_and(|e| {
        e.to_string()
            .contains("built on the device, and there is none")
    }));
    for bad in [f32::NAN, f32::INFINITY, -2e18] {
        soup.records[217].v1[2] = bad;
        soup.records[250].v0[0] = bad;
        let host = build(&soup, &settings)
            .expect_err("a bad number")
            .to_string();
        assert!(
            host.contains("triangle 217") && host.contains("1e18"),
            "{host}"
        );
        assert_eq!(on_device(gpu(), &soup, &settings), Err(host));
    }
}

#[test]
fn faults_in_the_passes_are_seen() {
    // Kernel, original text, replacement, and `true` if triangles share their codes.
    let faults = [
        (
            "device/boxes",
            "the last triangle missing",
            "if (triangle < size.count) {",
            "if (triangle + 1u < size.count) {",
        ),
        (
            "device/inner",
            "the second child not waited for",
            "var end = ranges[inner].y + 1u;",
            "var end = ranges[inner].y;",
        ),
        (
            "device/blocks",
            "a block without its last child",
            "min(BLOCK * (block + 1u), level.below_count)",
            "min(BLOCK * (block + 1u) - 1u, level.below_count)",
        ),
        (
            "lbvh",
            "the tie break dropped",
            "return CODE_BITS + i32(countLeadingZeros(u32(i ^ j)));",
            "return CODE_BITS;",
        ),
        (
            "morton",
            "an axis dropped",
            "(x.y << 1u) | x.z",
            "(x.y << 1u)",
        ),
        (
            "clusters",
            "the search one short on one side",
            "min(place + radius + 1u, count)",
            "min(place + radius, count)",
        ),
        (
            "clusters",
            "ties of clusters settled the other way",
            "a.apart < b.apart",
            "a.apart > b.apart",
        ),
        (
            "device/advance",
            "the last tile of clusters left out",
            "first < tile_count;",
            "first + 1u < tile_count;",
        ),
        (
            "device/merge",
            "the last cluster lost",
            "min(first + PER_LANE, count)",
            "min(first + PER_LANE, count - 1u)",
        ),
        (
            "device/joins",
            "clusters joined that do not choose each other",
            "if (nearest[other] != place || other == place) {",
            "if (other == place) {",
        ),
        (
            "device/sorted",
            "codes not in the order of the sort",
            "codes[sorted_triangles[place]]",
            "codes[place]",
        ),
        (
            "boxes",
            "numbers below zero in the wrong order",
            "return select(bits ^ vec3<u32>(SIGN), ~bits,",
            "return select(bits ^ vec3<u32>(SIGN), bits,",
        ),
    ];
    let soups = [
        clusters(&mut Pcg::new(11), 3000),
        lattice_soup(&mut Pcg::new(12), 3000, 4),
    ];
    for (module, what, from, to) in faults_in_turn("faults of device builders", faults) {
        let module = format!("accel/tree/parallel/{module}");
        let gpu = open(kernels_with(&module, &[(from, to)]));
        let differs = |soup: &TriangleSoup, settings: &Settings| {
            let host = build(soup, settings).expect("a tree");
            match on_device(&gpu, soup, settings) {
                Ok(device) => difference(&host, &device).is_some(),
                // Faults may fail the build, but not by a kernel that does not compile.
                Err(error) => !error.contains(".wesl"),
            }
        };
        let seen = |s: &Settings| soups.iter().any(|soup| differs(soup, s));
        let [lbvh, ploc] = METHODS.map(|(_, method)| {
            let settings = settings().into_iter().filter(|s| s.method == method);
            settings.map(|s| seen(&s)).collect::<Vec<_>>()
        });
        // Code run by only one of the methods is not tested by the other.
        let all = |seen: &[bool]| seen.iter().all(|s| *s);
        assert!(all(&lbvh) || all(&ploc), "{what}: {lbvh:?} {ploc:?}");
    }
}

/// The triangles, with each vertex displaced by up to `by`.
fn moved(soup: &TriangleSoup, random: &mut Pcg, by: f32) -> TriangleSoup {
    let mut out = soup.clone();
    for record in &mut out.records {
        for x in record
            .v0
            .iter_mut()
            .chain(&mut record.v1)
            .chain(&mut record.v2)
        {
            *x += by * random.signed();
        }
    }
    out
}

fn tree_of(gpu: &Gpu, soup: &TriangleSoup, builder: &str) -> Tree {
    let params = default_params(&TreeParameters::schema());
    let mut params = Params(params.0);
    params
        .0
        .insert("builder".into(), ParamValue::Name(builder.to_owned()));
    let parameters = TreeParameters::from_params(&params).expect("parameters");
    Tree::build(soup, &parameters, &mut BuildLog::with_gpu(gpu)).expect("a tree")
}

/// Bits of all boxes.
fn boxes(tree: &Tree) -> Vec<[u32; 6]> {
    let bits = |b: &Bounds| {
        let [x, y, z] = b.min.map(f32::to_bits);
        let [u, v, w] = b.max.map(f32::to_bits);
        [x, y, z, u, v, w]
    };
    tree.nodes.iter().map(|node| bits(&node.bounds)).collect()
}

#[test]
fn boxes_are_fitted_to_moved_triangles_the_same_on_host_and_device() {
    let mut random = Pcg::new(14);
    for count in [1, 2, 9, 700, 5000] {
        let soup = clusters(&mut random, count);
        let later = moved(&soup, &mut random, 3.0);
        for builder in ["binned", "sbvh", "ploc", "device-lbvh", "device-ploc"] {
            let built = tree_of(gpu(), &soup, builder);
            let [mut host, mut device] = [built.clone(), built.clone()];
            host.refit(&later).expect("the same triangles");
            let fitted = device.refit_on_device(&later, &mut BuildLog::with_gpu(gpu()));
            fitted.expect("the same triangles");
            assert!(
                boxes(&host) == boxes(&device),
                "{builder}, {count} triangles"
            );
            for (node, was) in host.nodes.iter().zip(&built.nodes) {
                assert_eq!(node.kind, was.kind, "{builder}");
                let expected = match node.kind {
                    NodeKind::Inner { left, right } => {
                        let [a, b] = [left, right].map(|c| host.nodes[c as usize].bounds);
                        a.union(&b)
                    }
                    NodeKind::Leaf { first, count } => {
                        let listed = &host.order[first as usize..(first + count) as usize];
                        let boxes = listed.iter().map(|id| later.records[*id as usize].bounds());
                        boxes.fold(Bounds::EMPTY, |all, b| all.union(&b))
                    }
                };
                assert_eq!(node.bounds, expected, "{builder}");
            }
            if builder != "sbvh" {
                device
                    .refit_on_device(&soup, &mut BuildLog::with_gpu(gpu()))
                    .expect("a tree");
                assert_eq!(device.nodes, built.nodes, "{builder}: moved back");
            }
        }
    }
}

#[test]
fn what_cannot_be_fitted_says_why() {
    let soup = clusters(&mut Pcg::new(15), 100);
    let mut tree = tree_of(gpu(), &soup, "device-lbvh");
    let mut fewer = soup.clone();
    fewer.records.pop();
    let mut bad = soup.clone();
    bad.records[31].v2[0] = f32::NAN;
    for (soup, text) in [(&fewer, "there are 99"), (&bad, "triangle 31")] {
        let host = tree.refit(soup).expect_err("other triangles").to_string();
        assert!(host.contains(text), "{host}");
        let device = tree.refit_on_device(soup, &mut BuildLog::with_gpu(gpu()));
        assert_eq!(device.expect_err("other triangles").to_string(), host);
    }
    let alone = tree.refit_on_device(&soup, &mut BuildLog::default());
    assert!(alone.is_err_and(|e| e.to_string().contains("there is none")));
}
