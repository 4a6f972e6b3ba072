//! Faults planted in kernels must turn the comparison with brute force red: what the tests of
//! structures would otherwise prove nothing about.

mod support;

use raystone::accel::{AccelRegistry, Hit, Intersection, Ray, TriangleSoup};
use raystone::gpu::{Gpu, KernelLibrary};
use support::{Pcg, brute_force, build, default_params, differences, scenes, trace};

/// One fault: replace `from` by `to` in the kernel `file`; structures whose answers must go wrong.
struct Fault {
    what: &'static str,
    file: &'static str,
    from: &'static str,
    to: &'static str,
    /// The triangle test under which it shows.
    triangle: &'static str,
    structures: &'static [&'static str],
}

const FAULTS: &[Fault] = &[
    Fault {
        what: "a ray along a face of a triangle's box hits what lies behind it",
        file: "accel/triangle",
        from: "all(outside <= allowance(triangle, ray, inverse, found))",
        to: "true",
        triangle: "moeller-trumbore",
        structures: &["brute-force"],
    },
    Fault {
        what: "ties go to whichever triangle comes first",
        file: "accel/triangle",
        from: "t < (*hit).t || (t == (*hit).t && triangle.v0.w < (*hit).triangle)",
        to: "t < (*hit).t",
        triangle: "watertight",
        structures: &["bvh", "roped-bvh"],
    },
    Fault {
        what: "boxes are missed where the ray only touches them, and not padded",
        file: "accel/bounds",
        from: "enter <= min(span.y, t_best) * BOX_PAD",
        to: "enter < min(span.y, t_best)",
        triangle: "watertight",
        structures: &["bvh", "roped-bvh"],
    },
    Fault {
        what: "the far child is culled as near as the hit",
        file: "accel/bvh/pairs",
        from: "far_enter <= (*hit).t * BOX_PAD",
        to: "far_enter < (*hit).t",
        triangle: "watertight",
        structures: &["bvh"],
    },
    Fault {
        what: "the far child is dropped",
        file: "accel/bvh/stack",
        from: "push(&stack, inner.second);",
        to: "",
        triangle: "watertight",
        structures: &["bvh"],
    },
    Fault {
        what: "a leaf ends the walk along the ropes",
        file: "accel/bvh/roped",
        from: "let rope = high.w;",
        to: "let rope = select(NONE, high.w, enter == MISSED || low.w < LEAF);",
        triangle: "watertight",
        structures: &["roped-bvh"],
    },
    Fault {
        what: "the walk stops at the first cell with a hit",
        file: "accel/uniform_grid",
        from: "if (hit.t * BOX_PAD < leave)",
        to: "if (hit.triangle != NO_HIT || hit.t < leave)",
        triangle: "watertight",
        structures: &["uniform-grid"],
    },
    Fault {
        what: "the far child of a two-level structure is dropped",
        file: "accel/meta_bvh",
        from: "push(&stack, children.far);",
        to: "",
        triangle: "watertight",
        structures: &["meta-bvh"],
    },
    Fault {
        what: "the last instance is forgotten",
        file: "accel/object_list",
        from: "i < limits.elements; i++",
        to: "i + 1u < limits.elements; i++",
        triangle: "watertight",
        structures: &["object-list"],
    },
    Fault {
        what: "the walk stops at the first leaf with a hit",
        file: "accel/kd_tree",
        from: "if (enter > hit.t * END_PAD)",
        to: "if (hit.triangle != NO_HIT)",
        triangle: "watertight",
        structures: &["kd-tree"],
    },
    Fault {
        what: "what only touches a plane of a cell is passed by",
        file: "accel/kd_tree",
        from: "enter > plane * BOX_PAD",
        to: "enter >= plane",
        triangle: "watertight",
        structures: &["kd-tree"],
    },
    Fault {
        what: "the walk stops at the first cell with a hit",
        file: "accel/octree",
        from: "if (enter > hit.t * END_PAD)",
        to: "if (hit.triangle != NO_HIT)",
        triangle: "watertight",
        structures: &["octree"],
    },
    Fault {
        what: "children that the ray only touches are passed by",
        file: "accel/octree",
        from: "enter <= p.x",
        to: "enter < m.x",
        triangle: "watertight",
        structures: &["octree"],
    },
    Fault {
        what: "planes of quantised boxes are moved inwards",
        file: "accel/wide",
        from: "base - slack, base + slack",
        to: "base + slack, base - slack",
        triangle: "watertight",
        structures: &["bvh4", "cwbvh"],
    },
    Fault {
        what: "children that must wait are dropped",
        file: "accel/cwbvh",
        from: "entries += select(0u, 1u, left != 0u);",
        to: "",
        triangle: "watertight",
        structures: &["cwbvh"],
    },
    Fault {
        what: "children nearly as far as the hit are dropped",
        file: "accel/bvh4",
        from: "> hit.t * BOX_PAD",
        to: "> hit.t * 0.9",
        triangle: "watertight",
        structures: &["bvh4"],
    },
    Fault {
        what: "the last triangle is forgotten",
        file: "accel/brute_force",
        from: "i < limits.elements; i++",
        to: "i + 1u < limits.elements; i++",
        triangle: "watertight",
        structures: &["brute-force"],
    },
];

