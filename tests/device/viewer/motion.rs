//! Scenes that move on screen: images are those of the moved scene, frames follow one another, objects can be dragged.

use super::{bits, finish, screen, show, viewer, works};
use crate::support;
use raystone::accel::Intersection;
use raystone::config::{Animation, Axis, Follow, Motion};
use raystone::image::Image;
use raystone::integrator::{Renderer, Stage};
use raystone::measure::animation::moved;
use raystone::params::ParamValue;
use raystone::run::{Estimator, Registries};
use raystone_viewer::{Screen, Step, Viewer, Work};

const INSTANCES: &str = "axes.scene=instances";

/// Copies of an object, moved to a frame.
fn moving(motion: Motion, accel: &str, frame: u32) -> Screen {
    let mut screen = screen(&[INSTANCES, &format!("axes.accel=[\"{accel}\"]")]);
    screen.animation = Some(Animation {
        motion,
        frames: 5,
        ..Animation::default()
    });
    screen.window.frame = frame;
    screen
}

fn image(viewer: &mut Viewer) -> Vec<[u32; 3]> {
    finish(viewer);
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("image.pfm");
    viewer.save(&file, 0).unwrap();
    bits(&file)
}

/// The image of a screen by another structure, built for the moved scene, without a viewer.
fn expected(screen: &Screen) -> Vec<[u32; 3]> {
    let (gpu, registries, cell) = (support::gpu(), Registries::default(), &screen.cells[0]);
    let still = support::builtin("instances", &[]);
    let camera = still.view(screen.aspect());
    let scene = moved(&still, &screen.animation.unwrap(), screen.window.frame).unwrap();
    let stage = Stage::new(gpu, scene, Intersection::default()).unwrap();
    // Where loops are ended early, brute force cannot go over all triangles.
    let structure = match gpu.loop_limit {
        None => "brute-force",
        Some(_) => "bvh4",
    };
    let brute = stage.structure(&registries.accel, structure).unwrap();
    let estimator = Estimator::of(&registries, cell, screen.spp, screen.size[0]).unwrap();
    let job = estimator.image(screen.size, camera, true);
    let renderer = Renderer::new(gpu, &stage.buffers, &brute, &job, true).unwrap();
    renderer.add_samples(0, screen.spp, screen.seed).unwrap();
    let Image { pixels, .. } = renderer.image().unwrap();
    pixels.iter().map(|p| p.map(f32::to_bits)).collect()
}

#[test]
fn images_of_a_frame_are_those_of_the_moved_scene_however_structures_follow() {
    let mut viewer = viewer();
    for (motion, accel) in [(Motion::Deform, "bvh"), (Motion::Instances, "cwbvh")] {
        let now = moving(motion, accel, 0);
        let still = {
            show(&mut viewer, now.clone());
            image(&mut viewer)
        };
        for (frame, follow) in [(3, Follow::Refit), (2, Follow::Refit), (3, Follow::Rebuild)] {
            let mut now = moving(motion, accel, frame);
            now.window.follow = follow;
            let done = works(&show(&mut viewer, now.clone()));
            assert!(done.contains(&Work::Followed) && !done.contains(&Work::Loaded));
            let found = image(&mut viewer);
            assert!(
                found == expected(&now),
                "{motion:?}, {follow:?}, frame {frame}"
            );
            assert!(found != still, "nothing moved");
        }
        show(&mut viewer, now);
        assert!(image(&mut viewer) == still, "and back");
    }
}

#[test]
fn structures_of_objects_take_transforms_and_others_are_built_anew() {
    let mut viewer = viewer();
    for (motion, accel) in [(Motion::Instances, "meta-bvh"), (Motion::Deform, "kd-tree")] {
        show(&mut viewer, moving(motion, accel, 0));
        let mut images = Vec::new();
        for (frame, follow) in [(3, Follow::Refit), (1, Follow::Refit), (3, Follow::Rebuild)] {
            let mut now = moving(motion, accel, frame);
            now.window.follow = follow;
            show(&mut viewer, now);
            images.push(image(&mut viewer));
        }
        assert!(images[0] == images[2] && images[0] != images[1], "{accel}");
    }
}

