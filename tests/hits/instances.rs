//! Two-level structures: bit-identical to brute force over the same instances, before and after
//! instances move; and the check, records and flat structures for such scenes.

use crate::support;
use crate::support::Stage;
use crate::support::{Pcg, assert_same_hits, build, default_params, differences, scenes, trace};
use glam::{Mat3, Quat, Vec3};
use raystone::accel::{
    AccelKind, Counters, CpuTwin, Hit, InstanceReference, MetaBvh, NO_HIT, ObjectList, Placed, Ray,
    Space, TriangleSoup, brute_force_hits, brute_force_instances,
};
use raystone::geometry::Triangle;
use raystone::gpu::Gpu;
use raystone::measure::gate::{Checks, compare};
use raystone::measure::hard_rays::HARD_RAYS;
use raystone::measure::record::{StructureRecord, TimeRecord, all_of, axis};
use raystone::params::{ParamValue, Params};
use raystone::run::Registries;
use raystone::scene::{Assembly, Transform};

const KINDS: [&dyn AccelKind; 2] = [&ObjectList, &MetaBvh];

/// The defaults, each upper-level parameter in turn at other values, and spatial splits, after
/// which several leaves of an object contain a triangle.
fn variants(kind: &dyn AccelKind) -> Vec<Params> {
    let default = default_params(&kind.parameters());
    let mut out = vec![default.clone()];
    for (key, value) in [
        ("rebraid", ParamValue::Integer(3)),
        ("rebraid", ParamValue::Integer(8)),
        ("loop", ParamValue::Name("nested".to_owned())),
        ("builder", ParamValue::Name("sbvh".to_owned())),
    ] {
        let mut params = default.clone();
        if params.0.insert(key.to_owned(), value).is_some() {
            out.push(params);
        }
    }
    out
}

/// Instances without the rest of a scene; the flat records are the copies.
fn soup_of(assembly: &Assembly) -> TriangleSoup {
    let instances = assembly.instances().iter();
    let copies = instances.flat_map(|i| assembly.copy(i).map(|t| t.vertices));
    TriangleSoup {
        placed: Some(Placed::new(assembly)),
        ..scenes::soup(copies)
    }
}

fn triangles(soup: &TriangleSoup) -> Vec<Triangle> {
    soup.records.iter().map(|r| r.triangle()).collect()
}

/// A rotation by right angles, possibly mirrored, and an integer translation: copies share planes.
fn lattice_transform(rng: &mut Pcg) -> Transform {
    let mut axes = [Vec3::X, Vec3::Y, Vec3::Z];
    axes.swap(0, rng.below(3) as usize);
    axes.swap(1, 1 + rng.below(2) as usize);
    let columns = axes.map(|axis| if rng.below(2) == 0 { axis } else { -axis });
    let mut step = || rng.between(-3, 3) as f32;
    Transform::new(columns, Vec3::new(step(), step(), step()))
}

/// Any invertible transform: rotated, mirrored, scaled by 10⁻² to 10², sometimes nearly flat.
fn wild_transform(rng: &mut Pcg) -> Transform {
    let turn = |rng: &mut Pcg| {
        let q = Quat::from_xyzw(rng.signed(), rng.signed(), rng.signed(), rng.signed());
        Mat3::from_quat(q.normalize())
    };
    let power = |rng: &mut Pcg, range: f32| 10.0_f32.powf(range * rng.signed());
    let mut scale = Vec3::new(power(rng, 0.5), power(rng, 0.5), power(rng, 0.5)) * power(rng, 1.5);
    match rng.below(4) {
        0 => scale.x *= -1.0,
        1 => scale.z *= 1e-3,
        _ => {}
    }
    let linear = turn(rng) * Mat3::from_diagonal(scale) * turn(rng);
    let place = Vec3::new(rng.signed(), rng.signed(), rng.signed()) * 20.0;
    Transform::new([linear.x_axis, linear.y_axis, linear.z_axis], place)
}

/// Instances of two lattice objects, one of which contains a triangle twice.
fn random_assembly(
    rng: &mut Pcg,
    instances: usize,
    transform: fn(&mut Pcg) -> Transform,
) -> Assembly {
    let mut assembly = Assembly::default();
    for count in [1, 60] {
        let mut object = triangles(&scenes::lattice_soup(rng, count, 5));
        object.push(object[0]);
        assembly.add_object(object).expect("an object");
    }
    for _ in 0..instances {
        let object = rng.below(2);
        assembly.place(object, transform(rng)).expect("a place");
    }
    assembly
}

