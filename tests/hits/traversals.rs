//! Every traversal of every layout of the binary BVH: hits bit-identical to brute force, the work
//! claimed by the papers, and errors if something is too small.

use crate::support;
use crate::support::scenes::{self, Case};
use crate::support::{Pcg, assert_same_hits, brute_force, build, default_params, in_turn, trace};
use raystone::accel::{
    AccelError, AccelKind, BuildLog, Bvh, Counters, Hit, Ray, RopedBvh, TriangleSoup,
};
use raystone::config::Axis;
use raystone::params::{ParamRange, ParamValue, Params};

fn params(changes: &[(&str, &str)]) -> Params {
    let mut out = default_params(&Bvh.parameters());
    for (name, value) in changes {
        let value = match out.0.get(*name) {
            Some(ParamValue::Integer(_)) => ParamValue::Integer(value.parse().expect("a number")),
            Some(ParamValue::Flag(_)) => ParamValue::Flag(value.parse().expect("true or false")),
            Some(_) => ParamValue::Name((*value).to_owned()),
            None => panic!("bvh has no parameter {name}"),
        };
        out.0.insert((*name).to_owned(), value);
    }
    out
}

/// Allowed names of a parameter of `bvh`.
fn names_of(parameter: &str) -> &'static [&'static str] {
    let schema = Bvh.parameters();
    let found = schema.iter().find(|p| p.name == parameter);
    match found.expect("a parameter of bvh").range {
        ParamRange::Choice(names) => names,
        ref other => panic!("{parameter} takes {other}"),
    }
}

/// Traversal with node size, stack memory and entries, which determine the kernel.
const KERNELS: &[&[(&str, &str)]] = &[
    &[("traversal", "stack"), ("node_bytes", "64")],
    &[("traversal", "stack"), ("node_bytes", "32")],
    &[("traversal", "stack"), ("stack_memory", "private")],
    &[("traversal", "stack"), ("stack_memory", "workgroup")],
    &[
        ("traversal", "stack"),
        ("node_bytes", "32"),
        ("stack_memory", "workgroup"),
    ],
    &[("traversal", "parent-pointer"), ("node_bytes", "64")],
    &[("traversal", "parent-pointer"), ("node_bytes", "32")],
    &[("traversal", "roped")],
    &[("traversal", "octant-roped")],
    &[
        ("traversal", "short-stack"),
        ("node_bytes", "64"),
        ("short_stack_entries", "1"),
    ],
    &[
        ("traversal", "short-stack"),
        ("node_bytes", "64"),
        ("short_stack_entries", "3"),
    ],
    &[
        ("traversal", "short-stack"),
        ("node_bytes", "32"),
        ("short_stack_entries", "2"),
        ("stack_memory", "private"),
    ],
    &[
        ("traversal", "short-stack"),
        ("short_stack_entries", "2"),
        ("stack_memory", "workgroup"),
    ],
];

/// Every kernel whose turn it is, with every node order and leaf form.
fn combinations() -> Vec<Params> {
    let mut out = Vec::new();
    for kernel in in_turn("kernels of a binary tree", KERNELS) {
        for triangles in names_of("triangles") {
            for order in names_of("node_order") {
                let layout = [("triangles", *triangles), ("node_order", *order)];
                out.push(params(&[*kernel, &layout].concat()));
            }
        }
    }
    out
}

#[test]
fn every_traversal_has_a_kernel_on_the_list() {
    for traversal in names_of("traversal") {
        let is_it = |kernel: &&&[(&str, &str)]| kernel.contains(&("traversal", *traversal));
        assert!(KERNELS.iter().any(|kernel| is_it(&kernel)), "{traversal}");
    }
}

/// Hard scenes with rays and the answers of brute force.
fn hard_cases(rays_per_kind: usize) -> Vec<(Case, Vec<Ray>, Vec<Hit>)> {
    let mut rng = Pcg::new(31);
    let mut cases = scenes::degenerate_cases();
    for (name, count, extent) in [("sparse lattice", 90, 9), ("dense lattice", 500, 5)] {
        let soup = scenes::lattice_soup(&mut rng, count, extent);
        cases.push(Case { name, soup });
    }
    let with_rays = |case: Case| {
        let mut rays = scenes::aimed_rays(&mut rng, &case.soup, rays_per_kind);
        let planes = scenes::lattice_plane_rays(&mut rng, &case.soup, rays_per_kind);
        rays.extend(planes);
        rays.extend(scenes::lattice_rays(&mut rng, rays_per_kind, 8));
        let hits = brute_force(&case.soup, &rays);
        rays.extend(scenes::cut_at_hits(&rays, &hits));
        let hits = brute_force(&case.soup, &rays);
        (case, rays, hits)
    };
    cases.into_iter().map(with_rays).collect()
}