#[test]
fn frames_follow_one_another_until_they_are_stopped() {
    let mut viewer = viewer();
    let mut now = moving(Motion::Deform, "bvh\", \"cwbvh", 3);
    now.window.play = true;
    show(&mut viewer, now.clone());
    let (mut numbers, mut shown) = (Vec::new(), 0);
    while numbers.len() < 7 {
        let step = viewer.step(&|| false).unwrap();
        assert!(step != Step::Idle, "it stands still");
        let sides = viewer.frame().sides;
        if step == Step::Shown && sides.iter().all(|side| side.figures.spp > 0) {
            assert!(sides[0].picture == sides[1].picture, "of two frames");
            shown += 1;
        }
        if numbers.last() != Some(&viewer.frame_number()) {
            numbers.push(viewer.frame_number());
        }
    }
    assert_eq!(numbers, [3, 4, 0, 1, 2, 3, 4]);
    assert_eq!(shown, 6);
    let frame = viewer.frame();
    let times = frame.times.unwrap();
    assert_eq!((times.frame, times.whole_ms.len()), ([3, 5], 5));
    let side = times.sides[0];
    let of_sides = times
        .sides
        .iter()
        .map(|side| side.update_ms + side.render_ms);
    let parts = times.scene_ms + of_sides.sum::<f64>() + times.rest_ms();
    assert!(side.update_ms > 0.0 && side.render_ms > 0.0 && times.scene_ms > 0.0);
    let whole = f64::from(*times.whole_ms.last().unwrap());
    assert!((parts / whole - 1.0).abs() < 1e-3, "{parts} of {whole}");
    assert_eq!(frame.sides[0].figures.of, 1, "one sample a frame");
    // It stops where it is.
    now.window.play = false;
    show(&mut viewer, now.clone());
    let found = image(&mut viewer);
    assert_eq!((viewer.frame_number(), viewer.frame().times), (4, None));
    now.window.frame = 4;
    assert!(found == expected(&now));
}

#[test]
fn an_object_is_grasped_moved_and_put_back() {
    let mut viewer = viewer();
    let mut now = screen(&[INSTANCES, "axes.accel=[\"meta-bvh\"]"]);
    show(&mut viewer, now.clone());
    let still = image(&mut viewer);
    let pixels = (0..32).flat_map(|y| (0..40).map(move |x| [x, y]));
    let (pixel, grasp) = pixels
        .filter_map(|pixel| Some((pixel, viewer.grasp(pixel).unwrap()?)))
        .nth(60)
        .expect("something is seen");
    // Out of sight: another object, or none, is at its pixel.
    now.dragged.insert(grasp.instance, glam::Vec3::splat(1e3));
    let done = works(&show(&mut viewer, now.clone()));
    assert_eq!(done, [Work::Followed, Work::Restarted]);
    assert!(image(&mut viewer) != still);
    let behind = viewer.grasp(pixel).unwrap();
    assert_ne!(behind.map(|g| g.instance), Some(grasp.instance));
    now.dragged.clear();
    show(&mut viewer, now.clone());
    assert!(image(&mut viewer) == still);
    assert_eq!(viewer.grasp(pixel).unwrap(), Some(grasp));
    // Where there are no instances, a sentence says so, and the screen stays.
    show(&mut viewer, screen(&[]));
    let error = viewer.grasp(pixel).unwrap_err();
    assert!(error.contains("no instances"), "{error}");
    let mut wrong = screen(&[]);
    wrong.dragged.insert(0, glam::Vec3::ONE);
    let error = viewer.show(wrong, &mut |_| ()).unwrap_err().to_string();
    assert!(error.contains("no instances"), "{error}");
    assert_eq!(
        viewer.screen().unwrap().cells[0][Axis::Scene].name,
        "cornell-box"
    );
}

#[test]
fn what_is_grasped_is_the_object_whose_triangle_is_seen() {
    // Objects of eight triangles: the first and the last of each are hit, too.
    let scene = "axes.scene=[\"instances\"]";
    let mut viewer = viewer();
    let now = screen(&[
        scene,
        "scene.instances.detail=8",
        "scene.instances.count=27",
    ]);
    show(&mut viewer, now);
    let changes = [
        ("detail", ParamValue::Integer(8)),
        ("count", ParamValue::Integer(27)),
    ];
    let scene = support::builtin("instances", &changes);
    let assembly = scene.assembly.as_ref().expect("instances");
    let firsts: Vec<u32> = assembly.instances().iter().map(|i| i.first).collect();
    let mut ends = [0; 2];
    for pixel in (0..32).flat_map(|y| (0..40).map(move |x| [x, y])) {
        let Some(grasp) = viewer.grasp(pixel).unwrap() else {
            continue;
        };
        let seen = viewer.inspect(pixel).unwrap().expect("a pixel");
        let hit = seen.sides[0].hit.expect("a hit").triangle;
        let first = firsts[grasp.instance as usize];
        let next = firsts.get(grasp.instance as usize + 1);
        let end = next.copied().unwrap_or(scene.triangles.len() as u32);
        assert!((first..end).contains(&hit), "{pixel:?}: {hit} of {grasp:?}");
        ends[0] += u32::from(hit == first);
        ends[1] += u32::from(hit + 1 == end);
    }
    assert!(ends.iter().all(|seen| *seen > 3), "{ends:?}");
}
