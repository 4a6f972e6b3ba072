//! Moving scenes: frames, refitted trees against rebuilt ones in every structure with a tree
//! layout, and planted refit faults.

use crate::support::{
    Stage, builtin, default_params, gpu, is_exact, kernels_with, open, run, shows, structure,
    structures,
};
use raystone::accel::tree::{NodeKind, Tree};
use raystone::accel::{AccelKind, BuildLog, Traced, TriangleSoup};
use raystone::config::{Animation, Motion};
use raystone::gpu::Gpu;
use raystone::measure::animation::{Actor, Taken, Way, moved};
use raystone::measure::gate::Checks;
use raystone::measure::record::{AnimationRecord, Line, all_of, axis};
use raystone::params::{ParamValue, Params};
use raystone::run::Registries;
use raystone::scene::SceneData;

const WAVE: Animation = Animation {
    motion: Motion::Deform,
    frames: 5,
    amplitude: 0.2,
    wavelength: 1.0,
};
const DRIFT: Animation = Animation {
    motion: Motion::Instances,
    ..WAVE
};

fn frame(scene: &SceneData, animation: &Animation, number: u32) -> SceneData {
    moved(scene, animation, number).expect("a frame")
}

fn sphere() -> SceneData {
    builtin(
        "displaced-sphere",
        &[("triangles", ParamValue::Integer(1200))],
    )
}

fn few_instances() -> SceneData {
    let changes = [
        ("count", ParamValue::Integer(5)),
        ("detail", ParamValue::Integer(100)),
    ];
    builtin("instances", &changes)
}

fn with_builder(kind: &dyn AccelKind, builder: &str) -> Params {
    let mut params = default_params(&kind.parameters());
    let name = ParamValue::Name(builder.to_owned());
    *params.0.get_mut("builder").expect("a builder") = name;
    params
}

#[test]
fn the_first_frame_is_the_scene_and_a_wave_returns_to_it() {
    for (scene, animation) in [(sphere(), WAVE), (few_instances(), DRIFT)] {
        assert_eq!(frame(&scene, &animation, 0).triangles, scene.triangles);
        let way = |number: u32| {
            let moved = frame(&scene, &animation, number);
            let pairs = moved.triangles.iter().zip(&scene.triangles);
            let vertices = pairs.flat_map(|(a, b)| a.vertices.into_iter().zip(b.vertices));
            vertices.map(|(a, b)| (a - b).length()).fold(0.0, f32::max)
        };
        let radius = scene.bounds().radius();
        let last = match animation.motion {
            Motion::Deform => 0.0,
            // Straight on, by the requested distance.
            Motion::Instances => animation.amplitude as f32 * radius,
        };
        assert!((way(4) - last).abs() < 1e-4 * radius, "{animation:?}");
        assert!(way(2) > 0.09 * radius, "{animation:?}");
    }
}

#[test]
fn shared_vertices_stay_shared_and_copies_stay_copies() {
    let scene = sphere();
    let distinct = |scene: &SceneData| {
        let vertices = scene.triangles.iter().flat_map(|t| t.vertices);
        let bits = vertices.map(|v| v.to_array().map(f32::to_bits));
        bits.collect::<std::collections::BTreeSet<_>>().len()
    };
    assert_eq!(distinct(&frame(&scene, &WAVE, 1)), distinct(&scene));
    let placed = frame(&few_instances(), &DRIFT, 3);
    let soup = TriangleSoup::new(&placed);
    let copies = soup.placed.expect("instances").instances;
    assert_eq!(copies.len(), 5);
    let assembly = placed.assembly.as_ref().expect("an assembly");
    let all: Vec<_> = copies.iter().flat_map(|i| assembly.copy(i)).collect();
    assert_eq!(all, placed.triangles);
    let nothing = moved(&scene, &DRIFT, 1).expect_err("no instances");
    assert!(nothing.contains("no instances"), "{nothing}");
}

/// The error of a structure updated to a frame, if any.
fn fault(
    gpu: &Gpu,
    actor: &Actor,
    way: Way,
    first: &TriangleSoup,
    stage: &Stage,
) -> Option<String> {
    let soup = &stage.soup;
    let mut log = BuildLog::with_gpu(gpu);
    let taken = actor
        .start(way, first)
        .and_then(|from| actor.take(way, from, soup, &mut log))
        .and_then(|taken| actor.built(taken, soup));
    let built = match taken {
        Ok(built) => built,
        Err(error) => return Some(error.to_string()),
    };
    if let Err(error) = built.validate(soup) {
        return Some(error.to_string());
    }
    let reference = stage.judge(Checks::Repeated, [1000, 1_000_000, 64]);
    let traced = Traced::upload(gpu, &*built).expect("buffers that fit");
    let verdict = stage.verdict(gpu, &traced, &reference).expect("a verdict");
    (!verdict.passed).then(|| format!("{verdict:?}"))
}