/// Closest and any hit of every ray by the scalar twin, with the work of the closest hits.
fn twin_answers(soup: &TriangleSoup, params: &Params, rays: &[Ray]) -> (Vec<Hit>, Vec<Counters>) {
    let built = build(&Bvh, soup, params);
    let twin = built.cpu_twin(soup).expect("a twin");
    let answer = |ray| {
        let mut work = Counters::default();
        let hit = twin.closest_hit(ray, &mut work);
        let any = twin.any_hit(ray, &mut Counters::default());
        assert_eq!(any, hit.triangle != raystone::accel::NO_HIT, "{params:?}");
        (hit, work)
    };
    rays.iter().map(answer).unzip()
}

#[test]
fn twins_of_all_combinations_equal_brute_force_to_the_bit_on_hard_scenes() {
    for (case, rays, expected) in hard_cases(150) {
        for params in combinations() {
            let (found, _) = twin_answers(&case.soup, &params, &rays);
            assert_same_hits(
                &format!("{} {params:?}", case.name),
                &rays,
                &expected,
                &found,
            );
        }
    }
}

#[test]
fn kernels_of_all_combinations_equal_brute_force_and_count_like_their_twins() {
    let gpu = support::gpu();
    if !support::is_exact(gpu) {
        return;
    }
    let combinations = combinations();
    for (index, (case, rays, expected)) in hard_cases(100).into_iter().enumerate() {
        // The order of nodes changes no kernel: each case uses another third of the combinations.
        for params in combinations.iter().skip(index % 3).step_by(3) {
            let what = format!("{} {params:?}", case.name);
            let built = build(&Bvh, &case.soup, params);
            let twin = built.cpu_twin(&case.soup).expect("a twin");
            let plain = trace(gpu, &*built, &case.soup, &rays, &[]);
            assert_same_hits(&what, &rays, &expected, &plain.hits);
            for (features, any) in [(["counters", ""], false), (["counters", "any"], true)] {
                let counted = trace(gpu, &*built, &case.soup, &rays, &features);
                for (ray, found) in rays.iter().zip(&counted.work) {
                    let mut work = Counters::default();
                    if any {
                        twin.any_hit(ray, &mut work);
                    } else {
                        twin.closest_hit(ray, &mut work);
                    }
                    assert_eq!(*found, work, "{what}, any: {any}, {ray:?}");
                }
            }
        }
    }
}

#[test]
fn trees_that_list_a_triangle_in_several_leaves_are_traversed_to_the_bit_too() {
    let mut rng = Pcg::new(12);
    // Long thin intersecting triangles, which spatial splits cut.
    let soup = scenes::lattice_soup(&mut rng, 600, 30);
    let rays = scenes::aimed_rays(&mut rng, &soup, 1500);
    let expected = brute_force(&soup, &rays);
    // Device builds are tested in tests/device/device_builders.
    let on_the_host = |name: &&&str| !name.starts_with("device-");
    for builder in names_of("builder").iter().filter(on_the_host) {
        let built = build(&Bvh, &soup, &params(&[("builder", builder)]));
        if *builder == "sbvh" {
            let references = built.stats().references;
            assert!(references > 600, "only {references} references");
        }
        for kernel in KERNELS {
            let params = params(&[*kernel, &[("builder", builder)]].concat());
            let (found, _) = twin_answers(&soup, &params, &rays);
            assert_same_hits(&format!("{params:?}"), &rays, &expected, &found);
        }
    }
}

/// Work of the twin over a scene with high depth complexity, summed over all rays.
fn summed_work(changes: &[(&str, &str)]) -> (Vec<Counters>, Counters) {
    let mut rng = Pcg::new(5);
    let soup = scenes::lattice_soup(&mut rng, 3000, 40);
    let rays = scenes::aimed_rays(&mut rng, &soup, 2000);
    let (_, work) = twin_answers(&soup, &params(changes), &rays);
    let mut sum = Counters::default();
    for w in &work {
        sum.nodes += w.nodes;
        sum.box_tests += w.box_tests;
        sum.triangle_tests += w.triangle_tests;
        sum.stack_high_water = sum.stack_high_water.max(w.stack_high_water);
    }
    (work, sum)
}

fn triangle_tests(work: &[Counters]) -> Vec<u32> {
    work.iter().map(|w| w.triangle_tests).collect()
}

