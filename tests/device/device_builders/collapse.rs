//! Wide nodes made on the device: the same words as the host twin's.

use super::soups::{clusters, equal_positions, shrinking};
use super::{METHODS, SPONZA, with_builder};
use crate::support::scenes::{degenerate_cases, lattice_soup};
use crate::support::{self, Pcg, faults_in_turn, gpu, in_turn, is_exact, kernels_with, open};
use raystone::accel::{AccelKind, BuildLog, Bvh4, Cwbvh, StructureStats, TriangleSoup};
use raystone::gpu::Gpu;
use raystone::params::ParamValue;
use raystone::scene::builtin_scenes;
use std::path::Path;

const WIDE: [&dyn AccelKind; 2] = [&Bvh4, &Cwbvh];

/// Parameters besides the builder.
type Changes<'a> = &'a [(&'a str, ParamValue)];

/// The words of all arrays, and the figures.
type Words = (Vec<Vec<u32>>, StructureStats);

/// The result of a builder, if it is valid.
fn words(
    gpu: &Gpu,
    kind: &dyn AccelKind,
    soup: &TriangleSoup,
    builder: &str,
    changes: Changes,
) -> Result<Words, String> {
    let mut params = with_builder(kind, builder).expect("a parameter `builder`");
    for (name, value) in changes {
        let before = params.0.insert((*name).to_owned(), value.clone());
        assert!(before.is_some(), "{} has no {name}", kind.name());
    }
    let built = kind.build(soup, &params, &mut BuildLog::with_gpu(gpu));
    let built = built.map_err(|e| e.to_string())?;
    built.validate(soup).map_err(|e| e.to_string())?;
    let arrays = built.buffers().arrays;
    let words = arrays.iter().map(|a| a.words.to_vec()).collect();
    Ok((words, built.stats()))
}

fn check(what: &str, soup: &TriangleSoup, changes: Changes) {
    for kind in WIDE {
        for (method, _) in METHODS {
            let [device, host] = ["device", "host"].map(|place| {
                let found = words(gpu(), kind, soup, &format!("{place}-{method}"), changes);
                found.unwrap_or_else(|e| panic!("{what}, {} {method}: {e}", kind.name()))
            });
            let count = soup.records.len();
            let which = format!("{what}, {count} triangles, {} {method}", kind.name());
            assert_eq!(device.1, host.1, "{which}");
            assert!(device.0 == host.0, "{which}: other words");
        }
    }
}

#[test]
fn wide_nodes_equal_those_of_the_host_twin_to_the_bit() {
    if !is_exact(gpu()) {
        return;
    }
    let mut random = Pcg::new(21);
    for case in degenerate_cases() {
        check(case.name, &case.soup, &[]);
    }
    let counts = [0, 1, 2, 3, 4, 5, 8, 9, 33, 64, 65, 513, 4097];
    for count in in_turn("sizes of wide trees", counts) {
        check("lattice", &lattice_soup(&mut random, count, 30), &[]);
        check("clusters", &clusters(&mut random, count), &[]);
        check("equal positions", &equal_positions(count), &[]);
    }
    check("shrinking", &shrinking(1200), &[]);
    // Levels with more nodes than a pass has invocations.
    check("lattice", &lattice_soup(&mut random, 40_001, 200), &[]);
}

#[test]
fn wide_nodes_equal_those_of_the_host_twin_whatever_they_cost() {
    if !is_exact(gpu()) {
        return;
    }
    let soup = clusters(&mut Pcg::new(22), 700);
    for [traversal, intersection] in [[0.01, 1.0], [100.0, 1.0], [0.3, 0.7], [1.0, 0.01]] {
        for leaf_size in [1, 2, 3] {
            let changes = [
                ("traversal_cost", ParamValue::Number(traversal)),
                ("intersection_cost", ParamValue::Number(intersection)),
                ("leaf_size", ParamValue::Integer(leaf_size)),
            ];
            check(&format!("{changes:?}"), &soup, &changes);
        }
    }
    let improved = [("reinsertion", ParamValue::Integer(2))];
    check("after reinsertion", &soup, &improved);
}

#[test]
fn wide_nodes_of_built_in_scenes_and_of_sponza_equal_those_of_the_host_twin() {
    if !is_exact(gpu()) {
        return;
    }
    for entry in in_turn("built-in scenes of wide trees", builtin_scenes()) {
        let scene = support::builtin(&entry.name, &[]);
        if scene.triangles.len() < 30_000 {
            check(&entry.name, &TriangleSoup::new(&scene), &[]);
        }
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(SPONZA);
    if !path.exists() {
        return crate::support::needs::skip("files", format!("{} is not there", path.display()));
    }
    let soup = TriangleSoup::new(&support::from_file(&path));
    check("sponza", &soup, &[]);
}

#[test]
fn passes_of_the_collapse_are_timed_by_name() {
    let soup = lattice_soup(&mut Pcg::new(23), 3000, 20);
    let params = with_builder(&Cwbvh, "device-lbvh").expect("a parameter `builder`");
    let mut log = BuildLog::with_gpu(gpu());
    Cwbvh.build(&soup, &params, &mut log).expect("a structure");
    let names: Vec<&str> = log.phases.iter().map(|p| p.name.as_str()).collect();
    let on_device: &[&str] = match gpu().timestamp_period {
        Some(_) => &["levels", "costs", "places", "transfer"],
        None => &[],
    };
    for name in on_device
        .iter()
        .chain(&["upload of the tree", "wide nodes"])
    {
        let times = names.iter().filter(|n| *n == name).count();
        assert_eq!(times, 1, "{name}: {names:?}");
    }
    assert!(!names.contains(&"collapse"), "{names:?}");
}

/// Kernel, original text, replacement, and the fault.
const FAULTS: [(&str, &str, &str, &str); 19] = [
    (
        "costs",
        "the last way to share children not tried",
        "for (var k = 1u; k < children; k++)",
        "for (var k = 1u; k + 1u < children; k++)",
    ),
    (
        "costs",
        "a leaf costs a triangle more",
        "f32(count)",
        "f32(count + 1u)",
    ),
    (
        "costs",
        "the cost of the node itself forgotten",
        "kept(half_area(node) * settings.traversal_cost) + whole.cost",
        "whole.cost",
    ),
    (
        "costs",
        "triangles of one child only",
        "below[pair.x].triangles + below[pair.y].triangles",
        "below[pair.x].triangles + 1u",
    ),
    (
        "costs",
        "leaves of a triangle less",
        "triangles > settings.leaf_size",
        "triangles >= settings.leaf_size",
    ),
    (
        "costs",
        "children taken that do not pay",
        "if (found.cost < least)",
        "if (found.cost <= least)",
    ),
    (
        "costs",
        "a choice that does not pay taken for one that does",
        "(1u << (BITS * (children - 1u))) - 1u",
        "(1u << (BITS * children)) - 1u",
    ),
    (
        "costs",
        "children in the other order",
        "open[waiting] = vec2<u32>(pair.y, most - first);
        open[waiting + 1u] = vec2<u32>(pair.x, first);",
        "open[waiting + 1u] = vec2<u32>(pair.y, most - first);
        open[waiting] = vec2<u32>(pair.x, first);",
    ),
    (
        "costs",
        "an area without one of its faces",
        " + kept(e.z * e.x)",
        "",
    ),
    (
        "octants",
        "an axis looked at twice",
        "vec3<u32>(0u, 1u, 2u)",
        "vec3<u32>(0u, 1u, 1u)",
    ),
    (
        "octants",
        "ties of slots settled the other way",
        "found > most",
        "found >= most",
    ),
    (
        "octants",
        "a slot given twice",
        "((taken >> slot) & 1u) == 0u && (best.x",
        "(best.x",
    ),
    (
        "device/levels",
        "second children not listed",
        "side < 2u",
        "side < 1u",
    ),
    (
        "device/levels",
        "a level begins one late",
        "starts[level.depth + 1u] = end;",
        "starts[level.depth + 1u] = end + 1u;",
    ),
    (
        "device/costs",
        "a level skipped",
        "let end = starts[level.depth + 1u];",
        "let end = select(starts[level.depth + 1u], 0u, level.depth == 3u);",
    ),
    (
        "device/costs",
        "the last child not counted",
        "i < roots.count",
        "i + 1u < roots.count",
    ),
    (
        "device/places",
        "what is below begins one too far",
        "below_nodes += held.nodes - 1u;",
        "below_nodes += held.nodes;",
    ),
    (
        "device/places",
        "triangles of a leaf exchanged",
        "open[waiting] = pair.y;
            open[waiting + 1u] = pair.x;",
        "open[waiting] = pair.x;
            open[waiting + 1u] = pair.y;",
    ),
    (
        "device/places",
        "a child lost",
        "let root = slots[slot];",
        "let root = select(slots[slot], NOTHING, slot == 3u);",
    ),
];

#[test]
fn faults_in_the_collapse_are_seen() {
    let soups = [
        clusters(&mut Pcg::new(24), 1500),
        lattice_soup(&mut Pcg::new(25), 1500, 4),
    ];
    let host = |kind| {
        soups
            .each_ref()
            .map(|soup| words(gpu(), kind, soup, "host-ploc", &[]))
    };
    let expected = WIDE.map(host);
    for (module, what, from, to) in faults_in_turn("faults of the collapse", FAULTS) {
        let module = format!("accel/wide/{module}");
        let faulty = open(kernels_with(&module, &[(from, to)]));
        let seen = [0, 1].map(|which| {
            soups.iter().zip(&expected[which]).any(|(soup, expected)| {
                words(&faulty, WIDE[which], soup, "device-ploc", &[]) != *expected
            })
        });
        // Only nodes of eight are arranged.
        let [four, eight] = seen;
        assert!(
            eight && (four || module.ends_with("octants")),
            "{what}: {seen:?}"
        );
    }
}
