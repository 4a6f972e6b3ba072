//! Organisations of the path tracer: bit-identical to the single kernel for any structure, queue
//! length, compaction and sorting; planted faults are detected.

mod kinds;

use crate::adding_an_integrator::piped::PipedBvh;
use crate::support::*;
use glam::Vec3;
use raystone::accel::{AccelKind, Traced};
use raystone::gpu::{Gpu, GpuError, KernelLibrary};
use raystone::image::Image;
use raystone::integrator::{
    ConfiguredIntegrator, IntegratorRegistry, OrganisationRegistry, RayOffset, RenderJob, Renderer,
};
use raystone::params::{ParamValue, Params, Variant};
use raystone::scene::SceneData;

/// Not a multiple of the workgroup's edge of eight pixels.
const SIZE: [u32; 2] = [37, 29];
const SPPS: [u32; 2] = [1, 3];

fn organisation(name: &str, changes: &[(&str, ParamValue)]) -> Variant {
    let changes = changes.iter().map(|(k, v)| ((*k).to_owned(), v.clone()));
    Variant {
        name: name.to_owned(),
        label: name.to_owned(),
        params: Params(changes.collect()),
    }
}

fn word(value: &str) -> ParamValue {
    ParamValue::Name(value.to_owned())
}

fn wavefront(changes: &[(&str, ParamValue)]) -> Variant {
    organisation("wavefront", changes)
}

fn small(more: &[(&str, ParamValue)]) -> Variant {
    let capacity = ("capacity", ParamValue::Integer(1024));
    wavefront(&[&[capacity], more].concat())
}

fn organised(what: &Variant, by: &Variant) -> Result<ConfiguredIntegrator, String> {
    let integrator = IntegratorRegistry::default().configured(what);
    let integrator = integrator.map_err(|e| e.to_string())?;
    integrator.organised(OrganisationRegistry::default().configured(by)?)
}

/// Images as bits of the channels per pixel.
type Bits = Vec<Vec<[u32; 3]>>;

/// Bits of the images after [`SPPS`] samples, and rays by class.
fn rendered(
    gpu: &Gpu,
    stage: &Stage,
    traced: &Traced,
    what: &Variant,
    by: &Variant,
) -> Result<(Bits, Vec<u64>), GpuError> {
    rendered_as(SIZE, gpu, stage, traced, [what, by])
}

/// [`rendered`] of a size.
fn rendered_as(
    size: [u32; 2],
    gpu: &Gpu,
    stage: &Stage,
    traced: &Traced,
    [what, by]: [&Variant; 2],
) -> Result<(Bits, Vec<u64>), GpuError> {
    let integrator = IntegratorRegistry::default()
        .configured(what)
        .expect("an integrator");
    let by = OrganisationRegistry::default().configured(by);
    let integrator = integrator.organised(by.expect("an organisation"));
    let job = RenderJob {
        size,
        camera: stage.camera,
        sampler: &sampler("owen-sobol", "none"),
        integrator: &integrator.map_err(GpuError::Kernel)?,
        offset: RayOffset::default(),
        runtime_checks: true,
    };
    let renderer = Renderer::new(gpu, &stage.buffers, traced, &job, true)?;
    let shots = renderer.render(&SPPS, 9)?;
    let bits = |image: &Image| image.pixels.iter().map(|p| p.map(f32::to_bits)).collect();
    let images = shots.iter().map(|shot| bits(&shot.image)).collect();
    Ok((images, renderer.ray_counts()?.to_vec()))
}

fn glass_box() -> SceneData {
    builtin("cornell-box", &[("glass", ParamValue::Flag(true))])
}

/// A closed room with glass, instances in the open, and masked surfaces.
fn scenes() -> [SceneData; 3] {
    [
        glass_box(),
        builtin("instances", &[("count", ParamValue::Integer(9))]),
        builtin("foliage", &[("plants", ParamValue::Integer(6))]),
    ]
}

