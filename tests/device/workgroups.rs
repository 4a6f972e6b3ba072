//! Workgroups: hits and images do not depend on workgroup size, nor on the shape of their pixels;
//! planted faults are detected. No dispatch takes long, however slow its work.

use crate::support::*;
use raystone::accel::{Hit, Query, Ray, Traced, Workgroup, WorkgroupRegistry};
use raystone::gpu::{Gpu, GpuError, MOST_SLICE_MS};
use raystone::integrator::{
    IntegratorRegistry, OrganisationRegistry, RayOffset, RenderJob, Renderer,
};
use raystone::params::{ParamValue, Params, Variant};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Not a multiple of any edge, nor its pixels of any workgroup.
const SIZE: [u32; 2] = [37, 29];
/// Nor these rays: with the slices of a batch (64, 512, …) every kernel has a partial group.
const RAYS: usize = 5003;

fn workgroup(name: &str) -> Workgroup {
    *WorkgroupRegistry::default()
        .named("workgroup", name)
        .expect("a workgroup")
}

fn in_groups(gpu: &Gpu, traced: &Traced, name: &str) -> Traced {
    let traced = traced.clone().in_workgroups(gpu, &workgroup(name));
    traced.expect("an inline structure")
}

/// A small scene with instances, and rays at it and past it; one of them is invalid.
fn subject(gpu: &Gpu) -> (Stage, Vec<Ray>) {
    let stage = Stage::builtin(gpu, "instances", &[("count", ParamValue::Integer(9))]);
    let mut rays = scenes::aimed_rays(&mut Pcg::new(5), &stage.soup, RAYS);
    rays[RAYS / 2].direction = [f32::NAN, 0.0, 1.0];
    (stage, rays)
}

/// Nearest hits, in dispatches of one row and of narrow ones, and any-hit flags.
fn answers(stage: &Stage, traced: &Traced, rays: &[Ray]) -> Result<[Vec<Hit>; 2], GpuError> {
    let batch = stage.tracer(traced, Query::Closest)?.batch(rays)?;
    batch.trace()?;
    let hits = batch.hits()?;
    batch.trace_in_rows()?;
    assert_same_hits("narrow rows", rays, &hits, &batch.hits()?);
    stage.gpu.check_error_word(batch.error_word()?)?;
    let any = stage.tracer(traced, Query::Any)?.batch(rays)?;
    any.trace()?;
    Ok([hits, any.hits()?])
}

fn same(a: &[Vec<Hit>; 2], b: &[Vec<Hit>; 2]) -> bool {
    a.iter().zip(b).all(|(a, b)| differences(a, b).is_empty())
}

#[test]
fn every_structure_finds_the_same_in_workgroups_of_every_size() {
    let (stage, rays) = subject(gpu());
    for kind in in_turn("structures in other workgroups", inline_structures()) {
        let traced = stage.traced(gpu(), kind);
        let expected = answers(&stage, &traced, &rays).expect("answers");
        assert!(expected[0].iter().any(|hit| hit.triangle != u32::MAX));
        // Rays lie in a row: there is one kernel each for 64 and 256.
        for size in ["32", "128", "16x16"] {
            let other = in_groups(gpu(), &traced, size);
            let found = answers(&stage, &other, &rays);
            let found = found.unwrap_or_else(|e| panic!("{} × {size}: {e}", kind.name()));
            let what = format!("{} × {size}", kind.name());
            assert_same_hits(&what, &rays, &expected[0], &found[0]);
            assert!(same(&expected, &found), "{what}: any hit");
        }
    }
}

/// Structures whose kernels use their place in a workgroup, or take several rays each.
fn with(name: &str, changes: &[(&str, &str)]) -> Params {
    let mut params = default_params(&structure(name).parameters());
    for (key, value) in changes {
        let value = ParamValue::Name((*value).to_owned());
        assert!(params.0.insert((*key).to_owned(), value).is_some(), "{key}");
    }
    params
}

fn built_with(stage: &Stage, name: &str, params: &Params) -> Traced {
    let stage: &raystone::integrator::Stage = stage;
    stage.traced(structure(name), params).expect("a structure")
}