#[test]
fn parent_pointers_and_short_stacks_test_the_same_triangles_as_the_stack_ray_by_ray() {
    for node_bytes in ["64", "32"] {
        let size = ("node_bytes", node_bytes);
        let (stack, sum) = summed_work(&[("traversal", "stack"), size]);
        let (parent, parent_sum) = summed_work(&[("traversal", "parent-pointer"), size]);
        assert_eq!(triangle_tests(&stack), triangle_tests(&parent));
        assert!(parent_sum.nodes > sum.nodes && parent_sum.stack_high_water == 0);
        let mut nodes = u32::MAX;
        for entries in ["1", "4", "32"] {
            let short = [
                ("traversal", "short-stack"),
                size,
                ("short_stack_entries", entries),
            ];
            let (short, short_sum) = summed_work(&short);
            assert_eq!(triangle_tests(&stack), triangle_tests(&short));
            assert_eq!(short_sum.box_tests, sum.box_tests, "{entries} entries");
            assert!(
                short_sum.nodes < nodes,
                "restarts get fewer with more entries"
            );
            nodes = short_sum.nodes;
        }
        assert_eq!(nodes, sum.nodes, "32 entries are never exceeded here");
    }
}

#[test]
fn octant_ropes_test_the_same_boxes_as_the_stack_over_single_boxes() {
    let (stack, sum) = summed_work(&[("traversal", "stack"), ("node_bytes", "32")]);
    let (octant, octant_sum) = summed_work(&[("traversal", "octant-roped")]);
    assert_eq!(triangle_tests(&stack), triangle_tests(&octant));
    assert_eq!(
        (octant_sum.nodes, octant_sum.box_tests),
        (sum.nodes, sum.box_tests)
    );
    let (_, fixed) = summed_work(&[("traversal", "roped")]);
    assert!(
        fixed.nodes > octant_sum.nodes,
        "an order for all octants costs visits: {} and {}",
        fixed.nodes,
        octant_sum.nodes
    );
}

#[test]
fn layouts_change_no_visit() {
    for kernel in in_turn("kernels whose layouts change no visit", KERNELS) {
        let (plain, _) = summed_work(kernel);
        for change in [
            ("triangles", "indexed"),
            ("node_order", "breadth-first"),
            ("node_order", "van-emde-boas"),
        ] {
            let (changed, _) = summed_work(&[*kernel, &[change]].concat());
            assert_eq!(plain, changed, "{kernel:?} {change:?}");
        }
    }
}

fn refusal(changes: &[(&str, &str)]) -> String {
    let soup = scenes::lattice_soup(&mut Pcg::new(1), 40, 5);
    match Bvh.build(&soup, &params(changes), &mut BuildLog::default()) {
        Err(error @ AccelError::Contradiction(_)) => error.to_string(),
        Err(other) => panic!("{changes:?}: {other}"),
        Ok(_) => panic!("{changes:?} is built"),
    }
}

#[test]
fn combinations_that_make_no_sense_are_refused_with_the_reason() {
    for (changes, tells) in [
        ([("traversal", "roped"), ("node_bytes", "64")], "takes 32"),
        (
            [("traversal", "octant-roped"), ("node_bytes", "32")],
            "parent-pointer",
        ),
        (
            [("traversal", "parent-pointer"), ("stack_memory", "private")],
            "no stack",
        ),
        (
            [("traversal", "roped"), ("stack_memory", "workgroup")],
            "no stack",
        ),
    ] {
        let told = refusal(&changes);
        assert!(told.contains(tells), "{changes:?}: {told}");
    }
}

/// Triangles whose 60-bit Morton codes each begin with another bit, and 2¹⁷ with none: a radix tree
/// separates one from the rest per bit, and finally halves the equal ones.
fn deep_scene() -> TriangleSoup {
    let single = (0..60).map(|bit| {
        let mut at = glam::Vec3::ZERO;
        // Well within its cell, however positions are rounded.
        at[bit % 3] = 1.2 * 0.5_f32.powi(bit as i32 / 3 + 1);
        at
    });
    let corners = single
        .chain(std::iter::repeat_n(glam::Vec3::ZERO, 1 << 17))
        .chain([glam::Vec3::ONE]);
    scenes::soup(corners.map(|at| [at; 3]))
}

