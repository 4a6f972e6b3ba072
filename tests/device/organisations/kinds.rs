//! One kernel and queue per material kind: images bit-identical to the single kernel, kernels
//! without the code of other kinds, and planted faults.

use super::*;
use glam::Vec2;
use raystone::scene::{CookTorrance, Fresnel, Light, Masking, Material, Texture, TextureUse};

/// `wavefront` with a small queue and a kernel per material kind.
fn per_material(more: &[(&str, ParamValue)]) -> Variant {
    small(&[&[("shading", word("per-material"))], more].concat())
}

fn picture() -> Texture {
    let texel = |i: u8| [40 * i, 255 - 30 * i, 90 + 20 * i, 255];
    Texture {
        name: "picture".to_owned(),
        width: 4,
        height: 2,
        texels: (0..8).map(texel).collect(),
    }
}

/// One of each kind, and one with a shining front; some with textures.
fn materials() -> Vec<Material> {
    let grey = Vec3::new(0.8, 0.7, 0.6);
    let lobes = CookTorrance {
        diffuse: Vec3::splat(0.3),
        specular: Vec3::splat(0.5),
        roughness: 0.3,
        ior: 1.5,
        masking: Masking::Smith,
        fresnel: Fresnel::Exact,
    };
    let used = Some(TextureUse::plain(0));
    vec![
        Material {
            base_color_texture: used,
            ..Material::diffuse("diffuse", grey)
        },
        Material::phong("phong", Vec3::splat(0.3), Vec3::splat(0.5), 20.0),
        Material::cook_torrance("cook-torrance", &lobes),
        Material {
            metallic_roughness_texture: used,
            normal_texture: used,
            ..Material::principled("principled", grey, 0.6, 0.4, 0.04)
        },
        Material::mirror("mirror", grey),
        Material::dielectric("dielectric", Vec3::ONE, 1.5),
        Material::phong("lamp", Vec3::splat(0.2), Vec3::splat(0.2), 5.0)
            .emitting_from_front(Vec3::new(4.0, 3.0, 2.0)),
    ]
}

/// Triangles of all kinds below a white sky, some shining, and a ball of light rays can hit.
fn all_kinds() -> SceneData {
    let mut scene = builtin(
        "triangle-soup",
        &[
            ("triangles", ParamValue::Integer(300)),
            ("size", ParamValue::Number(0.4)),
        ],
    );
    scene.name = "all kinds".to_owned();
    scene.materials = materials();
    scene.textures = vec![picture()];
    let count = scene.triangles.len();
    // Few shine: their row of materials is the longest.
    let material = |i: usize| if i % 50 == 49 { 6 } else { i as u32 % 6 };
    scene.material_ids = (0..count).map(material).collect();
    scene.uvs = vec![[Vec2::ZERO, Vec2::new(3.0, 0.5), Vec2::new(0.2, 2.0)]; count];
    scene.lights.push(Light::Sphere {
        center: Vec3::splat(0.5),
        radius: 0.2,
        radiance: Vec3::new(1.0, 2.0, 3.0),
    });
    scene
}

/// All kinds, one kind next to masked surfaces, and glass in a room.
fn scenes() -> [SceneData; 3] {
    let foliage = builtin("foliage", &[("plants", ParamValue::Integer(6))]);
    [all_kinds(), foliage, glass_box()]
}

fn ways() -> Vec<Variant> {
    let never = ("regeneration", ParamValue::Flag(false));
    let mut ways = vec![wavefront(&[("shading", word("per-material"))])];
    for sorting in ["none", "material", "ray-key"] {
        let sorting = ("sorting", word(sorting));
        ways.push(per_material(std::slice::from_ref(&sorting)));
        ways.push(per_material(&[sorting, never.clone()]));
    }
    let methods = [
        "workgroup",
        "reduce-scan-scatter",
        "horn",
        "blelloch",
        "roger",
    ];
    ways.extend(methods.map(|method| per_material(&[("compaction", word(method))])));
    ways
}

#[test]
fn a_kernel_for_each_kind_of_material_makes_the_image_of_the_single_kernel_to_the_bit() {
    for scene in scenes() {
        let stage = Stage::new(gpu(), scene);
        let traced = stage.traced(gpu(), structure("bvh"));
        let single = organisation("single-kernel", &[]);
        let expected = rendered(gpu(), &stage, &traced, &path(5), &single).expect("an image");
        for by in in_turn("organisations by kinds", ways()) {
            let found = rendered(gpu(), &stage, &traced, &path(5), &by);
            let found = found.unwrap_or_else(|e| panic!("{by:?}: {e}"));
            let name = &stage.scene.name;
            assert!(found.0 == expected.0, "{name}: {by:?}: other pixels");
            assert_eq!(found.1, expected.1, "{name}: {by:?}: rays");
        }
    }
}

#[test]
fn queues_of_kinds_of_any_length_make_the_same_image() {
    let stage = Stage::new(gpu(), all_kinds());
    let traced = stage.traced(gpu(), structure("cwbvh"));
    let single = organisation("single-kernel", &[]);
    let expected = rendered(gpu(), &stage, &traced, &path(3), &single).expect("an image");
    for capacity in [1 << 10, 1 << 11, 1 << 13, 1 << 18] {
        for regeneration in [true, false] {
            let by = wavefront(&[
                ("shading", word("per-material")),
                ("capacity", ParamValue::Integer(capacity)),
                ("regeneration", ParamValue::Flag(regeneration)),
            ]);
            let found = rendered(gpu(), &stage, &traced, &path(3), &by).expect("an image");
            assert!(found == expected, "{capacity}, {regeneration}");
        }
    }
}