fn all() -> Vec<Variant> {
    let never = ("regeneration", ParamValue::Flag(false));
    let mut all = vec![
        organisation("regeneration", &[]),
        organisation("multi-kernel", &[]),
        wavefront(&[]),
        small(&[]),
        small(std::slice::from_ref(&never)),
        small(&[("sorting", word("material"))]),
        small(&[("sorting", word("ray-key")), never]),
    ];
    for method in [
        "atomic",
        "workgroup",
        "reduce-scan-scatter",
        "horn",
        "blelloch",
        "roger",
    ] {
        all.push(small(&[("compaction", word(method))]));
    }
    all
}

#[test]
fn all_organisations_make_the_image_of_the_single_kernel_to_the_bit() {
    for scene in scenes() {
        let stage = Stage::new(gpu(), scene);
        let traced = stage.traced(gpu(), structure("bvh"));
        let single = organisation("single-kernel", &[]);
        let expected = rendered(gpu(), &stage, &traced, &path(5), &single).expect("an image");
        for by in in_turn("organisations", all()) {
            let found = rendered(gpu(), &stage, &traced, &path(5), &by);
            let found = found.unwrap_or_else(|e| panic!("{by:?}: {e}"));
            assert!(
                found.0 == expected.0,
                "{}: {by:?}: other pixels",
                stage.scene.name
            );
            assert_eq!(found.1, expected.1, "{}: {by:?}: rays", stage.scene.name);
        }
    }
}

#[test]
fn a_queue_of_any_length_makes_the_same_image_and_one_too_long_is_refused_with_numbers() {
    let stage = Stage::new(gpu(), glass_box());
    let traced = stage.traced(gpu(), structure("cwbvh"));
    let single = organisation("single-kernel", &[]);
    let expected = rendered(gpu(), &stage, &traced, &path(3), &single).expect("an image");
    let limit = gpu().limits.max_storage_buffer_binding_size;
    for capacity in [1 << 10, 1 << 11, 1 << 13, 1 << 16, 1 << 20, 1 << 22] {
        for regeneration in [true, false] {
            let by = wavefront(&[
                ("capacity", ParamValue::Integer(capacity)),
                ("regeneration", ParamValue::Flag(regeneration)),
            ]);
            match rendered(gpu(), &stage, &traced, &path(3), &by) {
                Ok(found) => assert!(found == expected, "{capacity}"),
                Err(error) => {
                    let text = error.to_string();
                    assert!(112 * capacity as u64 > limit, "{text}");
                    assert!(text.contains(&limit.to_string()), "{text}");
                }
            }
        }
    }
}

/// Whether an image is the same in bands, which sums need where a buffer does not hold them all.
fn is_same_in_bands(kernels: KernelLibrary, by: &Variant) -> Result<bool, GpuError> {
    const SIZE: [u32; 2] = [200, 97];
    let image = |gpu: &Gpu| {
        let stage = Stage::builtin(gpu, "cornell-box", &[]);
        let traced = stage.traced(gpu, structure("bvh"));
        rendered_as(SIZE, gpu, &stage, &traced, [&path(3), by])
    };
    let mut few = alone(kernels);
    // 61 rows of 200 pixels, and the paths of eight.
    few.limits.max_storage_buffer_binding_size = 192 << 10;
    Ok(image(&few)? == image(gpu())?)
}

#[test]
fn an_image_in_bands_is_that_of_one_buffer() {
    for by in [
        organisation("regeneration", &[]),
        organisation("multi-kernel", &[]),
        small(&[]),
    ] {
        let found = is_same_in_bands(KernelLibrary::default(), &by);
        assert!(found.expect("an image"), "{by:?}");
    }
}

#[test]
fn faults_in_the_rows_of_bands_are_seen() {
    const FROM: &str = " - frame.band_row)";
    for (by, module) in [
        (organisation("regeneration", &[]), "regeneration"),
        (organisation("multi-kernel", &[]), "accumulate"),
    ] {
        let changed = kernels_with(&format!("organisation/{module}"), &[(FROM, ")")]);
        let found = is_same_in_bands(changed, &by);
        assert!(!found.unwrap_or(false), "{by:?}");
    }
}