#[test]
fn trees_deeper_than_a_trail_or_the_workgroups_memory_are_refused_with_both_numbers() {
    let soup = deep_scene();
    let deep = [
        ("builder", "host-lbvh"),
        ("long_codes", "true"),
        ("leaf_size", "1"),
    ];
    let depth = build(&Bvh, &soup, &params(&deep))
        .stats()
        .depth
        .expect("a depth");
    assert!(depth > 64, "{depth}");
    for (change, limit) in [
        (("traversal", "short-stack"), 64),
        (("stack_memory", "workgroup"), 16384),
    ] {
        let changes = [&deep[..], &[change]].concat();
        match Bvh.build(&soup, &params(&changes), &mut BuildLog::default()) {
            Err(AccelError::Limit {
                needed, limit: l, ..
            }) => assert!(l == limit && needed > limit, "{needed} {l}"),
            Err(other) => panic!("{changes:?}: {other}"),
            Ok(_) => panic!("{changes:?} is built at depth {depth}"),
        }
    }
}

/// The error word of a kernel with one line of `module` replaced.
fn error_word(module: &str, from: &str, to: &str, changes: &[(&str, &str)]) -> Option<String> {
    let gpu = support::open(support::kernels_with(module, &[(from, to)]));
    let mut rng = Pcg::new(2);
    let soup = scenes::lattice_soup(&mut rng, 400, 12);
    let rays = scenes::aimed_rays(&mut rng, &soup, 300);
    let built = build(&Bvh, &soup, &params(changes));
    let run = std::panic::AssertUnwindSafe(|| trace(&gpu, &*built, &soup, &rays, &[]));
    let panic = std::panic::catch_unwind(run).err()?;
    panic.downcast_ref::<String>().cloned()
}

#[test]
fn an_overflowing_stack_and_a_blown_step_fuse_raise_the_error_word() {
    let full = "(*stack).held == STACK_ENTRIES";
    for memory in names_of("stack_memory") {
        let changes = [("stack_memory", *memory)];
        assert_eq!(error_word("accel/stack", full, full, &changes), None);
        let told = error_word("accel/stack", full, "(*stack).held == 1u", &changes);
        let told = told.expect("an overflow");
        assert!(told.contains("stack overflowed"), "{memory}: {told}");
    }
    for (traversal, module) in [
        ("stack", "stack"),
        ("parent-pointer", "parent_pointer"),
        ("roped", "roped"),
        ("octant-roped", "octant_roped"),
        ("short-stack", "short_stack"),
    ] {
        assert!(names_of("traversal").contains(&traversal));
        let (module, fuse) = (format!("accel/bvh/{module}"), "step < limits.step_fuse");
        let changes = [("traversal", traversal), ("refill", "none")];
        assert_eq!(error_word(&module, fuse, fuse, &changes), None);
        let told = error_word(&module, fuse, "step < 4u", &changes).expect("a blown fuse");
        assert!(told.contains("step fuse"), "{traversal}: {told}");
    }
    // Refilled lanes count the steps of each ray.
    let (module, fuse) = ("accel/bvh/stack", "(*at).steps == limits.step_fuse");
    let changes = [("refill", "always")];
    assert_eq!(error_word(module, fuse, fuse, &changes), None);
    let told = error_word(module, fuse, "(*at).steps == 4u", &changes).expect("a blown fuse");
    assert!(told.contains("step fuse"), "refilled: {told}");
}

#[test]
fn a_link_or_content_that_leads_astray_is_no_valid_structure() {
    let mut rng = Pcg::new(9);
    let soup = scenes::lattice_soup(&mut rng, 60, 7);
    let other = scenes::lattice_soup(&mut rng, 60, 7);
    for kernel in KERNELS {
        let built = build(&Bvh, &soup, &params(kernel));
        assert!(built.validate(&other).is_err(), "{kernel:?}");
    }
    let roped = default_params(&RopedBvh.parameters());
    assert!(build(&RopedBvh, &soup, &roped).validate(&other).is_err());
}