/// Text of all kernels, and the names of those that were dispatched.
fn kernels(stage: &Stage, by: &Variant) -> (String, Vec<String>) {
    let traced = stage.traced(gpu(), structure("bvh"));
    let integrator = organised(&path(3), by).expect("an integrator");
    let job = RenderJob {
        size: SIZE,
        camera: stage.camera,
        sampler: &sampler("owen-sobol", "none"),
        integrator: &integrator,
        offset: RayOffset::default(),
        runtime_checks: true,
    };
    let renderer = Renderer::new(gpu(), &stage.buffers, &traced, &job, false).expect("kernels");
    renderer.render(&[1], 9).expect("an image");
    let stages = renderer.stages().into_keys();
    let stages = stages.filter(|stage| stage.starts_with("shade"));
    (renderer.kernel_text(), stages.collect())
}

#[test]
fn a_kernel_has_its_own_kind_alone_in_it() {
    let stage = Stage::new(gpu(), all_kinds());
    let own = [
        "phong_sample",
        "cook_torrance_sample",
        "principled_sample",
        "mirror_sample",
        "dielectric_sample",
        "bent_normal",
    ];
    let (text, stages) = kernels(&stage, &per_material(&[]));
    let defines = |line: &&str, name: &str| {
        let rest = line
            .strip_prefix("fn ")
            .and_then(|rest| rest.split('(').next());
        rest.is_some_and(|full| full.ends_with(name))
    };
    let kernels_with = |name: &str| text.lines().filter(|line| defines(line, name)).count();
    for name in own {
        assert_eq!(kernels_with(name), 1, "{name}");
    }
    // Two kinds have textures, and rays that have hit nothing have no surface.
    assert_eq!(kernels_with("bilinear"), 2);
    assert_eq!(kernels_with("load_surface_from"), 6);
    let kinds = [
        "cook-torrance",
        "dielectric",
        "diffuse",
        "mirror",
        "nothing",
        "phong",
        "principled",
    ];
    assert_eq!(stages, kinds.map(|kind| format!("shade {kind}")));
    let (_, stages) = kernels(&stage, &small(&[]));
    assert_eq!(stages, ["shade"]);
}

#[test]
fn planted_faults_are_seen() {
    let by = per_material(&[]);
    let sorted = per_material(&[("sorting", word("material"))]);
    let one_by_one = per_material(&[("compaction", word("workgroup"))]);
    let mut unseen = Vec::new();
    #[rustfmt::skip]
    let faults = [
        // The kernel of another kind; a kind in no queue, and in that of its neighbour, too; rays
        // without a hit are in none.
        (&by, "organisation/kinds", "FIRST_KIND + material_kind(", "FIRST_KIND + 0u * material_kind("),
        (&by, "organisation/kinds", "flags[at] = flag;", "flags[at] = select(flag, 0u, flag == FIRST_KIND + 4u);"),
        (&one_by_one, "compaction/stream", "flags[element] == BUCKET", "flags[element] == BUCKET || flags[element] == BUCKET + 1u"),
        (&by, "organisation/kinds", "var flag = MISSED;", "var flag = 0u;"),
        (&by, "organisation/kinds", "triangle != NO_HIT", "triangle < 7u"),
        // One-sided emitters are of no kind.
        (&one_by_one, "shading/material", "return kind & ~ONE_SIDED;", "return kind;"),
        // A queue is one short, has the previous one's count, or workgroups rounded down.
        (&by, "organisation/plan_kind", "let found = kind_counts[QUEUE];", "let found = max(kind_counts[QUEUE], 1u) - 1u;"),
        (&by, "organisation/plan_kind", "atomicStore(&counts[OF_KIND], found);", ""),
        (&by, "organisation/plan_kind", "write_groups(found);", "write_groups(found / 64u * 64u);"),
        (&by, "organisation/shade", "at >= atomicLoad(&counts[OF_KIND])", "at + 1u >= atomicLoad(&counts[OF_KIND])"),
        (&by, "organisation/plan_kind", "kind_counts[QUEUE]", "kind_counts[QUEUE ^ 1u]"),
        (&by, "compaction/atomic", "kept_count[flag - 1u]", "kept_count[0u]"),
        // Paths of a neighbour, of any kind, and of the order before sorting.
        (&by, "organisation/shade", "QUEUE * batch.capacity + at]", "(QUEUE ^ 1u) * batch.capacity + at]"),
        (&by, "compaction/atomic", "(flag - 1u) * part.capacity", "(flag - 1u) * (part.capacity - 1u)"),
        (&by, "organisation/shade", "order[QUEUE * batch.capacity + at];", "order[QUEUE * batch.capacity + at + 1u];"),
        (&by, "organisation/shade", "let place = order[QUEUE * batch.capacity + at];", "let place = at;"),
        (&by, "organisation/kinds", "places[at] = at;", "places[at] = at / 2u;"),
        (&sorted, "organisation/kinds", "answers[places[at]].y", "answers[at].y"),
        // A kind's requirement is missing in its kernel.
        (&by, "shading/material", "@if(textures) base_color", "@if(textures && phong) base_color"),
        // Sums of all queues persist.
        (&by, "organisation/plan", "atomicStore(&counts[QUEUED], 0u);", ""),
    ];
    for (by, module, from, to) in faults_in_turn("faults of organisations by kinds", faults) {
        let found = fault_on(all_kinds(), &path(4), by, (module, from, to));
        println!("{module}: {to}: {found:?}");
        if found.is_none() {
            unseen.push(format!("{module}: {from} -> {to}"));
        }
    }
    assert_eq!(unseen, [""; 0]);
}
