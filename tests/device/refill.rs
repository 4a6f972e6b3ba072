//! Lane refill: invocations that answer several rays in turn find the same hits with the same work
//! as those of one ray; faults between two rays are detected.

use crate::support;
use crate::support::{
    Pcg, assert_same_hits, build, default_params, faults_in_turn, in_turn, is_exact, kernels_with,
    open, scenes,
};
use raystone::accel::{AccelKind, AccelRegistry, Counters, Hit, Ray, TriangleSoup};
use raystone::gpu::Gpu;
use raystone::params::{ParamValue, Params};

/// Structures whose invocations can be refilled.
const REFILLED: [&str; 3] = ["bvh", "bvh4", "cwbvh"];
const KERNEL: &str = "integrator/trace_rays";

/// A soup, and an odd number of rays; one of them is invalid.
fn subject(rays: usize) -> (TriangleSoup, Vec<Ray>) {
    let mut rng = Pcg::new(23);
    let soup = scenes::lattice_soup(&mut rng, 600, 9);
    let mut all = scenes::aimed_rays(&mut rng, &soup, rays);
    all.extend(scenes::lattice_rays(&mut rng, rays, 9));
    all.truncate(rays);
    all[rays / 2].direction = [f32::NAN, 0.0, 1.0];
    (soup, all)
}

fn with_refill(kind: &dyn AccelKind, refill: &str, rays_per_lane: i64) -> Params {
    let mut params = default_params(&kind.parameters());
    let changes = [
        ("refill", ParamValue::Name(refill.to_owned())),
        ("rays_per_lane", ParamValue::Integer(rays_per_lane)),
    ];
    for (name, value) in changes {
        let before = params.0.insert(name.to_owned(), value);
        assert!(before.is_some(), "{} has no {name}", kind.name());
    }
    params
}

/// Hits, any-hit flags, and the work of both.
type Answers = (Vec<Hit>, Vec<bool>, Vec<Counters>, Vec<Counters>);

fn answers(
    gpu: &Gpu,
    name: &str,
    subject: &(TriangleSoup, Vec<Ray>),
    refill: (&str, i64),
) -> Answers {
    let registry = AccelRegistry::default();
    let kind = registry.get(name).expect("a structure");
    let (soup, rays) = subject;
    let built = build(kind, soup, &with_refill(kind, refill.0, refill.1));
    let trace = |features: &[&str]| support::trace(gpu, &*built, soup, rays, features);
    (
        trace(&[]).hits,
        trace(&["any"]).found(),
        trace(&["counters"]).work,
        trace(&["any", "counters"]).work,
    )
}

#[test]
fn what_is_found_and_counted_does_not_depend_on_it() {
    if !is_exact(support::gpu()) {
        return;
    }
    for rays in [1, 64, 65, 2048, 5003] {
        let subject = subject(rays);
        for name in in_turn("structures that are refilled", REFILLED) {
            let plain = answers(support::gpu(), name, &subject, ("none", 64));
            for rays_per_lane in [2, 3, 64] {
                let what = format!("{name}, {rays} rays, at most {rays_per_lane} a lane");
                let found = answers(support::gpu(), name, &subject, ("always", rays_per_lane));
                assert_same_hits(&what, &subject.1, &plain.0, &found.0);
                assert!(plain.1 == found.1, "{what}: any hit");
                assert!(plain.2 == found.2, "{what}: work of the nearest");
                assert!(plain.3 == found.3, "{what}: work of any");
            }
        }
    }
}

/// True if this kernel fault makes refilled invocations differ from those without refill, or raises
/// the error word.
fn is_seen(subject: &(TriangleSoup, Vec<Ray>), fault: (&str, &str, &str)) -> bool {
    let (module, from, to) = fault;
    let gpu = open(kernels_with(module, &[(from, to)]));
    REFILLED.iter().all(|name| {
        let kernel = match *name {
            "bvh" => "accel/bvh/stack".to_owned(),
            name => format!("accel/{name}"),
        };
        if module.starts_with("accel/") && module != kernel {
            return true;
        }
        let plain = answers(support::gpu(), name, subject, ("none", 64));
        let crooked = || answers(&gpu, name, subject, ("always", 64));
        match std::panic::catch_unwind(std::panic::AssertUnwindSafe(crooked)) {
            Ok(found) => {
                let same = |(a, b): (&Hit, &Hit)| a.same_bits(b);
                !plain.0.iter().zip(&found.0).all(same)
                    || (&plain.1, &plain.2, &plain.3) != (&found.1, &found.2, &found.3)
            }
            Err(caught) => support::panic_shows(&*caught),
        }
    })
}

#[test]
fn what_goes_wrong_between_two_rays_is_seen() {
    if !is_exact(support::gpu()) {
        return;
    }
    let subject = subject(5003);
    let mut faults = vec![
        (
            KERNEL,
            "if (index >= end) {\n                break;",
            "if (index + LANES >= end) {\n                break;",
        ),
        (KERNEL, "index += LANES;", "index += LANES + 1u;"),
        (
            KERNEL,
            "let run = (total + lanes - 1u) / lanes",
            "let run = total / lanes",
        ),
        (
            KERNEL,
            "min(first + run, total)",
            "min(first + run, total - 1u)",
        ),
        (
            KERNEL,
            "workgroup.x + workgroup.y * groups.x) * run",
            "workgroup.x + workgroup.y) * (run + 64u)",
        ),
        (
            KERNEL,
            "counters = Counters();",
            "counters.stack_high_water = 0u;",
        ),
        (KERNEL, "return is_ray(next);", "return true;"),
        (
            KERNEL,
            "            goes_on = begin_ray(index, &at);",
            "            goes_on = true;",
        ),
    ];
    for module in ["accel/bvh4", "accel/cwbvh"] {
        for left_over in [
            "    (*at).inverse = inverse;\n",
            "    (*at).hit = miss(ray);\n",
            "    (*at).entries = 0u;\n",
            "    (*at).steps = 0u;\n",
            "    (*at).backward = backward;\n",
        ] {
            faults.push((module, left_over, "\n"));
        }
    }
    faults.push((
        "accel/cwbvh",
        "    (*at).group = vec2<u32>(0u, ROOT);\n",
        "\n",
    ));
    faults.push(("accel/bvh4", "    (*at).list = ROOT_LIST;\n", "\n"));
    for left_over in [
        "    (*at).inverse = 1.0 / ray.direction;\n",
        "    (*at).hit = miss(ray);\n",
        "    (*at).current = ROOT;\n",
        "    (*at).steps = 0u;\n",
        "    (*at).stack.held = 0u;\n",
        "    (*at).current = current;\n",
        "    (*at).stack = stack;\n",
    ] {
        faults.push(("accel/bvh/stack", left_over, "\n"));
    }
    let faults = faults_in_turn("faults between two rays of an invocation", faults);
    let unseen: Vec<_> = faults
        .iter()
        .filter(|fault| !is_seen(&subject, **fault))
        .collect();
    assert!(unseen.is_empty(), "not seen: {unseen:#?}");
    assert!(!is_seen(
        &subject,
        (KERNEL, "// A workgroup has", "// Any workgroup has")
    ));
    let no_kernel = (KERNEL, "return is_ray(next);", "return is_none(next);");
    assert!(!is_seen(&subject, no_kernel), "it does not compile");
}