/// All kinds of rays for a scene of this extent, with brute-force answers over instances.
fn rays_and_hits(rng: &mut Pcg, soup: &TriangleSoup, count: usize) -> (Vec<Ray>, Vec<Hit>) {
    let placed = soup.placed.as_ref().expect("instances");
    let mut rays = scenes::aimed_rays(rng, soup, count);
    rays.extend(scenes::lattice_plane_rays(rng, soup, count));
    rays.extend(scenes::lattice_rays(rng, count, 6));
    let hits = brute_force_instances(placed, &rays);
    rays.extend(scenes::cut_at_hits(&rays, &hits));
    let hits = brute_force_instances(placed, &rays);
    (rays, hits)
}

/// Checks closest and any hits of a structure's twin and kernel; returns their counters.
fn check(what: &str, kind: &dyn AccelKind, soup: &TriangleSoup, rays: &[Ray], expected: &[Hit]) {
    for params in variants(kind) {
        let built = build(kind, soup, &params);
        let what = format!("{what}: {} {params:?}", kind.name());
        assert_eq!(built.space(), Space::Instances, "{what}");
        let twin = built.cpu_twin(soup).expect("a twin");
        let mut work = vec![[Counters::default(); 2]; rays.len()];
        let twins = rays.iter().zip(&mut work);
        let hits: Vec<Hit> = twins.map(|(r, w)| twin.closest_hit(r, &mut w[0])).collect();
        assert_same_hits(&what, rays, expected, &hits);
        let blocked: Vec<bool> = expected.iter().map(|h| h.triangle != NO_HIT).collect();
        let twins = rays.iter().zip(&mut work);
        let any: Vec<bool> = twins.map(|(r, w)| twin.any_hit(r, &mut w[1])).collect();
        assert_eq!(any, blocked, "{what}: any hit of the twin");

        let run = |features: &[&str]| trace(support::gpu(), &*built, soup, rays, features);
        assert_same_hits(&what, rays, expected, &run(&[]).hits);
        assert_eq!(run(&["any"]).found(), blocked, "{what}: any hit");
        let counted = [run(&["counters"]).work, run(&["any", "counters"]).work];
        for (index, work) in work.iter().enumerate() {
            let found = [counted[0][index], counted[1][index]];
            assert_eq!(found, *work, "{what}: work of ray {index}");
        }
    }
}

#[test]
fn structures_equal_brute_force_over_instances_and_count_like_their_twins() {
    if !support::is_exact(support::gpu()) {
        return;
    }
    type Draw = fn(&mut Pcg) -> Transform;
    let sorts: [(&str, usize, Draw); 4] = [
        ("one", 1, lattice_transform),
        ("lattice", 30, lattice_transform),
        ("wild", 30, wild_transform),
        ("many", 300, wild_transform),
    ];
    for (seed, (what, count, transform)) in sorts.into_iter().enumerate() {
        let mut rng = Pcg::new(seed as u64);
        let soup = soup_of(&random_assembly(&mut rng, count, transform));
        let (rays, hits) = rays_and_hits(&mut rng, &soup, 300);
        let struck = hits.iter().filter(|h| h.triangle != NO_HIT).count();
        assert!(struck * 10 > rays.len(), "{what}: {struck} hits");
        for kind in KINDS {
            check(what, kind, &soup, &rays, &hits);
        }
    }
}

#[test]
fn rays_at_the_margins_of_boxes_show_how_far_these_grow() {
    if !support::is_exact(support::gpu()) {
        return;
    }
    let mut rng = Pcg::new(77);
    let soup = soup_of(&random_assembly(&mut rng, 30, wild_transform));
    for (kind, module) in KINDS
        .into_iter()
        .zip(["accel/object_list", "accel/meta_bvh"])
    {
        let built = build(kind, &soup, &default_params(&kind.parameters()));
        let rays = built.marginal_rays();
        assert!(rays.len() > 100, "{} rays of {}", rays.len(), kind.name());
        let twin = built.cpu_twin(&soup).expect("a twin");
        let count = |ray: &Ray| {
            let mut counters = Counters::default();
            twin.closest_hit(ray, &mut counters);
            counters
        };
        let expected: Vec<Counters> = rays.iter().map(count).collect();
        let found = |gpu: &Gpu| trace(gpu, &*built, &soup, &rays, &["counters"]).work;
        assert_eq!(found(support::gpu()), expected, "{}", kind.name());
        for factor in ["0.0", "0.98", "1.02"] {
            let growth = "level(ray, instancing.growth)";
            let faulty = format!("level(ray, {factor} * instancing.growth)");
            let kernels = support::kernels_with(module, &[(growth, &faulty)]);
            let seen = found(&support::open(kernels)) != expected;
            assert!(seen, "{}: growth times {factor} is not seen", kind.name());
        }
    }
}