#[test]
fn stacks_in_workgroup_memory_and_refilled_invocations_go_with_every_size() {
    let (stage, rays) = subject(gpu());
    for (name, changes) in [
        ("bvh", [("stack_memory", "workgroup")]),
        ("cwbvh", [("refill", "always")]),
        ("bvh4", [("refill", "always")]),
    ] {
        let traced = built_with(&stage, name, &with(name, &changes));
        let expected = answers(&stage, &traced, &rays).expect("answers");
        for size in ["32", "128", "256"] {
            let found = answers(&stage, &in_groups(gpu(), &traced, size), &rays);
            let found = found.unwrap_or_else(|e| panic!("{name} × {size}: {e}"));
            assert!(same(&expected, &found), "{name} × {size}");
        }
    }
}

fn organisation(name: &str, changes: &[(&str, ParamValue)]) -> Variant {
    let changes = changes.iter().map(|(k, v)| ((*k).to_owned(), v.clone()));
    Variant {
        name: name.to_owned(),
        label: name.to_owned(),
        params: Params(changes.collect()),
    }
}

fn pixels(
    stage: &Stage,
    traced: &Traced,
    what: &Variant,
    by: &Variant,
) -> Result<Vec<[u32; 3]>, GpuError> {
    let integrator = IntegratorRegistry::default().configured(what);
    let by = OrganisationRegistry::default().configured(by);
    let integrator = integrator.expect("an integrator");
    let integrator = integrator.organised(by.expect("an organisation"));
    let job = RenderJob {
        size: SIZE,
        camera: stage.camera,
        sampler: &sampler("owen-sobol", "none"),
        integrator: &integrator.map_err(GpuError::Kernel)?,
        offset: RayOffset::default(),
        runtime_checks: true,
    };
    let renderer = Renderer::new(&stage.gpu, &stage.buffers, traced, &job, true)?;
    let shots = renderer.render(&[3], 9)?;
    let bits = |p: &[f32; 3]| p.map(f32::to_bits);
    Ok(shots[0].image.pixels.iter().map(bits).collect())
}

/// Organisations with an integrator each.
fn organised() -> Vec<(Variant, Variant)> {
    let short = ("capacity", ParamValue::Integer(1024));
    let sorted = ("sorting", ParamValue::Name("ray-key".to_owned()));
    vec![
        (path(3), organisation("single-kernel", &[])),
        (
            integrator_variant("ao", &[]),
            organisation("single-kernel", &[]),
        ),
        (path(3), organisation("regeneration", &[])),
        (path(3), organisation("multi-kernel", &[])),
        (path(3), organisation("wavefront", &[short, sorted])),
    ]
}

#[test]
fn images_are_the_same_in_workgroups_of_every_shape() {
    let stage = Stage::builtin(gpu(), "cornell-box", &[]);
    let traced = stage.traced(gpu(), structure("cwbvh"));
    for (what, by) in organised() {
        let expected = pixels(&stage, &traced, &what, &by).expect("an image");
        for shape in in_turn("shapes of workgroups", &Workgroup::ALL) {
            let other = in_groups(gpu(), &traced, shape.name);
            let found = pixels(&stage, &other, &what, &by);
            let found = found.unwrap_or_else(|e| panic!("{by:?} × {}: {e}", shape.name));
            assert!(expected == found, "{what}, {by:?} × {}", shape.name);
        }
    }
}

#[test]
fn a_workgroup_beyond_the_adapter_is_refused_with_both_numbers() {
    let mut small = alone(raystone::gpu::KernelLibrary::default());
    small.limits.max_compute_invocations_per_workgroup = 128;
    small.limits.max_compute_workgroup_size_x = 100;
    let (stage, rays) = subject(&small);
    let traced = stage.traced(&small, structure("bvh"));
    for (size, needed, limit) in [("256", "256", "100"), ("128", "128", "100")] {
        let refused = answers(&stage, &in_groups(&small, &traced, size), &rays);
        let refused = refused.expect_err("a refusal");
        let text = refused.to_string();
        assert!(text.contains(needed) && text.contains(limit), "{text}");
        assert!(refused.is_refusal());
    }
    let single = organisation("single-kernel", &[]);
    let large = in_groups(&small, &traced, "16x16");
    let refused = pixels(&stage, &large, &path(1), &single).expect_err("a refusal");
    let text = refused.to_string();
    assert!(
        text.contains("256 invocations") && text.contains("128"),
        "{text}"
    );
    assert!(answers(&stage, &in_groups(&small, &traced, "8x8"), &rays).is_ok());
    // So is workgroup memory.
    small.limits.max_compute_workgroup_storage_size = 64 * 16 * 4;
    small.limits.max_compute_invocations_per_workgroup = 1024;
    small.limits.max_compute_workgroup_size_x = 1024;
    let (stage, rays) = subject(&small);
    let stacks = built_with(
        &stage,
        "bvh",
        &with("bvh", &[("stack_memory", "workgroup")]),
    );
    assert!(answers(&stage, &in_groups(&small, &stacks, "64"), &rays).is_ok());
    let refused = answers(&stage, &in_groups(&small, &stacks, "128"), &rays);
    let text = refused.expect_err("a refusal").to_string();
    assert!(
        text.contains("8192 bytes") && text.contains("4096"),
        "{text}"
    );
}