#[test]
fn structures_that_answer_buffers_alone_are_rendered_through_by_queues_and_not_by_one_kernel() {
    let gpu = open(KernelLibrary::default().with_sources(PipedBvh.sources()));
    let stage = Stage::new(&gpu, glass_box());
    let [inline, piped] =
        [structure("bvh"), &PipedBvh as &dyn AccelKind].map(|kind| stage.traced(&gpu, kind));
    let single = organisation("single-kernel", &[]);
    let expected = rendered(&gpu, &stage, &inline, &path(4), &single).expect("an image");
    for by in [organisation("multi-kernel", &[]), small(&[])] {
        let found = rendered(&gpu, &stage, &piped, &path(4), &by).expect("an image");
        assert!(found == expected, "{by:?}");
    }
    for by in [single, organisation("regeneration", &[])] {
        let refused = rendered(&gpu, &stage, &piped, &path(4), &by).expect_err("a refusal");
        assert!(refused.to_string().contains("`wavefront`"), "{refused}");
    }
}

#[test]
fn what_cannot_be_organised_so_is_refused_with_the_reason() {
    let queues = || small(&[]);
    let all = integrator_variant("path", &[("lights", word("all"))]);
    for (what, by, reason) in [
        (integrator_variant("ao", &[]), queues(), "`single-kernel`"),
        (all, queues(), "lights = one"),
        (
            path(3),
            organisation("wavefornt", &[]),
            "did you mean `wavefront`",
        ),
        (
            path(3),
            wavefront(&[("capacity", ParamValue::Integer(9))]),
            "capacity",
        ),
        (
            path(3),
            wavefront(&[("sorting", word("colour"))]),
            "sorting",
        ),
    ] {
        let refused = organised(&what, &by).err().expect("a refusal");
        assert!(refused.contains(reason), "{refused}");
    }
}

/// The error with this kernel fault; `None` if the image is that of the single kernel.
fn fault(by: &Variant, module: &str, from: &str, to: &str) -> Option<String> {
    fault_on(glass_box(), &path(4), by, (module, from, to))
}

/// [`fault`] on a scene, with an integrator.
fn fault_on(
    scene: SceneData,
    what: &Variant,
    by: &Variant,
    (module, from, to): (&str, &str, &str),
) -> Option<String> {
    let gpu = open(kernels_with(module, &[(from, to)]));
    let stage = Stage::new(&gpu, scene);
    let traced = stage.traced(&gpu, structure("bvh"));
    let single = organisation("single-kernel", &[]);
    let expected = rendered(&gpu, &stage, &traced, what, &single).expect("an image");
    match rendered(&gpu, &stage, &traced, what, by) {
        Ok((images, _)) if images != expected.0 => Some("other pixels".to_owned()),
        Ok((_, rays)) => (rays != expected.1).then(|| "other rays".to_owned()),
        Err(error) => shows(&format!("{error:?}")).then(|| error.to_string()),
    }
}

#[test]
fn a_tree_of_lights_knows_the_surface_that_a_ray_has_left() {
    // A shining wall next to the lamp: rays find lights that a tree selects by surface.
    let lamps = || {
        let mut scene = builtin("cornell-box", &[]);
        scene.materials[0].emission = Vec3::splat(0.5);
        scene
    };
    let tree = integrator_variant("path", &[("light_choice", word("tree"))]);
    let several = organisation("multi-kernel", &[]);
    let paths = |from, to| fault_on(lamps(), &tree, &several, ("organisation/paths", from, to));
    let normal = "vec4<f32>(s.path.normal,";
    assert_eq!(paths(normal, "vec4<f32>( s.path.normal,"), None);
    // Stored twice per bounce: a sign lost twice is not lost.
    assert!(paths(normal, "vec4<f32>(s.path.normal.yzx,").is_some());
}