#[test]
fn twins_and_the_judge_equal_brute_force_on_many_random_scenes() {
    let mut struck = 0;
    for seed in 0..300 {
        let mut rng = Pcg::new(1000 + seed);
        let transform = [lattice_transform, wild_transform][seed as usize % 2];
        let count = 1 + rng.below(24) as usize;
        let soup = soup_of(&random_assembly(&mut rng, count, transform));
        let (mut rays, _) = rays_and_hits(&mut rng, &soup, 16);
        // The same from far outside, where rounding of transformed origins is worst.
        let near = rays.clone();
        rays.extend(near.into_iter().map(|mut ray| {
            let back = Vec3::from(ray.direction).normalize_or_zero() * 1e4;
            ray.origin = (Vec3::from(ray.origin) - back).to_array();
            ray.t_max = scenes::FAR;
            ray
        }));
        let placed = soup.placed.as_ref().expect("instances");
        let hits = brute_force_instances(placed, &rays);
        struck += hits.iter().filter(|h| h.triangle != NO_HIT).count();
        let reference = InstanceReference::new(placed).expect("a judge");
        let mut built = Vec::new();
        for kind in KINDS {
            for params in variants(kind) {
                let what = format!("{} {params:?}", kind.name());
                built.push((what, build(kind, &soup, &params)));
            }
        }
        let mut twins: Vec<(String, Box<dyn CpuTwin>)> =
            vec![("judge".into(), Box::new(reference))];
        for (what, built) in &built {
            twins.push((what.clone(), built.cpu_twin(&soup).expect("a twin")));
        }
        for (what, twin) in &twins {
            let mut counters = Counters::default();
            let closest = |ray| twin.closest_hit(ray, &mut counters);
            let found: Vec<Hit> = rays.iter().map(closest).collect();
            assert_same_hits(&format!("seed {seed}: {what}"), &rays, &hits, &found);
        }
    }
    assert!(struck > 3000, "only {struck} hits");
}

#[test]
fn after_an_update_hits_are_those_of_the_moved_instances() {
    let mut rng = Pcg::new(7);
    let mut assembly = random_assembly(&mut rng, 40, wild_transform);
    let before = soup_of(&assembly);
    for instance in 0..40 {
        if instance % 3 != 0 {
            let there = wild_transform(&mut rng);
            assembly.move_to(instance, there).expect("a place");
        }
    }
    let after = soup_of(&assembly);
    let (rays, hits) = rays_and_hits(&mut rng, &after, 500);
    let mut fewer = after.clone();
    fewer.placed.as_mut().expect("instances").instances.pop();
    // Objects with as many triangles elsewhere, to detect a rebuild of them.
    let mut elsewhere = after.clone();
    for object in &mut elsewhere.placed.as_mut().expect("instances").objects {
        let doubled = object.records.iter().map(|r| r.triangle().vertices);
        *object = scenes::soup(doubled.map(|corners| corners.map(|v| 2.0 * v)));
    }
    for kind in KINDS {
        for params in variants(kind) {
            let what = format!("{} {params:?}", kind.name());
            let mut built = build(kind, &before, &params);
            let objects = |built: &dyn raystone::accel::BuiltAccel| {
                let arrays = built.buffers().arrays;
                // Nodes of the objects come first and stay, as do the triangles.
                (arrays[0].words[..16].to_vec(), arrays[1].words.to_vec())
            };
            let kept = objects(&*built);
            let anew = objects(&*build(kind, &elsewhere, &params));
            assert!(anew != kept, "{what}: a new build is not seen");
            assert!(built.validate(&after).is_err(), "{what}: not yet moved");
            let twin = |built: &dyn raystone::accel::BuiltAccel| -> Vec<Hit> {
                let twin = built.cpu_twin(&after).expect("a twin");
                let closest = |ray| twin.closest_hit(ray, &mut Counters::default());
                rays.iter().map(closest).collect()
            };
            assert!(!differences(&hits, &twin(&*built)).is_empty(), "{what}");
            for soup in [&elsewhere, &after] {
                let updated = built.update(soup).expect("an update");
                updated.unwrap_or_else(|e| panic!("{what}: {e}"));
                assert!(objects(&*built) == kept, "{what}: objects were rebuilt");
            }
            built
                .validate(&after)
                .unwrap_or_else(|e| panic!("{what}: {e}"));
            assert!(built.validate(&before).is_err(), "{what}: moved");
            assert_same_hits(&what, &rays, &hits, &twin(&*built));
            let refused = built.update(&fewer).expect("an update");
            let refused = refused
                .expect_err("another number of instances")
                .to_string();
            assert!(refused.contains("40 instances"), "{refused}");
        }
    }
}