#[test]
fn no_dispatch_takes_long_however_slow_what_it_does() {
    // Brute force over so many triangles needs as long per sample as a tree for hundreds.
    let stage = Stage::builtin(
        gpu(),
        "displaced-sphere",
        &[("triangles", ParamValue::Integer(2000))],
    );
    let traced = stage.traced(gpu(), structure("brute-force"));
    let rays = scenes::aimed_rays(&mut Pcg::new(5), &stage.soup, 1 << 15);
    let trace = || {
        let tracer = stage.tracer(&traced, Query::Closest).expect("a tracer");
        let batch = tracer.batch(&rays).expect("a batch");
        let all = batch.trace().expect("answers").ms();
        (batch.longest_slice_ms(), all)
    };
    let render = || {
        let owen = sampler("owen-sobol", "none");
        let renderer = stage.renderer(gpu(), &traced, &owen, &path(4), [64, 48], false);
        renderer.render(&[4], 1).expect("an image");
        (renderer.longest_slice_ms(), renderer.spent().ms())
    };
    // Slices are sized by earlier ones; other load may lengthen some, but not all.
    const TRIES: usize = 10;
    for (what, run) in [
        ("rays", &trace as &dyn Fn() -> (f64, f64)),
        ("samples", &render),
    ] {
        let is_short = |_| {
            let (longest, all) = run();
            println!("{what}: {longest:.0} ms of {all:.0} ms");
            assert!(
                longest > 0.0 && all > longest,
                "{what} in one slice of {all} ms: nothing is seen"
            );
            longest < MOST_SLICE_MS
        };
        assert!((0..TRIES).any(is_short), "{what}: too long {TRIES} times");
    }
}

#[test]
fn a_name_that_is_no_workgroup_is_an_error_with_the_nearest() {
    let registry = WorkgroupRegistry::default();
    let refused = registry.named("workgroup", "16*16").expect_err("no such");
    assert!(refused.contains("`16x16`"), "{refused}");
    assert_eq!(registry.iter().count(), Workgroup::ALL.len());
}

/// True if a fault in tracing ray buffers shows in workgroups of this size.
fn rays_show(size: &str, (module, from, to): (&str, &str, &str), refill: &str) -> bool {
    let (stage, rays) = subject(gpu());
    let params = with("cwbvh", &[("refill", refill)]);
    let expected = answers(&stage, &built_with(&stage, "cwbvh", &params), &rays);
    let crooked = open(kernels_with(module, &[(from, to)]));
    let found = || {
        let (stage, rays) = subject(&crooked);
        let traced = built_with(&stage, "cwbvh", &params);
        answers(&stage, &in_groups(&crooked, &traced, size), &rays)
    };
    match catch_unwind(AssertUnwindSafe(found)) {
        Ok(Ok(found)) => !same(&expected.expect("answers"), &found),
        Ok(Err(error)) => shows(&format!("{error:?}")),
        Err(caught) => panic_shows(&*caught),
    }
}

/// True if a fault in tracing images shows.
fn pixels_show(
    shape: &str,
    (module, from, to): (&str, &str, &str),
    (what, by): &(Variant, Variant),
) -> bool {
    let stage = Stage::builtin(gpu(), "cornell-box", &[]);
    let traced = stage.traced(gpu(), structure("cwbvh"));
    let expected = pixels(&stage, &traced, what, by).expect("an image");
    let crooked = open(kernels_with(module, &[(from, to)]));
    let stage = Stage::builtin(&crooked, "cornell-box", &[]);
    let traced = stage.traced(&crooked, structure("cwbvh"));
    let found = pixels(&stage, &in_groups(&crooked, &traced, shape), what, by);
    match found {
        Ok(found) => found != expected,
        Err(error) => shows(&format!("{error:?}")),
    }
}