#[test]
fn every_structure_over_a_tree_or_objects_is_taken_to_a_frame_and_passes_its_gate() {
    if !is_exact(gpu()) {
        return;
    }
    let mut taken = 0;
    for (scene, animation) in [(sphere(), WAVE), (few_instances(), DRIFT)] {
        let first = TriangleSoup::new(&scene);
        let stage = Stage::new(gpu(), frame(&scene, &animation, 2));
        for kind in structures() {
            let params = default_params(&kind.parameters());
            let actor = Actor::new(kind, &params, animation.motion, (&first, gpu()));
            let Ok(actor) = actor else { continue };
            for way in actor.ways() {
                let fault = fault(gpu(), &actor, *way, &first, &stage);
                assert_eq!(fault, None, "{} {way:?} {animation:?}", kind.name());
                taken += 1;
            }
        }
    }
    // bvh, roped-bvh, bvh4, cwbvh in three ways on both scenes; meta-bvh, object-list: two on one.
    assert!(taken >= 4 * 3 * 2 + 2 * 2, "{taken}");
}

fn tree(gpu: &Gpu, actor: &Actor, way: Way, soup: &TriangleSoup) -> Result<Tree, String> {
    let mut log = BuildLog::with_gpu(gpu);
    let from = actor.start(way, soup).map_err(|e| e.to_string())?;
    match actor.take(way, from, soup, &mut log) {
        Ok(Taken::Tree(tree)) => Ok(tree),
        Ok(Taken::Built(_)) => Err("no tree".to_owned()),
        Err(error) => Err(error.to_string()),
    }
}

#[test]
fn faults_in_the_passes_of_a_refit_are_seen() {
    let faults = [
        (
            "inner",
            "the root keeps its box",
            "if (inner >= fit.nodes) {",
            "if (inner >= fit.nodes || inner == 0u) {",
        ),
        (
            "inner",
            "only the first half of the leaves below is united",
            "var end = ranges[inner].y + 1u;",
            "var end = (ranges[inner].x + ranges[inner].y) / 2u + 1u;",
        ),
        (
            "inner",
            "one level too few",
            "while (begin < end) {",
            "while (begin < end && level <= size.count + fit.nodes) {",
        ),
        (
            "inner",
            "levels in the wrong order",
            "level = select(level + level_count, size.count + fit.nodes, level == 0u);",
            "level = select(size.count + fit.nodes, level + level_count, level == 0u);",
        ),
        (
            "leaves",
            "a leaf keeps its old box",
            "if (place >= size.count) {",
            "if (place >= size.count || place == 77u) {",
        ),
        (
            "blocks",
            "a level without its last block",
            "if (block >= level.count) {",
            "if (block + 1u >= level.count) {",
        ),
    ];
    let scene = sphere();
    let first = TriangleSoup::new(&scene);
    let later = TriangleSoup::new(&frame(&scene, &WAVE, 2));
    let params = with_builder(structure("bvh"), "device-ploc");
    for (kernel, what, from, to) in faults {
        let module = format!("accel/tree/parallel/device/{kernel}");
        let faulty = open(kernels_with(&module, &[(from, to)]));
        // Built with correct kernels.
        let actor = Actor::new(structure("bvh"), &params, WAVE.motion, (&first, gpu()));
        let actor = actor.expect("a tree");
        let host = tree(gpu(), &actor, Way::Host, &later).expect("a tree");
        let right = tree(gpu(), &actor, Way::Device, &later).expect("a tree");
        assert!(right.nodes == host.nodes, "without a fault");
        let is_seen = match tree(&faulty, &actor, Way::Device, &later) {
            Ok(found) => found.nodes != host.nodes,
            Err(error) => shows(&format!("{error:?}")),
        };
        assert!(is_seen, "{what}");
    }
}

/// A faulty host refit.
type Fault = fn(&mut Tree, &Tree);