#[test]
fn planted_faults_are_seen() {
    let queues = small(&[]);
    let sorted = |by| small(&[("sorting", word(by))]);
    let several = organisation("multi-kernel", &[]);
    let again = organisation("regeneration", &[]);
    let mut unseen = Vec::new();
    let faults = [
        // A queue one short; a workgroup of it lost; a path lost, or begun twice.
        (
            &queues,
            "plan",
            "let live = kept_count[0];",
            "let live = max(kept_count[0], 1u) - 1u;",
        ),
        (
            &queues,
            "groups",
            "(live + LANES - 1u) / LANES",
            "max(live, LANES) / LANES",
        ),
        (&queues, "finish", "new_slot(next)", "new_slot(next + 1u)"),
        (
            &queues,
            "generate",
            "batch.first + begun);",
            "batch.first + begun - 1u);",
        ),
        (
            &queues,
            "finish",
            "if (next < batch.total)",
            "if (next + 1u < batch.total)",
        ),
        (&queues, "finish", "select(0u, 1u, stored.is_alive)", "1u"),
        // Answers of neighbours, of none, and reversed.
        (
            &queues,
            "finish",
            "batch.capacity + stored.shadow",
            "batch.capacity + (stored.shadow ^ 1u)",
        ),
        (
            &several,
            "finish",
            "batch.capacity + stored.shadow",
            "stored.shadow",
        ),
        (&several, "finish", ".x == 0u", ".x != 0u"),
        (&several, "finish", "stored.shadow = NO_SHADOW;", ""),
        (&several, "shade", "answers[place]", "answers[place ^ 1u]"),
        // Path state between rays.
        (
            &several,
            "paths",
            "vec4<f32>(s.path.start,",
            "vec4<f32>(s.path.ray.origin,",
        ),
        (
            &several,
            "paths",
            "vec4<f32>(s.path.ray.direction, s.path.medium)",
            "vec4<f32>(s.path.ray.direction, 1.0)",
        ),
        (
            &several,
            "paths",
            "vec4<f32>(s.path.ray.origin, s.path.density)",
            "vec4<f32>(s.path.ray.origin, 0.0)",
        ),
        (
            &several,
            "paths",
            "number % frame.samples",
            "(number + 1u) % frame.samples",
        ),
        // The order of samples, and a stale result.
        (
            &several,
            "accumulate",
            "frame.samples + i]",
            "frame.samples + (frame.samples - 1u - i)]",
        ),
        (
            &again,
            "regeneration",
            "            result = vec3<f32>(0.0);\n",
            "",
        ),
        (
            &again,
            "regeneration",
            "frame.first_sample + done",
            "frame.first_sample",
        ),
        // Invalid orders.
        (
            &sorted("ray-key"),
            "ray_keys",
            "keys[place] = 0xffffffffu;",
            "keys[place] = 0u;",
        ),
        (
            &sorted("ray-key"),
            "take_order",
            "place < atomicLoad",
            "place + 1u < atomicLoad",
        ),
        (
            &sorted("material"),
            "material_keys",
            "keys[place] = 0xffffu;",
            "keys[place] = 0u;",
        ),
        (
            &sorted("material"),
            "material_keys",
            "values[place] = place;",
            "values[place] = place / 2u;",
        ),
    ];
    for (by, module, from, to) in faults_in_turn("faults of organisations", faults) {
        let found = fault(by, &format!("organisation/{module}"), from, to);
        println!("{module}: {from}: {found:?}");
        if found.is_none() {
            unseen.push(format!("{module}: {from} -> {to}"));
        }
    }
    assert_eq!(unseen, [""; 0]);
    let last = (
        "min(batch.count, live[batch.word])",
        "min(batch.count, live[batch.word] - 1u)",
    );
    let found = fault(&queues, "integrator/trace_rays", last.0, last.1);
    assert!(
        found.is_some(),
        "the last ray of a queue left out: not seen"
    );
}