#[test]
fn without_instances_rays_stay_as_they_are_and_hits_equal_the_flat_ones() {
    let mut rng = Pcg::new(11);
    let mut assembly = Assembly::default();
    for _ in 0..5 {
        let object = triangles(&scenes::lattice_soup(&mut rng, 40, 6));
        let object = assembly.add_object(object).expect("an object");
        assembly
            .place(object, Transform::IDENTITY)
            .expect("a place");
    }
    let grouped = soup_of(&assembly);
    let mut rays = scenes::aimed_rays(&mut rng, &grouped, 500);
    rays.extend(scenes::lattice_plane_rays(&mut rng, &grouped, 500));
    let flat = brute_force_hits(&grouped, &rays);
    for soup in [grouped.records.clone().into(), grouped] {
        for kind in KINDS {
            let built = build(kind, &soup, &default_params(&kind.parameters()));
            assert_eq!(built.space(), Space::World);
            let twin = built.cpu_twin(&soup).expect("a twin");
            let closest = |ray| twin.closest_hit(ray, &mut Counters::default());
            let found: Vec<Hit> = rays.iter().map(closest).collect();
            assert_same_hits(kind.name(), &rays, &flat, &found);
        }
    }
}

#[test]
fn instances_are_where_their_flat_copies_are() {
    let scene = support::builtin("instances", &[("count", ParamValue::Integer(27))]);
    let soup = TriangleSoup::new(&scene);
    let mut rng = Pcg::new(3);
    let rays: Vec<Ray> = (0..4000)
        .map(|_| {
            let mut inside = || Vec3::new(rng.unit(), rng.unit(), rng.unit());
            let (origin, goal) = (inside() * 3.0 - 1.0, inside());
            Ray {
                origin: origin.to_array(),
                t_min: 0.0,
                direction: (goal - origin).to_array(),
                t_max: scenes::FAR,
            }
        })
        .collect();
    let flat = brute_force_hits(&soup, &rays);
    let placed = brute_force_instances(soup.placed.as_ref().expect("instances"), &rays);
    let same = flat
        .iter()
        .zip(&placed)
        .filter(|(a, b)| a.triangle == b.triangle && (a.t - b.t).abs() <= 1e-4 * a.t.max(1e-2));
    // Edges and grazing rays may fall on either side.
    let same = same.count();
    assert!(same * 1000 > rays.len() * 995, "{same} of {}", rays.len());
}

#[test]
fn the_gate_judges_each_structure_in_its_space_and_sees_the_difference() {
    let gpu = support::gpu();
    if !support::is_exact(gpu) {
        return;
    }
    let changes = [("count", ParamValue::Integer(16))];
    let stage = Stage::builtin(gpu, "instances", &changes);
    let reference = stage.judge(Checks::Repeated, [1024, 20_000_000, 256]);
    let over_instances = reference
        .instances
        .as_deref()
        .expect("a reference of instances");
    for reference in [&reference, over_instances] {
        assert!(reference.is_sound(), "{:?}", reference.first_wrong());
        assert!(reference.brute_force.rays >= 2000 && reference.oracle.rays >= 64);
        let oracle = &reference.oracle;
        let [ambiguous, rays] = [
            oracle.ambiguous - oracle.hard_ambiguous,
            oracle.rays - HARD_RAYS,
        ];
        assert!(ambiguous * 4 < rays, "{oracle:?}");
    }
    for kind in support::in_turn("structures at the gate of instances", support::structures()) {
        let verdict = stage.verdict(gpu, &stage.traced(gpu, kind), &reference);
        let verdict = verdict.unwrap_or_else(|e| panic!("{}: {e}", kind.name()));
        assert!(verdict.passed, "{}: {verdict:?}", kind.name());
    }
    // The flat reference would call instances wrong bit by bit; as ties, none of it is hidden.
    let rounded = reference.sets.iter().zip(&over_instances.sets);
    let wrong = rounded.map(|(flat, set)| {
        let found: Vec<_> = (set.truth.iter())
            .map(|h| Some(h.triangle != NO_HIT))
            .collect();
        compare(flat, &set.truth, &found, &stage.soup, Space::World, true).wrong
    });
    let wrong: usize = wrong.sum();
    assert!(wrong > 1000, "{wrong} rays round otherwise");
}