#[test]
fn faults_of_a_refitted_tree_fail_validation_or_the_gate() {
    if !is_exact(gpu()) {
        return;
    }
    // A tree, and its previous state.
    let faults: [(&str, Fault); 4] = [
        // No layout stores the box of the root itself; the other twin checks its fit.
        ("the root's children keep their boxes", |tree, before| {
            let NodeKind::Inner { left, right } = tree.nodes[0].kind else {
                panic!("a tree of one leaf")
            };
            for child in [left, right].map(|child| child as usize) {
                tree.nodes[child].bounds = before.nodes[child].bounds;
            }
        }),
        ("a leaf keeps its box", |tree, before| {
            let is_leaf = |kind: &NodeKind| matches!(kind, NodeKind::Leaf { .. });
            let moved = |i: &usize| tree.nodes[*i].bounds != before.nodes[*i].bounds;
            let mut leaves = (0..tree.nodes.len()).filter(|i| is_leaf(&tree.nodes[*i].kind));
            let leaf = leaves.find(moved).expect("a leaf that moved");
            tree.nodes[leaf].bounds = before.nodes[leaf].bounds;
        }),
        ("only the first child is united", |tree, _| {
            for index in (0..tree.nodes.len()).rev() {
                if let NodeKind::Inner { left, .. } = tree.nodes[index].kind {
                    tree.nodes[index].bounds = tree.nodes[left as usize].bounds;
                }
            }
        }),
        ("nothing is refitted", |tree, before| *tree = before.clone()),
    ];
    let scene = sphere();
    let first = TriangleSoup::new(&scene);
    let stage = Stage::new(gpu(), frame(&scene, &WAVE, 2));
    for name in ["bvh", "cwbvh"] {
        let params = with_builder(structure(name), "host-ploc");
        let actor = Actor::new(structure(name), &params, WAVE.motion, (&first, gpu()));
        let actor = actor.expect("a tree");
        let over = structure(name).over_tree().expect("a layout of a tree");
        let before = over.tree(&first, &params, &mut BuildLog::default());
        let before = before.expect("a tree");
        for (what, plant) in faults {
            let mut tree = tree(gpu(), &actor, Way::Host, &stage.soup).expect("a tree");
            plant(&mut tree, &before);
            let built = actor.built(Taken::Tree(tree), &stage.soup);
            let built = built.expect("a layout");
            let valid = built.validate(&stage.soup);
            assert!(valid.is_err(), "{name}: {what}");
        }
        // Vertices that lag one frame fit the previous one: only this frame's triangles reveal it.
        let late = TriangleSoup::new(&frame(&scene, &WAVE, 1));
        let late = tree(gpu(), &actor, Way::Device, &late).expect("a tree");
        let built = actor.built(Taken::Tree(late), &stage.soup);
        assert!(
            built.expect("a layout").validate(&stage.soup).is_err(),
            "{name}: late"
        );
    }
}

const EXPERIMENT: &str = r#"
[run]
name = "animation"
replicates = 1
resolution = [16, 16]
spp = [1]
[axes]
scene = ["instances"]
accel = ["bvh", "meta-bvh", "uniform-grid"]
sequence = ["sobol"]
integrator = ["primary"]
[scene.instances]
count = 4
detail = 60
[accel.bvh]
builder = ["device-lbvh"]
[animation]
motion = "instances"
frames = 3
amplitude = 1.0
[reference]
spp = 8
[timing]
rounds = 3
min_warmup_ms = 0
max_warmup_ms = 1
rays = 1024
[gate]
rays = 256
brute_force_tests = 10000
oracle_rays = 16
"#;

fn animations(lines: &[Line]) -> Vec<(String, &AnimationRecord)> {
    all_of::<AnimationRecord>(lines)
        .map(|found| (found.key.label(axis::ACCEL).to_owned(), found.body))
        .collect()
}

#[test]
fn a_run_records_every_frame_and_shows_it() {
    let registries = Registries::default();
    let folder = tempfile::tempdir().expect("a folder");
    let (summary, lines) = run(EXPERIMENT, &registries, folder.path(), None);
    assert_eq!(summary.failed, 0);
    // The grid cannot be updated to a frame.
    assert!(summary.skipped >= 1);
    let found = animations(&lines);
    assert_eq!(found.len(), 2, "bvh and meta-bvh");
    for (name, record) in found {
        assert_eq!(
            (record.failure.as_deref(), record.frames.len()),
            (None, 3),
            "{name}"
        );
        for frame in &record.frames {
            assert!(frame.judged > 256 && frame.classes.len() > 2, "{name}");
            for cost in [&frame.refit, &frame.rebuild] {
                assert_eq!(cost.wall_ms.len(), 3);
                assert!(cost.wall_ms.iter().all(|ms| *ms > 0.0));
            }
            assert_eq!(frame.refit_on_host.is_some(), name.starts_with("bvh"));
        }
        let ratio = |place: usize| {
            let [refitted, rebuilt] = record.frames[place].sah;
            Some(refitted? / rebuilt?)
        };
        if name.starts_with("bvh") {
            assert_eq!(ratio(0), Some(1.0));
            assert!(ratio(2) > Some(1.05), "{:?}", ratio(2));
        }
    }
    let page = std::fs::read_to_string(folder.path().join("summary.md")).expect("a summary");
    for text in [
        "Trees frame by frame",
        "Every instance moves",
        "rebuilding pays from",
    ] {
        assert!(page.contains(text), "{text}");
    }
}