/// Scenes full of ties and touching boxes, with a triangle test.
fn cases(triangle: &str) -> Vec<(TriangleSoup, Vec<Ray>, Vec<Hit>)> {
    let case = |seed| {
        let mut rng = Pcg::new(seed);
        let tests = Intersection::named(triangle, "padded-16").expect("two tests");
        let soup = scenes::lattice_soup(&mut rng, 200, 6).intersecting(tests);
        let mut rays = scenes::lattice_rays(&mut rng, 2048, 6);
        rays.extend(scenes::aimed_rays(&mut rng, &soup, 2048));
        let hits = brute_force(&soup, &rays);
        (soup, rays, hits)
    };
    (40..44).map(case).collect()
}

/// Rays that differ from brute force, over all cases.
fn wrong_rays(gpu: &Gpu, structure: &str, cases: &[(TriangleSoup, Vec<Ray>, Vec<Hit>)]) -> usize {
    let registry = AccelRegistry::default();
    let kind = registry
        .get(structure)
        .unwrap_or_else(|| panic!("no structure {structure}"));
    let wrong = |(soup, rays, expected): &(TriangleSoup, Vec<Ray>, Vec<Hit>)| {
        let built = build(kind, soup, &default_params(&kind.parameters()));
        let found = trace(gpu, &*built, soup, rays, &[]);
        differences(expected, &found.hits).len()
    };
    cases.iter().map(wrong).sum()
}

/// A library whose kernel `file` comes from an override folder, with `change` applied.
fn with_override(file: &str, change: impl Fn(&str) -> String) -> KernelLibrary {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join(format!("{file}.wesl"));
    let library = KernelLibrary::default();
    let text = change(library.text(file).expect("an embedded kernel"));
    std::fs::create_dir_all(path.parent().expect("a parent")).expect("a folder");
    std::fs::write(&path, text).expect("a written kernel");
    let library = library.with_folder(folder.path()).expect("the folder");
    assert_eq!(library.overridden(), [file]);
    library
}

#[test]
fn planted_faults_turn_the_comparison_red_and_unchanged_overrides_do_not() {
    if !support::is_exact(support::gpu()) {
        return;
    }
    for fault in FAULTS {
        let cases = cases(fault.triangle);
        let sound = support::open(with_override(fault.file, str::to_owned));
        let faulty = support::open(with_override(fault.file, |text| {
            let times = text.matches(fault.from).count();
            assert_eq!(
                times, 1,
                "{}: `{}` is there {times} times",
                fault.file, fault.from
            );
            text.replace(fault.from, fault.to)
        }));
        for structure in fault.structures {
            let before = wrong_rays(&sound, structure, &cases);
            assert_eq!(before, 0, "{structure} without a fault");
            let after = wrong_rays(&faulty, structure, &cases);
            println!("{structure}: {}: {after} rays differ", fault.what);
            assert!(after > 0, "{structure}: not seen: {}", fault.what);
        }
    }
}