#[test]
fn a_tie_over_instances_allows_what_rounding_the_transform_can_do_and_no_more() {
    let mut rng = Pcg::new(5);
    let soup = soup_of(&random_assembly(&mut rng, 6, wild_transform));
    let (rays, hits) = rays_and_hits(&mut rng, &soup, 300);
    let index = hits.iter().position(|h| h.triangle != NO_HIT && h.t > 1.0);
    let index = index.expect("a hit");
    let set = raystone::measure::rays::RaySet {
        class: raystone::measure::record::RayClass::Chord,
        rays: vec![rays[index]],
        truth: vec![hits[index]],
        shadow: Vec::new(),
    };
    let verdict = |t: f32| {
        let hit = Hit { t, ..hits[index] };
        let verdict = compare(&set, &[hit], &[Some(true)], &soup, Space::Instances, false);
        (verdict.ties, verdict.wrong)
    };
    let t = hits[index].t;
    assert_eq!(verdict(t), (0, 0));
    assert_eq!(verdict(t.next_up().next_up()), (1, 0));
    assert_eq!(verdict(t * 1.01), (0, 1));
}

#[test]
fn faults_in_the_kernels_of_instances_are_seen() {
    if !support::is_exact(support::gpu()) {
        return;
    }
    let mut rng = Pcg::new(21);
    let soup = soup_of(&random_assembly(&mut rng, 60, wild_transform));
    let (rays, hits) = rays_and_hits(&mut rng, &soup, 1000);
    let faults: [(&str, &str, &str, &[usize]); 5] = [
        (
            "accel/instance",
            "z * ray.origin.z + entry.offset",
            "z * ray.origin.z",
            &[0, 1],
        ),
        ("accel/instance", "record.v0.w += first_id;", "", &[0, 1]),
        (
            "accel/instance",
            "return Ray(origin, ray.t_min, direction,",
            "return Ray(origin, ray.t_min, direction * 1.0000002,",
            &[0, 1],
        ),
        (
            "accel/meta_bvh",
            "if (stack.held == floor)",
            "if (stack.held == 0u)",
            &[1],
        ),
        (
            "accel/object_list",
            "node_words(boxes + 2u * i + 1u)",
            "node_words(boxes + 2u * i)",
            &[0],
        ),
    ];
    for (module, from, to, kinds) in faults {
        let gpu = support::open(support::kernels_with(module, &[(from, to)]));
        for kind in kinds.iter().map(|k| KINDS[*k]) {
            let built = build(kind, &soup, &default_params(&kind.parameters()));
            let found = trace(&gpu, &*built, &soup, &rays, &[]);
            let wrong = differences(&hits, &found.hits).len();
            assert!(wrong > 0, "{}: not seen: {to}", kind.name());
        }
    }
}

#[test]
fn a_run_reports_updates_and_demands_equal_images_within_a_space() {
    let experiment = r#"
[run]
replicates = 1
resolution = [32, 24]
spp = { pow2 = [0, 1] }
[axes]
scene = ["instances"]
accel = ["bvh", "uniform-grid", "object-list", "meta-bvh"]
sequence = ["pixel-hash"]
[scene.instances]
count = 12
detail = 60
[accel.meta-bvh]
rebraid = [0, 3]
loop = ["one", "nested"]
[reference]
spp = 8
[gate]
rays = 512
[timing]
rounds = 3
min_warmup_ms = 0
max_warmup_ms = 1
rays = 1024
"#;
    let out = tempfile::tempdir().expect("a folder");
    let (summary, records) = support::run(experiment, &Registries::default(), out.path(), None);
    assert_eq!(summary.failed, 0, "{records:?}");
    let mut spaces = Vec::new();
    for s in all_of::<StructureRecord>(&records) {
        let moves = s.space == Space::Instances;
        assert_eq!(s.update_ms.is_some(), moves, "{}", s.key);
        spaces.push(s.space);
    }
    spaces.sort();
    assert_eq!(
        spaces,
        [[Space::World; 2].as_slice(), &[Space::Instances; 5]].concat()
    );
    let times = all_of::<TimeRecord>(&records);
    let times: Vec<_> = times
        .map(|t| (t.image_equal, t.key.name(axis::ACCEL)))
        .collect();
    assert!(
        times.len() == 7 && times.iter().all(|(equal, _)| *equal),
        "{times:?}"
    );
    let page = std::fs::read_to_string(out.path().join("index.html")).expect("the page");
    assert!(page.contains("update, ms") && page.contains("checked over instances"));
}