#[test]
fn what_goes_wrong_with_the_size_of_workgroups_is_seen() {
    const RAYS: &str = "integrator/trace_rays";
    let mut unseen = Vec::new();
    let of_rays = [
        // The last, partial group is dropped.
        (
            "128",
            (
                RAYS,
                "if (item >= ray_total()) {",
                "if (item >= ray_total() / LANES * LANES) {",
            ),
            "none",
        ),
        // An index with another width.
        (
            "128",
            (
                RAYS,
                "id.x + id.y * groups.x * LANES",
                "id.x + id.y * groups.x * 64u",
            ),
            "none",
        ),
        (
            "32",
            (
                RAYS,
                "id.x + id.y * groups.x * LANES",
                "id.x + id.y * groups.x * 64u",
            ),
            "none",
        ),
        ("128", (RAYS, "index += LANES;", "index += 256u;"), "always"),
        ("32", (RAYS, "index += LANES;", "index += 64u;"), "always"),
        ("32", (RAYS, "/ lanes * LANES;", "/ lanes * 31u;"), "always"),
        (
            "32",
            (
                RAYS,
                "groups.x * groups.y * LANES;",
                "groups.x * groups.y * 64u;",
            ),
            "always",
        ),
    ];
    for (size, fault, refill) in faults_in_turn("faults of workgroups of rays", of_rays) {
        if !rays_show(size, fault, refill) {
            unseen.push(format!("{size}: {fault:?}"));
        }
    }
    let cases = organised();
    let [single, again, several, queues] = [0, 2, 3, 4].map(|place| &cases[place]);
    let of_pixels = [
        // Rows and columns swapped, in the kernel and of the pixel.
        (
            "32",
            "integrator/render",
            "@workgroup_size(GROUP_WIDTH, GROUP_HEIGHT)",
            "@workgroup_size(GROUP_HEIGHT, GROUP_WIDTH)",
            single,
        ),
        (
            "16x16",
            "integrator/render",
            "@if(!block_list) let x = id.x;",
            "@if(!block_list) let x = id.y;",
            single,
        ),
        // Groups of another width than counted; the last column or row of groups is lost.
        (
            "256",
            "organisation/regeneration",
            "@workgroup_size(GROUP_WIDTH, GROUP_HEIGHT)",
            "@workgroup_size(8, 8)",
            again,
        ),
        (
            "16x16",
            "integrator/render",
            "@if(!block_list) let is_outside = x >= frame.width ||",
            "@if(!block_list) let is_outside = x >= frame.width / GROUP_WIDTH * GROUP_WIDTH ||",
            single,
        ),
        (
            "16x16",
            "integrator/render",
            "id.y >= frame.rows;",
            "id.y >= frame.rows / GROUP_HEIGHT * GROUP_HEIGHT;",
            single,
        ),
        (
            "128",
            "organisation/queue",
            "groups.x * LANES",
            "groups.x * LANES + 1u",
            several,
        ),
        (
            "32",
            "organisation/groups",
            "(live + LANES - 1u) / LANES",
            "(live + 63u) / 64u",
            queues,
        ),
        (
            "128",
            "organisation/groups",
            "(live + LANES - 1u) / LANES",
            "max(live, LANES) / LANES",
            queues,
        ),
        (
            "32",
            "organisation/shade",
            "@workgroup_size(LANES)",
            "@workgroup_size(16)",
            several,
        ),
    ];
    for (shape, module, from, to, case) in
        faults_in_turn("faults of workgroups of pixels", of_pixels)
    {
        if !pixels_show(shape, (module, from, to), case) {
            unseen.push(format!("{shape}: {module}: {to}"));
        }
    }
    assert!(unseen.is_empty(), "not seen: {unseen:#?}");
    // A no-op change is not.
    assert!(!rays_show(
        "128",
        (RAYS, "// A workgroup has", "// Any workgroup has"),
        "always"
    ));
}