#[test]
fn arrays_in_two_to_four_parts_give_the_same_hits() {
    use raystone::accel::{Load, Query, Traced, Tracer, TriangleBuffers};
    if !support::is_exact(support::gpu()) {
        return;
    }
    let catalogue = raystone::run::Registries::default().catalogue();
    let sphere = catalogue[Axis::Scene]
        .iter()
        .find(|e| e.name == "displaced-sphere");
    let mut variant = sphere.expect("a built-in scene").default_variant();
    let few = ("triangles".to_owned(), ParamValue::Integer(3000));
    variant.params.0.extend([few]);
    let scene = raystone::scene::load(&variant, &Default::default()).expect("a scene");
    let soup = TriangleSoup::new(&scene);
    let rays = scenes::aimed_rays(&mut Pcg::new(4), &soup, 1000);
    let expected = brute_force(&soup, &rays);
    let mut gpu = support::alone(raystone::gpu::KernelLibrary::default());
    let mut seen = std::collections::BTreeSet::new();
    for (index, kernel) in KERNELS.iter().enumerate() {
        for triangles in names_of("triangles") {
            let params = params(&[*kernel, &[("triangles", *triangles)]].concat());
            let built = build(&Bvh, &soup, &params);
            let arrays = built.buffers().arrays;
            let largest = arrays.iter().map(|a| 4 * a.words.len()).max().unwrap_or(0);
            let largest = largest.max(48 * soup.records.len()) as u64;
            gpu.limits.max_storage_buffer_binding_size = largest / (2 + index as u64 % 3) + 400;
            let buffers = TriangleBuffers::upload(&gpu, &soup).expect("triangles");
            let traced = Traced::upload(&gpu, &*built).expect("arrays in parts");
            // The parts are bound one by one, or become one texture.
            for load in &Load::ALL[1..] {
                let what = format!("{params:?}, load {}", load.name);
                let traced = traced.clone().loading(&gpu, load).expect(&what);
                let tracer = Tracer::new(&gpu, &buffers, &traced, Query::Closest);
                let batch = tracer.and_then(|tracer| tracer.batch(&rays));
                let batch = batch.unwrap_or_else(|e| panic!("{what}: {e}"));
                batch.trace().unwrap_or_else(|e| panic!("{what}: {e}"));
                assert_eq!(batch.error_word().expect("the error word"), 0);
                let hits = batch.hits().expect("hits");
                assert_same_hits(&what, &rays, &expected, &hits);
                seen.extend(batch.tracer().features());
            }
        }
    }
    for array in ["nodes", "leaf_triangles", "triangles"] {
        let last = format!("{array}_3");
        assert!(seen.contains(&last), "{last} is not among {seen:?}");
    }
}

#[test]
fn more_parts_than_the_adapter_binds_are_refused_with_both_numbers() {
    use raystone::accel::{Load, Query, Traced, Tracer, TriangleBuffers};
    let catalogue = raystone::run::Registries::default().catalogue();
    let sphere = catalogue[Axis::Scene]
        .iter()
        .find(|e| e.name == "displaced-sphere");
    let variant = sphere.expect("a built-in scene").default_variant();
    let scene = raystone::scene::load(&variant, &Default::default()).expect("a scene");
    let soup = TriangleSoup::new(&scene);
    let mut gpu = support::alone(raystone::gpu::KernelLibrary::default());
    gpu.limits.max_storage_buffer_binding_size = soup.records.len() as u64 * 12 + 400;
    gpu.limits.max_storage_buffers_per_shader_stage = 8;
    let built = build(&Bvh, &soup, &params(&[("triangles", "indexed")]));
    let buffers = TriangleBuffers::upload(&gpu, &soup).expect("triangles");
    let traced = Traced::upload(&gpu, &*built).expect("arrays in parts");
    let traced = traced.loading(&gpu, &Load::ALL[1]).expect("buffers");
    let tracer = Tracer::new(&gpu, &buffers, &traced, Query::Closest);
    let told = tracer.err().expect("too many buffers").to_string();
    assert!(told.contains("at most 8"), "{told}");
    assert!(["9", "10", "11"].iter().any(|n| told.contains(n)), "{told}");
}

#[test]
fn skip_pointers_visit_at_most_three_times_the_nodes_of_the_ordered_traversal_on_real_scenes() {
    for path in [
        "sponza-crytek/sponza.obj",
        "stanford-dragon/dragon_100k.obj",
    ] {
        let at = std::path::Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../shared/scenes")
            .join(path);
        if !at.exists() {
            support::needs::skip("files", format!("{} is not there", at.display()));
            continue;
        }
        let variant = raystone::params::Variant {
            name: at.display().to_string(),
            params: Params::default(),
            label: path.to_owned(),
        };
        let options = raystone::scene::LoadOptions {
            textures: false,
            ..Default::default()
        };
        let scene = raystone::scene::load(&variant, &options).expect("a scene");
        let soup = TriangleSoup::new(&scene);
        let rays = scenes::aimed_rays(&mut Pcg::new(6), &soup, 4000);
        let nodes = |changes: &[(&str, &str)]| -> u64 {
            let (_, work) = twin_answers(&soup, &params(changes), &rays);
            work.iter().map(|w| u64::from(w.nodes)).sum()
        };
        let ordered = nodes(&[("traversal", "stack"), ("node_bytes", "32")]);
        let roped = nodes(&[("traversal", "roped")]);
        let octants = nodes(&[("traversal", "octant-roped")]);
        println!("{path}: ordered {ordered}, roped {roped}, in octants {octants}");
        assert!(ordered < roped && roped <= 3 * ordered);
        assert_eq!(octants, ordered);
    }
}
